#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "core/random.h"
#include "sensors/drawn_noise.h"
#include "sensors/sensor.h"

/// A receiver of satellite navigation that states fixes: place and velocity of its antenna, their truth and what errors
/// make of it.
namespace terracast::sensors {
namespace {

using core::ErrorKind;
using core::fail;
using Eigen::Vector3d;

/// Kinds of fixes, numbered as NMEA 0183's GGA numbers them.
enum class Fix { Single = 1, Fixed = 4, Floating = 5 };

/// Errors of fixes of one kind, along east and north each and along up; 0: there are none of the kind.
struct FixErrors {
  double markov_horizontal_m = 0.0;
  double markov_vertical_m = 0.0;
  double markov_s = 100.0;
  double noise_horizontal_m = 0.0;
  double noise_vertical_m = 0.0;
  double velocity_horizontal_mps = 0.0;
  double velocity_vertical_mps = 0.0;

  bool operator==(const FixErrors&) const = default;
  double horizontal_m() const { return std::hypot(markov_horizontal_m, noise_horizontal_m); }
  double vertical_m() const { return std::hypot(markov_vertical_m, noise_vertical_m); }

  void describe(core::SchemaVisitor& visit) {
    const core::Constraint metres = core::between(0.0, 1e4);
    visit.key("markov_horizontal_m", markov_horizontal_m,
              "Deviation, to the east and to the north, of an error that wanders and comes back.",
              metres);
    visit.key("markov_vertical_m", markov_vertical_m, "The same of heights.", metres);
    visit.key("markov_s", markov_s, "Over this time that error correlates by 1/e.",
              core::between(1e-3, 1e9));
    visit.key("noise_horizontal_m", noise_horizontal_m,
              "Deviation, to the east and to the north, of an error that each sample has anew.",
              metres);
    visit.key("noise_vertical_m", noise_vertical_m, "The same of heights.", metres);
    visit.key("velocity_noise_horizontal_mps", velocity_horizontal_mps,
              "Deviation of velocities to the north and to the east, of each sample anew.",
              core::between(0.0, 1e3));
    visit.key("velocity_noise_vertical_mps", velocity_vertical_mps, "The same of velocities down.",
              core::between(0.0, 1e3));
  }
};

/// Errors along three axes, by numbers of a stream of their own.
class DrawnVector {
 public:
  DrawnVector(const NoiseSizes& horizontal, const NoiseSizes& vertical, std::uint64_t seed,
              std::uint64_t stream)
      : axes_{DrawnNoise(horizontal, seed, stream, 0), DrawnNoise(horizontal, seed, stream, 1),
              DrawnNoise(vertical, seed, stream, 2)} {}
  Vector3d at(std::int64_t tick) {
    return {axes_[0].added_to(0.0, tick), axes_[1].added_to(0.0, tick),
            axes_[2].added_to(0.0, tick)};
  }

 private:
  std::array<DrawnNoise, 3> axes_;
};

/// What random numbers of a receiver are for.
enum Stream : std::uint64_t { kOfPlaces = 1, kOfVelocities, kOfLosses };

/// The errors that fixes of one kind have.
class DrawnFixes {
 public:
  DrawnFixes(const FixErrors& errors, const SensorSite& site, Fix fix)
      : place_(of_place(errors.markov_horizontal_m, errors.noise_horizontal_m, errors, site),
               of_place(errors.markov_vertical_m, errors.noise_vertical_m, errors, site),
               site.stream_seed, stream_of(kOfPlaces, fix)),
        velocity_({.white = errors.velocity_horizontal_mps},
                  {.white = errors.velocity_vertical_mps}, site.stream_seed,
                  stream_of(kOfVelocities, fix)) {}
  Vector3d place_enu_m(std::int64_t tick) { return place_.at(tick); }
  Vector3d velocity_ned_mps(std::int64_t tick) { return velocity_.at(tick); }

 private:
  static std::uint64_t stream_of(Stream stream, Fix fix) {
    return core::stream_of(stream, static_cast<std::uint64_t>(fix));
  }
  static NoiseSizes of_place(double markov_m, double noise_m, const FixErrors& errors,
                             const SensorSite& site) {
    return {.white = noise_m, .markov = markov_m, .markov_ticks = errors.markov_s * site.rate_hz};
  }
  DrawnVector place_, velocity_;
};

/// What a receiver states, of one point of its antenna.
struct Statement {
  geo::Geodetic place;
  double altitude_msl_m = 0.0;
  Vector3d velocity_ned_mps;

  std::array<double, 7> numbers() const {
    return {place.lat_deg,        place.lon_deg,        place.height_m,      altitude_msl_m,
            velocity_ned_mps.x(), velocity_ned_mps.y(), velocity_ned_mps.z()};
  }
};

class Gnss : public Sensor {
 public:
  void describe(core::SchemaVisitor& visit) override {
    visit.key("mode", mode_,
              "single: fixes by one receiver alone. rtk: fixes against a base station, whose whole "
              "numbers of waves are known (fixed) or, for a while, are lost (floating).",
              core::one_of({"single", "rtk"}));
    visit.section("single", single_, "Errors of single fixes; without keys they are the truth.");
    visit.section("fixed", fixed_, "Errors of rtk's fixed fixes; without keys they are the truth.");
    visit.section("floating", floating_,
                  "Errors of rtk's floating fixes; without keys they are the truth.");
    visit.key("fixed_for_s", fixed_for_s_,
              "How long rtk is fixed until it is lost, in the mean; 0: it is never lost.",
              core::between(0.0, 1e9));
    visit.key("floating_for_s", floating_for_s_, "How long it is lost then, in the mean.",
              core::between(0.0, 1e9));
  }

