#pragma once

#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "capture/frame.h"
#include "capture/stream.h"
#include "core/choice.h"
#include "core/schema.h"
#include "geo/geoid.h"
#include "geo/rigid3.h"
#include "geo/trajectory.h"
#include "scene/scene.h"
#include "sensors/clock.h"
#include "world/ray_trail.h"

namespace terracast::sensors {

/// A point that a body carries: its place in the world, and its velocity against the Earth along the world's axes.
struct PointMotion {
  Eigen::Vector3d place_world;
  Eigen::Vector3d velocity_world_mps;
};
/// arm_body   from the body's reference point to it
PointMotion point_motion(const geo::MotionState& body, const Eigen::Vector3d& arm_body);

/// What a scanner whose scans depend on those before them keeps between two of them.
class ScanMemory {
 public:
  virtual ~ScanMemory() = default;
};

/// A sensor's place in a scene, and its motion: everything that it may ask.
struct SensorSite {
  const scene::Scene& scene;
  const geo::BodyMotion& body;
  geo::Rigid3d body_from_sensor;  ///< sensor: x forward, y left, z up
  double rate_hz;                 ///< of its samples, of which tick k is at k / rate_hz
  std::uint64_t stream_seed;      ///< of its random numbers: no other sensor's of any sequence
  world::RayTrail* trail;         ///< takes the tiles that its rays visit; null: not recorded
  /// The camera of its rig that Sensor::camera() names; null: it names none.
  const capture::CameraCalibration* camera = nullptr;
  /// Of a run that makes scans in turn: what the ones before left. It saves work and changes no byte. Null: nothing is kept.
  std::unique_ptr<ScanMemory>* memory = nullptr;

  geo::Rigid3d world_from_sensor(double time_s) const {
    return body.at(time_s).world_from_body * body_from_sensor;
  }
  PointMotion point_at(double time_s) const {
    return point_motion(body.at(time_s), body_from_sensor.translation);
  }
  std::int64_t tick_at(double time_s) const { return std::llround(time_s * rate_hz); }
  /// Mean sea level: EGM96's geoid.
  /// throws   Io: as geo::Geoid::egm96()
  static std::shared_ptr<const geo::Geoid> mean_sea_level() { return geo::Geoid::egm96(); }
};

/// A kind of sensor with its options. Each sample has a time of its own and a value in each channel.
///
/// determinism   a sample depends on the scene, the motion, the options, the seed and its time alone: not on which
///               others are measured with it
/// threads       const use is safe
class Sensor {
 public:
  virtual ~Sensor() = default;
  virtual void describe(core::SchemaVisitor& visit) = 0;
  /// throws   Config: options that contradict each other
  virtual void validate() const {}
  virtual std::unique_ptr<Sensor> clone() const = 0;
  /// Whether it can measure from one time to another one, which is asked before anything is rendered.
  /// from_unix_s, to_unix_s   UTC in seconds since 1970
  /// throws   Config: it cannot, and why
  virtual void check_times(double /*from_unix_s*/, double /*to_unix_s*/) const {}

  /// The camera of its rig through which it looks, whose place is then its own; empty: it has a place of its own.
  virtual std::string camera() const { return {}; }

  virtual std::vector<capture::StreamChannel> channels() const = 0;
  /// values   as many rows as times, of a value a channel
  virtual void measure(const SensorSite& site, std::span<const double> times_s,
                       std::span<double> values) const = 0;
};

/// A kind of sensor of which each tick is a scan: any number of rows, each at its own time from the tick's to before the
/// next one's.
class Scanner : public Sensor {
 public:
  /// A frame's scans are in memory together, for each frame that is rendered at once: up to 400 bytes a row (345 measured,
  /// two frames of 3 million rows together).
  static constexpr double kMostRows = 1.6e7;

  /// throws   Internal: scanners have no samples
  void measure(const SensorSite& site, std::span<const double> times_s,
               std::span<double> values) const final;
  /// At most; 0: not known before, and scan() fails with Config where there are more than kMostRows.
  virtual double rows_per_s(double rate_hz) const = 0;
  /// Rays that a second of scans casts at least, where they are so many that it is announced; else 0.
  /// camera   as SensorSite::camera
  virtual double least_rays_per_s(double /*rate_hz*/,
                                  const capture::CameraCalibration* /*camera*/) const {
    return 0.0;
  }
  /// No sequence's scans cast more.
  static constexpr double kMostRays = 1e12;
  /// returns   rows of the ticks' scans, in the order of their times
  virtual capture::Samples scan(const SensorSite& site, const capture::TickRange& ticks) const = 0;
};

struct SensorInfo {
  std::string_view name;
  std::string_view summary;
  std::unique_ptr<Sensor> (*make)();
};

/// The table of sensors beside cameras, alphabetical.
std::span<const SensorInfo> sensors();

/// A `[[rigs.sensors]]` of a config.
struct SensorOptions {
  std::string name;
  double rate_hz = 100.0;
  std::vector<double> offset_mm;  ///< in the rig's axes; empty: 0
  std::vector<double> euler_deg;  ///< yaw, pitch, roll as of cameras; empty: 0
  ClockOptions clock;
  core::Choice<SensorInfo> sensor;

  void describe(core::SchemaVisitor& visit);
  void validate() const;
};

/// A sensor of a sequence's body, with the record of its stream.
struct MountedSensor {
  capture::StreamInfo info;  ///< its clock as it is believed to be, until draw_clocks()
  core::Choice<SensorInfo> sensor;
  std::optional<capture::CameraCalibration> camera = {};  ///< as SensorSite::camera
  ClockOptions clock = {};

  /// memory   as SensorSite::memory
  capture::Samples measure(const scene::Scene& scene, const geo::BodyMotion& body,
                           std::uint64_t sequence_seed, const capture::TickRange& ticks,
                           world::RayTrail* trail,
                           std::unique_ptr<ScanMemory>* memory = nullptr) const;
  /// Scanner::least_rays_per_s(); of what is no scanner 0.
  double least_rays_per_s() const;
};

/// Draws how far the sensors' clocks are from what is believed of them: by the seed and the names of sequence, rig and
/// sensor alone.
void draw_clocks(std::vector<MountedSensor>& sensors, std::int64_t seed,
                 const std::string& sequence);

}  // namespace terracast::sensors
