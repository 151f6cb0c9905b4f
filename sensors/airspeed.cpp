#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "geo/atmosphere.h"
#include "sensors/pressure_errors.h"
#include "sensors/sensor.h"

/// A pitot tube along the sensor's x axis: the pressure that the air builds up in it over that of still air, the
/// airspeed that follows at sea level, and what errors make of both.
namespace terracast::sensors {
namespace {

class Airspeed : public Sensor {
 public:
  void describe(core::SchemaVisitor& visit) override {
    visit.key("sea_level_pressure_pa", air_.sea_level_pressure_pa,
              "The day's pressure at mean sea level (QNH).", core::between(80000.0, 110000.0));
    visit.key("warmer_k", air_.warmer_k,
              "How much warmer than the standard atmosphere the day's air is, at all heights.",
              core::between(-80.0, 60.0));
    visit.key("range_pa", range_pa_, "Most that the instrument shows, either way; 0: no limit.",
              core::between(0.0, 1e6));
    visit.section("errors", errors_, "Errors of the instrument; without keys it shows the truth.");
  }
  std::unique_ptr<Sensor> clone() const override { return std::make_unique<Airspeed>(*this); }

  std::vector<capture::StreamChannel> channels() const override {
    return {{.name = "differential_pressure_pa", .unit = "Pa"},
            {.name = "indicated_airspeed_mps", .unit = "m/s"},
            {.name = "true_differential_pressure_pa", .unit = "Pa"},
            {.name = "true_airspeed_mps", .unit = "m/s"},
            {.name = "true_wind_east_mps", .unit = "m/s"},
            {.name = "true_wind_north_mps", .unit = "m/s"},
            {.name = "true_wind_up_mps", .unit = "m/s"}};
  }

  void measure(const SensorSite& site, std::span<const double> times_s,
               std::span<double> values) const override {
    const std::shared_ptr<const geo::Geoid> sea_level = SensorSite::mean_sea_level();
    const geo::WorldFrame& frame = site.scene.frame();
    PressureInstrument instrument(errors_, site, range_pa_);
    for (std::size_t i = 0; i < times_s.size(); ++i) {
      const PointMotion point = site.point_at(times_s[i]);
      const geo::Geodetic place = frame.geodetic_from_world(point.place_world);
      const double height_m = geo::geopotential_height_m(
          place.height_m - sea_level->undulation_m(place.lat_deg, place.lon_deg));
      const Eigen::Vector3d wind = site.body.wind_world_mps(times_s[i]);
      const Eigen::Vector3d through_air = point.velocity_world_mps - wind;
      const Eigen::Vector3d tube =
          site.world_from_sensor(times_s[i]).rotation * Eigen::Vector3d::UnitX();
      // Air from behind builds up no pressure.
      const double along_mps = std::max(tube.dot(through_air), 0.0);
      const double truth_pa = geo::impact_pressure_pa(
          along_mps, geo::air_pressure_pa(height_m, air_), geo::air_temperature_k(height_m, air_));
      const double shown_pa = instrument.shown_pa(truth_pa, site.tick_at(times_s[i]));
      const Eigen::Vector3d wind_enu = frame.world_from_enu(point.place_world).transpose() * wind;
      const std::array<double, 7> row = {
          shown_pa,     std::sqrt(2.0 * std::max(shown_pa, 0.0) / geo::kSeaLevelDensity_kg_per_m3),
          truth_pa,     through_air.norm(),
          wind_enu.x(), wind_enu.y(),
          wind_enu.z()};
      std::copy(row.begin(), row.end(), values.begin() + static_cast<std::ptrdiff_t>(7 * i));
    }
  }

 private:
  geo::Air air_;
  double range_pa_ = 0.0;
  PressureErrors errors_;
};

}  // namespace

SensorInfo airspeed_sensor() {
  return {.name = "airspeed",
          .summary = "pressure in a pitot tube and the airspeed that it indicates, in the wind",
          .make = [] { return std::unique_ptr<Sensor>(std::make_unique<Airspeed>()); }};
}

}  // namespace terracast::sensors
