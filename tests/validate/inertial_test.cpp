#include "validate/inertial.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "geo/gravity.h"
#include "tests/jobs/draws.h"
#include "tests/support/test_data.h"
#include "validate/check.h"
#include "validate/checks/checker.h"
#include "validate/dataset.h"

/// IMUs of right and wrong datasets, whose samples are written here from a motion of waves.
namespace terracast::validate {

std::unique_ptr<Checker> make_inertial_check(const ValidateOptions& options);

namespace {

using Eigen::AngleAxisd;
using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr geo::Geodetic kOrigin{.lat_deg = 46.5, .lon_deg = 8.0, .height_m = 600.0};

/// What the wrong dataset has instead.
struct Mistake {
  bool has_no_earth_rate = false, has_no_coriolis = false;
  double gravity = 0.0;  ///< everywhere; 0: that of the place
  bool leaves_out_arm = false;
  int late = 0;  ///< samples
  std::function<void(InertialReading&)> change = [](InertialReading&) {};
};

/// A motion, and what a sensor on it shows.
class AnyMotion {
 public:
  virtual ~AnyMotion() = default;
  virtual Pose local_from_body(double t) const = 0;
  virtual InertialReading truth_at(double t, const Pose& body_from_sensor,
                                   const Mistake& mistake) const = 0;
};

/// What a sensor shows where it stands, moves and turns so.
InertialReading reading_of(const Pose& local_from_sensor, const Vector3d& velocity,
                           const Vector3d& acceleration, const Vector3d& turn,
                           const Mistake& mistake) {
  const geo::WorldFrame frame(kOrigin);
  const Vector3d earth = geo::earth_rate_world_radps(frame);
  Vector3d gravity = geo::gravity_world_mps2(frame, local_from_sensor.translation);
  if (mistake.gravity > 0.0) gravity *= mistake.gravity / gravity.norm();
  Vector3d force = acceleration - gravity;
  if (!mistake.has_no_coriolis) force += 2.0 * earth.cross(velocity);
  Vector3d rate = turn;
  if (!mistake.has_no_earth_rate) rate += local_from_sensor.rotation.transpose() * earth;
  return {rate, local_from_sensor.rotation.transpose() * force};
}

/// Places and angles that are sums of sines; derivatives by central differences of the eighth order.
class Motion : public AnyMotion {
 public:
  explicit Motion(std::uint64_t seed) {
    test::Draws draws(seed, "motion");
    for (auto& wave : waves_)
      wave = {draws.between(-1.0, 1.0), draws.between(0.2, 0.9), draws.between(0.0, 6.0)};
    speed_ = {draws.between(5.0, 20.0), draws.between(-5.0, 5.0), draws.between(-2.0, 2.0)};
  }

  Pose local_from_body(double t) const override {
    const auto wave = [&](std::size_t i, double size) {
      return size * waves_[i][0] * std::sin(waves_[i][1] * t + waves_[i][2]);
    };
    const Matrix3d rotation =
        (AngleAxisd(wave(3, 2.0), Vector3d::UnitZ()) * AngleAxisd(wave(4, 0.3), Vector3d::UnitY()) *
         AngleAxisd(wave(5, 0.5), Vector3d::UnitX()))
            .toRotationMatrix();
    return {rotation, speed_ * t + Vector3d(wave(0, 30.0), wave(1, 20.0), 200.0 + wave(2, 5.0))};
  }

