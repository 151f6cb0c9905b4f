#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/random.h"
#include "geo/gravity.h"
#include "geo/paths/recorded_motion.h"
#include "sensors/instrument_errors.h"
#include "sensors/motion_check.h"
#include "sensors/sensor.h"

/// Gyroscopes and accelerometers on a turning Earth: what they would show without errors, as exact derivatives of the
/// body's motion at the sensor's own place, what they do show, and the state of the sensor that explains both.
namespace terracast::sensors {
namespace {

using Eigen::Vector3d;

/// Turn rate against the stars, rad/s, and specific force, m/s^2, along the sensor's axes.
struct Inertial {
  Vector3d turn_rate = Vector3d::Zero();
  Vector3d force = Vector3d::Zero();
};

/// f = a + 2 W x v - g and w + W, with W the Earth's turning and g the gravity at the sensor's place: the world turns with
/// the Earth, and g has the centrifugal part.
Inertial inertial_of(const SensorSite& site, const geo::MotionState& body) {
  const Eigen::Quaterniond& world_from_body = body.world_from_body.rotation;
  const Vector3d& arm = site.body_from_sensor.translation;
  const Vector3d& w = body.angular_velocity_body_radps;
  const PointMotion point = point_motion(body, arm);
  const Vector3d acceleration =
      body.acceleration_world_mps2 +
      world_from_body * (body.angular_acceleration_body_radps2.cross(arm) + w.cross(w.cross(arm)));
  const geo::WorldFrame& frame = site.scene.frame();
  const Vector3d earth = geo::earth_rate_world_radps(frame);
  const Vector3d force = acceleration + 2.0 * earth.cross(point.velocity_world_mps) -
                         geo::gravity_world_mps2(frame, point.place_world);
  const Eigen::Quaterniond sensor_from_body = site.body_from_sensor.rotation.conjugate();
  return {.turn_rate = sensor_from_body * (w + world_from_body.conjugate() * earth),
          .force = sensor_from_body * (world_from_body.conjugate() * force)};
}

/// Nodes and weights of Gauss and Legendre's rule of five points over (-1, 1): exact for polynomials of degree 9.
constexpr std::array<std::array<double, 2>, 5> kGauss = {
    {{-0.90617984593866399, 0.23692688505618908},
     {-0.53846931010568309, 0.47862867049936647},
     {0.0, 0.56888888888888889},
     {0.53846931010568309, 0.47862867049936647},
     {0.90617984593866399, 0.23692688505618908}}};

/// Means over a time, from knot to knot of the motion.
Inertial mean_of(const SensorSite& site, double from_s, double to_s,
                 const std::vector<double>& knots_s) {
  Inertial sum;
  const auto add = [&](double begin_s, double end_s) {
    const double half_s = 0.5 * (end_s - begin_s);
    for (const auto& [node, weight] : kGauss) {
      const Inertial at = inertial_of(site, site.body.at(begin_s + half_s * (1.0 + node)));
      sum.turn_rate += weight * half_s * at.turn_rate;
      sum.force += weight * half_s * at.force;
    }
  };
  double begin_s = from_s;
  for (auto knot = std::upper_bound(knots_s.begin(), knots_s.end(), from_s);
       knot != knots_s.end() && *knot < to_s; ++knot) {
    add(begin_s, *knot);
    begin_s = *knot;
  }
  add(begin_s, to_s);
  return {.turn_rate = sum.turn_rate / (to_s - from_s), .force = sum.force / (to_s - from_s)};
}

/// The sensor's pose and velocity against the Earth in the Earth's axes (WGS84).
struct EarthState {
  geo::Rigid3d ecef_from_sensor;
  Vector3d velocity_mps = Vector3d::Zero();
};

EarthState earth_state_of(const SensorSite& site, const geo::MotionState& body) {
  const geo::Rigid3d& ecef_from_world = site.scene.frame().ecef_from_world();
  EarthState state{.ecef_from_sensor =
                       ecef_from_world * (body.world_from_body * site.body_from_sensor)};
  // Of the two quaternions of a rotation, the one that formats state.
  if (state.ecef_from_sensor.rotation.w() < 0.0) state.ecef_from_sensor.rotation.coeffs() *= -1.0;
  state.velocity_mps = ecef_from_world.rotation *
                       (body.velocity_world_mps +
                        body.world_from_body.rotation * body.angular_velocity_body_radps.cross(
                                                            site.body_from_sensor.translation));
  return state;
}

/// The same number in a unit that data sheets have.
struct OtherUnit {
  std::string_view name;
  double in_ours;
};

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kStandardGravity_mps2 = 9.80665;
constexpr std::array kUnitsOfTurnNoise = {OtherUnit{"deg/s/sqrt(Hz)", kDegree},
                                          OtherUnit{"deg/sqrt(h)", kDegree / 60.0}};
constexpr std::array kUnitsOfTurnWalk = {OtherUnit{"deg/s^2/sqrt(Hz)", kDegree},
                                         OtherUnit{"deg/h/sqrt(h)", kDegree / 216000.0}};
constexpr std::array kUnitsOfForceWalk = {
    OtherUnit{"ug/s/sqrt(Hz)", 1e-6 * kStandardGravity_mps2},
    OtherUnit{"ug/sqrt(h)", 1e-6 * kStandardGravity_mps2 / 60.0}};
constexpr std::array kUnitsOfTurnRate = {OtherUnit{"deg/s", kDegree},
                                         OtherUnit{"deg/h", kDegree / 3600.0}};
constexpr std::array kUnitsOfForceNoise = {OtherUnit{"ug/sqrt(Hz)", 1e-6 * kStandardGravity_mps2},
                                           OtherUnit{"m/s/sqrt(h)", 1.0 / 60.0}};
constexpr std::array kUnitsOfForce = {OtherUnit{"mg", 1e-3 * kStandardGravity_mps2},
                                      OtherUnit{"ug", 1e-6 * kStandardGravity_mps2}};

/// throws   Config: more than any instrument has, which is most often a number in another unit
void check_size(const std::string& key, double value, double most,
                std::span<const OtherUnit> units) {
  if (value <= most) return;
  std::string others;
  for (const OtherUnit& unit : units)
    others += fmt::format("{}{} {} is {:.4g}", others.empty() ? "" : ", ", value, unit.name,
                          value * unit.in_ours);
  core::fail(core::ErrorKind::Config,
             "{} = {} is more than any instrument's ({}); if it is in another unit, {}", key, value,
             most, others);
}

class Imu : public Sensor, public MotionCheck {
 public:
  void describe(core::SchemaVisitor& visit) override {
    visit.key(
        "sampling", sampling_,
        "instant: turn rate and specific force at a sample's time. integrated: means since the "
        "sample before, along the sensor's turning axes, as from instruments that sample faster "
        "internally.",
        core::one_of({"instant", "integrated"}));
    visit.section("gyroscope", gyroscope_,
                  "Errors of the gyroscopes; without keys they show the truth.");
    visit.section("accelerometer", accelerometer_,
                  "Errors of the accelerometers; without keys they show the truth.");
    visit.key("least_fixes_hz", least_fixes_hz_,
              "On a recorded motion: as many fixes a second have to be there on average. "
              "Between sparser ones accelerations are those of a smooth curve, not the body's. 0: "
              "any.",
              core::between(0.0, 1e6));
    visit.key("least_attitudes_hz", least_attitudes_hz_,
              "The same of recorded attitudes, whose changes are turn rates.",
              core::between(0.0, 1e6));
  }
  void check_motion(const geo::Trajectory& motion) const override {
    const auto* recorded = dynamic_cast<const geo::RecordedMotion*>(&motion);
    if (recorded == nullptr) return;
    const geo::RecordedRates rates = recorded->recorded_rates();
    refuse_if_coarse(rates.fixes_hz, "fixes", "accelerations", least_fixes_hz_);
    if (rates.attitudes_hz)
      refuse_if_coarse(*rates.attitudes_hz, "attitudes", "turn rates", least_attitudes_hz_);
  }
  /// The bounds are well beyond the errors of the worst gyroscopes and accelerometers that are sold.
  void validate() const override {
    const auto check =
        [](const std::string& section, const InstrumentOptions& errors, double most_noise,
           double most_bias, std::span<const OtherUnit> units_of_noise,
           std::span<const OtherUnit> units_of_walk, std::span<const OtherUnit> units_of_bias) {
          check_size(section + ".noise_" + errors.unit + "_per_sqrt_hz", errors.noise_per_sqrt_hz,
                     most_noise, units_of_noise);
          check_size(section + ".walk_" + errors.unit + "_per_s_per_sqrt_hz",
                     errors.walk_per_s_per_sqrt_hz, most_noise, units_of_walk);
          for (const auto& [key, value] : {std::pair{"markov_", errors.markov},
                                           {"flicker_", errors.flicker},
                                           {"turn_on_", errors.turn_on}})
            check_size(section + "." + key + errors.unit, value, most_bias, units_of_bias);
        };
    check("gyroscope", gyroscope_, 0.05, 1.0, kUnitsOfTurnNoise, kUnitsOfTurnWalk,
          kUnitsOfTurnRate);
    check("accelerometer", accelerometer_, 1.0, 5.0, kUnitsOfForceNoise, kUnitsOfForceWalk,
          kUnitsOfForce);
  }
  std::unique_ptr<Sensor> clone() const override { return std::make_unique<Imu>(*this); }

