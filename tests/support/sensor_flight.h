#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <filesystem>
#include <functional>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include "core/toml_reader.h"
#include "sensors/sensor.h"
#include "tests/support/hills_flight.h"
#include "tests/support/test_data.h"

/// Sensors beside cameras on motions in closed form.
namespace terracast::test {

/// A function of time with its derivatives: c + a sin(w t + p).
struct Wave {
  double middle = 0.0, amplitude = 0.0, rate = 0.0, phase = 0.0, slope = 0.0;
  double at(int order, double t) const {
    const double quarter = 0.5 * std::numbers::pi * order;
    const double wave = amplitude * std::pow(rate, order) * std::sin(rate * t + phase + quarter);
    return wave + (order == 0 ? middle + slope * t : order == 1 ? slope : 0.0);
  }
};

/// Positions and angles (about z, then y, then x of the body) that are waves: all derivatives in closed form.
struct WavyMotion : geo::Trajectory {
  std::array<Wave, 3> place;
  Wave yaw, pitch, roll;
  double duration_s() const override { return 1000.0; }
  std::vector<double> knots_s() const override { return {0.0, 1000.0}; }
  geo::MotionState at(double t) const override {
    geo::MotionState state;
    state.time_s = t;
    for (int axis = 0; axis < 3; ++axis) {
      const Wave& wave = place[static_cast<std::size_t>(axis)];
      state.world_from_body.translation[axis] = wave.at(0, t);
      state.velocity_world_mps[axis] = wave.at(1, t);
      state.acceleration_world_mps2[axis] = wave.at(2, t);
      state.jerk_world_mps3[axis] = wave.at(3, t);
    }
    state.world_from_body.rotation = Eigen::AngleAxisd(yaw.at(0, t), Eigen::Vector3d::UnitZ()) *
                                     Eigen::AngleAxisd(pitch.at(0, t), Eigen::Vector3d::UnitY()) *
                                     Eigen::AngleAxisd(roll.at(0, t), Eigen::Vector3d::UnitX());
    const double sp = std::sin(pitch.at(0, t)), cp = std::cos(pitch.at(0, t));
    const double sr = std::sin(roll.at(0, t)), cr = std::cos(roll.at(0, t));
    const double y1 = yaw.at(1, t), p1 = pitch.at(1, t), r1 = roll.at(1, t);
    const double y2 = yaw.at(2, t), p2 = pitch.at(2, t), r2 = roll.at(2, t);
    state.angular_velocity_body_radps = {r1 - y1 * sp, p1 * cr + y1 * cp * sr,
                                         -p1 * sr + y1 * cp * cr};
    state.angular_acceleration_body_radps2 = {
        r2 - y2 * sp - y1 * p1 * cp,
        p2 * cr - p1 * r1 * sr + y2 * cp * sr - y1 * p1 * sp * sr + y1 * r1 * cp * cr,
        -p2 * sr - p1 * r1 * cr + y2 * cp * cr - y1 * p1 * sp * cr - y1 * r1 * cp * sr};
    return state;
  }
};

/// A figure of eight at about 15 m/s, of 150 by 80 m and 10 m of height, with a roll of 29 degrees.
inline std::shared_ptr<WavyMotion> figure_of_eight() {
  auto motion = std::make_shared<WavyMotion>();
  motion->place = {Wave{.middle = 200.0, .amplitude = 150.0, .rate = 0.09},
                   Wave{.middle = -90.0, .amplitude = 80.0, .rate = 0.18},
                   Wave{.middle = 400.0, .amplitude = 10.0, .rate = 0.21, .phase = 1.0}};
  motion->yaw = {.amplitude = 1.9, .rate = 0.09, .phase = 0.3, .slope = 0.05};
  motion->pitch = {.amplitude = 0.2, .rate = 0.4, .phase = 0.7};
  motion->roll = {.amplitude = 0.5, .rate = 0.88};
  return motion;
}

/// The sensor of a config's keys.
inline core::Choice<sensors::SensorInfo> sensor_of(const std::string& kind,
                                                   const std::string& keys) {
  struct Read {
    core::Choice<sensors::SensorInfo> choice;
    void describe(core::SchemaVisitor& visit) {
      choice.describe(visit, "kind", "sensor", "", sensors::sensors());
    }
    void validate() const { choice.validate(); }
  } read;
  core::TomlDocument::parse("kind = \"" + kind + "\"\n" + keys, kind + ".toml").read(read);
  return read.choice;
}

/// A world over which sensors fly; its time 0 is 2025-06-21T10:00:00Z.
class SensorFlight {
 public:
  /// make   writes the world into a folder
  explicit SensorFlight(
      const std::function<world::TileStore(const std::filesystem::path&)>& make = make_hills)
      : traced_(make(folder_.path()), small_plan(2, 24, 16)) {}

  /// Values of all channels, sample by sample, at k / rate_hz.
  std::vector<double> measure(const std::string& kind, const std::string& keys,
                              std::shared_ptr<const geo::Trajectory> motion, double rate_hz,
                              std::size_t count, const geo::Rigid3d& body_from_sensor = {},
                              std::uint64_t seed = 11) const {
    const core::Choice<sensors::SensorInfo> sensor = sensor_of(kind, keys);
    const geo::BodyMotion body{.trajectory = std::move(motion), .start_s = 0.0};
    const sensors::SensorSite site{.scene = traced_.scene,
                                   .body = body,
                                   .body_from_sensor = body_from_sensor,
                                   .rate_hz = rate_hz,
                                   .stream_seed = seed,
                                   .trail = nullptr};
    std::vector<double> times_s, values(sensor->channels().size() * count);
    for (std::size_t k = 0; k < count; ++k) times_s.push_back(static_cast<double>(k) / rate_hz);
    sensor->measure(site, times_s, values);
    return values;
  }
  /// The rows of a scanner's ticks.
  capture::Samples scan(const std::string& kind, const std::string& keys,
                        std::shared_ptr<const geo::Trajectory> motion, double rate_hz,
                        const capture::TickRange& ticks, std::uint64_t seed = 11) const {
    const core::Choice<sensors::SensorInfo> sensor = sensor_of(kind, keys);
    const geo::BodyMotion body{.trajectory = std::move(motion), .start_s = 0.0};
    const sensors::SensorSite site{.scene = traced_.scene,
                                   .body = body,
                                   .body_from_sensor = {},
                                   .rate_hz = rate_hz,
                                   .stream_seed = seed,
                                   .trail = nullptr};
    return dynamic_cast<const sensors::Scanner&>(*sensor).scan(site, ticks);
  }
  const geo::WorldFrame& frame() const { return traced_.scene.frame(); }

 private:
  ScratchFolder folder_;
  TracedPlan traced_;
};

}  // namespace terracast::test