  InertialReading truth_at(double t, const Pose& body_from_sensor,
                           const Mistake& mistake) const override {
    const auto pose = [&](double at) {
      Pose mount = body_from_sensor;
      if (mistake.leaves_out_arm) mount.translation.setZero();
      return local_from_body(at) * mount;
    };
    constexpr double kStep_s = 0.02;
    const auto place = [&](int k) { return pose(t + k * kStep_s).translation; };
    // Of waves below 1 rad/s the eighth order leaves 1e-11 of speeds and 1e-9 m/s^2.
    const Vector3d velocity =
        ((place(1) - place(-1)) * (4.0 / 5.0) - (place(2) - place(-2)) / 5.0 +
         (place(3) - place(-3)) * (4.0 / 105.0) - (place(4) - place(-4)) / 280.0) /
        kStep_s;
    const Vector3d acceleration =
        (-(205.0 / 72.0) * place(0) + (8.0 / 5.0) * (place(1) + place(-1)) -
         (1.0 / 5.0) * (place(2) + place(-2)) + (8.0 / 315.0) * (place(3) + place(-3)) -
         (1.0 / 560.0) * (place(4) + place(-4))) /
        (kStep_s * kStep_s);
    const Matrix3d rotation = pose(t).rotation;
    Matrix3d slope = Matrix3d::Zero();
    const auto turned = [&](int k) { return pose(t + k * kStep_s).rotation; };
    slope = ((turned(1) - turned(-1)) * (4.0 / 5.0) - (turned(2) - turned(-2)) / 5.0 +
             (turned(3) - turned(-3)) * (4.0 / 105.0) - (turned(4) - turned(-4)) / 280.0) /
            kStep_s;
    const Matrix3d cross = rotation.transpose() * slope;
    const Vector3d turn(cross(2, 1), cross(0, 2), cross(1, 0));
    return reading_of(pose(t), velocity, acceleration, turn, mistake);
  }

 private:
  std::array<std::array<double, 3>, 6> waves_;
  Vector3d speed_;
};

/// A flight about the vertical whose jerk and angular acceleration jump at knots, wherever they fall among the samples:
/// turn rates and forces bend there, and forces on an arm jump.
class KinkedMotion : public AnyMotion {
 public:
  KinkedMotion(std::uint64_t seed, int num_knots) {
    test::Draws draws(seed, "knots");
    for (int i = 0; i < num_knots; ++i)
      knots_.push_back({draws.between(0.2, 3.8), draws.both_ways(0.3), draws.both_ways(0.5)});
  }

  Pose local_from_body(double t) const override {
    const State state = at(t);
    return {AngleAxisd(state.yaw[0], Vector3d::UnitZ()).toRotationMatrix(), state.place[0]};
  }
  InertialReading truth_at(double t, const Pose& body_from_sensor,
                           const Mistake& mistake) const override {
    const State state = at(t);
    const Pose pose = local_from_body(t) * body_from_sensor;
    const Vector3d arm = pose.translation - state.place[0];
    const Vector3d turn = state.yaw[1] * Vector3d::UnitZ();
    return reading_of(
        pose, state.place[1] + turn.cross(arm),
        state.place[2] + state.yaw[2] * Vector3d::UnitZ().cross(arm) + turn.cross(turn.cross(arm)),
        pose.rotation.transpose() * turn, mistake);
  }

