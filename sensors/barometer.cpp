#include <cmath>
#include <vector>

#include "geo/atmosphere.h"
#include "sensors/drawn_noise.h"
#include "sensors/instrument_errors.h"
#include "sensors/sensor.h"

/// An instrument that measures the pressure of still air: that of the standard atmosphere at its height above mean sea
/// level, with a day's pressure and warmth, and what errors make of it.
namespace terracast::sensors {
namespace {

/// Errors of the instrument; 0: it has none of the kind.
struct PressureErrors {
  double noise_pa = 0.0;
  double walk_pa_per_sqrt_s = 0.0;
  double markov_pa = 0.0;
  double markov_s = 1000.0;
  double turn_on_pa = 0.0;
  double step_pa = 0.0;

  void describe(core::SchemaVisitor& visit) {
    const core::Constraint positive = core::between(0.0, 1e5);
    visit.key("noise_pa", noise_pa, "Deviation of an error that each sample has anew.", positive);
    visit.key("walk_pa_per_sqrt_s", walk_pa_per_sqrt_s,
              "Deviation of what a drift gains over a second; over t seconds it is sqrt(t) of it.",
              positive);
    visit.key("markov_pa", markov_pa, "Deviation of a drift that wanders and comes back.",
              positive);
    visit.key("markov_s", markov_s, "Over this time that drift correlates by 1/e.",
              core::between(1e-3, 1e9));
    visit.key("turn_on_pa", turn_on_pa, "Deviation of an offset that stays, drawn by the seed.",
              positive);
    visit.key("step_pa", step_pa, "Step of the numbers that are shown; 0: doubles.", positive);
  }
};

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
    DrawnNoise noise({.white = errors_.noise_pa,
                      .walk = errors_.walk_pa_per_sqrt_s / std::sqrt(site.rate_hz),
                      .markov = errors_.markov_pa,
                      .markov_ticks = errors_.markov_s * site.rate_hz},
                     site.stream_seed, kErrors, 0);
    const double turn_on_pa =
        drawn_constant(errors_.turn_on_pa, site.stream_seed, kErrors, kTurnOnBias, 0);
    for (std::size_t i = 0; i < times_s.size(); ++i) {
      const geo::Geodetic place =
          site.scene.frame().geodetic_from_world(site.point_at(times_s[i]).place_world);
      const double altitude_m =
          place.height_m - sea_level->undulation_m(place.lat_deg, place.lon_deg);
      const double truth_pa = geo::air_pressure_pa(geo::geopotential_height_m(altitude_m), air_);
      const double shown_pa = shown_number(
          noise.added_to(truth_pa + turn_on_pa, site.tick_at(times_s[i])), errors_.step_pa, 0.0);
      values[3 * i] = shown_pa;
      values[3 * i + 1] = truth_pa;
      values[3 * i + 2] = altitude_m;
    }
  }

 private:
  static constexpr std::uint64_t kErrors = 1;  ///< stream of random numbers

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
