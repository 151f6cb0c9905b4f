#include "tiler/objects/things.h"

// Bridges from terminals to the doors of aircraft.
namespace terracast::tiler {
namespace {

using Eigen::Vector3d;
using world::Material;

/// From the terminal's wall (-x) to the cab at the door (x): two tunnels that slide into each other on a
/// column and a driven bogie.
void build_jet_bridge(ThingMesh& mesh, int detail) {
  const FinishNumber white = mesh.finish(Material::Paint, {226, 229, 230});
  const FinishNumber steel = mesh.finish(Material::Metal, {150, 154, 158});
  const FinishNumber glass = mesh.finish(Material::Glass, {62, 80, 90});
  const FinishNumber dark = mesh.finish(Material::Rubber, {42, 42, 44});
  mesh.box({-8.7, -1.55, 3.5}, {0.5, 1.55, 6.3}, white);
  mesh.box({0.2, -1.40, 3.35}, {6.6, 1.40, 6.1}, white);
  mesh.box({6.2, -1.75, 3.2}, {8.2, 1.75, 6.6}, white);
  mesh.box({8.0, -1.65, 3.3}, {8.7, 1.65, 6.45}, dark);  // bellows
  if (detail >= 2) {
    mesh.box({-7.4, -0.5, -0.6}, {-6.4, 0.5, 3.7}, steel);
    return;
  }
  mesh.cylinder({-6.9, 0.0, -0.6}, {-6.9, 0.0, 3.7}, 0.55, round_sides(12, detail), steel, steel);
  for (const double y : {-1.0, 1.0}) mesh.box({3.6, y - 0.2, 0.4}, {4.2, y + 0.2, 3.6}, steel);
  mesh.box({3.3, -1.5, -0.5}, {4.5, 1.5, 0.9}, dark);
  for (const double y : {-1.58, 1.42}) mesh.box({-8.0, y, 4.5}, {-0.4, y + 0.16, 5.5}, glass);
  if (detail > 0) return;
  for (const double y : {-1.43, 1.31}) mesh.box({0.9, y, 4.4}, {5.8, y + 0.12, 5.3}, glass);
  mesh.box({-8.5, -0.35, 6.2}, {0.3, 0.35, 6.45}, steel);  // cables on the roof
}

}  // namespace

std::vector<ThingInfo> jet_bridges();
std::vector<ThingInfo> jet_bridges() {
  return {{.name = "jet_bridge",
           .family = {},
           .semantic_class = core::SemanticClass::Object,
           .stance = Stance::Rooted,
           .size_m = Vector3d(17.4, 3.5, 6.6),
           .source = "apron-drive bridges of two tunnels, 3.1 m wide, drawn in; sills of doors of "
                     "the A320 and 737 are 2.7 to 3.5 m high",
           .coarsest_levels = {0, 1, 3},
           .num_variants = 1,
           .build = [](ThingMesh& m, int d, int) { build_jet_bridge(m, d); }}};
}

}  // namespace terracast::tiler
