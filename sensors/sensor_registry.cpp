#include <algorithm>
#include <cmath>
#include <vector>

#include "capture/sequence_files.h"
#include "core/error.h"
#include "core/hash.h"
#include "core/plugin_rows.h"
#include "sensors/sensor.h"

// Every sensor beside cameras, in alphabetical order: X(name) is sensors/name.cpp, which defines `SensorInfo
// name_sensor()`.
#define TERRACAST_SENSORS(X) \
  X(airspeed)                \
  X(barometer)               \
  X(events)                  \
  X(gnss)                    \
  X(gnss_observations)       \
  X(imu)                     \
  X(lidar)                   \
  X(magnetometer)            \
  X(radar_altimeter)         \
  X(rangefinder)

namespace terracast::sensors {

using core::ErrorKind;
using core::fail;

#define TERRACAST_DECLARE(name) SensorInfo name##_sensor();
TERRACAST_SENSORS(TERRACAST_DECLARE)
#undef TERRACAST_DECLARE

std::span<const SensorInfo> sensors() {
#define TERRACAST_ENTRY(name) name##_sensor(),
  static const auto table =
      core::with_plugin_rows<SensorInfo>({TERRACAST_SENSORS(TERRACAST_ENTRY)});
#undef TERRACAST_ENTRY
  return table;
}

void Scanner::measure(const SensorSite& /*site*/, std::span<const double> /*times_s*/,
                      std::span<double> /*values*/) const {
  fail(ErrorKind::Internal, "scanners have no samples");
}

PointMotion point_motion(const geo::MotionState& body, const Eigen::Vector3d& arm_body) {
  return {.place_world = body.world_from_body * arm_body,
          .velocity_world_mps =
              body.velocity_world_mps +
              body.world_from_body.rotation * body.angular_velocity_body_radps.cross(arm_body)};
}

void SensorOptions::describe(core::SchemaVisitor& visit) {
  visit.key("name", name, "Name of the sensor, and of its folder.", core::required());
  visit.key("rate_hz", rate_hz, "Samples a second.",
            core::between(1e-3, capture::kMaxStreamRate_hz));
  visit.key("offset_mm", offset_mm, "Position of the sensor, in the rig's axes; empty: 0.",
            core::size_of(3));
  visit.key("euler_deg", euler_deg,
            "Yaw about up (positive left), pitch about left (positive down), roll about forward, "
            "intrinsic, of a sensor that looks forward; empty: 0.",
            core::size_of(3));
  visit.optional_section(
      "clock", clock,
      "The sensor's own clock, by which its samples are stamped; without keys it "
      "shows the time.");
  sensor.describe(visit, "kind", "sensor",
                  "Kind of sensor; it decides further keys (`terracast list sensors`).", sensors());
}

void SensorOptions::validate() const {
  if (!capture::is_safe_name(name))
    fail(ErrorKind::Config,
         "sensor name \"{}\" names a folder; it takes 1 to 64 letters, digits, _ or -", name);
  for (const std::vector<double>* numbers : {&offset_mm, &euler_deg})
    for (const double number : *numbers)
      if (!std::isfinite(number))
        fail(ErrorKind::Config, "sensor {}: {} is not a finite number", name, number);
  core::with_context([&] { clock.check_order(rate_hz); }, fmt::format("checking sensor {}", name));
  sensor.validate();
  if (!sensor->camera().empty() && !(offset_mm.empty() && euler_deg.empty()))
    fail(ErrorKind::Config,
         "sensor {}: offset_mm or euler_deg beside camera = \"{}\", whose place it has; leave them "
         "out",
         name, sensor->camera());
  const auto* const scanner = dynamic_cast<const Scanner*>(&*sensor);
  if (scanner == nullptr) return;
  const double rows = scanner->rows_per_s(rate_hz) / rate_hz;
  if (!(rows <= Scanner::kMostRows))
    fail(ErrorKind::Config,
         "sensor {}: a scan has up to {:.3g} points, and {:.3g} fit; take a higher rate_hz ({}) or "
         "fewer pulses",
         name, rows, Scanner::kMostRows, rate_hz);
}

double MountedSensor::least_rays_per_s() const {
  const auto* const scanner = dynamic_cast<const Scanner*>(&*sensor);
  if (scanner == nullptr) return 0.0;
  return scanner->least_rays_per_s(info.rate_hz, camera ? &*camera : nullptr);
}

capture::Samples MountedSensor::measure(const scene::Scene& scene, const geo::BodyMotion& body,
                                        std::uint64_t sequence_seed,
                                        const capture::TickRange& ticks, world::RayTrail* trail,
                                        std::unique_ptr<ScanMemory>* memory) const {
  capture::Samples samples;
  const std::string names = info.rig + "/" + info.name;
  const SensorSite site{
      .scene = scene,
      .body = body,
      .body_from_sensor = info.body_from_sensor(),
      .rate_hz = info.rate_hz,
      .stream_seed = sequence_seed ^ core::content_hash64(std::as_bytes(std::span(names))),
      .trail = trail,
      .camera = camera ? &*camera : nullptr,
      .memory = memory};
  // The sensor knows nothing of its clock.
  const std::size_t num_channels = info.channels.size() - (info.clock ? 1 : 0);
  core::with_context(
      [&] {
        if (const auto* const scanner = dynamic_cast<const Scanner*>(&*sensor)) {
          samples = scanner->scan(site, ticks);
          return;
        }
        samples.times_s = capture::times_of(ticks, info.rate_hz);
        samples.values.resize(samples.times_s.size() * num_channels);
        sensor->measure(site, samples.times_s, samples.values);
      },
      fmt::format("measuring with {}", names));
  if (info.clock) add_stamps(*info.clock, site.stream_seed, info.rate_hz, num_channels, samples);
  const auto nan = std::find_if(samples.values.begin(), samples.values.end(),
                                [](double value) { return std::isnan(value); });
  if (nan != samples.values.end()) {
    const auto at = static_cast<std::size_t>(nan - samples.values.begin());
    fail(ErrorKind::Internal, "{}: {} at {} s is NaN{}", names,
         info.channels[at % info.channels.size()].name, samples.times_s[at / info.channels.size()],
         core::bug_of_plugin(sensor.kind()));
  }
  return samples;
}

void draw_clocks(std::vector<MountedSensor>& sensors, std::int64_t seed,
                 const std::string& sequence) {
  for (MountedSensor& sensor : sensors)
    if (sensor.info.clock)
      sensor.info.clock = drawn_clock(sensor.clock, seed,
                                      sequence + "/" + sensor.info.rig + "/" + sensor.info.name);
}

}  // namespace terracast::sensors