 private:
  /// With two derivatives.
  struct State {
    std::array<double, 3> yaw;
    std::array<Vector3d, 3> place;
  };
  struct Knot {
    double time_s, angular_acceleration, jerk;
  };
  State at(double t) const {
    State state{{0.3 + 0.2 * t, 0.2, 0.0},
                {Vector3d(12.0 * t, 3.0, 150.0), Vector3d(12.0, 0.0, 0.0), Vector3d::Zero()}};
    for (const Knot& knot : knots_) {
      const double s = std::max(t - knot.time_s, 0.0);
      state.yaw[0] += 0.5 * knot.angular_acceleration * s * s;
      state.yaw[1] += knot.angular_acceleration * s;
      state.yaw[2] += t > knot.time_s ? knot.angular_acceleration : 0.0;
      const Vector3d axis(0.3, -1.0, 0.5);
      state.place[0] += knot.jerk * s * s * s / 6.0 * axis;
      state.place[1] += knot.jerk * s * s / 2.0 * axis;
      state.place[2] += knot.jerk * s * axis;
    }
    return state;
  }
  std::vector<Knot> knots_;
};

/// Validates a dataset of frames at 10 Hz over four seconds.
std::vector<CheckResult> results_of(const AnyMotion& motion, double rate_hz, bool is_integrated,
                                    const Mistake& mistake = {}) {
  const Pose body_from_sensor{
      AngleAxisd(0.7, Vector3d(1.0, -2.0, 0.5).normalized()).toRotationMatrix(), {0.5, -0.2, 0.3}};
  const test::ScratchFolder folder;
  std::string text = "time_s";
  std::string channels;
  for (const char* what : {"", "true_"})
    for (const auto& [name, end, unit] :
         {std::array{"gyro_", "_radps", "rad/s"}, std::array{"accel_", "_mps2", "m/s^2"}})
      for (const char* axis : {"x", "y", "z"}) {
        text += fmt::format(",{}{}{}{}", what, name, axis, end);
        channels += fmt::format(R"({}{{"name": "{}{}{}{}", "unit": "{}"}})",
                                channels.empty() ? "" : ", ", what, name, axis, end, unit);
      }
  text += "\n";
  const int count = static_cast<int>(4.1 * rate_hz);
  for (int k = 0; k < count; ++k) {
    const double t = (k - mistake.late) / rate_hz;
    InertialReading reading = motion.truth_at(t, body_from_sensor, mistake);
    if (is_integrated) {
      // Gauss and Legendre's rule of three points, in parts so short that a kink in one leaves 1e-8 of it.
      constexpr int kParts = 40;
      InertialReading mean{Vector3d::Zero(), Vector3d::Zero()};
      for (int part = 0; part < kParts; ++part)
        for (const auto& [node, weight] : {std::pair{-std::sqrt(0.6), 5.0 / 18.0},
                                           {0.0, 8.0 / 18.0},
                                           {std::sqrt(0.6), 5.0 / 18.0}}) {
          const double share = (part + 0.5 * (1.0 + node)) / kParts;
          const InertialReading at =
              motion.truth_at(t - (1.0 - share) / rate_hz, body_from_sensor, mistake);
          mean.turn_rate_radps += weight / kParts * at.turn_rate_radps;
          mean.force_mps2 += weight / kParts * at.force_mps2;
        }
      reading = mean;
    }
    mistake.change(reading);
    text += fmt::format("{:.17g},0,0,0,0,0,0", k / rate_hz);
    for (const Vector3d& three : {reading.turn_rate_radps, reading.force_mps2})
      text += fmt::format(",{:.17g},{:.17g},{:.17g}", three.x(), three.y(), three.z());
    text += "\n";
  }
  const auto mount = [](const Pose& pose) {
    const Eigen::Quaterniond q(pose.rotation);
    return fmt::format(
        R"({{"quaternion_wxyz": [{:.17g}, {:.17g}, {:.17g}, {:.17g}], "translation_m": [{:.17g}, {:.17g}, {:.17g}]}})",
        q.w(), q.x(), q.y(), q.z(), pose.translation.x(), pose.translation.y(),
        pose.translation.z());
  };
  test::write_text(folder.path() / "P000/sensors/rig/imu.csv", text);
  test::write_text(
      folder.path() / "P000/sensors.json",
      fmt::format(
          R"({{"frames": "body, rig and sensor: x forward, y left, z up", "sensors": [{{"rig": "rig",
"name": "imu", "kind": "imu", "file": "sensors/rig/imu.csv", "rate_hz": {}, "channels": [{}],
"body_from_sensor": {}, "rig_from_sensor": {}, "settings_toml": "sampling = \"{}\"\n"}}]}})",
          rate_hz, channels, mount(body_from_sensor), mount(body_from_sensor),
          is_integrated ? "integrated" : "instant"));
  Dataset dataset;
  dataset.format = "terracast";
  dataset.root = folder.path();
  dataset.files["P000/sensors.json"] = {};
  dataset.files["P000/sensors/rig/imu.csv"] = {};
  Sequence sequence;
  sequence.path = "P000";
  sequence.num_frames = 40;
  sequence.rate_hz = 10.0;
  sequence.origin = {kOrigin.lat_deg, kOrigin.lon_deg, kOrigin.height_m};
  Camera& camera = sequence.cameras.emplace_back();
  camera.body_from_camera = Pose{Matrix3d::Identity(), Vector3d::Zero()};
  for (int i = 0; i < sequence.num_frames; ++i)
    camera.local_from_camera.emplace_back(motion.local_from_body(i / sequence.rate_hz));
  return make_inertial_check({})->finish(dataset, sequence);
}

