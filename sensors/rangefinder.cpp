#include <limits>
#include <vector>

#include "sensors/sensor.h"

/// A laser that measures the range to the first surface along the sensor's x axis: a ray a sample, each at its own time
/// from its own pose, in a world that moves meanwhile. Air, clouds and haze let it through.
namespace terracast::sensors {
namespace {

class Rangefinder : public Sensor {
 public:
  void describe(core::SchemaVisitor& visit) override {
    visit.key("least_range_m", least_range_m_, "What is nearer is passed over.",
              core::between(0.0, 1e5));
    visit.key("most_range_m", most_range_m_,
              "What is farther is not found: its range is +inf, as the sky's.",
              core::between(1e-3, 1e6));
  }
  void validate() const override {
    if (!(least_range_m_ < most_range_m_))
      core::fail(core::ErrorKind::Config,
                 "least_range_m = {} is not below most_range_m = {}; take more of the latter",
                 least_range_m_, most_range_m_);
  }
  std::unique_ptr<Sensor> clone() const override { return std::make_unique<Rangefinder>(*this); }

  std::vector<capture::StreamChannel> channels() const override {
    return {{.name = "range_m", .unit = "m"}};
  }

  void measure(const SensorSite& site, std::span<const double> times_s,
               std::span<double> values) const override {
    for (std::size_t i = 0; i < times_s.size(); ++i) {
      const geo::Rigid3d pose = site.world_from_sensor(times_s[i]);
      const world::WorldRay ray{.origin_world = pose.translation,
                                .direction_world = pose.rotation * Eigen::Vector3d::UnitX(),
                                .t_min = least_range_m_,
                                .t_max = most_range_m_};
      world::SurfaceHit hit;
      site.scene.at(times_s[i])
          .trace({&ray, 1}, {}, {&hit, 1}, world::Coherence::Incoherent, {}, site.trail);
      values[i] = hit.t;
    }
  }

 private:
  double least_range_m_ = 0.1;
  double most_range_m_ = 2000.0;
};

}  // namespace

SensorInfo rangefinder_sensor() {
  return {.name = "rangefinder",
          .summary = "a laser's range to the first surface straight ahead",
          .make = [] { return std::unique_ptr<Sensor>(std::make_unique<Rangefinder>()); }};
}

}  // namespace terracast::sensors
