#include <vector>

#include "geo/atmosphere.h"
#include "sensors/pressure_errors.h"
#include "sensors/sensor.h"

/// An instrument that measures the pressure of still air: that of the standard atmosphere at its height above mean sea
/// level, with a day's pressure and warmth, and what errors make of it.
namespace terracast::sensors {
namespace {

class Barometer : public Sensor {
 public:
  void describe(core::SchemaVisitor& visit) override {
    visit.key("sea_level_pressure_pa", air_.sea_level_pressure_pa,
              "The day's pressure at mean sea level (QNH).", core::between(80000.0, 110000.0));
    visit.key("warmer_k", air_.warmer_k,
              "How much warmer than the standard atmosphere the day's air is, at all heights.",
              core::between(-80.0, 60.0));
    visit.section("errors", errors_, "Errors of the instrument; without keys it shows the truth.");
  }
  std::unique_ptr<Sensor> clone() const override { return std::make_unique<Barometer>(*this); }

  std::vector<capture::StreamChannel> channels() const override {
    return {{.name = "pressure_pa", .unit = "Pa"},
            {.name = "true_pressure_pa", .unit = "Pa"},
            {.name = "true_altitude_msl_m", .unit = "m"}};
  }

  void measure(const SensorSite& site, std::span<const double> times_s,
               std::span<double> values) const override {
    const std::shared_ptr<const geo::Geoid> sea_level = SensorSite::mean_sea_level();
    PressureInstrument instrument(errors_, site, 0.0);
    for (std::size_t i = 0; i < times_s.size(); ++i) {
      const geo::Geodetic place =
          site.scene.frame().geodetic_from_world(site.point_at(times_s[i]).place_world);
      const double altitude_m =
          place.height_m - sea_level->undulation_m(place.lat_deg, place.lon_deg);
      const double truth_pa = geo::air_pressure_pa(geo::geopotential_height_m(altitude_m), air_);
      values[3 * i] = instrument.shown_pa(truth_pa, site.tick_at(times_s[i]));
      values[3 * i + 1] = truth_pa;
      values[3 * i + 2] = altitude_m;
    }
  }

 private:
  geo::Air air_;
  PressureErrors errors_;
};

}  // namespace

SensorInfo barometer_sensor() {
  return {.name = "barometer",
          .summary = "pressure of the air, its truth and what is shown",
          .make = [] { return std::unique_ptr<Sensor>(std::make_unique<Barometer>()); }};
}

}  // namespace terracast::sensors