TEST(InertialNavigation, GravityIsThatOfTheClosedForm) {
  test::Draws draws(3, "places");
  for (int i = 0; i < 1000; ++i) {
    const geo::WorldFrame frame(
        {draws.both_ways(90.0), draws.both_ways(180.0), draws.between(-400.0, 5e4)});
    const Vector3d ecef = frame.ecef_from_world().translation;
    const Vector3d expected =
        frame.ecef_from_world().rotation * geo::gravity_world_mps2(frame, Vector3d::Zero());
    EXPECT_LT((normal_gravity_ecef_mps2(ecef) - expected).norm(), 1e-11);
  }
}

TEST(Inertial, HoldsOfRightDatasets) {
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    test::Draws draws(seed, "rate");
    const double rate_hz = draws.among({50.0, 100.0, 123.0, 200.0, 400.0});
    for (const bool is_integrated : {false, true})
      for (const CheckResult& result : results_of(Motion(seed), rate_hz, is_integrated)) {
        EXPECT_TRUE(result.ok) << seed << ", " << rate_hz << " Hz"
                               << (is_integrated ? ", means: " : ": ") << result.name << " "
                               << result.value << ", " << result.worst;
        EXPECT_FALSE(result.is_unseen) << seed << ", " << rate_hz << " Hz: " << result.name;
      }
  }
}

TEST(Inertial, HoldsWhereMotionsHaveKnots) {
  for (const int num_knots : {1, 2, 4, 8})
    for (std::uint64_t seed = 1; seed <= 25; ++seed) {
      test::Draws draws(seed, "rate");
      const double rate_hz = draws.among({50.0, 100.0, 200.0});
      for (const CheckResult& result :
           results_of(KinkedMotion(seed, num_knots), rate_hz, seed % 5 == 0))
        EXPECT_TRUE(result.ok) << num_knots << " knots, " << seed << ", " << rate_hz
                               << " Hz: " << result.name << " " << result.value << ", "
                               << result.worst;
    }
}

TEST(Inertial, FindsEachMistake) {
  constexpr const char* kPosition = "inertial_position";
  constexpr const char* kRotation = "inertial_rotation";
  struct Row {
    const char* name;
    const char* result;
    Mistake mistake;
  };
  Mistake negated, in_degrees, swapped, turns_swapped, standard, earth, coriolis, arm, late, early;
  negated.change = [](InertialReading& r) { r.force_mps2 = -r.force_mps2; };
  in_degrees.change = [](InertialReading& r) { r.turn_rate_radps *= 57.29577951308232; };
  swapped.change = [](InertialReading& r) { std::swap(r.force_mps2.x(), r.force_mps2.y()); };
  turns_swapped.change = [](InertialReading& r) {
    std::swap(r.turn_rate_radps.y(), r.turn_rate_radps.z());
  };
  standard.gravity = 9.81;
  earth.has_no_earth_rate = true;
  coriolis.has_no_coriolis = true;
  arm.leaves_out_arm = true;
  late.late = 1;
  early.late = -1;
  const std::vector<Row> rows = {{"forces negated", kPosition, negated},
                                 {"9.81 everywhere", kPosition, standard},
                                 {"no turning of the Earth", kRotation, earth},
                                 {"no Coriolis force", kPosition, coriolis},
                                 {"no lever arm", kPosition, arm},
                                 {"a sample late", kRotation, late},
                                 {"a sample early", kRotation, early},
                                 {"degrees", kRotation, in_degrees},
                                 {"axes of forces exchanged", kPosition, swapped},
                                 {"axes of turning exchanged", kRotation, turns_swapped}};
  for (const Row& row : rows)
    for (std::uint64_t seed = 21; seed <= 24; ++seed)
      for (const double rate_hz : {100.0, 200.0}) {
        bool is_found = false;
        for (const CheckResult& result :
             results_of(Motion(seed), rate_hz, seed % 2 == 0, row.mistake))
          is_found = is_found || (result.name == row.result && !result.ok);
        EXPECT_TRUE(is_found) << row.name << ", " << seed << ", " << rate_hz << " Hz";
      }
}

}  // namespace
}  // namespace terracast::validate
