#include <cmath>
#include <vector>

#include "geo/magnetic_field.h"
#include "geo/sun.h"
#include "sensors/instrument_errors.h"
#include "sensors/sensor.h"

/// An instrument that measures the Earth's magnetic field along its axes: that of the World Magnetic Model at its place
/// and date, and what the iron around it and errors make of it.
namespace terracast::sensors {
namespace {

using core::ErrorKind;
using core::fail;
using Eigen::Vector3d;

class Magnetometer : public Sensor {
 public:
  void describe(core::SchemaVisitor& visit) override {
    visit.key("hard_iron_nt", hard_iron_nt_,
              "Field of what is magnetic on the body, along the sensor's axes; empty: none.",
              core::size_of(3));
    visit.key("soft_iron", soft_iron_,
              "What iron on the body makes of the Earth's field: the matrix that it is multiplied "
              "with, along the sensor's axes, row by row; empty: the field stays as it is.",
              core::size_of(9));
    visit.section("errors", errors_,
                  "Errors of the instrument; without keys it shows the field as iron leaves it.");
  }
  void validate() const override {
    for (const std::vector<double>* numbers : {&hard_iron_nt_, &soft_iron_})
      for (const double number : *numbers)
        if (!std::isfinite(number))
          fail(ErrorKind::Config, "hard_iron_nt and soft_iron: {} is not a finite number", number);
    constexpr double kLeastDeterminant = 1e-6;
    if (const double determinant = soft_iron().determinant(); !(determinant > kLeastDeterminant))
      fail(ErrorKind::Config,
           "soft_iron has the determinant {:.3g}: such a matrix mirrors the field or flattens it; "
           "its rows are near 1 0 0, 0 1 0 and 0 0 1",
           determinant);
  }
  void check_times(double from_unix_s, double to_unix_s) const override {
    for (const double time : {from_unix_s, to_unix_s})
      geo::check_magnetic_year(geo::decimal_year(time));
  }
  std::unique_ptr<Sensor> clone() const override { return std::make_unique<Magnetometer>(*this); }

  std::vector<capture::StreamChannel> channels() const override {
    std::vector<capture::StreamChannel> channels;
    for (const char* what : {"", "true_"})
      for (const char* axis : {"x", "y", "z"})
        channels.push_back({.name = std::string(what) + "field_" + axis + "_nt", .unit = "nT"});
    return channels;
  }

  void measure(const SensorSite& site, std::span<const double> times_s,
               std::span<double> values) const override {
    const double start_unix_s = geo::unix_seconds_from_utc(site.scene.utc_start());
    const geo::Rigid3d& ecef_from_world = site.scene.frame().ecef_from_world();
    const Eigen::Matrix3d soft_iron_matrix = soft_iron();
    const Vector3d hard_iron =
        hard_iron_nt_.empty() ? Vector3d::Zero() : Vector3d(hard_iron_nt_.data());
    Instrument instrument(errors_, site.rate_hz, site.stream_seed, 1);
    for (std::size_t i = 0; i < times_s.size(); ++i) {
      const geo::Rigid3d ecef_from_sensor = ecef_from_world * site.world_from_sensor(times_s[i]);
      const Vector3d truth =
          ecef_from_sensor.rotation.conjugate() *
          geo::magnetic_field_ecef_nt(ecef_from_sensor.translation,
                                      geo::decimal_year(start_unix_s + times_s[i]));
      const Vector3d shown =
          instrument.shown(soft_iron_matrix * truth + hard_iron, site.tick_at(times_s[i]));
      for (Eigen::Index axis = 0; axis < 3; ++axis) {
        values[6 * i + static_cast<std::size_t>(axis)] = shown[axis];
        values[6 * i + 3 + static_cast<std::size_t>(axis)] = truth[axis];
      }
    }
  }

 private:
  Eigen::Matrix3d soft_iron() const {
    if (soft_iron_.empty()) return Eigen::Matrix3d::Identity();
    return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(soft_iron_.data());
  }

  std::vector<double> hard_iron_nt_, soft_iron_;
  InstrumentOptions errors_{"nt"};
};

}  // namespace

SensorInfo magnetometer_sensor() {
  return {.name = "magnetometer",
          .summary = "the Earth's magnetic field by place and date, its truth and what is shown",
          .make = [] { return std::unique_ptr<Sensor>(std::make_unique<Magnetometer>()); }};
}

}  // namespace terracast::sensors
