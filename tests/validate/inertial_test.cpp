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

/// Places and angles that are sums of sines; derivatives by central differences of the sixth order.
class Motion {
 public:
  explicit Motion(std::uint64_t seed) {
    test::Draws draws(seed, "motion");
    for (auto& wave : waves_)
      wave = {draws.between(-1.0, 1.0), draws.between(0.2, 0.9), draws.between(0.0, 6.0)};
    speed_ = {draws.between(5.0, 20.0), draws.between(-5.0, 5.0), draws.between(-2.0, 2.0)};
  }

  Pose local_from_body(double t) const {
    const auto wave = [&](std::size_t i, double size) {
      return size * waves_[i][0] * std::sin(waves_[i][1] * t + waves_[i][2]);
    };
    const Matrix3d rotation =
        (AngleAxisd(wave(3, 2.0), Vector3d::UnitZ()) * AngleAxisd(wave(4, 0.3), Vector3d::UnitY()) *
         AngleAxisd(wave(5, 0.5), Vector3d::UnitX()))
            .toRotationMatrix();
    return {rotation, speed_ * t + Vector3d(wave(0, 30.0), wave(1, 20.0), 200.0 + wave(2, 5.0))};
  }

 private:
  std::array<std::array<double, 3>, 6> waves_;
  Vector3d speed_;
};

/// What the wrong dataset has instead.
struct Mistake {
  bool has_no_earth_rate = false, has_no_coriolis = false;
  double gravity = 0.0;  ///< everywhere; 0: that of the place
  bool leaves_out_arm = false;
  int late = 0;  ///< samples
  std::function<void(InertialReading&)> change = [](InertialReading&) {};
};

/// What a sensor would show, from differences of its own poses.
InertialReading truth_at(const Motion& motion, const Pose& body_from_sensor, double t,
                         const geo::WorldFrame& frame, const Mistake& mistake) {
  const auto pose = [&](double at) {
    Pose mount = body_from_sensor;
    if (mistake.leaves_out_arm) mount.translation.setZero();
    return motion.local_from_body(at) * mount;
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
  const Vector3d earth = geo::earth_rate_world_radps(frame);
  Vector3d gravity = geo::gravity_world_mps2(frame, pose(t).translation);
  if (mistake.gravity > 0.0) gravity *= mistake.gravity / gravity.norm();
  Vector3d force = acceleration - gravity;
  if (!mistake.has_no_coriolis) force += 2.0 * earth.cross(velocity);
  Vector3d rate = turn;
  if (!mistake.has_no_earth_rate) rate += rotation.transpose() * earth;
  return {rate, rotation.transpose() * force};
}

/// Validates a dataset of frames at 10 Hz over four seconds.
std::vector<CheckResult> results_of(std::uint64_t seed, double rate_hz, bool is_integrated,
                                    const Mistake& mistake) {
  const Motion motion(seed);
  const geo::WorldFrame frame(kOrigin);
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
    InertialReading reading = truth_at(motion, body_from_sensor, t, frame, mistake);
    if (is_integrated) {
      // Gauss and Legendre's rule of three points.
      InertialReading mean{Vector3d::Zero(), Vector3d::Zero()};
      for (const auto& [node, weight] : {std::pair{-std::sqrt(0.6), 5.0 / 18.0},
                                         {0.0, 8.0 / 18.0},
                                         {std::sqrt(0.6), 5.0 / 18.0}}) {
        const InertialReading at =
            truth_at(motion, body_from_sensor, t - 0.5 * (1.0 - node) / rate_hz, frame, mistake);
        mean.turn_rate_radps += weight * at.turn_rate_radps;
        mean.force_mps2 += weight * at.force_mps2;
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
      for (const CheckResult& result : results_of(seed, rate_hz, is_integrated, {})) {
        EXPECT_TRUE(result.ok) << seed << ", " << rate_hz << " Hz"
                               << (is_integrated ? ", means: " : ": ") << result.name << " "
                               << result.value << ", " << result.worst;
        EXPECT_FALSE(result.is_unseen) << seed << ", " << rate_hz << " Hz: " << result.name;
      }
  }
}

TEST(Inertial, FindsEachMistake) {
  const auto negate = [](InertialReading& r) { r.force_mps2 = -r.force_mps2; };
  const auto degrees = [](InertialReading& r) { r.turn_rate_radps *= 57.29577951308232; };
  const auto swap = [](InertialReading& r) { std::swap(r.force_mps2.x(), r.force_mps2.y()); };
  const auto swap_turns = [](InertialReading& r) {
    std::swap(r.turn_rate_radps.y(), r.turn_rate_radps.z());
  };
  const std::vector<std::pair<const char*, Mistake>> mistakes = {
      {"forces negated", {.change = negate}},
      {"9.81 everywhere", {.gravity = 9.81}},
      {"no turning of the Earth", {.has_no_earth_rate = true}},
      {"no Coriolis force", {.has_no_coriolis = true}},
      {"no lever arm", {.leaves_out_arm = true}},
      {"a sample late", {.late = 1}},
      {"a sample early", {.late = -1}},
      {"degrees", {.change = degrees}},
      {"axes of forces exchanged", {.change = swap}},
      {"axes of turning exchanged", {.change = swap_turns}}};
  for (const auto& [name, mistake] : mistakes)
    for (std::uint64_t seed = 21; seed <= 24; ++seed) {
      bool is_found = false;
      for (const CheckResult& result : results_of(seed, 200.0, seed % 2 == 0, mistake))
        is_found = is_found || !result.ok;
      EXPECT_TRUE(is_found) << name << ", " << seed;
    }
}

}  // namespace
}  // namespace terracast::validate
