#include "tiler/objects/road_vehicle.h"

#include <cmath>

namespace terracast::tiler {

using Eigen::Vector2d;
using Eigen::Vector3d;
using world::Material;

void add_wheel(ThingMesh& mesh, double x_m, double outer_y_m, double radius_m, double width_m,
               int detail) {
  const FinishNumber tyre = mesh.finish(Material::Rubber, kTyre);
  const double inner_y_m = outer_y_m > 0.0 ? outer_y_m - width_m : outer_y_m + width_m;
  const int num_sides = detail == 0 ? 16 : 8;
  const auto build = [&] {
    mesh.cylinder({x_m, inner_y_m, radius_m}, {x_m, outer_y_m, radius_m}, radius_m, num_sides, tyre,
                  tyre);
    if (detail > 0) return;
    const FinishNumber rim = mesh.finish(Material::Metal, kRim);
    const double out = outer_y_m > 0.0 ? 0.006 : -0.006;
    mesh.cone({x_m, outer_y_m - 5.0 * out, radius_m}, {x_m, outer_y_m + out, radius_m},
              0.66 * radius_m, 0.62 * radius_m, 12, rim, rim);
  };
  // It rolls: its upper side goes forward.
  mesh.turning({.name = "wheel",
                .origin_m = {x_m, 0.5 * (inner_y_m + outer_y_m), radius_m},
                .axis = Vector3d::UnitY(),
                .per_metre_rad = 1.0 / radius_m},
               build);
}

void add_axle(ThingMesh& mesh, double x_m, double outer_y_m, double radius_m, double width_m,
              int detail) {
  add_wheel(mesh, x_m, outer_y_m, radius_m, width_m, detail);
  add_wheel(mesh, x_m, -outer_y_m, radius_m, width_m, detail);
}

void add_box_body(ThingMesh& mesh, const BoxBody& body, FinishNumber paint, FinishNumber lower,
                  FinishNumber glass, FinishNumber roof) {
  // Points along the left side from rear to front: pillars between windows; then mirrored.
  std::vector<double> stations;  // from rear to front, 0 to 1
  const double length_m = body.front_x_m - body.rear_x_m;
  std::vector<bool> is_glass;  // of the edge that starts at a station
  if (body.num_windows > 0) {
    const double from = body.first_window_m / length_m;
    const double pitch = (0.985 - from) / body.num_windows;
    const double pillar = std::min(0.12 * pitch, 0.12 / length_m);
    for (int k = 0; k < body.num_windows; ++k) {
      stations.push_back(from + k * pitch + pillar);
      is_glass.push_back(true);
      stations.push_back(from + (k + 1) * pitch - pillar);
      is_glass.push_back(false);
    }
  }
  const auto ring = [&](double z_m, double inset_m, double front_lean_m) {
    const double front = body.front_x_m - front_lean_m - inset_m;
    const double rear = body.rear_x_m + inset_m;
    const double side = body.half_width_m - inset_m;
    const double cut = std::min(body.corner_m, 0.8 * side);
    const double from = rear + cut;
    const double to = front - cut;
    Outline outline = {{rear, side - cut}, {from, side}};
    for (const double at : stations) outline.emplace_back(from + at * (to - from), side);
    outline.emplace_back(to, side);
    outline.emplace_back(front, side - cut);
    for (std::size_t i = outline.size(); i-- > 0;)
      outline.emplace_back(outline[i].x(), -outline[i].y());
    return ring_at(z_m, outline);
  };
  const double whole_m = body.top_z_m - body.low_z_m;
  const auto lean = [&](double z_m) {
    return z_m <= body.belt_z_m ? 0.0
                                : body.front_slope_m * (z_m - body.belt_z_m) /
                                      std::max(body.top_z_m - body.belt_z_m, 0.01 * whole_m);
  };
  const double shoulder_m = std::min(0.08, 0.5 * (body.top_z_m - body.window_z_m));
  const std::vector<Ring> rings = {
      ring(body.low_z_m, 0.03, 0.0),
      ring(body.low_z_m + 0.25 * (body.belt_z_m - body.low_z_m), 0.0, 0.0),
      ring(body.belt_z_m, 0.0, 0.0),
      ring(body.window_z_m, 0.01, lean(body.window_z_m)),
      ring(body.top_z_m - shoulder_m, 0.015, lean(body.top_z_m - shoulder_m)),
      ring(body.top_z_m, 0.1, lean(body.top_z_m))};
  const std::size_t half = 4 + stations.size();
  const auto finish = [&](std::size_t r, std::size_t edge) {
    if (r == 0) return lower;
    if (r != 2) return r == 4 ? roof : paint;
    const std::size_t along = edge < half ? edge : 2 * half - 2 - edge;
    if (edge == half - 1) return glass;                                     // the front
    if (edge == 2 * half - 1) return body.has_rear_window ? glass : paint;  // the rear
    if (along >= 2 && along - 2 < is_glass.size() && is_glass[along - 2]) return glass;
    if (along + 1 == half - 1) return glass;  // corners of the windscreen
    return paint;
  };
  mesh.loft(rings, finish, lower, roof);
}

void add_pair(ThingMesh& mesh, const Vector3d& lowest, const Vector3d& highest,
              FinishNumber finish) {
  mesh.box(lowest, highest, finish);
  mesh.box({lowest.x(), -highest.y(), lowest.z()}, {highest.x(), -lowest.y(), highest.z()}, finish);
}

}  // namespace terracast::tiler
