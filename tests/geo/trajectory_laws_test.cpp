// What holds for every kind of trajectory.

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <fstream>
#include <map>
#include <numbers>
#include <thread>

#include "core/schema_writer.h"
#include "tests/geo/trajectory_support.h"
#include "tests/support/test_data.h"

namespace terracast::geo {
namespace {

using test::GroundWorld;

/// A weaving climb, a fix a second.
void write_recording(const std::filesystem::path& file) {
  std::ofstream csv(file);
  csv << "time_s,x_m,y_m,z_m\n";
  for (int t = 0; t <= 30; ++t)
    csv << t << ',' << 18.0 * t << ',' << 60.0 * std::sin(t / 6.0) << ','
        << 25.0 * std::sin(t / 9.0) << '\n';
}

/// A lively example of each kind: turns, climbs, changes of speed.
std::string example_of(const std::string& kind, const std::filesystem::path& folder) {
  write_recording(folder / "flight.csv");
  const std::string recorded = fmt::format(R"(
kind = "recorded"
file = "{}"
format = "csv"
frame = "local"
place_columns = ["x_m", "y_m", "z_m"]
origin = {{ lat_deg = 42.51, lon_deg = 1.52, height_m = 120.0 }}
sigma_m = 0.02
)",
                                           (folder / "flight.csv").string());
  const std::map<std::string, std::string> examples = {{"explore", R"(
kind = "explore"
area = [
  { lat_deg = 42.50, lon_deg = 1.50 },
  { lat_deg = 42.50, lon_deg = 1.53 },
  { lat_deg = 42.52, lon_deg = 1.53 },
  { lat_deg = 42.52, lon_deg = 1.50 },
]
num_legs = 5
seed = 3
)"},
                                                       {"survey", R"(
kind = "survey"
area = [
  { lat_deg = 42.510, lon_deg = 1.520 },
  { lat_deg = 42.510, lon_deg = 1.522 },
  { lat_deg = 42.512, lon_deg = 1.523 },
]
heading_deg = 15.0
height_m = 100.0
overlap = 0.98
)"},
                                                       {"forward", R"(
kind = "forward"
start = { lat_deg = 42.51, lon_deg = 1.52, height_m = 80.0 }
heading_deg = 30.0
climb_m = 40.0
length_m = 400.0
)"},
                                                       {"loop", R"(
kind = "loop"
start = { east_m = 9000.0, north_m = -4000.0, height_m = 120.0 }
heading_deg = 250.0
length_m = 500.0
width_m = 260.0
height_change_m = 45.0
direction = "right"
)"},
                                                       {"orbit", R"(
kind = "orbit"
centre = { lat_deg = 42.45, lon_deg = 1.58, height_m = 1200.0, above = "ellipsoid" }
radius_m = 150.0
speed_mps = 18.0
)"},
                                                       {"recorded", recorded},
                                                       {"waypoints", R"(
kind = "waypoints"
speed_mps = 20.0
waypoints = [
  { lat_deg = 42.50, lon_deg = 1.50, height_m = 100.0 },
  { lat_deg = 42.503, lon_deg = 1.502, height_m = 160.0, speed_mps = 30.0 },
  { lat_deg = 42.5035, lon_deg = 1.508, height_m = 130.0 },
  { east_m = 900.0, north_m = 200.0, height_m = 1300.0, above = "ellipsoid", speed_mps = 12.0 },
  { east_m = 1500.0, north_m = -100.0, height_m = 200.0 },
]
)"}};
  const auto found = examples.find(kind);
  if (found == examples.end()) {
    ADD_FAILURE() << "the kind " << kind << " has no example here";
    return "";
  }
  return found->second;
}

class TrajectoryLaws : public testing::TestWithParam<std::string> {
 protected:
  terracast::test::ScratchFolder scratch_;
  GroundWorld world_;
  TrajectoryOptions options_ = test::options_from(example_of(GetParam(), scratch_.path()));
  std::unique_ptr<Trajectory> motion_ = options_.kind_options().build(world_.context());
};

Eigen::Vector3d rotation_between(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b) {
  const Eigen::AngleAxisd turn(a.conjugate() * b);
  return turn.angle() * turn.axis();
}

TEST_P(TrajectoryLaws, VelocitiesAreTheDerivativesOfThePose) {
  constexpr double kStep_s = 1e-3;
  const int count = 400;
  for (int i = 0; i < count; ++i) {
    const double time_s = kStep_s + (motion_->duration_s() - 2 * kStep_s) * (i + 0.37) / count;
    const BodyState before = motion_->at(time_s - kStep_s);
    const BodyState state = motion_->at(time_s);
    const BodyState after = motion_->at(time_s + kStep_s);
    const Eigen::Vector3d velocity =
        (after.world_from_body.translation - before.world_from_body.translation) / (2 * kStep_s);
    // Third derivatives of some 10 m/s^3 times step^2 / 6, and 1e-10 m of rounding over the step.
    ASSERT_LT((state.velocity_world_mps - velocity).norm(), 1e-5) << time_s;
    const Eigen::Vector3d acceleration =
        (after.velocity_world_mps - before.velocity_world_mps) / (2 * kStep_s);
    // Where pieces of a spline meet the third derivative jumps by some 10 m/s^3: a quarter of it
    // times the step.
    ASSERT_LT((state.acceleration_world_mps2 - acceleration).norm(), 5e-3) << time_s;
    // Half from each side, so that the body axes are those in the middle.
    const Eigen::Quaterniond& middle = state.world_from_body.rotation;
    const Eigen::Vector3d turning = (rotation_between(middle, after.world_from_body.rotation) -
                                     rotation_between(middle, before.world_from_body.rotation)) /
                                    (2 * kStep_s);
    // Where pieces of a spline meet the third derivative jumps, and with it the turn's own rate.
    ASSERT_LT((state.angular_velocity_body_radps - turning).norm(), 2e-5) << time_s;
    ASSERT_NEAR(state.world_from_body.rotation.norm(), 1.0, 1e-15);
    ASSERT_EQ(state.time_s, time_s);
  }
}

TEST_P(TrajectoryLaws, PositionsAreTwiceContinuouslyDifferentiable) {
  // A jump in acceleration would stay while the step shrinks; a bounded third derivative gives
  // differences that shrink with it.
  const auto largest_jump = [&](double step_s) {
    const auto velocity = [&](double t) { return motion_->at(t).velocity_world_mps; };
    double jump = 0.0;
    Eigen::Vector3d before = Eigen::Vector3d::Zero();
    const int count = static_cast<int>(motion_->duration_s() / step_s);
    for (int i = 0; i + 1 < count; ++i) {
      const Eigen::Vector3d acceleration =
          (velocity((i + 1) * step_s) - velocity(i * step_s)) / step_s;
      if (i > 0) jump = std::max(jump, (acceleration - before).norm());
      before = acceleration;
    }
    return jump;
  };
  const double coarse = largest_jump(0.05);
  const double fine = largest_jump(0.005);
  EXPECT_LT(fine, 0.15 * coarse + 1e-6);
}

TEST_P(TrajectoryLaws, TheBodyLooksAheadWithItsWingsLevelledByGravity) {
  for (int i = 0; i <= 100; ++i) {
    const BodyState state = motion_->at(motion_->duration_s() * i / 100);
    const Eigen::Matrix3d axes = state.world_from_body.rotation.toRotationMatrix();
    ASSERT_LT((axes.col(0) - state.velocity_world_mps.normalized()).norm(), 1e-12);
    const Eigen::Vector3d up = world_.frame.up_world(state.world_from_body.translation);
    ASSERT_GT(axes.col(2).dot(up), 0.5);
    ASSERT_LE(std::abs(test::roll_rad(world_, state)), 30.0 * std::numbers::pi / 180 + 1e-12);
  }
}

TEST_P(TrajectoryLaws, BuildingAgainAndManyThreadsGiveTheSameBits) {
  const auto again = options_.kind_options().clone()->build(world_.context());
  ASSERT_EQ(again->duration_s(), motion_->duration_s());
  std::vector<std::vector<BodyState>> results(3);
  {
    std::vector<std::jthread> threads;
    for (auto& result : results) {
      threads.emplace_back([&, this] {
        for (int i = 0; i < 200; ++i) result.push_back(again->at(again->duration_s() * i / 199));
      });
    }
  }
  for (int i = 0; i < 200; ++i) {
    const BodyState state = motion_->at(motion_->duration_s() * i / 199);
    for (const auto& result : results) {
      ASSERT_EQ(result[i].world_from_body, state.world_from_body);
      ASSERT_EQ(result[i].velocity_world_mps, state.velocity_world_mps);
      ASSERT_EQ(result[i].acceleration_world_mps2, state.acceleration_world_mps2);
      ASSERT_EQ(result[i].angular_velocity_body_radps, state.angular_velocity_body_radps);
    }
  }
}

TEST_P(TrajectoryLaws, OptionsReadBackFromTheirOwnText) {
  const std::string text = core::toml_text(options_);
  EXPECT_EQ(text.find("nan"), std::string::npos) << text;
  const TrajectoryOptions again = test::options_from(text);
  EXPECT_EQ(core::toml_text(again), text);
  const auto motion = again.kind_options().build(world_.context());
  EXPECT_EQ(motion->at(1.0).world_from_body, motion_->at(1.0).world_from_body);
}

TEST_P(TrajectoryLaws, PathsUnderGroundOrOutsideTheWorldAreRefused) {
  GroundWorld high = world_;
  // Places above ground would rise with it, so it rises only after they were looked up.
  int calls = 0;
  high.ground = [&](double lat_deg, double lon_deg) {
    return std::optional(++calls > 60 ? 5000.0 : *world_.ground(lat_deg, lon_deg));
  };
  // A kind that lays its path out over the ground may fly over the new one; then it keeps clear of it.
  try {
    const auto motion = options_.kind_options().build(high.context());
    for (int i = 0; i <= 1000; ++i) {
      const BodyState state = motion->at(motion->duration_s() * i / 1000);
      ASSERT_GE(test::agl_m(high, state.world_from_body.translation), 5.0 - 0.01);
    }
  } catch (const core::Error& error) {
    EXPECT_EQ(error.kind(), core::ErrorKind::Input);
    const std::string low = error.what();
    EXPECT_NE(low.find("below the ground at t = "), std::string::npos) << low;
    EXPECT_NE(low.find("lat 42."), std::string::npos) << low;
    EXPECT_NE(low.find("raise "), std::string::npos) << low;
  }

  GroundWorld small = world_;
  calls = 0;
  small.ground = [&](double lat_deg, double lon_deg) {
    return ++calls > 60 ? std::nullopt : world_.ground(lat_deg, lon_deg);
  };
  const std::string outside = test::message_of(
      core::ErrorKind::Input, [&] { options_.kind_options().build(small.context()); });
  EXPECT_NE(outside.find("leaves the world"), std::string::npos) << outside;
}

std::vector<std::string> kind_names() {
  std::vector<std::string> names;
  for (const TrajectoryKindInfo& info : trajectory_kinds()) names.emplace_back(info.name);
  return names;
}

INSTANTIATE_TEST_SUITE_P(AllKinds, TrajectoryLaws, testing::ValuesIn(kind_names()),
                         [](const auto& kind) { return kind.param; });

}  // namespace
}  // namespace terracast::geo
