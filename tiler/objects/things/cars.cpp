#include <algorithm>
#include <cmath>
#include <numbers>

#include "tiler/objects/road_vehicle.h"

// Passenger cars, pick-ups and vans. A lower body whose side view, with its wheel arches, goes across from
// side to side, and a glass house of level rings on it.
namespace terracast::tiler {
namespace {

using core::SemanticClass;
using Eigen::Vector2d;
using Eigen::Vector3d;
using world::Material;

/// x from the car's middle, forward; z above the road; m.
struct CarSpec {
  Vector3d size_m;
  double wheelbase_m;
  double front_axle_m;  ///< from the front end
  double wheel_radius_m;
  double clearance_m;
  double nose_z_m;  ///< where the bonnet begins
  double cowl_z_m;  ///< where it ends, at the windscreen
  double belt_z_m;  ///< lower edge of the side windows
  double deck_z_m;  ///< rear deck
  // From the front end:
  double screen_m;     ///< foot of the windscreen
  double roof_from_m;  ///< its top
  double roof_to_m;
  double house_to_m;             ///< foot of the rear window
  double tumble_m;               ///< by which the roof is narrower on each side
  bool has_rear_windows = true;  ///< beside the load
  bool has_bed = false;          ///< open, behind the house
};

void add_lower_body(ThingMesh& mesh, const CarSpec& car, int detail, FinishNumber paint,
                    FinishNumber dark) {
  const double front = 0.5 * car.size_m.x();
  const double rear = -front;
  const double half = 0.5 * car.size_m.y();
  const double radius = car.wheel_radius_m;
  const double low = car.clearance_m;
  std::vector<Vector2d> profile;  // from the rear's foot forward along the sill, then back on top
  std::vector<bool> is_dark;      // of the edge from a point to the next
  std::vector<bool> is_arch;
  const auto add = [&](double x, double z, bool dark_edge = false, bool arch = false) {
    profile.emplace_back(x, z);
    is_dark.push_back(dark_edge);
    is_arch.push_back(arch);
  };
  add(rear + 0.10, low + 0.08, true);
  const double front_axle = front - car.front_axle_m;
  for (const double axle : {front_axle - car.wheelbase_m, front_axle}) {
    const double arch = radius + 0.055;
    const double from = std::asin((low - radius) / arch);
    const int num_points = detail == 0 ? 9 : 5;
    for (int k = 0; k < num_points; ++k) {
      const double turn =
          std::numbers::pi - from + (2.0 * from - std::numbers::pi) * k / (num_points - 1);
      add(axle + arch * std::cos(turn), radius + arch * std::sin(turn), true, true);
    }
  }
  add(front - 0.12, low + 0.05);
  add(front, low + 0.26);
  add(front - 0.015, 0.5 * (low + car.nose_z_m) + 0.08);
  add(front - 0.12, car.nose_z_m);
  add(front - 0.45 * car.screen_m, car.nose_z_m + 0.62 * (car.cowl_z_m - car.nose_z_m));
  add(front - car.screen_m, car.cowl_z_m);
  add(front - car.roof_to_m, car.belt_z_m);
  add(front - car.house_to_m, car.deck_z_m);
  add(std::min(rear + 0.10, front - car.house_to_m - 0.005), car.deck_z_m - 0.03);
  add(rear + 0.01, car.deck_z_m - 0.16);
  add(rear, low + 0.25);

  const auto narrowing = [&](double x) {
    const double reach = 0.75;
    const double t = std::max(std::abs(x) - (front - reach), 0.0) / reach;
    return 1.0 - 0.16 * t * t;
  };
  const auto ring = [&](double side, double width, double inset) {
    Ring points;
    for (std::size_t i = 0; i < profile.size(); ++i) {
      // Wheel arches go straight across: what bends inward there would go through the side.
      const Vector2d& point = profile[i];
      const double own = is_arch[i] ? 0.0 : inset;
      const bool is_upper = point.y() > 0.5 * (low + car.belt_z_m);
      const double z = is_upper ? point.y() - own : point.y();
      points.emplace_back(point.x() * (1.0 - 0.25 * own / front),
                          side * width * narrowing(point.x()), z);
    }
    return points;
  };
  // Sides bend inward to sill and shoulder.
  std::vector<Ring> rings = {ring(-1.0, half - 0.0, 0.09), ring(-1.0, half - 0.06, 0.03),
                             ring(-1.0, half - 0.16, 0.0), ring(1.0, half - 0.16, 0.0),
                             ring(1.0, half - 0.06, 0.03), ring(1.0, half - 0.0, 0.09)};
  if (detail > 0) {
    rings.erase(rings.begin() + 4);
    rings.erase(rings.begin() + 1);
  }
  mesh.loft(
      rings, [&](std::size_t, std::size_t edge) { return is_dark[edge] ? dark : paint; }, paint,
      paint);
}

void add_house(ThingMesh& mesh, const CarSpec& car, int detail, FinishNumber paint,
               FinishNumber glass, FinishNumber pillar) {
  const double front = 0.5 * car.size_m.x();
  const double half = 0.5 * car.size_m.y() - 0.07;
  const double low_z = std::min(car.cowl_z_m, std::min(car.belt_z_m, car.deck_z_m)) - 0.12;
  const double glass_z = car.size_m.z() - 0.09;
  // Stations along the side from the windscreen's corner to the rear window's.
  const std::vector<double> stations = {0.0, 0.05, 0.40, 0.44, 0.74, 0.78, 0.93, 1.0};
  const std::vector<FinishNumber> kinds = {pillar,
                                           glass,
                                           pillar,
                                           car.has_rear_windows ? glass : paint,
                                           car.has_rear_windows ? pillar : paint,
                                           car.has_rear_windows && !car.has_bed ? glass : paint,
                                           paint};
  const auto ring = [&](double z, double share, double inset) {
    // share   0 at the belt, 1 at the roof
    const double from = front - (car.screen_m + share * (car.roof_from_m - car.screen_m)) - inset;
    const double to = front - (car.house_to_m + share * (car.roof_to_m - car.house_to_m)) + inset;
    const double side = half - share * car.tumble_m - 0.8 * inset;
    Outline outline;
    outline.emplace_back(from + 0.07 - 0.03 * share, 0.0);  // the windscreen bends
    for (const double at : stations) {
      const double narrow = at == 0.0 ? 0.07 : at == 1.0 ? 0.05 : 0.0;
      outline.emplace_back(from + at * (to - from), side - narrow);
    }
    outline.emplace_back(to - 0.04, 0.0);
    for (std::size_t i = outline.size() - 2; i > 0; --i)
      outline.emplace_back(outline[i].x(), -outline[i].y());
    return ring_at(z, outline);
  };
  // The glass goes on below the belt, inside the lower body.
  const double slope = (car.belt_z_m - low_z) / (glass_z - car.belt_z_m);
  std::vector<Ring> rings = {ring(low_z, -slope, 0.0), ring(glass_z, 1.0, 0.0),
                             ring(car.size_m.z() - 0.035, 1.0, 0.05),
                             ring(car.size_m.z(), 1.0, 0.22)};
  const std::size_t last = stations.size();  // point of the rear window's left corner
  const auto finish = [&](std::size_t r, std::size_t edge) {
    if (r > 0) return paint;
    if (edge == 0 || edge == 2 * last + 1) return glass;  // windscreen
    if (edge == last || edge == last + 1) return car.has_rear_windows ? glass : paint;
    const std::size_t along = edge < last ? edge - 1 : 2 * last - edge;
    return kinds[std::min(along, kinds.size() - 1)];
  };
  if (detail > 1) rings.erase(rings.begin() + 2);
  mesh.loft(rings, finish, pillar, paint);
}

void add_small_parts(ThingMesh& mesh, const CarSpec& car, FinishNumber paint, FinishNumber dark) {
  const double front = 0.5 * car.size_m.x();
  const double half = 0.5 * car.size_m.y();
  const FinishNumber head = mesh.finish(Material::Lamp, {240, 242, 235});
  const FinishNumber tail = mesh.finish(Material::Lamp, {150, 12, 14});
  const FinishNumber plate = mesh.finish(Material::Plain, {225, 225, 215});
  const double nose = car.nose_z_m;
  add_pair(mesh, {front - 0.42, 0.48 * half, nose - 0.17},
           {front - 0.035, 0.83 * half, nose - 0.05}, head);
  const double deck = car.deck_z_m;
  add_pair(mesh, {-front + 0.012, 0.52 * half, deck - 0.30},
           {-front + 0.30, 0.84 * half, deck - 0.14}, tail);
  mesh.box({front - 0.2, -0.42 * half, nose - 0.24}, {front - 0.008, 0.42 * half, nose - 0.10},
           dark);
  mesh.box({front - 0.2, -0.7 * half, car.clearance_m + 0.12},
           {front + 0.0, 0.7 * half, car.clearance_m + 0.25}, dark);
  mesh.box({front - 0.2, -0.26, car.clearance_m + 0.27},
           {front + 0.0, 0.26, car.clearance_m + 0.38}, plate);
  mesh.box({-front + 0.0, -0.26, 0.5 * deck + 0.06}, {-front + 0.2, 0.26, 0.5 * deck + 0.17},
           plate);
  // Mirrors, within the body's width.
  const double mirror_x = front - car.screen_m - 0.32;
  add_pair(mesh, {mirror_x, half - 0.16, car.belt_z_m + 0.01},
           {mirror_x + 0.11, half, car.belt_z_m + 0.14}, paint);
}

void build_car(ThingMesh& mesh, const CarSpec& car, int detail, const Color& color) {
  const FinishNumber paint = mesh.finish(Material::Paint, color);
  const FinishNumber glass = mesh.finish(Material::Glass, kWindow);
  const FinishNumber dark = mesh.finish(Material::Plain, kDark);
  const double front = 0.5 * car.size_m.x();
  const double half = 0.5 * car.size_m.y();
  if (detail >= 2) {
    // One prism for the body, down to the ground between the wheels.
    const FinishNumber tyre = mesh.finish(Material::Rubber, kTyre);
    mesh.prism_across({{-front, 0.3},
                       {front, 0.3},
                       {front - 0.05, car.nose_z_m},
                       {front - car.screen_m, car.cowl_z_m - 0.03},
                       {-front + 0.05, car.deck_z_m - 0.03}},
                      -0.97 * half, 0.97 * half, paint, paint);
    const double axle = front - car.front_axle_m;
    for (const double x : {axle, axle - car.wheelbase_m})
      mesh.box({x - 0.8 * car.wheel_radius_m, -half, 0.0},
               {x + 0.8 * car.wheel_radius_m, half, 0.5}, tyre);
    mesh.loft(
        {ring_at(car.belt_z_m - 0.2, rectangle({front - car.house_to_m, -half + 0.08},
                                               {front - car.screen_m, half - 0.08})),
         ring_at(car.size_m.z() - 0.06,
                 rectangle({front - car.roof_to_m, -half + 0.07 + car.tumble_m},
                           {front - car.roof_from_m, half - 0.07 - car.tumble_m})),
         ring_at(car.size_m.z(),
                 rectangle({front - car.roof_to_m + 0.1, -half + 0.2 + car.tumble_m},
                           {front - car.roof_from_m - 0.1, half - 0.2 - car.tumble_m}))},
        [&](std::size_t r, std::size_t edge) {
          return r == 0 && (car.has_rear_windows || edge == 1) ? glass : paint;
        },
        dark, paint);
    return;
  }
  add_lower_body(mesh, car, detail, paint, dark);
  add_house(mesh, car, detail, paint, glass, dark);
  const double width = 0.36 * car.wheel_radius_m * 2.0 * 0.9;
  const double axle = front - car.front_axle_m;
  for (const double x : {axle, axle - car.wheelbase_m})
    add_axle(mesh, x, half - 0.008, car.wheel_radius_m, width, detail);
  if (car.has_bed)  // the bed's floor, seen as a dark opening
    mesh.box({-front + 0.16, -half + 0.2, car.deck_z_m - 0.12},
             {front - car.house_to_m - 0.12, half - 0.2, car.deck_z_m + 0.006}, dark);
  if (detail == 0) add_small_parts(mesh, car, paint, dark);
}

ThingInfo car(std::string name, const CarSpec& spec, std::string_view source,
              SemanticClass semantic_class = SemanticClass::Car) {
  return {.name = std::move(name),
          .family = {},
          .semantic_class = semantic_class,
          .stance = Stance::Stands,
          .size_m = spec.size_m,
          .source = source,
          .coarsest_levels = {0, 1, 2},
          .num_variants = static_cast<int>(kCarColors.size()),
          .build = [spec](ThingMesh& mesh, int detail, int variant) {
            build_car(mesh, spec, detail, kCarColors[static_cast<std::size_t>(variant)]);
          }};
}

}  // namespace

std::vector<ThingInfo> cars();
std::vector<ThingInfo> cars() {
  return {
      car("city_car",
          {.size_m = {3.571, 1.627, 1.488},
           .wheelbase_m = 2.300,
           .front_axle_m = 0.70,
           .wheel_radius_m = 0.290,
           .clearance_m = 0.16,
           .nose_z_m = 0.78,
           .cowl_z_m = 0.97,
           .belt_z_m = 0.98,
           .deck_z_m = 0.98,
           .screen_m = 0.92,
           .roof_from_m = 1.52,
           .roof_to_m = 3.15,
           .house_to_m = 3.44,
           .tumble_m = 0.13},
          "Fiat 500 (2007): 3.571 x 1.627 x 1.488 m, wheelbase 2.300 m (manufacturer's data)"),
      car("hatchback",
          {.size_m = {4.284, 1.789, 1.456},
           .wheelbase_m = 2.636,
           .front_axle_m = 0.85,
           .wheel_radius_m = 0.316,
           .clearance_m = 0.16,
           .nose_z_m = 0.72,
           .cowl_z_m = 0.95,
           .belt_z_m = 0.96,
           .deck_z_m = 0.98,
           .screen_m = 1.16,
           .roof_from_m = 1.92,
           .roof_to_m = 3.72,
           .house_to_m = 4.12,
           .tumble_m = 0.15},
          "Volkswagen Golf VIII: 4.284 x 1.789 x 1.456 m, wheelbase 2.636 m (manufacturer's data)"),
      car("sedan",
          {.size_m = {4.709, 1.827, 1.435},
           .wheelbase_m = 2.851,
           .front_axle_m = 0.79,
           .wheel_radius_m = 0.325,
           .clearance_m = 0.15,
           .nose_z_m = 0.70,
           .cowl_z_m = 0.93,
           .belt_z_m = 0.95,
           .deck_z_m = 1.00,
           .screen_m = 1.42,
           .roof_from_m = 2.10,
           .roof_to_m = 3.45,
           .house_to_m = 4.10,
           .tumble_m = 0.17},
          "BMW 3 Series (G20): 4.709 x 1.827 x 1.435 m, wheelbase 2.851 m (manufacturer's data)"),
      car("estate",
          {.size_m = {4.761, 1.850, 1.427},
           .wheelbase_m = 2.872,
           .front_axle_m = 0.87,
           .wheel_radius_m = 0.330,
           .clearance_m = 0.15,
           .nose_z_m = 0.72,
           .cowl_z_m = 0.95,
           .belt_z_m = 0.97,
           .deck_z_m = 0.98,
           .screen_m = 1.45,
           .roof_from_m = 2.15,
           .roof_to_m = 4.30,
           .house_to_m = 4.62,
           .tumble_m = 0.16},
          "Volvo V60 (2018): 4.761 x 1.850 x 1.427 m, wheelbase 2.872 m (manufacturer's data)"),
      car("suv",
          {.size_m = {4.600, 1.855, 1.685},
           .wheelbase_m = 2.690,
           .front_axle_m = 0.92,
           .wheel_radius_m = 0.355,
           .clearance_m = 0.20,
           .nose_z_m = 0.92,
           .cowl_z_m = 1.12,
           .belt_z_m = 1.13,
           .deck_z_m = 1.14,
           .screen_m = 1.28,
           .roof_from_m = 1.98,
           .roof_to_m = 4.05,
           .house_to_m = 4.45,
           .tumble_m = 0.16},
          "Toyota RAV4 (XA50): 4.600 x 1.855 x 1.685 m, wheelbase 2.690 m (manufacturer's data)"),
      car("pickup",
          {.size_m = {5.325, 1.855, 1.815},
           .wheelbase_m = 3.085,
           .front_axle_m = 0.99,
           .wheel_radius_m = 0.380,
           .clearance_m = 0.28,
           .nose_z_m = 1.02,
           .cowl_z_m = 1.18,
           .belt_z_m = 1.20,
           .deck_z_m = 1.15,
           .screen_m = 1.40,
           .roof_from_m = 1.98,
           .roof_to_m = 3.42,
           .house_to_m = 3.62,
           .tumble_m = 0.17,
           .has_bed = true},
          "Toyota Hilux (2015): 5.325 x 1.855 x 1.815 m, wheelbase 3.085 m (manufacturer's data)"),
      car("small_van",
          {.size_m = {4.500, 1.855, 1.833},
           .wheelbase_m = 2.755,
           .front_axle_m = 0.89,
           .wheel_radius_m = 0.320,
           .clearance_m = 0.17,
           .nose_z_m = 0.86,
           .cowl_z_m = 1.08,
           .belt_z_m = 1.10,
           .deck_z_m = 1.10,
           .screen_m = 0.98,
           .roof_from_m = 1.68,
           .roof_to_m = 4.38,
           .house_to_m = 4.45,
           .tumble_m = 0.10,
           .has_rear_windows = false},
          "Volkswagen Caddy V Cargo: 4.500 x 1.855 x 1.833 m, wheelbase 2.755 m (manufacturer's "
          "data)",
          SemanticClass::Van),
      car("van",
          {.size_m = {5.986, 2.040, 2.590},
           .wheelbase_m = 3.640,
           .front_axle_m = 1.00,
           .wheel_radius_m = 0.345,
           .clearance_m = 0.20,
           .nose_z_m = 1.02,
           .cowl_z_m = 1.30,
           .belt_z_m = 1.32,
           .deck_z_m = 1.32,
           .screen_m = 0.82,
           .roof_from_m = 1.72,
           .roof_to_m = 5.90,
           .house_to_m = 5.95,
           .tumble_m = 0.09,
           .has_rear_windows = false},
          "Volkswagen Crafter, high roof: 5.986 x 2.040 x 2.590 m, wheelbase 3.640 m "
          "(manufacturer's data)",
          SemanticClass::Van)};
}

}  // namespace terracast::tiler
