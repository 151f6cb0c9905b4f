#include <algorithm>

#include "tiler/objects/air_parts.h"
#include "tiler/objects/road_vehicle.h"

// Airliners and business jets. x is counted from the nose aft in the table, z above the ground.
namespace terracast::tiler {
namespace {

using core::SemanticClass;
using Eigen::Vector3d;
using world::Material;

struct JetSpec {
  Vector3d size_m;
  double half_width_m;  ///< of the fuselage
  double half_height_m;
  double belly_z_m;
  double nose_gear_m;
  double wheelbase_m;
  double track_m;
  double wheel_m;  ///< radius
  // Wing, at the middle and at the tip.
  double wing_m, root_chord_m, tip_m, tip_chord_m, wing_z_m, tip_z_m;
  double winglet_m;  ///< height
  // Tail plane and fin.
  double tail_m, tail_chord_m, tail_tip_m, tail_tip_chord_m, tail_span_m, tail_z_m;
  double fin_m, fin_chord_m, fin_tip_m, fin_tip_chord_m;
  // Engines: their fronts.
  double engine_m, engine_y_m, engine_z_m, engine_length_m, engine_radius_m;
  bool has_propellers = false;
  bool has_rear_engines = false;
  double window_pitch_m = 0.533;
};

/// Of fins and engines.
constexpr std::array<Color, 5> kLiveries = {
    {{22, 50, 110}, {178, 24, 36}, {236, 120, 24}, {24, 108, 84}, {90, 94, 100}}};

void add_body(ThingMesh& mesh, const JetSpec& jet, int detail) {
  const FinishNumber white = mesh.finish(Material::Paint, {236, 237, 238});
  const FinishNumber belly = mesh.finish(Material::Paint, {196, 199, 203});
  const FinishNumber glass = mesh.finish(Material::Glass, kWindow);
  const double nose = 0.5 * jet.size_m.x();
  const double w = jet.half_width_m;
  const double h = jet.half_height_m;
  const double z = jet.belly_z_m + h;
  const double length = jet.size_m.x();
  const double cone = std::min(0.34 * length, 6.4 * h);  // the tail's
  const auto at = [&](double from_nose, double share, double dz) {
    return Section{nose - from_nose, z + dz * h, share * w, share * h};
  };
  std::vector<Section> sections = {at(0.0, 0.04, -0.28),
                                   at(0.18 * h, 0.26, -0.27),
                                   at(0.6 * h, 0.52, -0.21),
                                   at(1.15 * h, 0.74, -0.12),
                                   at(1.75 * h, 0.88, -0.05),
                                   at(2.6 * h, 0.975, -0.01),
                                   at(3.4 * h, 1.0, 0.0),
                                   at(length - cone, 1.0, 0.0),
                                   at(length - 0.72 * cone, 0.92, 0.08),
                                   at(length - 0.42 * cone, 0.66, 0.30),
                                   at(length - 0.16 * cone, 0.34, 0.52),
                                   at(length, 0.09, 0.66)};
  if (detail >= 2)
    sections = {sections[0], sections[2], sections[4], sections[6],
                sections[7], sections[9], sections[11]};
  const int num_sides = round_sides(20, detail);
  add_fuselage(
      mesh, sections, num_sides,
      [&](std::size_t r, std::size_t edge) {
        // Edges count from straight below.
        const double turn = (static_cast<double>(edge) + 0.5) / num_sides;  // 0.25: the left side
        const double from_top = std::abs(turn - 0.5);
        if (detail < 2 && (r == 3) && from_top < 0.19) return glass;  // the cockpit's windows
        return from_top > 0.36 ? belly : white;
      },
      white);
  if (detail > 0) return;
  // Cabin windows, 0.23 x 0.33 m, a little above the middle; doors' outlines.
  const double window_z = z + 0.22 * h;
  const double out = w * std::sqrt(1.0 - 0.22 * 0.22);
  int number = 0;
  for (double x = nose - 4.6 * h; x > nose - length + 1.04 * cone;
       x -= jet.window_pitch_m, ++number) {
    const double half = std::min(0.115, 0.26 * jet.window_pitch_m);
    add_pair(mesh, {x - half, out - 0.12, window_z - 0.165},
             {x + half, out + 0.012, window_z + 0.165}, glass);
  }
  const FinishNumber line = mesh.finish(Material::Paint, {120, 124, 130});
  for (const double x : {nose - 3.6 * h, nose - length + 0.98 * cone}) {
    add_pair(mesh, {x - 0.44, 0.9 * w, z - 0.35 * h}, {x - 0.40, 1.004 * w, z + 0.5 * h}, line);
    add_pair(mesh, {x + 0.40, 0.9 * w, z - 0.35 * h}, {x + 0.44, 1.004 * w, z + 0.5 * h}, line);
  }
}

void add_engine(ThingMesh& mesh, const JetSpec& jet, double side, int detail, const Color& livery) {
  const FinishNumber cowl = mesh.finish(Material::Paint, livery);
  const FinishNumber lip = mesh.finish(Material::Metal, {200, 202, 205});
  const FinishNumber dark = mesh.finish(Material::Metal, {58, 58, 60});
  const FinishNumber white = mesh.finish(Material::Paint, {236, 237, 238});
  const double front = 0.5 * jet.size_m.x() - jet.engine_m;
  const double r = jet.engine_radius_m;
  const double length = jet.engine_length_m;
  const Vector3d middle(0.0, side * jet.engine_y_m, jet.engine_z_m);
  std::vector<Ring> rings;
  const auto ring = [&](double back, double radius) {
    Ring points = ring_across(front - back, round_outline(radius, radius, round_sides(16, detail)));
    for (Vector3d& point : points) point += middle;
    rings.push_back(points);
  };
  if (jet.has_propellers) {
    ring(0.0, 0.10 * r);
    ring(0.35 * r, 0.55 * r);
    ring(1.2 * r, 0.9 * r);
    ring(0.5 * length, r);
    ring(0.85 * length, 0.7 * r);
    ring(length, 0.2 * r);
    mesh.loft(rings, white);
    add_blades(mesh, {front - 0.25 * r, side * jet.engine_y_m, jet.engine_z_m}, Vector3d::UnitX(),
               Vector3d::UnitZ(), 1.965, 0.30, 6, dark);
    return;
  }
  ring(0.28 * r, 0.78 * r);  // the fan lies inside the lip
  ring(0.0, 0.86 * r);
  ring(0.12 * r, 0.94 * r);
  ring(0.3 * length, r);
  ring(0.72 * length, 0.84 * r);
  ring(0.74 * length, 0.60 * r);
  ring(0.92 * length, 0.42 * r);
  ring(length, 0.16 * r);
  mesh.loft(
      rings, [&](std::size_t k, std::size_t) { return k < 2   ? lip
                                                      : k < 4 ? cowl
                                                              : dark; }, dark,
      dark);
  // Its pylon.
  if (jet.has_rear_engines) {
    mesh.box({front - 0.75 * length, side > 0 ? 0.5 * jet.half_width_m : -jet.engine_y_m + 0.5 * r,
              jet.engine_z_m - 0.08},
             {front - 0.25 * length, side > 0 ? jet.engine_y_m - 0.5 * r : -0.5 * jet.half_width_m,
              jet.engine_z_m + 0.08},
             white);
  } else {
    const double wing_z =
        jet.wing_z_m + (jet.tip_z_m - jet.wing_z_m) * 2.0 * jet.engine_y_m / jet.size_m.y();
    mesh.prism_across({{front - 0.25 * length, jet.engine_z_m + 0.7 * r},
                       {front - 1.1 * length, jet.engine_z_m + 0.35 * r},
                       {front - 1.3 * length, wing_z + 0.05},
                       {front - 0.8 * length, wing_z + 0.15}},
                      side * jet.engine_y_m - 0.16, side * jet.engine_y_m + 0.16, white, white);
  }
}

void add_gear(ThingMesh& mesh, const JetSpec& jet, int detail) {
  const FinishNumber steel = mesh.finish(Material::Metal, {170, 172, 175});
  const double nose = 0.5 * jet.size_m.x();
  const double r = jet.wheel_m;
  const auto leg = [&](double x, double y, double up_z, double radius) {
    mesh.bar({x, y, radius}, {x, y, up_z}, 0.35 * radius, steel, 6);
    for (const double side : {-1.0, 1.0}) {
      const double outer = y + side * 0.95 * radius;
      if (detail < 2) {
        const FinishNumber tyre = mesh.finish(Material::Rubber, kTyre);
        mesh.cylinder({x, outer, radius}, {x, outer - side * 0.65 * radius, radius}, radius,
                      detail == 0 ? 14 : 8, tyre, tyre);
      }
    }
    if (detail >= 2) {
      const FinishNumber tyre = mesh.finish(Material::Rubber, kTyre);
      mesh.box({x - 0.8 * radius, y - 0.95 * radius, 0.0},
               {x + 0.8 * radius, y + 0.95 * radius, 1.6 * radius}, tyre);
    }
  };
  leg(nose - jet.nose_gear_m, 0.0, jet.belly_z_m + 0.4 * jet.half_height_m, 0.68 * r);
  for (const double side : {-1.0, 1.0})
    leg(nose - jet.nose_gear_m - jet.wheelbase_m, side * 0.5 * jet.track_m,
        std::max(jet.belly_z_m + 0.3, jet.has_propellers ? 0.0 : jet.wing_z_m), r);
}

void build_jet(ThingMesh& mesh, const JetSpec& jet, int detail, int variant) {
  const Color& livery = kLiveries[static_cast<std::size_t>(variant)];
  const FinishNumber grey = mesh.finish(Material::Paint, {206, 209, 212});
  const FinishNumber white = mesh.finish(Material::Paint, {236, 237, 238});
  const FinishNumber colour = mesh.finish(Material::Paint, livery);
  const double nose = 0.5 * jet.size_m.x();
  add_body(mesh, jet, detail);
  const double half_span = 0.5 * jet.size_m.y();
  const auto along = [](double a, double b, double t) { return a + t * (b - a); };
  // Trailing edges of swept wings run straight across as far as a kink.
  const double kink = 0.36;
  const bool is_swept = jet.tip_m - jet.wing_m > 0.6 * jet.root_chord_m;
  const double straight_m = is_swept ? jet.wing_m + jet.root_chord_m : 0.0;
  const double kink_m = along(jet.wing_m, jet.tip_m, kink);
  const double kink_chord_m = is_swept ? straight_m - kink_m + 0.04 * jet.root_chord_m
                                       : along(jet.root_chord_m, jet.tip_chord_m, kink);
  std::vector<WingSection> wing = {
      {{nose - jet.wing_m, 0.0, jet.wing_z_m}, jet.root_chord_m, 0.14 * jet.root_chord_m},
      {{nose - kink_m, kink * half_span, along(jet.wing_z_m, jet.tip_z_m, kink)},
       kink_chord_m,
       0.12 * kink_chord_m},
      {{nose - jet.tip_m, half_span - (jet.winglet_m > 0.0 ? 0.25 * jet.winglet_m : 0.0),
        jet.tip_z_m},
       jet.tip_chord_m,
       0.11 * jet.tip_chord_m}};
  add_wing_pair(mesh, wing, detail, grey);
  if (jet.winglet_m > 0.0 && detail < 2)
    for (const double side : {-1.0, 1.0}) {
      const double y = side * (half_span - 0.25 * jet.winglet_m);
      add_wing(mesh,
               {{{nose - jet.tip_m - 0.1, y, jet.tip_z_m - 0.02}, jet.tip_chord_m - 0.1, 0.16},
                {{nose - jet.tip_m - 0.6 * jet.winglet_m, side * (half_span - 0.02),
                  jet.tip_z_m + jet.winglet_m},
                 0.45 * jet.tip_chord_m,
                 0.07}},
               -side * Vector3d::UnitY(), detail, colour);
    }
  const double half_tail = 0.5 * jet.tail_span_m;
  add_wing_pair(mesh,
                {{{nose - jet.tail_m, 0.0, jet.tail_z_m}, jet.tail_chord_m, 0.1 * jet.tail_chord_m},
                 {{nose - jet.tail_tip_m, half_tail, jet.tail_z_m + 0.06 * half_tail},
                  jet.tail_tip_chord_m,
                  0.1 * jet.tail_tip_chord_m}},
                detail, grey);
  const double fin_foot_z = jet.belly_z_m + 1.55 * jet.half_height_m;
  add_wing(mesh,
           {{{nose - jet.fin_m, 0.0, fin_foot_z}, jet.fin_chord_m, 0.09 * jet.fin_chord_m},
            {{nose - jet.fin_tip_m, 0.0, jet.size_m.z()},
             jet.fin_tip_chord_m,
             0.09 * jet.fin_tip_chord_m}},
           Vector3d::UnitY(), detail, colour);
  // Where the wing goes through the body.
  if (!jet.has_propellers)
    mesh.tapered_box({nose - jet.wing_m - 1.06 * jet.root_chord_m, -0.72 * jet.half_width_m,
                      jet.belly_z_m - 0.06 * jet.half_height_m},
                     {nose - jet.wing_m + 0.12 * jet.root_chord_m, 0.72 * jet.half_width_m,
                      jet.belly_z_m + 0.6 * jet.half_height_m},
                     {nose - jet.wing_m - 1.0 * jet.root_chord_m, -0.95 * jet.half_width_m},
                     {nose - jet.wing_m, 0.95 * jet.half_width_m}, white);
  else
    add_pair(mesh,
             {nose - jet.nose_gear_m - jet.wheelbase_m - 1.6, 0.6 * jet.half_width_m,
              jet.belly_z_m + 0.05},
             {nose - jet.nose_gear_m - jet.wheelbase_m + 1.6, 0.5 * jet.track_m + 0.15,
              jet.belly_z_m + 0.75},
             white);
  for (const double side : {-1.0, 1.0})
    add_engine(mesh, jet, side, detail, jet.has_propellers ? kLiveries[4] : livery);
  add_gear(mesh, jet, detail);
}

ThingInfo jet(std::string name, const JetSpec& spec, std::string_view source,
              std::vector<int> levels) {
  return {.name = std::move(name),
          .family = {},
          .semantic_class = SemanticClass::Aircraft,
          .stance = Stance::Stands,
          .size_m = spec.size_m,
          .source = source,
          .coarsest_levels = std::move(levels),
          .num_variants = static_cast<int>(kLiveries.size()),
          .build = [spec](ThingMesh& m, int d, int v) { build_jet(m, spec, d, v); }};
}

}  // namespace

std::vector<ThingInfo> aircraft();
std::vector<ThingInfo> aircraft() {
  return {
      jet("airliner",
          {.size_m = {37.57, 34.10, 11.76},
           .half_width_m = 1.975,
           .half_height_m = 2.07,
           .belly_z_m = 1.74,
           .nose_gear_m = 5.07,
           .wheelbase_m = 12.64,
           .track_m = 7.59,
           .wheel_m = 0.585,
           .wing_m = 11.2,
           .root_chord_m = 7.1,
           .tip_m = 19.8,
           .tip_chord_m = 1.55,
           .wing_z_m = 2.75,
           .tip_z_m = 4.35,
           .winglet_m = 0.0,
           .tail_m = 31.3,
           .tail_chord_m = 4.0,
           .tail_tip_m = 35.0,
           .tail_tip_chord_m = 1.4,
           .tail_span_m = 12.45,
           .tail_z_m = 5.0,
           .fin_m = 28.9,
           .fin_chord_m = 6.2,
           .fin_tip_m = 34.3,
           .fin_tip_chord_m = 2.1,
           .engine_m = 11.6,
           .engine_y_m = 5.755,
           .engine_z_m = 1.82,
           .engine_length_m = 4.6,
           .engine_radius_m = 1.18},
          "Airbus A320-200: 37.57 x 34.10 x 11.76 m, wheelbase 12.64 m, track 7.59 m, fuselage "
          "3.95 x 4.14 m (Airbus, Aircraft characteristics for airport planning)",
          {0, 1, 3, 5}),
      jet("airliner_with_winglets",
          {.size_m = {39.47, 35.79, 12.55},
           .half_width_m = 1.88,
           .half_height_m = 2.00,
           .belly_z_m = 1.34,
           .nose_gear_m = 4.10,
           .wheelbase_m = 15.60,
           .track_m = 5.72,
           .wheel_m = 0.565,
           .wing_m = 13.6,
           .root_chord_m = 7.6,
           .tip_m = 22.0,
           .tip_chord_m = 1.6,
           .wing_z_m = 2.25,
           .tip_z_m = 4.0,
           .winglet_m = 2.45,
           .tail_m = 33.6,
           .tail_chord_m = 4.2,
           .tail_tip_m = 37.6,
           .tail_tip_chord_m = 1.3,
           .tail_span_m = 14.35,
           .tail_z_m = 4.9,
           .fin_m = 30.3,
           .fin_chord_m = 6.6,
           .fin_tip_m = 36.4,
           .fin_tip_chord_m = 2.0,
           .engine_m = 12.4,
           .engine_y_m = 4.83,
           .engine_z_m = 1.55,
           .engine_length_m = 4.7,
           .engine_radius_m = 1.05},
          "Boeing 737-800 with winglets: 39.47 x 35.79 x 12.55 m, wheelbase 15.60 m, track 5.72 m "
          "(Boeing, Airplane characteristics for airport planning)",
          {0, 1, 3, 5}),
      jet("wide_body",
          {.size_m = {63.66, 60.30, 16.79},
           .half_width_m = 2.82,
           .half_height_m = 2.82,
           .belly_z_m = 2.05,
           .nose_gear_m = 6.67,
           .wheelbase_m = 25.38,
           .track_m = 10.68,
           .wheel_m = 0.70,
           .wing_m = 20.5,
           .root_chord_m = 12.0,
           .tip_m = 37.5,
           .tip_chord_m = 2.6,
           .wing_z_m = 3.4,
           .tip_z_m = 6.2,
           .winglet_m = 1.6,
           .tail_m = 53.4,
           .tail_chord_m = 6.3,
           .tail_tip_m = 59.4,
           .tail_tip_chord_m = 2.4,
           .tail_span_m = 19.4,
           .tail_z_m = 6.7,
           .fin_m = 50.6,
           .fin_chord_m = 9.2,
           .fin_tip_m = 58.6,
           .fin_tip_chord_m = 3.4,
           .engine_m = 20.6,
           .engine_y_m = 9.37,
           .engine_z_m = 2.5,
           .engine_length_m = 6.4,
           .engine_radius_m = 1.55},
          "Airbus A330-300: 63.66 x 60.30 x 16.79 m, wheelbase 25.38 m, track 10.68 m, fuselage "
          "5.64 m (Airbus, Aircraft characteristics for airport planning)",
          {0, 1, 3, 5}),
      jet("turboprop",
          {.size_m = {27.17, 27.05, 7.65},
           .half_width_m = 1.43,
           .half_height_m = 1.40,
           .belly_z_m = 0.62,
           .nose_gear_m = 1.75,
           .wheelbase_m = 10.77,
           .track_m = 4.10,
           .wheel_m = 0.45,
           .wing_m = 11.0,
           .root_chord_m = 2.75,
           .tip_m = 11.55,
           .tip_chord_m = 1.45,
           .wing_z_m = 3.45,
           .tip_z_m = 3.60,
           .winglet_m = 0.0,
           .tail_m = 24.1,
           .tail_chord_m = 2.1,
           .tail_tip_m = 24.9,
           .tail_tip_chord_m = 1.2,
           .tail_span_m = 7.31,
           .tail_z_m = 7.38,
           .fin_m = 20.2,
           .fin_chord_m = 5.2,
           .fin_tip_m = 23.9,
           .fin_tip_chord_m = 2.5,
           .engine_m = 8.4,
           .engine_y_m = 4.05,
           .engine_z_m = 3.05,
           .engine_length_m = 4.6,
           .engine_radius_m = 0.62,
           .has_propellers = true,
           .window_pitch_m = 0.762},
          "ATR 72: 27.17 x 27.05 x 7.65 m, wheelbase 10.77 m, track 4.10 m, propellers of 3.93 m "
          "(manufacturer's data)",
          {0, 1, 2, 4}),
      jet("business_jet",
          {.size_m = {15.59, 16.26, 4.62},
           .half_width_m = 0.80,
           .half_height_m = 0.83,
           .belly_z_m = 0.72,
           .nose_gear_m = 1.6,
           .wheelbase_m = 6.08,
           .track_m = 4.99,
           .wheel_m = 0.28,
           .wing_m = 6.6,
           .root_chord_m = 2.7,
           .tip_m = 7.3,
           .tip_chord_m = 1.05,
           .wing_z_m = 0.98,
           .tip_z_m = 1.5,
           .winglet_m = 0.0,
           .tail_m = 13.2,
           .tail_chord_m = 1.45,
           .tail_tip_m = 14.6,
           .tail_tip_chord_m = 0.85,
           .tail_span_m = 6.33,
           .tail_z_m = 4.42,
           .fin_m = 11.3,
           .fin_chord_m = 2.9,
           .fin_tip_m = 13.3,
           .fin_tip_chord_m = 1.5,
           .engine_m = 9.6,
           .engine_y_m = 1.42,
           .engine_z_m = 2.05,
           .engine_length_m = 2.35,
           .engine_radius_m = 0.47,
           .has_rear_engines = true,
           .window_pitch_m = 0.72},
          "Cessna Citation CJ3: 15.59 x 16.26 x 4.62 m (manufacturer's data)", {0, 1, 3})};
}

}  // namespace terracast::tiler
