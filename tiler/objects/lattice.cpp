#include "tiler/objects/lattice.h"

namespace terracast::tiler {

using Eigen::Vector3d;

void add_lattice(ThingMesh& mesh, const std::vector<LatticeLevel>& levels, double leg_m,
                 double brace_m, int detail,
                 const std::function<FinishNumber(std::size_t)>& finish) {
  const auto corner = [&](const LatticeLevel& level, int k) {
    const double x = k == 0 || k == 3 ? -level.half_m : level.half_m;
    const double y = k < 2 ? -level.half_m : level.half_m;
    return Vector3d(x, y, level.z_m);
  };
  std::vector<LatticeLevel> used = levels;
  if (detail >= 2 && levels.size() > 3) used = {levels.front(), levels.back()};
  // Each leg is one body through all levels, so that no two faces fall together.
  const double half_leg = 0.5 * (detail >= 2 ? 1.3 * leg_m : leg_m);
  for (int k = 0; k < 4; ++k) {
    std::vector<Ring> rings;
    for (const LatticeLevel& level : used) {
      const Vector3d at = corner(level, k);
      rings.push_back(ring_at(
          at.z(), rectangle(at.head<2>().array() - half_leg, at.head<2>().array() + half_leg)));
    }
    mesh.loft(
        rings, [&](std::size_t ring, std::size_t) { return finish(ring); }, finish(0),
        finish(used.size() - 2));
  }
  if (detail >= 2) return;
  for (std::size_t i = 0; i + 1 < used.size(); ++i)
    for (int k = 0; k < 4; ++k) {
      const int next = (k + 1) % 4;
      mesh.bar(corner(used[i], k), corner(used[i + 1], next), brace_m, finish(i), 3);
      if (detail > 0) continue;
      mesh.bar(corner(used[i], next), corner(used[i + 1], k), brace_m, finish(i), 3);
      mesh.bar(corner(used[i + 1], k), corner(used[i + 1], next), brace_m, finish(i), 3);
    }
}

}  // namespace terracast::tiler
