#include "tiler/objects/hull.h"

#include <cmath>

namespace terracast::tiler {

using Eigen::Vector3d;

void add_hull(ThingMesh& mesh, const Hull& hull, int detail, FinishNumber topsides,
              FinishNumber underwater, FinishNumber deck) {
  const double half_length = 0.5 * hull.length_m;
  const double half_beam = 0.5 * hull.beam_m;
  const double paint_z = 0.06 * hull.draught_m;  // where the topsides' colour ends
  struct Station {
    double along;  // 0 at the stern, 1 at the stem
    double water;  // half breadths, of the half beam
    double deck;
    double keel;  // depth of the keel, of the draught
  };
  const double s = hull.stern_m / hull.length_m;
  const double b = hull.bow_m / hull.length_m;
  std::vector<Station> stations = {
      {0.0, 0.85 * hull.transom, hull.transom, 0.25},
      {0.35 * s, 0.5 + 0.5 * hull.transom - 0.1, 0.5 + 0.5 * hull.transom, 0.8},
      {s, 1.0, 1.0, 1.0},
      {1.0 - b, 1.0, 1.0, 1.0},
      {1.0 - 0.62 * b, 0.86, 0.96, 1.0},
      {1.0 - 0.30 * b, 0.52, 0.76, 1.0},
      {1.0 - 0.10 * b, 0.18, 0.42, 0.98},
      {1.0, 0.012, 0.03, 0.93}};
  if (detail >= 2) {
    stations.erase(stations.begin() + 6);
    stations.erase(stations.begin() + 4);
  }
  std::vector<Ring> rings;
  for (const Station& at : stations) {
    const double x = -half_length + at.along * hull.length_m;
    const double rise = std::max((at.along - (1.0 - 1.6 * b)) / (1.6 * b), 0.0);
    const double deck_z = hull.deck_z_m + hull.bow_rise_m * rise * rise;
    const double low_z = -hull.draught_m * at.keel;
    const double lean = at.along > 1.0 - b ? hull.rake_m * (at.along - (1.0 - b)) / b : 0.0;
    const double bilge_z = low_z + 0.12 * hull.draught_m;
    const double wet = half_beam * at.water;
    const double bottom = std::max(wet * hull.bottom, 0.004 * half_beam);
    const double bilge = hull.bottom > 0.5 ? wet : wet * 0.72;
    // Lower parts stand back under a raked stem.
    const auto point = [&](double y, double z) {
      const double share = std::clamp((z - low_z) / (deck_z - low_z), 0.0, 1.0);
      return Vector3d(x - lean * (1.0 - share), y, z);
    };
    const double upper = half_beam * at.deck;
    rings.push_back({point(upper, deck_z), point(wet, paint_z), point(bilge, 0.5 * bilge_z),
                     point(bottom, low_z), point(-bottom, low_z), point(-bilge, 0.5 * bilge_z),
                     point(-wet, paint_z), point(-upper, deck_z)});
  }
  mesh.loft(
      rings,
      [&](std::size_t, std::size_t edge) {
        if (edge == 7) return deck;
        return edge == 0 || edge == 6 ? topsides : underwater;
      },
      topsides, topsides);
}

}  // namespace terracast::tiler