  void validate() const override {
    const bool is_rtk = mode_ == "rtk";
    if (is_rtk && single_ != FixErrors())
      fail(ErrorKind::Config,
           "mode = \"rtk\" has no single fixes; give their errors in `fixed` and `floating`, or "
           "take mode = \"single\"");
    if (!is_rtk && (fixed_ != FixErrors() || floating_ != FixErrors() || fixed_for_s_ > 0.0 ||
                    floating_for_s_ > 0.0))
      fail(ErrorKind::Config,
           "`fixed`, `floating`, fixed_for_s and floating_for_s are of mode = \"rtk\", and the "
           "mode is \"single\"; take the other mode, or give `single`");
    if ((fixed_for_s_ > 0.0) != (floating_for_s_ > 0.0))
      fail(ErrorKind::Config,
           "fixed_for_s = {} and floating_for_s = {}: give both, or none where rtk is never lost",
           fixed_for_s_, floating_for_s_);
  }
  std::unique_ptr<Sensor> clone() const override { return std::make_unique<Gnss>(*this); }

  std::vector<capture::StreamChannel> channels() const override {
    std::vector<capture::StreamChannel> channels;
    const auto add = [&](const std::string& before) {
      for (const auto& [name, unit] :
           {std::array{"lat_deg", "deg"}, std::array{"lon_deg", "deg"}, std::array{"height_m", "m"},
            std::array{"altitude_msl_m", "m"}, std::array{"velocity_north_mps", "m/s"},
            std::array{"velocity_east_mps", "m/s"}, std::array{"velocity_down_mps", "m/s"}})
        channels.push_back({.name = before + name, .unit = unit});
    };
    add("");
    channels.push_back({.name = "sigma_horizontal_m", .unit = "m"});
    channels.push_back({.name = "sigma_vertical_m", .unit = "m"});
    channels.push_back({.name = "sigma_velocity_horizontal_mps", .unit = "m/s"});
    channels.push_back({.name = "sigma_velocity_vertical_mps", .unit = "m/s"});
    channels.push_back({.name = "fix", .unit = ""});
    add("true_");
    return channels;
  }

  void measure(const SensorSite& site, std::span<const double> times_s,
               std::span<double> values) const override {
    const geo::WorldFrame& frame = site.scene.frame();
    const std::shared_ptr<const geo::Geoid> sea_level = SensorSite::mean_sea_level();
    DrawnFixes single(single_, site, Fix::Single);
    DrawnFixes fixed(fixed_, site, Fix::Fixed);
    DrawnFixes floating(floating_, site, Fix::Floating);
    std::optional<DrawnSwitch> is_fixed;
    if (fixed_for_s_ > 0.0)
      is_fixed.emplace(fixed_for_s_ * site.rate_hz, floating_for_s_ * site.rate_hz,
                       site.stream_seed, kOfLosses);
    const auto stated = [&](const Vector3d& place_world, const Vector3d& velocity_ned_mps) {
      Statement statement{.place = frame.geodetic_from_world(place_world),
                          .velocity_ned_mps = velocity_ned_mps};
      statement.altitude_msl_m =
          statement.place.height_m -
          sea_level->undulation_m(statement.place.lat_deg, statement.place.lon_deg);
      return statement;
    };
    auto to = values.begin();
    for (const double time_s : times_s) {
      const std::int64_t tick = site.tick_at(time_s);
      const PointMotion antenna = site.point_at(time_s);
      // East, north and up of the antenna's own place: they turn by 0.22 degrees over 25 km.
      const Eigen::Matrix3d world_from_enu = frame.world_from_enu(antenna.place_world);
      const Vector3d enu = world_from_enu.transpose() * antenna.velocity_world_mps;
      const Vector3d ned(enu.y(), enu.x(), -enu.z());
      const Fix fix = mode_ == "single"                    ? Fix::Single
                      : !is_fixed || is_fixed->is_on(tick) ? Fix::Fixed
                                                           : Fix::Floating;
      const FixErrors& errors = fix == Fix::Single  ? single_
                                : fix == Fix::Fixed ? fixed_
                                                    : floating_;
      DrawnFixes& drawn = fix == Fix::Single ? single : fix == Fix::Fixed ? fixed : floating;
      const auto put = [&](const auto& numbers) {
        to = std::copy(numbers.begin(), numbers.end(), to);
      };
      put(stated(antenna.place_world + world_from_enu * drawn.place_enu_m(tick),
                 ned + drawn.velocity_ned_mps(tick))
              .numbers());
      put(std::array{errors.horizontal_m(), errors.vertical_m(), errors.velocity_horizontal_mps,
                     errors.velocity_vertical_mps, static_cast<double>(fix)});
      put(stated(antenna.place_world, ned).numbers());
    }
  }

 private:
  std::string mode_ = "single";
  FixErrors single_, fixed_, floating_;
  double fixed_for_s_ = 0.0, floating_for_s_ = 0.0;
};

}  // namespace

SensorInfo gnss_sensor() {
  return {.name = "gnss",
          .summary = "fixes of satellite navigation, their truth and what they show",
          .make = [] { return std::unique_ptr<Sensor>(std::make_unique<Gnss>()); }};
}

}  // namespace terracast::sensors
