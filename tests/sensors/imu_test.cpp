// An IMU's truth against mechanisations and closed forms of the test's own, and its errors against their theory.

#include <gtest/gtest.h>
#include <toml++/toml.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <memory>
#include <numbers>

#include "geo/gravity.h"
#include "geo/paths/recorded_motion.h"
#include "render/checked_plan.h"
#include "sensors/motion_check.h"
#include "tests/support/allan.h"
#include "tests/support/expect_error.h"
#include "tests/support/sensor_flight.h"

namespace terracast::test {
namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

struct Reading {
  Vector3d gyro, accel, true_gyro, true_accel;
  geo::Rigid3d ecef_from_sensor;
  Vector3d velocity_ecef, gyro_bias, accel_bias;
};

constexpr std::size_t kNumChannels = 28;

class Imu : public testing::Test {
 protected:
  std::vector<Reading> measure(const std::string& keys,
                               std::shared_ptr<const geo::Trajectory> motion, double rate_hz,
                               std::size_t count, const geo::Rigid3d& body_from_sensor = {},
                               std::uint64_t seed = 11) {
    const std::vector<double> values =
        flight_.measure("imu", keys, std::move(motion), rate_hz, count, body_from_sensor, seed);
    std::vector<Reading> readings;
    for (std::size_t k = 0; k < count; ++k) {
      const auto three = [&](std::size_t first) {
        return Vector3d(values[kNumChannels * k + first], values[kNumChannels * k + first + 1],
                        values[kNumChannels * k + first + 2]);
      };
      const double* q = &values[kNumChannels * k + 15];
      readings.push_back({three(0), three(3), three(6), three(9),
                          geo::Rigid3d{Quaterniond(q[0], q[1], q[2], q[3]), three(12)}, three(19),
                          three(22), three(25)});
    }
    return readings;
  }
  const geo::WorldFrame& frame() const { return flight_.frame(); }
  static std::vector<double> errors_of(const std::vector<Reading>& readings, bool is_gyro,
                                       int axis) {
    std::vector<double> errors;
    for (const Reading& r : readings)
      errors.push_back(is_gyro ? r.gyro[axis] - r.true_gyro[axis]
                               : r.accel[axis] - r.true_accel[axis]);
    return errors;
  }

