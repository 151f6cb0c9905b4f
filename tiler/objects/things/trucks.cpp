#include "tiler/objects/road_vehicle.h"

namespace terracast::tiler {
namespace {

using core::SemanticClass;
using Eigen::Vector3d;
using world::Material;

constexpr double kHalfWidth_m = 1.275;
constexpr double kWheel_m = 0.50;
constexpr std::array<Color, 5> kCabColors = {
    {{232, 232, 230}, {170, 24, 28}, {30, 70, 132}, {226, 160, 32}, {70, 74, 78}}};
constexpr std::array<Color, 5> kBoxColors = {
    {{228, 228, 224}, {216, 214, 206}, {50, 92, 150}, {190, 192, 190}, {38, 96, 62}}};

/// A cab over the engine, its front at front_m.
void add_cab(ThingMesh& mesh, double front_m, double length_m, double height_m, int detail,
             const Color& color) {
  const FinishNumber paint = mesh.finish(Material::Paint, color);
  const FinishNumber dark = mesh.finish(Material::Plain, kDark);
  const FinishNumber glass = mesh.finish(Material::Glass, kWindow);
  add_box_body(mesh,
               {.rear_x_m = front_m - length_m,
                .front_x_m = front_m,
                .half_width_m = 1.24,
                .low_z_m = 0.36,
                .belt_z_m = 1.75,
                .window_z_m = 2.55,
                .top_z_m = height_m,
                .corner_m = 0.16,
                .front_slope_m = 0.35,
                .num_windows = 1,
                .first_window_m = 0.42 * length_m,
                .has_rear_window = false},
               paint, dark, glass, paint);
  if (detail > 0) return;
  const FinishNumber head = mesh.finish(Material::Lamp, {240, 242, 235});
  mesh.box({front_m - 0.3, -0.85, 0.75}, {front_m + 0.0, 0.85, 1.45}, dark);
  add_pair(mesh, {front_m - 0.3, 0.78, 0.52}, {front_m + 0.0, 1.12, 0.70}, head);
  add_pair(mesh, {front_m - 0.30, 1.22, 1.85}, {front_m - 0.14, 1.275, 2.60}, dark);  // mirrors
}

void add_frame(ThingMesh& mesh, double rear_m, double front_m) {
  const FinishNumber dark = mesh.finish(Material::Metal, kDark);
  mesh.box({rear_m, -0.45, 0.62}, {front_m, 0.45, 0.98}, dark);
}

void add_wheels(ThingMesh& mesh, double x_m, bool is_driven, int detail) {
  if (detail < 2) {
    add_axle(mesh, x_m, 1.25, kWheel_m, is_driven ? 0.60 : 0.32, detail);
    return;
  }
  const FinishNumber tyre = mesh.finish(Material::Rubber, kTyre);
  mesh.box({x_m - 0.42, -1.25, 0.0}, {x_m + 0.42, 1.25, 0.8}, tyre);
}

void add_load(ThingMesh& mesh, double rear_m, double front_m, double low_m, double high_m,
              bool is_tank, int detail, const Color& color) {
  const FinishNumber paint = mesh.finish(Material::Paint, color);
  const FinishNumber dark = mesh.finish(Material::Metal, {70, 72, 74});
  if (is_tank) {
    const int num_sides = round_sides(20, detail);
    const double middle = 0.5 * (low_m + high_m);
    const FinishNumber steel = mesh.finish(Material::Metal, {196, 198, 200});
    std::vector<Ring> rings;
    for (const auto& [x, share] :
         {std::pair{rear_m, 0.72}, {rear_m + 0.35, 1.0}, {front_m - 0.35, 1.0}, {front_m, 0.72}})
      rings.push_back(ring_across(x, round_outline(share * 1.25, share * 0.5 * (high_m - low_m),
                                                   num_sides, {0.0, middle})));
    mesh.loft(rings, steel);
    if (detail == 0)
      mesh.box({rear_m + 1.0, -0.3, high_m - 0.2}, {front_m - 1.0, 0.3, high_m + 0.0}, dark);
    return;
  }
  mesh.loft(
      {ring_across(rear_m, cut_rectangle({-kHalfWidth_m, low_m}, {kHalfWidth_m, high_m}, 0.04)),
       ring_across(front_m, cut_rectangle({-kHalfWidth_m, low_m}, {kHalfWidth_m, high_m}, 0.04))},
      paint);
  if (detail > 0) return;
  // A rail along the foot, and the doors' bars.
  mesh.box({rear_m + 0.05, -kHalfWidth_m + 0.04, low_m - 0.12},
           {front_m - 0.05, kHalfWidth_m - 0.04, low_m + 0.02}, dark);
  const FinishNumber tail = mesh.finish(Material::Lamp, {150, 12, 14});
  add_pair(mesh, {rear_m + 0.06, 0.75, low_m - 0.30}, {rear_m + 0.2, 1.15, low_m - 0.10}, tail);
  for (const double y : {-0.9, -0.35, 0.35, 0.9})
    mesh.box({rear_m - 0.0, y - 0.02, low_m + 0.1}, {rear_m + 0.1, y + 0.02, high_m - 0.1}, dark);
}

void build_rigid(ThingMesh& mesh, bool is_tipper, int detail, int variant) {
  const auto v = static_cast<std::size_t>(variant);
  const double front = is_tipper ? 4.4 : 4.75;
  add_frame(mesh, -front + 0.15, front - 0.4);
  if (is_tipper) {
    add_cab(mesh, front, 1.95, 3.0, detail, kCabColors[v]);
    const FinishNumber body = mesh.finish(Material::Paint, kBoxColors[v]);
    const FinishNumber load = mesh.finish(Material::Plain, {124, 104, 78});
    mesh.tapered_box({-front, -1.15, 1.05}, {front - 2.25, 1.15, 2.45}, {-front, -kHalfWidth_m},
                     {front - 2.15, kHalfWidth_m}, body);
    mesh.tapered_box({-front + 0.15, -1.1, 2.3}, {front - 2.35, 1.1, 2.75}, {-front + 1.4, -0.4},
                     {front - 3.6, 0.4}, load);
    for (const double x : {front - 1.40, front - 5.25, front - 6.60})
      add_wheels(mesh, x, x < 0.0, detail);
    return;
  }
  add_cab(mesh, front, 2.0, 3.3, detail, kCabColors[v]);
  add_load(mesh, -front, front - 2.35, 1.05, 3.72, false, detail, kBoxColors[v]);
  for (const double x : {front - 1.40, front - 6.60}) add_wheels(mesh, x, x < 0.0, detail);
}

void build_articulated(ThingMesh& mesh, bool is_tank, int detail, int variant) {
  const auto v = static_cast<std::size_t>(variant);
  const double front = 8.25;
  add_cab(mesh, front, 2.28, 3.82, detail, kCabColors[v]);
  add_frame(mesh, front - 5.9, front - 0.4);
  for (const double x : {front - 1.40, front - 5.10}) add_wheels(mesh, x, x < front - 2.0, detail);
  if (detail < 2) {
    const FinishNumber steel = mesh.finish(Material::Metal, {150, 152, 154});
    add_pair(mesh, {front - 3.9, 0.6, 0.45}, {front - 2.7, 1.22, 1.0}, steel);  // tanks
  }
  // The semi-trailer: 13.6 m.
  add_load(mesh, -8.25, 5.35, is_tank ? 1.15 : 1.18, is_tank ? 3.55 : 4.0, is_tank, detail,
           kBoxColors[v]);
  add_frame(mesh, -8.1, 1.0);
  for (const double x : {-3.2, -4.51, -5.82}) add_wheels(mesh, x, false, detail);
  if (detail == 0) {
    const FinishNumber dark = mesh.finish(Material::Metal, {70, 72, 74});
    add_pair(mesh, {-2.4, 1.12, 0.45}, {1.6, 1.20, 1.0}, dark);  // side guards
    add_pair(mesh, {2.2, 0.7, 0.0}, {2.5, 0.9, 1.2}, dark);      // landing legs
  }
}

ThingInfo truck(std::string name, const Vector3d& size_m, std::string_view source,
                std::function<void(ThingMesh&, int, int)> build) {
  return {.name = std::move(name),
          .family = {},
          .semantic_class = SemanticClass::Truck,
          .stance = Stance::Stands,
          .size_m = size_m,
          .source = source,
          .coarsest_levels = {0, 1, 3},
          .num_variants = static_cast<int>(kCabColors.size()),
          .build = std::move(build)};
}

}  // namespace

std::vector<ThingInfo> trucks();
std::vector<ThingInfo> trucks() {
  return {
      truck(
          "box_truck", {9.50, 2.55, 3.72},
          "width: Directive 96/53/EC, 2.55 m; box 7.15 m: EN 284 swap body C 715; wheelbase 5.2 m "
          "as 18 t chassis have",
          [](ThingMesh& m, int d, int v) { build_rigid(m, false, d, v); }),
      truck(
          "tipper", {8.80, 2.55, 3.00},
          "width: Directive 96/53/EC, 2.55 m; three axles, wheelbase 3.85 + 1.35 m as 26 t chassis "
          "have",
          [](ThingMesh& m, int d, int v) { build_rigid(m, true, d, v); }),
      truck("articulated_truck", {16.50, 2.55, 4.00},
            "Directive 96/53/EC: 16.50 x 2.55 x 4.00 m; semi-trailer 13.6 m",
            [](ThingMesh& m, int d, int v) { build_articulated(m, false, d, v); }),
      truck("tank_truck", {16.50, 2.55, 3.82},
            "Directive 96/53/EC: 16.50 x 2.55 m; height below its 4.00 m",
            [](ThingMesh& m, int d, int v) { build_articulated(m, true, d, v); })};
}

}  // namespace terracast::tiler
