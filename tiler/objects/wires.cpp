#include "tiler/objects/wires.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "tiler/objects/power_line.h"
#include "tiler/objects/things.h"
#include "world/tile_id.h"

namespace terracast::tiler {
namespace {

using Eigen::Vector3d;
using world::Material;

/// Aluminium conductors of 400 mm2 are 28.6 mm across (EN 50182); poles' wires less.
constexpr double kConductorRadius_m = 0.0143;
constexpr double kPoleWireRadius_m = 0.006;

void add_wire(ThingMesh& mesh, const Vector3d& from, const Vector3d& to, const Vector3d& up,
              double catenary_m, double radius_m, int num_pieces, FinishNumber finish) {
  const double rise_m = (to - from).dot(up);
  const Vector3d level = (to - from) - rise_m * up;
  const double distance_m = level.norm();
  const Vector3d across = up.cross(level / distance_m);
  std::vector<Ring> rings;
  for (int k = 0; k <= num_pieces; ++k) {
    const double share = static_cast<double>(k) / num_pieces;
    const Vector3d at =
        from + share * level + wire_height_m(share, distance_m, rise_m, catenary_m) * up;
    rings.push_back({at + radius_m * up, at - 0.5 * radius_m * up + 0.866 * radius_m * across,
                     at - 0.5 * radius_m * up - 0.866 * radius_m * across});
  }
  mesh.loft(rings, finish);
}

}  // namespace

world::Solid wires_between(std::uint32_t from_thing, const world::InstanceFrame& from,
                           std::uint32_t to_thing, const world::InstanceFrame& to) {
  const ThingInfo& info = all_things()[from_thing];
  std::vector<Vector3d> starts = wire_points(info.name);
  std::vector<Vector3d> ends = wire_points(all_things()[to_thing].name);
  // The supports may look against each other: each wire goes to the same side.
  const Vector3d ahead = to.place_world - from.place_world;
  const auto faces = [&](const world::InstanceFrame& frame) {
    return (frame.world_from_prototype * Vector3d::UnitX()).dot(ahead) >= 0.0;
  };
  const auto mirrored = [](std::vector<Vector3d> points) {
    for (Vector3d& point : points) point.y() = -point.y();
    return points;
  };
  if (!faces(from)) starts = mirrored(starts);
  if (!faces(to)) ends = mirrored(ends);
  const bool is_pole = info.name == "wood_pole" || all_things()[to_thing].name == "wood_pole";
  const Vector3d up =
      (from.world_from_prototype * Vector3d::UnitZ() + to.world_from_prototype * Vector3d::UnitZ())
          .normalized();
  const Vector3d middle = 0.5 * (from.place_world + to.place_world);
  world::Solid solid;
  solid.place_m = middle.head<2>().array().floor().cast<int>();
  solid.origin_steps = (middle / world::kHeightStep_m).array().round().cast<int>();
  const Vector3d origin = solid.origin_steps.cast<double>() * world::kHeightStep_m;
  for (const auto& [level, num_pieces] : {std::pair{0, 16}, {kCoarsestWireLevel, 6}}) {
    ThingMesh mesh(core::SemanticClass::PowerLine);
    const FinishNumber metal = mesh.finish(Material::Metal, {96, 98, 100});
    for (std::size_t i = 0; i < std::min(starts.size(), ends.size()); ++i)
      add_wire(mesh, from * starts[i] - origin, to * ends[i] - origin, up,
               is_pole ? kPoleCatenary_m : kCatenary_m,
               is_pole ? kPoleWireRadius_m : kConductorRadius_m, num_pieces, metal);
    solid.levels.push_back(
        {.coarsest_level = static_cast<std::int8_t>(level), .shape = mesh.shape()});
  }
  return solid;
}

}  // namespace terracast::tiler