 private:
  SensorFlight flight_;
};

/// A sensor in the Earth's axes, which turn with it.
struct Navigated {
  Vector3d place, velocity;
  Quaterniond ecef_from_sensor;
};

/// What a mechanisation leaves out.
struct Omissions {
  bool earth_rate = false, coriolis = false, local_gravity = false;
};

/// Strapdown in the Earth's axes, by Runge's and Kutta's rule over two samples.
Navigated integrate(Navigated state, const std::vector<Reading>& readings, double rate_hz,
                    const geo::WorldFrame& frame, const Omissions& without = {}) {
  const Vector3d earth(0.0, 0.0, geo::kEarthRate_radps);
  struct Slope {
    Vector3d place, velocity;
    Eigen::Vector4d turn;
  };
  const auto slope_of = [&](const Navigated& at, const Reading& reading) {
    const Vector3d world = frame.ecef_from_world().inverse() * at.place;
    Vector3d gravity = frame.ecef_from_world().rotation * geo::gravity_world_mps2(frame, world);
    if (without.local_gravity) gravity *= 9.81 / gravity.norm();
    const Vector3d force = at.ecef_from_sensor * reading.true_accel;
    Vector3d rate = reading.true_gyro;
    if (!without.earth_rate) rate -= at.ecef_from_sensor.conjugate() * earth;
    const Vector3d coriolis =
        without.coriolis ? Vector3d::Zero() : Vector3d(2.0 * earth.cross(at.velocity));
    const Quaterniond turn = at.ecef_from_sensor * Quaterniond(0.0, rate.x(), rate.y(), rate.z());
    return Slope{at.velocity, force + gravity - coriolis, 0.5 * turn.coeffs()};
  };
  const auto moved = [](const Navigated& at, const Slope& slope, double step_s) {
    Navigated next = at;
    next.place += step_s * slope.place;
    next.velocity += step_s * slope.velocity;
    next.ecef_from_sensor.coeffs() += step_s * slope.turn;
    return next;
  };
  const double step_s = 2.0 / rate_hz;
  for (std::size_t k = 0; k + 2 < readings.size(); k += 2) {
    const Slope a = slope_of(state, readings[k]);
    const Slope b = slope_of(moved(state, a, 0.5 * step_s), readings[k + 1]);
    const Slope c = slope_of(moved(state, b, 0.5 * step_s), readings[k + 1]);
    const Slope d = slope_of(moved(state, c, step_s), readings[k + 2]);
    const Slope mean{(a.place + 2.0 * b.place + 2.0 * c.place + d.place) / 6.0,
                     (a.velocity + 2.0 * b.velocity + 2.0 * c.velocity + d.velocity) / 6.0,
                     (a.turn + 2.0 * b.turn + 2.0 * c.turn + d.turn) / 6.0};
    state = moved(state, mean, step_s);
    state.ecef_from_sensor.normalize();
  }
  return state;
}

/// The sensor by the body's own motion.
Navigated placed(const geo::Trajectory& motion, double time_s, const geo::Rigid3d& body_from_sensor,
                 const geo::WorldFrame& frame) {
  const geo::MotionState body = motion.at(time_s);
  const Quaterniond ecef_from_world = frame.ecef_from_world().rotation;
  const Vector3d arm = body_from_sensor.translation;
  return {.place = frame.ecef_from_world() * (body.world_from_body * arm),
          .velocity = ecef_from_world *
                      (body.velocity_world_mps +
                       body.world_from_body.rotation * body.angular_velocity_body_radps.cross(arm)),
          .ecef_from_sensor =
              ecef_from_world * body.world_from_body.rotation * body_from_sensor.rotation};
}

const geo::Rigid3d kMount{
    .rotation = Quaterniond(Eigen::AngleAxisd(0.4, Vector3d(1, 2, -1).normalized())),
    .translation = {0.4, -0.3, 0.2}};

TEST_F(Imu, ComesBackToTheBodysOwnMotionWhenItIsIntegrated) {
  const auto motion = figure_of_eight();
  constexpr double kRate_hz = 200.0, kDuration_s = 60.0;
  const auto readings = measure("", motion, kRate_hz, 12001, kMount);
  const Navigated end =
      integrate(placed(*motion, 0.0, kMount, frame()), readings, kRate_hz, frame());
  const Navigated right = placed(*motion, kDuration_s, kMount, frame());
  EXPECT_LT((end.place - right.place).norm(), 1e-6);
  EXPECT_LT(end.ecef_from_sensor.angularDistance(right.ecef_from_sensor), 1e-10);
  // At half the rate the rule errs by sixteen times as much: it is the rule's error alone.
  std::vector<Reading> half;
  for (std::size_t k = 0; k < readings.size(); k += 4) half.push_back(readings[k]);
  std::vector<Reading> quarter;
  for (std::size_t k = 0; k < readings.size(); k += 8) quarter.push_back(readings[k]);
  const auto off_m = [&](const std::vector<Reading>& some, double rate_hz) {
    return (integrate(placed(*motion, 0.0, kMount, frame()), some, rate_hz, frame()).place -
            right.place)
        .norm();
  };
  const double ratio = off_m(quarter, kRate_hz / 8.0) / off_m(half, kRate_hz / 4.0);
  EXPECT_GT(ratio, 13.0);
  EXPECT_LT(ratio, 19.0);
}

TEST_F(Imu, WhatAMechanisationLeavesOutShowsAtItsSize) {
  // A body that flies straight to the east: what is left out is all that moves it off its line.
  auto motion = std::make_shared<WavyMotion>();
  motion->place[0].slope = 15.0;  // to the east
  motion->place[2].middle = 300.0;
  const auto readings = measure("", motion, 200.0, 12001);
  const Navigated right = placed(*motion, 60.0, {}, frame());
  const auto off_m = [&](const Omissions& without) {
    return (integrate(placed(*motion, 0.0, {}, frame()), readings, 200.0, frame(), without).place -
            right.place)
        .norm();
  };
  EXPECT_LT(off_m({}), 1e-6);
  const double gravity = geo::gravity_world_mps2(frame(), {0.0, 0.0, 300.0}).norm();
  const double lat = frame().origin().lat_deg * std::numbers::pi / 180.0;
  // Tilted by w t, the reaction to gravity pushes aside: g w t^3 / 6, of the level part of the Earth's turning.
  const double by_earth_rate =
      gravity * geo::kEarthRate_radps * std::cos(lat) * 60.0 * 60.0 * 60.0 / 6.0;
  EXPECT_NEAR(off_m({.earth_rate = true}), by_earth_rate, 0.02 * by_earth_rate);
  // 2 w x v over t^2 / 2, of a flight to the east, which is square to the Earth's axis.
  const double by_coriolis = geo::kEarthRate_radps * 15.0 * 60.0 * 60.0;
  EXPECT_NEAR(off_m({.coriolis = true}), by_coriolis, 0.02 * by_coriolis);
  const double by_gravity = 0.5 * std::abs(gravity - 9.81) * 60.0 * 60.0;
  EXPECT_NEAR(off_m({.local_gravity = true}), by_gravity, 0.02 * by_gravity);
}

TEST_F(Imu, TellsWhereItIsAndHowItErrs) {
  const auto motion = figure_of_eight();
  const auto readings = measure(
      "[gyroscope]\nturn_on_radps = 0.01\nmarkov_radps = 0.003\n[accelerometer]\nturn_on_mps2 = "
      "0.2\nwalk_mps2_per_s_per_sqrt_hz = 0.05\n",
      motion, 50.0, 200, kMount);
  for (std::size_t k = 0; k < readings.size(); ++k) {
    const Reading& reading = readings[k];
    const Navigated right = placed(*motion, static_cast<double>(k) / 50.0, kMount, frame());
    EXPECT_LT((reading.ecef_from_sensor.translation - right.place).norm(), 5e-9);
    EXPECT_LT(reading.ecef_from_sensor.rotation.angularDistance(right.ecef_from_sensor), 1e-14);
    EXPECT_GE(reading.ecef_from_sensor.rotation.w(), 0.0);
    EXPECT_LT((reading.velocity_ecef - right.velocity).norm(), 1e-12);
    // Without noise, scales and misalignments biases are all that is wrong.
    EXPECT_LT((reading.gyro - reading.true_gyro - reading.gyro_bias).norm(), 1e-15);
    EXPECT_LT((reading.accel - reading.true_accel - reading.accel_bias).norm(), 1e-14);
  }
  EXPECT_GT(readings[0].gyro_bias.norm(), 1e-4);
  EXPECT_GT((readings[199].accel_bias - readings[0].accel_bias).norm(), 1e-3);
}

TEST_F(Imu, AtRestShowsTheGroundsReactionAndTheEarthsTurning) {
  auto motion = std::make_shared<WavyMotion>();
  motion->place[2].middle = 100.0;
  motion->yaw.middle = 0.8;
  const auto readings = measure("", motion, 10.0, 2);
  const Vector3d world_force = Eigen::AngleAxisd(0.8, Vector3d::UnitZ()) * readings[1].true_accel;
  EXPECT_LT((world_force + geo::gravity_world_mps2(frame(), {0, 0, 100.0})).norm(), 1e-14);
  EXPECT_NEAR(readings[1].true_gyro.norm(), 7.292115e-5, 1e-19);
  const double lat = frame().origin().lat_deg * std::numbers::pi / 180.0;
  EXPECT_NEAR(readings[1].true_gyro.z(), 7.292115e-5 * std::sin(lat), 1e-18);
  // Without errors it shows its truth.
  EXPECT_EQ(readings[1].gyro, readings[1].true_gyro);
  EXPECT_EQ(readings[1].accel, readings[1].true_accel);
}

TEST_F(Imu, TwoOnOneBodyDifferByItsTurning) {
  const auto motion = figure_of_eight();
  const geo::Rigid3d here{.rotation = Quaterniond::Identity(), .translation = {1.0, -2.0, 0.5}};
  const auto center = measure("", motion, 50.0, 500), beside = measure("", motion, 50.0, 500, here);
  for (std::size_t k = 0; k < center.size(); ++k) {
    const geo::MotionState body = motion->at(static_cast<double>(k) / 50.0);
    // Against the stars: the Earth turns both.
    const Quaterniond body_from_world = body.world_from_body.rotation.conjugate();
    const Vector3d earth = body_from_world * geo::earth_rate_world_radps(frame());
    const Vector3d w = body.angular_velocity_body_radps;
    const Vector3d r = here.translation;
    const Vector3d expected = body.angular_acceleration_body_radps2.cross(r) + w.cross(w.cross(r)) +
                              2.0 * earth.cross(w.cross(r));
    // Gravity differs by 3e-6 a metre of height.
    EXPECT_LT((beside[k].true_accel - center[k].true_accel - expected).norm(), 1e-5);
    EXPECT_LT((beside[k].true_gyro - center[k].true_gyro).norm(), 1e-15);
  }
}

TEST_F(Imu, FallingFreelyShowsNoForce) {
  /// Falls freely on the turning Earth, as seen in its axes.
  struct Fall : geo::Trajectory {
    const geo::WorldFrame* frame = nullptr;
    double duration_s() const override { return 1.0; }
    std::vector<double> knots_s() const override { return {0.0, 1.0}; }
    geo::MotionState at(double t) const override {
      geo::MotionState state;
      state.time_s = t;
      state.world_from_body.translation = {100.0, 50.0, 2000.0};
      state.velocity_world_mps = {3.0, -40.0, -60.0};
      state.acceleration_world_mps2 =
          geo::gravity_world_mps2(*frame, state.world_from_body.translation) -
          2.0 * geo::earth_rate_world_radps(*frame).cross(state.velocity_world_mps);
      return state;
    }
  };
  auto fall = std::make_shared<Fall>();
  fall->frame = &frame();
  EXPECT_LT(measure("", fall, 10.0, 1)[0].true_accel.norm(), 1e-14);
}

TEST_F(Imu, IntegratedSamplesAreMeansSinceTheSampleBefore) {
  const auto motion = figure_of_eight();
  const std::string keys = "sampling = \"integrated\"\n";
  const auto coarse = measure(keys, motion, 100.0, 100, kMount);
  const auto fine = measure(keys, motion, 400.0, 400, kMount);
  const auto instant = measure("", motion, 25600.0, 25600, kMount);
  for (std::size_t k = 1; k < coarse.size(); ++k) {
    Vector3d gyro = Vector3d::Zero(), accel = Vector3d::Zero();
    for (std::size_t i = 4 * k - 3; i <= 4 * k; ++i) {
      gyro += 0.25 * fine[i].true_gyro;
      accel += 0.25 * fine[i].true_accel;
    }
    EXPECT_LT((coarse[k].true_gyro - gyro).norm(), 1e-14);
    EXPECT_LT((coarse[k].true_accel - accel).norm(), 1e-13);
    // Simpson's rule over 256 steps.
    Vector3d simpson = Vector3d::Zero();
    for (std::size_t i = 0; i <= 256; ++i)
      simpson += (i == 0 || i == 256 ? 1.0
                  : i % 2 == 1       ? 4.0
                                     : 2.0) /
                 768.0 * instant[256 * (k - 1) + i].true_accel;
    EXPECT_LT((coarse[k].true_accel - simpson).norm(), 1e-12);
  }
}

TEST_F(Imu, ErrorsHaveTheAllanVarianceOfTheirParameters) {
  constexpr double kRate_hz = 20.0;
  constexpr std::size_t kCount = 20 * 7200;
  const auto rates_of = [&](const std::string& keys, bool is_gyro, int axis) {
    return errors_of(measure(keys, std::make_shared<WavyMotion>(), kRate_hz, kCount), is_gyro,
                     axis);
  };
  for (int axis = 0; axis < 3; ++axis) {
    expect_allan_line(rates_of("gyroscope = { noise_radps_per_sqrt_hz = 1.87e-4 }", true, axis),
                      kRate_hz, [](double m) { return white_allan(1.87e-4, kRate_hz, m); });
    expect_allan_line(
        rates_of("accelerometer = { walk_mps2_per_s_per_sqrt_hz = 4.33e-4 }", false, axis),
        kRate_hz, [](double m) { return walk_allan(4.33e-4, kRate_hz, m); });
  }
  // Gauss-Markov of two seconds, whose line bends.
  expect_allan_line(rates_of("gyroscope = { markov_radps = 0.01, markov_s = 2.0 }", true, 0),
                    kRate_hz, [](double m) { return markov_allan(0.01, 2.0 * kRate_hz, m); });
}

/// A bias instability B is the flat line at sqrt(2 ln 2 / pi) B; single samples are folded, 5 % below it.
TEST_F(Imu, FlickerIsAFlatLine) {
  constexpr double kRate_hz = 100.0, kBias_radps = 5e-5;
  const auto readings = measure("gyroscope = { flicker_radps = 5e-5 }",
                                std::make_shared<WavyMotion>(), kRate_hz, 100 * 1800);
  for (int axis = 0; axis < 3; ++axis)
    expect_allan_line(
        errors_of(readings, true, axis), kRate_hz,
        [](double) {
          return kBias_radps * kBias_radps * 2.0 * std::numbers::ln2 / std::numbers::pi;
        },
        0.02);
  for (const Reading& r : readings) EXPECT_LT((r.gyro - r.true_gyro - r.gyro_bias).norm(), 1e-15);
}

/// Each set of configs/sensors that has an accelerometer or gyroscopes, at ten times and along all axes: of 4 hours, as
/// the whole record asks; of one in every run.
TEST_F(Imu, ShippedSetsHaveTheAllanVarianceOfTheirNumbers) {
  const std::filesystem::path folder =
      std::filesystem::path(TERRACAST_SOURCE_DIR) / "configs" / "sensors";
  constexpr double kRate_hz = 20.0;
  const bool is_whole = std::getenv("TERRACAST_FULL") != nullptr;
  const std::size_t count = (is_whole ? 4 : 1) * 3600 * 20;
  int num_sets = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    for (const bool is_gyro : {true, false}) {
      const std::string section = is_gyro ? "gyroscope" : "accelerometer";
      const std::filesystem::path file = entry.path() / (section + ".toml");
      if (!std::filesystem::exists(file)) continue;
      SCOPED_TRACE(file.filename().string() + " of " + entry.path().filename().string());
      ++num_sets;
      std::string keys;
      double white = 0.0, walk = 0.0, markov = 0.0, markov_s = 0.0;
      for (const auto& [name, value] : toml::parse_file(file.string())) {
        const double number = value.value<double>().value();
        // A turn-on bias is constant, of which an Allan variance shows nothing.
        keys += fmt::format("{}{} = {}", keys.empty() ? "" : ", ", name.str(), number);
        if (name.str().starts_with("noise_")) white = number;
        if (name.str().starts_with("walk_")) walk = number;
        if (name.str() == "markov_s")
          markov_s = number;
        else if (name.str().starts_with("markov_"))
          markov = number;
      }
      const auto readings = measure(fmt::format("{} = {{ {} }}\n", section, keys),
                                    std::make_shared<WavyMotion>(), kRate_hz, count);
      const auto slow = [&](double m) {
        return walk_allan(walk, kRate_hz, m) +
               (markov > 0.0 ? markov_allan(markov, markov_s * kRate_hz, m) : 0.0);
      };
      for (int axis = 0; axis < 3; ++axis) {
        expect_allan_line(errors_of(readings, is_gyro, axis), kRate_hz,
                          [&](double m) { return white_allan(white, kRate_hz, m) + slow(m); });
        // White noise hides small drifts: the bias by itself.
        std::vector<double> biases;
        for (const Reading& r : readings)
          biases.push_back(is_gyro ? r.gyro_bias[axis] : r.accel_bias[axis]);
        expect_allan_line(biases, kRate_hz, slow);
      }
    }
  EXPECT_EQ(num_sets, 8);
}

TEST_F(Imu, ScalesBiasesStepsAndRangesAreWhatTheySay) {
  const auto motion = figure_of_eight();
  double sum_of_squares = 0.0;
  constexpr int kSeeds = 500;
  for (int seed = 0; seed < kSeeds; ++seed) {
    const auto readings = measure("gyroscope = { turn_on_radps = 0.02 }", motion, 10.0, 2, {},
                                  static_cast<std::uint64_t>(seed));
    EXPECT_LT((readings[0].gyro - readings[0].true_gyro - readings[1].gyro + readings[1].true_gyro)
                  .norm(),
              1e-16);
    sum_of_squares += (readings[0].gyro - readings[0].true_gyro).squaredNorm();
  }
  // 1500 squares of normal numbers, to five standard errors.
  EXPECT_NEAR(sum_of_squares / (3 * kSeeds * 0.02 * 0.02), 1.0,
              5.0 * std::sqrt(2.0 / (3 * kSeeds)));
  for (const Reading& r :
       measure("accelerometer = { step_mps2 = 0.01, range_mps2 = 9.0 }", motion, 10.0, 100))
    for (int axis = 0; axis < 3; ++axis) {
      const double limited = std::clamp(r.true_accel[axis], -9.0, 9.0);
      EXPECT_NEAR(r.accel[axis], limited, 0.005 + 1e-12);
      EXPECT_NEAR(r.accel[axis] / 0.01, std::round(r.accel[axis] / 0.01), 1e-9);
    }
  // A scale and a misalignment are one matrix for all samples: found again by least squares, exactly.
  const auto readings =
      measure("accelerometer = { scale_ppm = 500, misalignment_mrad = 2 }", motion, 10.0, 300);
  Matrix3d both = Matrix3d::Zero(), squares = Matrix3d::Zero();
  for (const Reading& r : readings) {
    both += r.accel * r.true_accel.transpose();
    squares += r.true_accel * r.true_accel.transpose();
  }
  const Matrix3d shown_from_true = both * squares.inverse();
  for (const Reading& r : readings)
    EXPECT_LT((r.accel - shown_from_true * r.true_accel).norm(), 1e-11);
  EXPECT_LT((shown_from_true - Matrix3d::Identity()).cwiseAbs().maxCoeff(), 0.01);
  EXPECT_GT((shown_from_true - Matrix3d::Identity()).norm(), 1e-4);
}

/// A recorded motion of 60 s, straight on, with a place and an attitude at each step.
/// jitter_s   by which every other time is late
std::unique_ptr<geo::RecordedMotion> recorded_motion(const geo::WorldFrame& frame, double fix_s,
                                                     std::optional<double> attitude_s,
                                                     double jitter_s = 0.0) {
  constexpr double kDuration_s = 60.0;
  const auto times_of = [jitter_s](double step_s) {
    std::vector<double> times;
    for (int i = 0; i * step_s <= kDuration_s + 1e-9; ++i)
      times.push_back(i * step_s + (i % 2 == 1 ? jitter_s : 0.0));
    return times;
  };
  const std::vector<double> times = times_of(fix_s);
  std::vector<Vector3d> places;
  for (const double time_s : times) places.emplace_back(10.0 * time_s, 0.0, 100.0);
  geo::InterpolatingSpline position(times, places, false);
  const geo::RecordedMotion::Window window{0.0, kDuration_s};
  if (!attitude_s)
    return std::make_unique<geo::RecordedMotion>(frame, position, window, std::nullopt,
                                                 geo::Attitude{});
  const std::vector<double> attitude_times = times_of(*attitude_s);
  return std::make_unique<geo::RecordedMotion>(
      frame, position, window, std::nullopt,
      geo::RotationSpline(attitude_times,
                          std::vector<Eigen::Vector4d>(attitude_times.size(), {1, 0, 0, 0})));
}

TEST(ImuOnRecordings, ThoseTooCoarseForItAreRefused) {
  const geo::WorldFrame frame({42.5, 1.5, 0.0});
  const auto check = [&](const std::string& keys, double fix_s, std::optional<double> attitude_s) {
    const auto motion = recorded_motion(frame, fix_s, attitude_s);
    const core::Choice<sensors::SensorInfo> sensor = sensor_of("imu", keys);
    dynamic_cast<const sensors::MotionCheck&>(*sensor).check_motion(*motion);
  };
  expect_error(core::ErrorKind::Config,
               {"1 fixes a second", "accelerations", "4 a second", "least_fixes_hz = 1 or less"},
               [&] { check("", 1.0, std::nullopt); });
  expect_error(
      core::ErrorKind::Config,
      {"10 attitudes a second", "turn rates", "15 a second", "least_attitudes_hz = 10 or less"},
      [&] { check("", 0.1, 0.1); });
  EXPECT_NO_THROW(check("", 0.2, std::nullopt));
  EXPECT_NO_THROW(check("", 0.2, 0.05));
  EXPECT_NO_THROW(check("least_fixes_hz = 1.0", 1.0, std::nullopt));
  EXPECT_NO_THROW(check("least_attitudes_hz = 0.0", 0.1, 5.0));
  // Every other message of a logger is late: as many come.
  for (const double jitter_s : {-0.002, 0.002}) {
    const core::Choice<sensors::SensorInfo> sensor = sensor_of("imu", "");
    EXPECT_NO_THROW(dynamic_cast<const sensors::MotionCheck&>(*sensor).check_motion(
        *recorded_motion(frame, 0.2, 0.05, jitter_s)));
  }
  // The number that a message suggests is accepted.
  for (const double fix_s : {1.0 / 1.99996, 1.0 / 3.4999, 1.0 / 3.0001, 60.0 / 7.0}) {
    const std::string message = [&] {
      try {
        check("", fix_s, std::nullopt);
      } catch (const core::Error& error) {
        return std::string(error.what());
      }
      return std::string("accepted");
    }();
    const std::string words = "least_fixes_hz = ";
    const std::size_t at = message.find(words);
    ASSERT_NE(at, std::string::npos) << message;
    const std::string number = message.substr(at + words.size(), 5);
    EXPECT_NO_THROW(
        check("least_fixes_hz = " + std::to_string(std::stod(number)), fix_s, std::nullopt))
        << message;
  }
  EXPECT_NO_THROW(check("least_fixes_hz = 200.0", 1.0 / 199.9954, std::nullopt));
  // What no recording was made of can be asked at any time.
  const core::Choice<sensors::SensorInfo> sensor = sensor_of("imu", "least_fixes_hz = 1e6");
  EXPECT_NO_THROW(
      dynamic_cast<const sensors::MotionCheck&>(*sensor).check_motion(*figure_of_eight()));
}

TEST_F(Imu, ARecordingTooCoarseForItIsRefusedWhereAFlightIsPlanned) {
  render::SequencePlan plan = test::small_plan(2, 16, 12);
  plan.motion.trajectory = recorded_motion(frame(), 1.0, std::nullopt);
  plan.sensors.push_back({.info = {}, .sensor = sensor_of("imu", "")});
  plan.sensors[0].info.rig = "mast";
  plan.sensors[0].info.name = "imu0";
  expect_error(core::ErrorKind::Config, {"mast/imu0", "1 fixes a second"},
               [&] { render::check_sensors(plan); });
  plan.sensors[0].sensor = sensor_of("imu", "least_fixes_hz = 1.0");
  EXPECT_NO_THROW(render::check_sensors(plan));
}

TEST_F(Imu, RefusesNegativeDensities) {
  expect_error(core::ErrorKind::Config, {"noise_radps_per_sqrt_hz", "-1"},
               [] { sensor_of("imu", "gyroscope = { noise_radps_per_sqrt_hz = -1 }"); });
}

/// Values of data sheets that were not converted: 0.3 degrees a square root of an hour, 20 degrees a second, 100
/// millionths of g.
TEST_F(Imu, NumbersInAnotherUnitAreNamedAsSuch) {
  expect_error(core::ErrorKind::Config,
               {"gyroscope.noise_radps_per_sqrt_hz = 0.3", "0.3 deg/sqrt(h) is 8.727e-05"},
               [] { sensor_of("imu", "gyroscope = { noise_radps_per_sqrt_hz = 0.3 }"); });
  expect_error(core::ErrorKind::Config, {"turn_on_radps = 20", "20 deg/s is 0.3491"},
               [] { sensor_of("imu", "gyroscope = { turn_on_radps = 20 }"); });
  expect_error(core::ErrorKind::Config, {"turn_on_mps2 = 20", "20 mg is 0.1961"},
               [] { sensor_of("imu", "accelerometer = { turn_on_mps2 = 20 }"); });
  expect_error(core::ErrorKind::Config, {"walk_radps_per_s_per_sqrt_hz = 10"},
               [] { sensor_of("imu", "gyroscope = { walk_radps_per_s_per_sqrt_hz = 10 }"); });
  expect_error(core::ErrorKind::Config,
               {"accelerometer.noise_mps2_per_sqrt_hz = 100", "100 ug/sqrt(Hz) is 0.0009807"},
               [] { sensor_of("imu", "accelerometer = { noise_mps2_per_sqrt_hz = 100 }"); });
}

}  // namespace
}  // namespace terracast::test
