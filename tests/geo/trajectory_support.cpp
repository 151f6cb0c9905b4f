#include "tests/geo/trajectory_support.h"

#include <cmath>
#include <fstream>
#include <iterator>

#include "core/toml_reader.h"

namespace terracast::test {

geo::TrajectoryOptions options_from(const std::string& toml) {
  geo::TrajectoryOptions options;
  core::TomlDocument::parse(toml, "test.toml").read(options);
  return options;
}

std::unique_ptr<geo::Trajectory> trajectory_from(const std::string& toml,
                                                 const GroundWorld& world) {
  return options_from(toml).kind_options().build(world.context());
}

bool is_set_of_rotors(const std::filesystem::path& file) {
  std::ifstream text(file);
  return std::string(std::istreambuf_iterator<char>(text), {}).find("num_rotors") !=
         std::string::npos;
}

double agl_m(const GroundWorld& world, const Eigen::Vector3d& point_world) {
  const geo::Geodetic place = world.frame.geodetic_from_world(point_world);
  return place.height_m - *world.ground(place.lat_deg, place.lon_deg);
}

double roll_rad(const GroundWorld& world, const geo::BodyState& state) {
  const Eigen::Vector3d up = world.frame.up_world(state.world_from_body.translation);
  const Eigen::Matrix3d axes = state.world_from_body.rotation.toRotationMatrix();
  const Eigen::Vector3d level_left = up.cross(axes.col(0)).normalized();
  return std::atan2(axes.col(1).dot(axes.col(0).cross(level_left)), axes.col(1).dot(level_left));
}

std::string orbit_text(double radius_m, double speed_mps, const std::string& more) {
  return fmt::format(R"(
kind = "orbit"
centre = {{ east_m = 12000.0, north_m = 9000.0, height_m = 300.0 }}
radius_m = {}
speed_mps = {}
{})",
                     radius_m, speed_mps, more);
}

}  // namespace terracast::test
