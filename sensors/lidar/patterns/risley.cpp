#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <optional>

#include "core/error.h"
#include "sensors/lidar/pattern.h"

/// Wedges of glass that turn about the forward axis, each at its own rate, and bend the beam: rosettes that close late or
/// never.
namespace terracast::sensors::lidar {
namespace {

using Eigen::Vector3d;

/// Snell's law at a plane face.
/// normal   unit, against the ray
/// ratio    of the refractive indices, before the face to behind it
/// returns  unit; nothing where all light is thrown back
std::optional<Vector3d> refracted(const Vector3d& ray, const Vector3d& normal, double ratio) {
  const double cosine = -normal.dot(ray);
  const double inner = 1.0 - ratio * ratio * (1.0 - cosine * cosine);
  if (inner < 0.0) return std::nullopt;
  return (ratio * ray + (ratio * cosine - std::sqrt(inner)) * normal).normalized();
}

class Risley : public ScanPattern {
 public:
  void describe(core::SchemaVisitor& visit) override {
    visit.key("pulse_hz", pulse_hz_, "Pulses a second.", core::between(1.0, 1e7));
    visit.key("turns_hz", turns_hz_,
              "Turns a second of each wedge, in the order in which the beam passes them; positive: "
              "counterclockwise, seen from ahead.");
    visit.key("wedge_deg", wedge_deg_,
              "Angle of each wedge: between its first face, square to the axis, and its second.");
    visit.key("refractive_index", refractive_index_, "Of the wedges' glass.",
              core::between(1.0, 4.0));
  }
  void validate() const override {
    using core::ErrorKind;
    using core::fail;
    if (turns_hz_.empty() || turns_hz_.size() > 8 || turns_hz_.size() != wedge_deg_.size())
      fail(ErrorKind::Config,
           "turns_hz has {} numbers and wedge_deg {}; each wedge, of 1 to 8, takes one of both",
           turns_hz_.size(), wedge_deg_.size());
    for (std::size_t i = 0; i < turns_hz_.size(); ++i) {
      if (!std::isfinite(turns_hz_[i]) || std::abs(turns_hz_[i]) > 1e5)
        fail(ErrorKind::Config, "turns_hz = {} is no rate of a wedge; it takes up to 1e5",
             turns_hz_[i]);
      if (!(std::abs(wedge_deg_[i]) < 60.0))
        fail(ErrorKind::Config, "wedge_deg = {}; it takes less than 60", wedge_deg_[i]);
    }
    // All wedges the same way bend the most.
    if (!direction(std::vector<double>(turns_hz_.size(), 0.0)))
      fail(ErrorKind::Config,
           "the wedges of {} throw the beam back where they stand the same way; take smaller "
           "wedge_deg",
           fmt::join(wedge_deg_, ", "));
  }
  std::unique_ptr<ScanPattern> clone() const override { return std::make_unique<Risley>(*this); }

  std::vector<Pulse> pulses(std::int64_t scan, double rate_hz) const override {
    std::vector<Pulse> pulses;
    std::vector<double> turned_rad(turns_hz_.size());
    for (const double time_s : times_of_pulses(pulse_hz_, scan, rate_hz)) {
      for (std::size_t i = 0; i < turns_hz_.size(); ++i)
        turned_rad[i] = 2.0 * std::numbers::pi * phase_of(time_s, turns_hz_[i]);
      if (const std::optional<Vector3d> ray = direction(turned_rad))
        pulses.push_back({.time_s = time_s, .direction = *ray});
    }
    return pulses;
  }
  double pulses_per_s(double /*rate_hz*/) const override { return pulse_hz_; }

 private:
  std::optional<Vector3d> direction(const std::vector<double>& turned_rad) const {
    std::optional<Vector3d> ray = Vector3d::UnitX();
    for (std::size_t i = 0; i < turned_rad.size() && ray; ++i) {
      const double wedge_rad = wedge_deg_[i] * std::numbers::pi / 180.0;
      const Vector3d second(-std::cos(wedge_rad), std::sin(wedge_rad) * std::cos(turned_rad[i]),
                            std::sin(wedge_rad) * std::sin(turned_rad[i]));
      ray = refracted(*ray, -Vector3d::UnitX(), 1.0 / refractive_index_);
      if (ray) ray = refracted(*ray, second, refractive_index_);
    }
    return ray;
  }

  double pulse_hz_ = 100e3;
  std::vector<double> turns_hz_ = {-121.5657, 77.7430};
  std::vector<double> wedge_deg_ = {18.7481, 17.9634};
  double refractive_index_ = 1.51;
};

}  // namespace

ScanPatternInfo risley_pattern() {
  return {.name = "risley", .summary = "rosettes of turning wedges of glass", .make = [] {
            return std::unique_ptr<ScanPattern>(std::make_unique<Risley>());
          }};
}

}  // namespace terracast::sensors::lidar
