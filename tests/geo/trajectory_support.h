#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <optional>
#include <string>

#include "core/error.h"
#include "geo/trajectory.h"

namespace terracast::test {

/// A world whose ground is a function of the place; by default 1000 m above the ellipsoid.
struct GroundWorld {
  geo::WorldFrame frame{{42.5, 1.5, 1000.0}};
  geo::GroundHeight ground = [](double, double) { return std::optional(1000.0); };

  geo::TrajectoryContext context() const { return {frame, ground, nullptr}; }
};

geo::TrajectoryOptions options_from(const std::string& toml);

std::unique_ptr<geo::Trajectory> trajectory_from(const std::string& toml, const GroundWorld& world);

/// The message of the error of that kind that `work` throws.
template <class Work>
std::string message_of(core::ErrorKind kind, Work&& work) {
  try {
    work();
  } catch (const core::Error& error) {
    EXPECT_EQ(error.kind(), kind) << error.what();
    return error.what();
  }
  ADD_FAILURE() << "no error";
  return "";
}

double agl_m(const GroundWorld& world, const Eigen::Vector3d& point_world);

/// Roll of a body whose x axis is level or nearly so: the angle of its y axis below the horizon,
/// positive when the left side is up.
double roll_rad(const GroundWorld& world, const geo::BodyState& state);

inline constexpr double kGravity_mps2 = 9.80665;

/// Whether a file of configs/vehicles is of a quadrotor, not of an aircraft.
bool is_set_of_rotors(const std::filesystem::path& file);

std::string orbit_text(double radius_m, double speed_mps, const std::string& more = "");

inline const char* const kFourPlaces = R"(
kind = "waypoints"
speed_mps = 25.0
waypoints = [
  { lat_deg = 42.50, lon_deg = 1.50, height_m = 100.0 },
  { lat_deg = 42.52, lon_deg = 1.52, height_m = 300.0 },
  { lat_deg = 42.51, lon_deg = 1.56, height_m = 150.0 },
  { lat_deg = 42.54, lon_deg = 1.58, height_m = 1400.0, above = "ellipsoid" },
]
)";

}  // namespace terracast::test
