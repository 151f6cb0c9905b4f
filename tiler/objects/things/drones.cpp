#include <Eigen/Geometry>
#include <array>
#include <cmath>

#include "tiler/objects/air_parts.h"

// Uncrewed aircraft with four rotors on arms.
namespace terracast::tiler {
namespace {

using core::SemanticClass;
using Eigen::Vector3d;
using world::Material;

constexpr std::array<Color, 3> kColors = {{{62, 64, 68}, {224, 224, 220}, {206, 92, 22}}};

struct QuadcopterSpec {
  Vector3d size_m;     ///< with the rotors, their blades along x
  double motor_x_m;    ///< of the motors from the middle, forward and aft
  double motor_y_m;    ///< and to the sides
  double rotor_m;      ///< radius
  double rotor_z_m;    ///< height of the blades
  double rotor_radps;  ///< as it hovers
};

void build_quadcopter(ThingMesh& mesh, const QuadcopterSpec& q, int detail, int variant) {
  const FinishNumber paint =
      mesh.finish(Material::Paint, kColors[static_cast<std::size_t>(variant)]);
  const FinishNumber dark = mesh.finish(Material::Plain, {30, 31, 33});
  const FinishNumber glass = mesh.finish(Material::Glass, {24, 28, 34});
  const double s = q.motor_x_m / 0.34;  // all but the rotors grows with the arms
  const double arm_z = q.rotor_z_m - 0.05 * s;
  // Body, battery, camera under the nose.
  const std::vector<Section> body = {{0.20 * s, arm_z - 0.01 * s, 0.045 * s, 0.025 * s},
                                     {0.15 * s, arm_z, 0.085 * s, 0.055 * s},
                                     {-0.10 * s, arm_z, 0.095 * s, 0.065 * s},
                                     {-0.20 * s, arm_z, 0.06 * s, 0.04 * s}};
  add_fuselage(
      mesh, body, round_sides(12, detail), [paint](std::size_t, std::size_t) { return paint; },
      paint);
  mesh.box({-0.14 * s, -0.05 * s, arm_z + 0.03 * s}, {0.06 * s, 0.05 * s, q.size_m.z()}, dark);
  mesh.box({0.11 * s, -0.035 * s, arm_z - 0.16 * s}, {0.19 * s, 0.035 * s, arm_z - 0.075 * s},
           dark);
  if (detail == 0)
    mesh.cylinder({0.188 * s, 0.0, arm_z - 0.118 * s}, {0.203 * s, 0.0, arm_z - 0.118 * s},
                  0.026 * s, 10, glass, glass);
  mesh.bar({0.15 * s, 0.0, arm_z - 0.09 * s}, {0.15 * s, 0.0, arm_z - 0.03 * s}, 0.02 * s, dark);
  for (const double along : {1.0, -1.0}) {
    for (const double aside : {1.0, -1.0}) {
      const Vector3d motor(along * q.motor_x_m, aside * q.motor_y_m, arm_z);
      mesh.bar({along * 0.08 * s, aside * 0.05 * s, arm_z}, motor, 0.03 * s, dark);
      mesh.cylinder(motor - Vector3d(0.0, 0.0, 0.03 * s),
                    {motor.x(), motor.y(), q.rotor_z_m + 0.006}, 0.028 * s, round_sides(12, detail),
                    dark, dark);
      const Vector3d hub(motor.x(), motor.y(), q.rotor_z_m);
      // Neighbours turn against each other, so that the body does not turn.
      mesh.turning({.name = "rotor",
                    .origin_m = hub,
                    .axis = Vector3d::UnitZ(),
                    .rate_radps = along * aside * q.rotor_radps},
                   [&] {
                     add_blades(mesh, hub, Vector3d::UnitZ(), Vector3d::UnitX(), q.rotor_m,
                                0.11 * q.rotor_m, 2, dark, 0.006);
                   });
    }
  }
  // Legs; their lowest sides lie on the ground.
  for (const double aside : {1.0, -1.0}) {
    const double y = aside * 0.16 * s, r = 0.011 * s;
    mesh.bar({-0.17 * s, y, r}, {0.17 * s, y, r}, 2.0 * r, dark);
    mesh.bar({0.0, y, r}, {0.0, aside * 0.06 * s, arm_z - 0.03 * s}, 0.02 * s, dark);
  }
}

ThingInfo quadcopter(std::string name, const QuadcopterSpec& spec, std::string_view source) {
  return {.name = std::move(name),
          .family = {},
          .semantic_class = SemanticClass::Drone,
          .stance = Stance::Stands,
          .size_m = spec.size_m,
          .source = source,
          .coarsest_levels = {0, 1, 2},
          .num_variants = static_cast<int>(kColors.size()),
          .build = [spec](ThingMesh& m, int d, int v) { build_quadcopter(m, spec, d, v); }};
}

}  // namespace

std::vector<ThingInfo> drones();
std::vector<ThingInfo> drones() {
  return {
      quadcopter(
          "quadcopter",
          {.size_m = {1.21, 0.64, 0.43},
           .motor_x_m = 0.34,
           .motor_y_m = 0.29,
           .rotor_m = 0.265,
           .rotor_z_m = 0.38,
           .rotor_radps = 330.0},
          "DJI Matrice 300 RTK: 0.81 m x 0.67 m x 0.43 m without propellers, motors 0.895 m "
          "apart across, propellers of 21 inches (manufacturer's data); with propellers along x"),
      quadcopter(
          "small_quadcopter",
          {.size_m = {0.41, 0.31, 0.12},
           .motor_x_m = 0.13,
           .motor_y_m = 0.14,
           .rotor_m = 0.075,
           .rotor_z_m = 0.105,
           .rotor_radps = 900.0},
          "DJI Phantom and Air classes: motors some 0.38 m apart across, propellers of 6 inches, "
          "as they are sold; with propellers along x"),
  };
}

}  // namespace terracast::tiler