  std::vector<capture::StreamChannel> channels() const override {
    std::vector<capture::StreamChannel> channels;
    for (const char* what : {"", "true_"})
      for (const auto& [name, key, unit] :
           {std::array{"gyro_", "_radps", "rad/s"}, std::array{"accel_", "_mps2", "m/s^2"}})
        for (const char* axis : {"x", "y", "z"})
          channels.push_back({.name = std::string(what) + name + axis + key, .unit = unit});
    for (const char* axis : {"x", "y", "z"})
      channels.push_back({.name = fmt::format("ecef_{}_m", axis), .unit = "m"});
    for (const char* axis : {"w", "x", "y", "z"})
      channels.push_back({.name = fmt::format("ecef_q{}", axis), .unit = ""});
    for (const char* axis : {"x", "y", "z"})
      channels.push_back({.name = fmt::format("ecef_v{}_mps", axis), .unit = "m/s"});
    for (const auto& [name, key, unit] :
         {std::array{"gyro_bias_", "_radps", "rad/s"}, std::array{"accel_bias_", "_mps2", "m/s^2"}})
      for (const char* axis : {"x", "y", "z"})
        channels.push_back({.name = std::string(name) + axis + key, .unit = unit});
    return channels;
  }

  void measure(const SensorSite& site, std::span<const double> times_s,
               std::span<double> values) const override {
    std::vector<double> knots_s;
    if (sampling_ == "integrated") {
      knots_s = site.body.trajectory->knots_s();
      for (double& knot_s : knots_s) knot_s -= site.body.start_s;
    }
    Instrument gyroscope(gyroscope_, site.rate_hz, site.stream_seed, 1);
    Instrument accelerometer(accelerometer_, site.rate_hz, site.stream_seed, 2);
    for (std::size_t i = 0; i < times_s.size(); ++i) {
      const double time_s = times_s[i];
      const geo::MotionState body = site.body.at(time_s);
      const Inertial truth = sampling_ == "instant"
                                 ? inertial_of(site, body)
                                 : mean_of(site, time_s - 1.0 / site.rate_hz, time_s, knots_s);
      const std::int64_t tick = site.tick_at(time_s);
      const EarthState state = earth_state_of(site, body);
      const Eigen::Quaterniond& q = state.ecef_from_sensor.rotation;
      std::span<double> row = values.subspan(kNumChannels * i, kNumChannels);
      const auto put = [&row](const auto& numbers) {
        for (const double number : numbers) {
          row[0] = number;
          row = row.subspan(1);
        }
      };
      put(gyroscope.shown(truth.turn_rate, tick));
      put(accelerometer.shown(truth.force, tick));
      put(truth.turn_rate);
      put(truth.force);
      put(state.ecef_from_sensor.translation);
      put(Eigen::Vector4d(q.w(), q.x(), q.y(), q.z()));
      put(state.velocity_mps);
      put(gyroscope.bias(tick));
      put(accelerometer.bias(tick));
    }
  }

