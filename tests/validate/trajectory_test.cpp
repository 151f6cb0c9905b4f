#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "tests/jobs/draws.h"
#include "validate/checks/checker.h"

/// The check of poses as such, on paths of few frames.
namespace terracast::validate {
namespace {

Eigen::Matrix3d yawed(double angle_deg) {
  return Eigen::AngleAxisd(radians_from_degrees(angle_deg), Eigen::Vector3d::UnitZ())
      .toRotationMatrix();
}

/// A flight of 30 m/s at 0.1 Hz: legs of 300 m and turns by 90 deg, each on a quarter of a circle
/// from one frame to the next.
std::vector<Pose> slow_frames() {
  std::vector<Pose> poses;
  Eigen::Vector3d place(0.0, 0.0, 500.0);
  double heading_deg = 20.0;
  for (const double turn_deg : {0.0, 0.0, 90.0, 0.0, 0.0, -90.0, 0.0, 0.0, 90.0, 90.0, 0.0}) {
    poses.push_back({yawed(heading_deg), place});
    const double half_rad = radians_from_degrees(0.5 * turn_deg);
    const double chord_m = half_rad == 0.0 ? 300.0 : 300.0 * std::sin(half_rad) / half_rad;
    place += yawed(heading_deg + 0.5 * turn_deg) * Eigen::Vector3d(chord_m, 0.0, 5.0);
    heading_deg += turn_deg;
  }
  return poses;
}

std::map<std::string, CheckResult> check(const std::vector<Pose>& poses) {
  Sequence sequence;
  Camera camera;
  camera.name = "cam0";
  camera.local_from_camera.assign(poses.begin(), poses.end());
  sequence.cameras.push_back(camera);
  std::map<std::string, CheckResult> results;
  for (const CheckInfo& info : checks())
    if (info.name == "trajectory")
      for (const CheckResult& result : info.make({})->finish({}, sequence))
        results[result.name] = result;
  return results;
}

TEST(ValidateTrajectory, FramesFarApartAreRight) {
  for (const auto& [name, result] : check(slow_frames()))
    EXPECT_TRUE(result.ok) << name << " = " << result.value << " at " << result.worst;
}

/// A camera that turns as it flies straight on keeps its step in the world, not in its own axes.
TEST(ValidateTrajectory, ACameraThatLooksAboutIsRight) {
  std::vector<Pose> poses;
  for (int i = 0; i < 8; ++i) poses.push_back({yawed(i % 2 == 0 ? 0.0 : 80.0), {30.0 * i, 0, 0}});
  for (const auto& [name, result] : check(poses))
    EXPECT_TRUE(result.ok) << name << " = " << result.value << " at " << result.worst;
}

/// It hovers, starts and stops within two frames, and turns on the spot: steps of 0 beside steps of 5 m.
TEST(ValidateTrajectory, AFlightThatStartsAndStopsIsRight) {
  int num_seen = 0;
  for (std::uint64_t seed = 1; seed <= 20000; ++seed) {
    test::Draws draws(seed, "path");
    std::vector<Pose> poses;
    Eigen::Vector3d place(0.0, 0.0, 50.0);
    double heading_deg = 0.0, speed_m = 0.0, wanted_m = 0.0;
    const int num_frames = 5 + draws.below(20);
    for (int i = 0; i < num_frames; ++i) {
      poses.push_back({yawed(heading_deg), place});
      if (draws.chance(0.4)) wanted_m = draws.among({0.0, 0.0, 2.0, 5.0});
      speed_m += std::clamp(wanted_m - speed_m, -2.5, 2.5);
      if (speed_m == 0.0) heading_deg += draws.both_ways(40.0);
      place += yawed(heading_deg) * Eigen::Vector3d(speed_m, 0.0, 0.0);
    }
    const CheckResult result = check(poses).at("trajectory_jumps");
    EXPECT_TRUE(result.ok) << seed << ": " << result.value << " at " << result.worst;
    num_seen += result.is_unseen ? 0 : 1;
  }
  EXPECT_GT(num_seen, 10000);
}

TEST(ValidateTrajectory, ALongHoverAndOneStartIsRight) {
  std::vector<Pose> poses;
  for (int i = 0; i < 12; ++i) poses.push_back({yawed(0.0), {3.0 * std::max(i - 7, 0), 0.0, 50.0}});
  EXPECT_TRUE(check(poses).at("trajectory_jumps").ok);
}

/// On an unsteady path a duplicated row does not stand out: the result is unseen, not right.
TEST(ValidateTrajectory, WhereNothingIsSteadyAWrongRowIsUnseen) {
  std::vector<Pose> poses;
  double x_m = 0.0;
  for (const double step_m : {0.0, 5.0, 0.0, 0.0, 5.0, 5.0, 0.0, 5.0, 0.0, 0.0, 5.0, 0.0}) {
    poses.push_back({yawed(0.0), {x_m, 0.0, 50.0}});
    x_m += step_m;
  }
  poses[6] = poses[3];
  EXPECT_TRUE(check(poses).at("trajectory_jumps").is_unseen);
}

/// A logger at rest: positions with a centimetre of noise.
TEST(ValidateTrajectory, ANoisyHoverIsRight) {
  for (std::uint64_t seed = 1; seed <= 20000; ++seed) {
    test::Draws draws(seed, "hover");
    std::vector<Pose> poses;
    const int num_frames = 5 + draws.below(6);
    const auto scatter_m = [&] {
      double sum = 0.0;
      for (int i = 0; i < 12; ++i) sum += draws.unit() - 0.5;  // of variance 1, nearly normal
      return 0.01 * sum;
    };
    for (int i = 0; i < num_frames; ++i)
      poses.push_back({yawed(0.0), {scatter_m(), scatter_m(), 50.0 + scatter_m()}});
    const CheckResult result = check(poses).at("trajectory_jumps");
    EXPECT_TRUE(result.ok) << seed << ": " << result.value << " at " << result.worst;
  }
}

TEST(ValidateTrajectory, ALeapIsFound) {
  for (const std::size_t at : {2U, 5U, 9U}) {
    std::vector<Pose> poses = slow_frames();
    for (std::size_t i = at; i < poses.size(); ++i) poses[i].translation.x() += 5000.0;
    const CheckResult result = check(poses).at("trajectory_jumps");
    EXPECT_FALSE(result.ok) << at;
    EXPECT_NE(result.worst.find(fmt::format("frame {}", at)), std::string::npos) << result.worst;
  }
}

TEST(ValidateTrajectory, ARowThatStandsTwiceOrTwoSwappedAreFound) {
  const std::vector<Pose> right = slow_frames();
  for (std::size_t i = 1; i + 2 < right.size(); ++i) {
    std::vector<Pose> twice = right;
    twice[i] = twice[i - 1];
    EXPECT_FALSE(check(twice).at("trajectory_jumps").ok) << "row " << i;
    std::vector<Pose> swapped = right;
    std::swap(swapped[i], swapped[i + 1]);
    EXPECT_FALSE(check(swapped).at("trajectory_jumps").ok) << "row " << i;
  }
}

/// Of a body whose speed changes by a tenth from frame to frame.
TEST(ValidateTrajectory, ARowThatStandsTwiceIsFoundOfTenFramesAndMore) {
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    test::Draws draws(seed, "twice");
    std::vector<Pose> poses;
    Eigen::Vector3d place(0.0, 0.0, 50.0);
    double step_m = draws.log_between(0.01, 100.0);
    const double turn_deg = draws.both_ways(20.0);
    const int num_frames = 10 + draws.below(15);
    for (int i = 0; i < num_frames; ++i) {
      poses.push_back({yawed(turn_deg * i), place});
      step_m *= draws.between(0.95, 1.05);
      place += yawed(turn_deg * (i + 0.5)) * Eigen::Vector3d(step_m, 0.0, 0.1 * step_m);
    }
    EXPECT_TRUE(check(poses).at("trajectory_jumps").ok) << seed;
    const auto row = static_cast<std::size_t>(1 + draws.below(num_frames - 2));
    poses[row] = poses[row - 1];
    EXPECT_FALSE(check(poses).at("trajectory_jumps").ok)
        << seed << ", row " << row << " of " << num_frames;
  }
}

TEST(ValidateTrajectory, AnAxisFlippedInOneRowIsFound) {
  const std::vector<Pose> right = slow_frames();
  for (const std::size_t i : {1U, 4U, 7U})
    for (const int axis : {0, 1, 2}) {
      std::vector<Pose> flipped = right;
      flipped[i].rotation = flipped[i].rotation *
                            Eigen::AngleAxisd(kPi, Eigen::Vector3d::Unit(axis)).toRotationMatrix();
      EXPECT_FALSE(check(flipped).at("trajectory_turns").ok) << "row " << i;
    }
}

}  // namespace
}  // namespace terracast::validate
