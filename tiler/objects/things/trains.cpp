#include <span>

#include "tiler/objects/road_vehicle.h"

// Cars of trains, one at a time: each stands on two bogies.
namespace terracast::tiler {
namespace {

using core::SemanticClass;
using Eigen::Vector3d;
using world::Material;

/// From the middle of one rail's head to that of the other: 1435 mm between heads of 72 mm.
constexpr double kHalfRails_m = 0.7535;
constexpr double kTread_m = 0.135;

constexpr std::array<Color, 4> kLocomotiveColors = {
    {{176, 28, 32}, {196, 200, 204}, {38, 62, 108}, {58, 60, 64}}};
constexpr std::array<Color, 4> kCoachColors = {
    {{222, 220, 214}, {150, 32, 38}, {56, 84, 128}, {74, 92, 78}}};
constexpr std::array<Color, 5> kContainerColors = {
    {{148, 52, 38}, {44, 84, 134}, {52, 98, 70}, {204, 140, 44}, {140, 142, 144}}};

struct CarSpec {
  Vector3d size_m;     ///< length over buffers or couplings
  double pivots_m;     ///< between the pivots of its bogies
  double wheelbase_m;  ///< of a bogie
  double wheel_m;      ///< radius
  double low_z_m;      ///< of the body
  double belt_z_m;
  double window_z_m;
  double end_m;    ///< from the body's end to that of buffers or coupling
  double slope_m;  ///< of the front
  int num_windows;
  bool has_buffers;  ///< two at each end; otherwise a coupling in the middle
};

/// Two discs on an axle, which roll.
void add_wheelset(ThingMesh& mesh, double x_m, double radius_m, int detail) {
  const FinishNumber steel = mesh.finish(Material::Metal, {92, 88, 84});
  const int num_sides = round_sides(20, detail);
  mesh.turning(
      {.name = "axle",
       .origin_m = {x_m, 0.0, radius_m},
       .axis = Vector3d::UnitY(),
       .per_metre_rad = 1.0 / radius_m},
      [&] {
        for (const double side : {1.0, -1.0}) {
          const double middle = side * kHalfRails_m, half = 0.5 * side * kTread_m;
          mesh.cylinder({x_m, middle - half, radius_m}, {x_m, middle + half, radius_m}, radius_m,
                        num_sides, steel, steel);
        }
        const double reach = kHalfRails_m - 0.3 * kTread_m;
        mesh.cylinder({x_m, -reach, radius_m}, {x_m, reach, radius_m}, 0.08, 8, steel, steel);
      });
}

void add_bogie(ThingMesh& mesh, const CarSpec& car, double x_m, int detail) {
  const FinishNumber frame = mesh.finish(Material::Metal, {48, 48, 50});
  const double half = 0.5 * car.wheelbase_m;
  const double reach = half + 0.45;
  if (detail < 2)
    for (const double at : {x_m + half, x_m - half}) add_wheelset(mesh, at, car.wheel_m, detail);
  else
    mesh.box({x_m - half, -kHalfRails_m, 0.0}, {x_m + half, kHalfRails_m, 0.4}, frame);
  // Beams beside the wheels carry what is above.
  add_pair(mesh, {x_m - reach, kHalfRails_m + 0.10, 0.8 * car.wheel_m},
           {x_m + reach, kHalfRails_m + 0.30, 1.35 * car.wheel_m}, frame);
  mesh.box({x_m - 0.35, -kHalfRails_m - 0.2, 0.9 * car.wheel_m},
           {x_m + 0.35, kHalfRails_m + 0.2, car.low_z_m + 0.1}, frame);
}

/// Buffers, or a coupling, from the body's ends as far as the car is long.
void add_ends(ThingMesh& mesh, const CarSpec& car, double low_z_m) {
  const FinishNumber dark = mesh.finish(Material::Metal, kDark);
  const double end = 0.5 * car.size_m.x();
  const double from = end - car.end_m - 0.3;
  for (const double side : {1.0, -1.0}) {
    const double a = side > 0.0 ? from : -end, b = side > 0.0 ? end : -from;
    if (car.has_buffers)
      add_pair(mesh, {a, 0.875 - 0.17, 0.89}, {b, 0.875 + 0.17, 1.23}, dark);
    else
      mesh.box({a, -0.15, low_z_m + 0.05}, {b, 0.15, low_z_m + 0.3}, dark);
  }
}

void add_running_gear(ThingMesh& mesh, const CarSpec& car, int detail) {
  for (const double side : {1.0, -1.0}) add_bogie(mesh, car, 0.5 * side * car.pivots_m, detail);
}

void add_lamps(ThingMesh& mesh, const CarSpec& car, double low_m, double across_m) {
  const FinishNumber head = mesh.finish(Material::Lamp, {240, 242, 235});
  const FinishNumber tail = mesh.finish(Material::Lamp, {150, 12, 14});
  const double end = 0.5 * car.size_m.x() - car.end_m;
  add_pair(mesh, {end - 0.3, across_m, low_m}, {end + 0.03, across_m + 0.25, low_m + 0.18}, head);
  add_pair(mesh, {-end - 0.03, across_m, low_m}, {-end + 0.3, across_m + 0.25, low_m + 0.18}, tail);
}

/// A body with windows: coaches, railcars, trams, locomotives.
void build_car(ThingMesh& mesh, const CarSpec& car, int detail, const Color& color) {
  const FinishNumber paint = mesh.finish(Material::Paint, color);
  const FinishNumber lower = mesh.finish(Material::Paint, {56, 58, 62});
  const FinishNumber glass = mesh.finish(Material::Glass, kWindow);
  const FinishNumber roof = mesh.finish(Material::Paint, {150, 152, 154});
  const double end = 0.5 * car.size_m.x() - car.end_m;
  const double half = 0.5 * car.size_m.y();
  add_box_body(mesh,
               {.rear_x_m = -end,
                .front_x_m = end,
                .half_width_m = half,
                .low_z_m = car.low_z_m,
                .belt_z_m = car.belt_z_m,
                .window_z_m = car.window_z_m,
                .top_z_m = car.size_m.z() - 0.12,
                .corner_m = 0.2,
                .front_slope_m = car.slope_m,
                .num_windows = detail == 0 ? car.num_windows : std::min(car.num_windows, 1),
                .first_window_m = 0.8,
                .has_rear_window = true},
               paint, lower, glass, roof);
  // On the roof, and below the floor between the bogies.
  mesh.tapered_box({-0.6 * end, -0.35 * half, car.size_m.z() - 0.3},
                   {0.6 * end, 0.35 * half, car.size_m.z()}, {-0.58 * end, -0.3 * half},
                   {0.58 * end, 0.3 * half}, roof);
  const double between = 0.5 * (car.pivots_m - car.wheelbase_m) - 0.9;
  mesh.box({-between, -half + 0.25, 0.35}, {between, half - 0.25, car.low_z_m + 0.1}, lower);
  add_running_gear(mesh, car, detail);
  add_ends(mesh, car, car.low_z_m);
  if (detail == 0) add_lamps(mesh, car, car.low_z_m + 0.3, 0.55 * half);
}

/// A frame with two containers, of 40 and of 20 feet (ISO 668: 12.192 and 6.058 x 2.438 x 2.591 m).
void build_wagon(ThingMesh& mesh, const CarSpec& car, int detail, int variant) {
  constexpr double kHalfContainer_m = 1.219;
  constexpr double kGap_m = 0.1;
  const FinishNumber frame = mesh.finish(Material::Metal, {70, 58, 52});
  const double end = 0.5 * car.size_m.x() - car.end_m;
  const double load_m = car.size_m.z() - 2.591;
  mesh.box({-end, -0.5 * car.size_m.y(), load_m - 0.4}, {end, 0.5 * car.size_m.y(), load_m}, frame);
  const double loaded_m = 12.192 + 6.058 + kGap_m;
  double at = -0.5 * loaded_m;
  for (const auto& [length_m, color] :
       {std::pair{12.192, variant}, std::pair{6.058, variant + 2}}) {
    const FinishNumber paint =
        mesh.finish(Material::Paint,
                    kContainerColors[static_cast<std::size_t>(color) % kContainerColors.size()]);
    mesh.box({at, -kHalfContainer_m, load_m - 0.05},
             {at + length_m, kHalfContainer_m, car.size_m.z()}, paint);
    at += length_m + kGap_m;
  }
  add_running_gear(mesh, car, detail);
  add_ends(mesh, car, 0.8);
}

ThingInfo car(std::string name, const CarSpec& spec, int num_variants, std::string_view source,
              std::function<void(ThingMesh&, int, int)> build) {
  return {.name = std::move(name),
          .family = {},
          .semantic_class = SemanticClass::Train,
          .stance = Stance::Stands,
          .size_m = spec.size_m,
          .source = source,
          .pivots_m = spec.pivots_m,
          .coarsest_levels = {0, 1, 3},
          .num_variants = num_variants,
          .build = std::move(build)};
}

ThingInfo bodied(std::string name, const CarSpec& spec, std::span<const Color> colors,
                 std::string_view source) {
  return car(std::move(name), spec, static_cast<int>(colors.size()), source,
             [spec, colors](ThingMesh& mesh, int detail, int variant) {
               build_car(mesh, spec, detail, colors[static_cast<std::size_t>(variant)]);
             });
}

}  // namespace

std::vector<ThingInfo> trains();
std::vector<ThingInfo> trains() {
  const CarSpec wagon = {.size_m = {19.740, 2.600, 3.746},
                         .pivots_m = 14.200,
                         .wheelbase_m = 1.800,
                         .wheel_m = 0.460,
                         .low_z_m = 0.755,
                         .belt_z_m = 0.0,
                         .window_z_m = 0.0,
                         .end_m = 0.620,
                         .slope_m = 0.0,
                         .num_windows = 0,
                         .has_buffers = true};
  return {
      bodied("locomotive",
             {.size_m = {18.980, 3.012, 4.248},
              .pivots_m = 9.500,
              .wheelbase_m = 3.000,
              .wheel_m = 0.625,
              .low_z_m = 1.05,
              .belt_z_m = 2.25,
              .window_z_m = 3.10,
              .end_m = 0.62,
              .slope_m = 0.55,
              .num_windows = 0,
              .has_buffers = true},
             kLocomotiveColors,
             "Siemens Vectron: 18.980 x 3.012 x 4.248 m, wheels of 1.250 m (manufacturer's data); "
             "pivots half its length apart"),
      bodied("passenger_coach",
             {.size_m = {26.400, 2.825, 4.050},
              .pivots_m = 19.000,
              .wheelbase_m = 2.500,
              .wheel_m = 0.460,
              .low_z_m = 0.95,
              .belt_z_m = 2.10,
              .window_z_m = 2.95,
              .end_m = 0.10,
              .slope_m = 0.0,
              .num_windows = 11,
              .has_buffers = true},
             kCoachColors, "UIC type Z: 26.400 x 2.825 x 4.050 m, pivots 19.000 m (UIC 567)"),
      car("container_wagon", wagon, static_cast<int>(kContainerColors.size()),
          "60-foot wagon, type 2 of UIC 571-4: 19.740 m over buffers, pivots 14.200 m, loading "
          "height 1.155 m; containers of ISO 668",
          [wagon](ThingMesh& mesh, int detail, int variant) {
            build_wagon(mesh, wagon, detail, variant);
          }),
      bodied("railcar",
             {.size_m = {25.500, 2.900, 3.700},
              .pivots_m = 17.100,
              .wheelbase_m = 1.800,
              .wheel_m = 0.385,
              .low_z_m = 0.50,
              .belt_z_m = 1.60,
              .window_z_m = 2.75,
              .end_m = 0.45,
              .slope_m = 0.45,
              .num_windows = 10,
              .has_buffers = true},
             kCoachColors,
             "Stadler Regio-Shuttle RS1: 25.50 m long; 2.90 x 3.70 m and pivots 17.10 m apart are "
             "rounded"),
      bodied("metro_car",
             {.size_m = {18.575, 2.900, 3.550},
              .pivots_m = 12.000,
              .wheelbase_m = 2.100,
              .wheel_m = 0.425,
              .low_z_m = 0.80,
              .belt_z_m = 1.90,
              .window_z_m = 2.80,
              .end_m = 0.30,
              .slope_m = 0.20,
              .num_windows = 9,
              .has_buffers = false},
             kCoachColors,
             "Munich class A: two cars 37.150 m over couplings, 2.900 x 3.550 m, pivots 12.000 m "
             "(operator's data)"),
      bodied("tram",
             {.size_m = {15.100, 2.500, 3.050},
              .pivots_m = 6.400,
              .wheelbase_m = 1.900,
              .wheel_m = 0.350,
              .low_z_m = 0.40,
              .belt_z_m = 1.45,
              .window_z_m = 2.40,
              .end_m = 0.55,
              .slope_m = 0.35,
              .num_windows = 6,
              .has_buffers = false},
             kCoachColors,
             "Tatra T3: 14.000 x 2.500 x 3.050 m, 15.10 m over couplings, pivots 6.400 m "
             "(manufacturer's data)")};
}

}  // namespace terracast::tiler
