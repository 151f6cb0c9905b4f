#include "tiler/objects/road_vehicle.h"

namespace terracast::tiler {
namespace {

using core::SemanticClass;
using Eigen::Vector3d;
using world::Material;

struct BusSpec {
  Vector3d size_m;
  double front_axle_m;          ///< from the front end
  std::vector<double> axles_m;  ///< behind the first
  double belt_z_m;
  double window_z_m;
  double joint_m = 0.0;  ///< of an articulated bus, from the front end
  int num_windows = 8;
};

constexpr std::array<Color, 4> kBusColors = {
    {{228, 226, 218}, {176, 28, 30}, {226, 178, 36}, {40, 88, 150}}};

/// Front and rear of one rigid piece.
void add_piece(ThingMesh& mesh, const BusSpec& bus, double rear_m, double front_m, int num_windows,
               int detail, const Color& color) {
  const FinishNumber paint = mesh.finish(Material::Paint, color);
  const FinishNumber lower = mesh.finish(Material::Paint, {52, 54, 58});
  const FinishNumber glass = mesh.finish(Material::Glass, kWindow);
  const FinishNumber roof = mesh.finish(Material::Paint, {232, 232, 228});
  const double half = 0.5 * bus.size_m.y();
  const double roof_z = bus.size_m.z() - 0.22;
  add_box_body(mesh,
               {.rear_x_m = rear_m,
                .front_x_m = front_m,
                .half_width_m = half,
                .low_z_m = 0.32,
                .belt_z_m = bus.belt_z_m,
                .window_z_m = bus.window_z_m,
                .top_z_m = roof_z,
                .corner_m = 0.18,
                .front_slope_m = 0.14,
                .num_windows = detail == 0 ? num_windows : 1,
                .first_window_m = 0.3,
                .has_rear_window = true},
               paint, lower, glass, roof);
}

void build_bus(ThingMesh& mesh, const BusSpec& bus, int detail, const Color& color) {
  const double front = 0.5 * bus.size_m.x();
  const double half = 0.5 * bus.size_m.y();
  const FinishNumber dark = mesh.finish(Material::Plain, kDark);
  const FinishNumber unit = mesh.finish(Material::Paint, {205, 206, 204});
  if (bus.joint_m > 0.0) {
    const double joint = front - bus.joint_m;
    add_piece(mesh, bus, joint + 0.55, front, bus.num_windows, detail, color);
    add_piece(mesh, bus, -front, joint - 0.55, bus.num_windows - 1, detail, color);
    // Bellows in folds.
    std::vector<Ring> folds;
    const int num_folds = detail == 0 ? 11 : 2;
    for (int k = 0; k < num_folds; ++k) {
      const double x = joint - 0.6 + 1.2 * k / (num_folds - 1);
      const double inset = k % 2 == 0 ? 0.12 : 0.05;
      folds.push_back(
          ring_across(x, cut_rectangle({-half + inset, 0.4 + inset},
                                       {half - inset, bus.size_m.z() - 0.25 - inset}, 0.1)));
    }
    mesh.loft(folds, dark);
  } else {
    add_piece(mesh, bus, -front, front, bus.num_windows, detail, color);
  }
  // Air conditioning on the roof, over the middle and the rear.
  mesh.tapered_box({-0.1, -0.8, bus.size_m.z() - 0.3}, {2.6, 0.8, bus.size_m.z()}, {0.1, -0.65},
                   {2.4, 0.65}, unit);
  if (detail < 2)
    mesh.tapered_box({-front + 0.6, -0.85, bus.size_m.z() - 0.3},
                     {-front + 2.6, 0.85, bus.size_m.z() - 0.06}, {-front + 0.8, -0.7},
                     {-front + 2.4, 0.7}, unit);
  double x = front - bus.front_axle_m;
  const double radius = 0.48;
  std::vector<double> axles = {x};
  for (const double back : bus.axles_m) axles.push_back(x -= back);
  for (const double at : axles) {
    if (detail == 0)
      add_pair(mesh, {at - 0.58, half - 0.3, 0.36}, {at + 0.58, half + 0.0, 1.02}, dark);
    if (detail < 2)
      add_axle(mesh, at, half - 0.002, radius, 0.3, detail);
    else
      mesh.box({at - 0.4, -half + 0.02, 0.0}, {at + 0.4, half - 0.02, 0.5}, dark);
  }
  if (detail > 0) return;
  const FinishNumber head = mesh.finish(Material::Lamp, {240, 242, 235});
  const FinishNumber tail = mesh.finish(Material::Lamp, {150, 12, 14});
  const FinishNumber sign = mesh.finish(Material::Lamp, {235, 150, 40});
  add_pair(mesh, {front - 0.2, 0.72, 0.62}, {front + 0.0, 1.06, 0.80}, head);
  add_pair(mesh, {-front + 0.0, 0.80, 0.85}, {-front + 0.2, 1.05, 1.25}, tail);
  mesh.box({front - 0.4, -0.75, bus.window_z_m + 0.02}, {front - 0.07, 0.75, bus.window_z_m + 0.22},
           sign);
  // Doors on the right, as tall as the windows' top; mirrors.
  const FinishNumber glass = mesh.finish(Material::Glass, kWindow);
  for (double door = front - 1.25; door > -front + 3.0; door -= 4.9)
    mesh.box({door - 0.62, -half - 0.0, 0.42}, {door + 0.62, -half + 0.25, bus.window_z_m}, glass);
}

ThingInfo bus(std::string name, const BusSpec& spec, std::string_view source) {
  return {.name = std::move(name),
          .family = {},
          .semantic_class = SemanticClass::Bus,
          .stance = Stance::Stands,
          .size_m = spec.size_m,
          .source = source,
          .coarsest_levels = {0, 1, 3},
          .num_variants = static_cast<int>(kBusColors.size()),
          .build = [spec](ThingMesh& mesh, int detail, int variant) {
            build_bus(mesh, spec, detail, kBusColors[static_cast<std::size_t>(variant)]);
          }};
}

}  // namespace

std::vector<ThingInfo> buses();
std::vector<ThingInfo> buses() {
  return {bus("city_bus",
              {.size_m = {12.135, 2.550, 3.120},
               .front_axle_m = 2.805,
               .axles_m = {5.900},
               .belt_z_m = 1.05,
               .window_z_m = 2.35,
               .num_windows = 8},
              "Mercedes-Benz Citaro: 12.135 x 2.550 x 3.120 m, wheelbase 5.900 m (manufacturer's "
              "data)"),
          bus("articulated_bus",
              {.size_m = {18.125, 2.550, 3.120},
               .front_axle_m = 2.805,
               .axles_m = {5.900, 5.990},
               .belt_z_m = 1.05,
               .window_z_m = 2.35,
               .joint_m = 10.6,
               .num_windows = 7},
              "Mercedes-Benz Citaro G: 18.125 x 2.550 x 3.120 m (manufacturer's data)"),
          bus("coach",
              {.size_m = {12.295, 2.550, 3.770},
               .front_axle_m = 2.76,
               .axles_m = {6.080},
               .belt_z_m = 1.75,
               .window_z_m = 3.05,
               .num_windows = 7},
              "Setra S 515 HD: 12.295 x 2.550 x 3.770 m, wheelbase 6.080 m (manufacturer's data)")};
}

}  // namespace terracast::tiler