 private:
  static constexpr std::size_t kNumChannels = 28;

  /// throws   Config: the recording has fewer of them a second than that
  static void refuse_if_coarse(double recorded_hz, const char* what, const char* unknown,
                               double least_hz) {
    constexpr double kTolerance = 1e-3;  // of times that are rounded
    if (recorded_hz >= least_hz * (1.0 - kTolerance)) return;
    core::fail(
        core::ErrorKind::Config,
        "the recording that it flies on has {:.4g} {} a second; between so few the {} are those "
        "of a smooth curve, not the body's, and at least {:.4g} a second are asked for: take a "
        "denser recording, or accept it by least_{}_hz = {:.3g} or less (0: any)",
        recorded_hz, what, unknown, least_hz, what, rounded_down(recorded_hz));
  }

  /// To three digits, the last of numbers that are whole but for rounding kept.
  static double rounded_down(double number) {
    if (number <= 0.0) return 0.0;
    constexpr double kRounding = 1e-9;
    const double digit = std::pow(10.0, std::floor(std::log10(number)) - 2.0);
    return std::floor(number * (1.0 + kRounding) / digit) * digit;
  }

  std::string sampling_ = "instant";
  InstrumentOptions gyroscope_{"radps"};
  InstrumentOptions accelerometer_{"mps2"};
  // Vehicles accelerate at up to some 2 Hz, and turn at up to some 7 Hz: twice as many samples. PX4 logs 5 and 20 a
  // second, more or less.
  double least_fixes_hz_ = 4.0;
  double least_attitudes_hz_ = 15.0;
};

}  // namespace

SensorInfo imu_sensor() {
  return {.name = "imu",
          .summary = "gyroscopes and accelerometers, their truth and what they show",
          .make = [] { return std::unique_ptr<Sensor>(std::make_unique<Imu>()); }};
}

}  // namespace terracast::sensors
