#include "rigs/rig_errors.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include "capture/clock.h"
#include "capture/frame_reader.h"
#include "core/error.h"
#include "geo/frames.h"
#include "geo/units.h"
#include "render/checked_plan.h"
#include "tests/support/hills_flight.h"
#include "tests/support/test_data.h"

namespace terracast::rigs {
namespace {

using capture::CameraCalibration;
using Eigen::Vector3d;

constexpr int kSeeds = 2000;

/// A rig whose only camera is turned by yaw, pitch and roll.
RigOptions turned_rig(const std::vector<double>& euler_deg) {
  RigOptions rig;
  rig.name = "rig";
  rig.cameras = {test::camera_options("cam", 64, 48, 50.0)};
  rig.cameras[0].euler_deg = euler_deg;
  rig.cameras[0].offset_mm = {100.0, 20.0, -30.0};
  return rig;
}

CameraCalibration draw(const RigOptions& rig, std::int64_t seed,
                       const std::string& sequence = "P000") {
  return draw_true_rigs({rig}, build_cameras({rig}), seed, sequence).cameras.at(0);
}

/// Azimuth, pitch (down) and roll of a camera by where its axis and its image's right and upper edge point
/// in the rig; deg.
Vector3d angles_deg(const CameraCalibration& camera) {
  const Vector3d axis = camera.rig_from_camera.rotation * Vector3d::UnitZ();
  const Vector3d left = camera.rig_from_camera.rotation * -Vector3d::UnitX();
  const Vector3d up = camera.rig_from_camera.rotation * -Vector3d::UnitY();
  return {geo::degrees_from_radians(std::atan2(axis.y(), axis.x())),
          geo::degrees_from_radians(-std::asin(axis.z())),
          geo::degrees_from_radians(std::atan2(left.z(), up.z()))};
}

/// Standard normal deviates: a mean of 0 and a variance of 1 within four standard deviations, which one of
/// 16 000 such sets exceeds (of the variance: N times it is chi-squared of N degrees of freedom).
void expect_standard_normal(const std::vector<double>& deviates, const std::string& what) {
  const auto count = static_cast<double>(deviates.size());
  double sum = 0.0, squares = 0.0;
  for (const double deviate : deviates) {
    sum += deviate;
    squares += deviate * deviate;
  }
  EXPECT_LT(std::abs(sum / std::sqrt(count)), 4.0) << what;
  EXPECT_LT(std::abs(squares - count) / std::sqrt(2.0 * count), 4.0) << what;
  const auto inside = std::count_if(deviates.begin(), deviates.end(),
                                    [](double deviate) { return std::abs(deviate) < 1.0; });
  const double share = std::erf(std::sqrt(0.5));
  EXPECT_LT(std::abs(static_cast<double>(inside) - share * count) /
                std::sqrt(share * (1.0 - share) * count),
            4.0)
      << what;
}

TEST(RigErrors, NoneLeaveEveryBit) {
  RigOptions rig = turned_rig({40.0, 30.0, 10.0});
  rig.errors.offset_sd_mm = {0.0, 0.0, 0.0};
  const auto believed = build_cameras({rig});
  const TrueRigs drawn = draw_true_rigs({rig}, believed, 1, "P000");
  EXPECT_EQ(drawn.cameras, believed);
  EXPECT_TRUE(drawn.clocks.empty());
}

TEST(RigErrors, AreNormalOfTheStatedDeviations) {
  RigOptions rig = turned_rig({40.0, 30.0, 10.0});
  rig.errors.focal_length_sd_px = 0.5;
  rig.errors.azimuth_sd_deg = 0.2;
  rig.errors.pitch_sd_deg = 0.3;
  rig.errors.roll_sd_deg = 0.4;
  rig.errors.offset_sd_mm = {1.0, 2.0, 3.0};
  rig.errors.clock_offset_sd_s = 0.01;
  rig.errors.clock_drift_sd_ppm = 20.0;
  rig.errors.clock_jitter_sd_s = 0.001;
  const auto believed = build_cameras({rig});
  const Vector3d believed_deg = angles_deg(believed[0]);
  EXPECT_LT((believed_deg - Vector3d(40.0, 30.0, 10.0)).norm(), 1e-12);
  constexpr std::size_t kDraws = 10;
  const std::array<const char*, kDraws> names = {
      "focal length", "azimuth",  "pitch",        "roll",        "offset x",
      "offset y",     "offset z", "clock offset", "clock drift", "jitter"};
  std::array<std::vector<double>, kDraws> deviates;
  for (int seed = 0; seed < kSeeds; ++seed) {
    const TrueRigs drawn = draw_true_rigs({rig}, believed, seed, "P000");
    const CameraCalibration& camera = drawn.cameras[0];
    const std::vector<double>& p = camera.intrinsics.parameters;
    EXPECT_EQ(p[0], p[1]);
    const Vector3d angle_deg = angles_deg(camera) - believed_deg;
    const Vector3d offset_mm =
        (camera.rig_from_camera.translation - believed[0].rig_from_camera.translation) * 1e3;
    const capture::CameraClock& clock = drawn.clocks.at(0);
    // At its start a clock is off by offset and jitter alone.
    const double jitter_s = capture::stamp_s(clock, camera, seed, "P000", 0, 0.0) - clock.offset_s;
    const std::array<double, kDraws> drawn_of = {
        (p[0] - 50.0) / 0.5,   angle_deg[0] / 0.2, angle_deg[1] / 0.3, angle_deg[2] / 0.4,
        offset_mm[0],          offset_mm[1] / 2.0, offset_mm[2] / 3.0, clock.offset_s / 0.01,
        clock.drift / 20.0e-6, jitter_s / 0.001};
    for (std::size_t k = 0; k < kDraws; ++k) deviates[k].push_back(drawn_of[k]);
  }
  for (std::size_t k = 0; k < kDraws; ++k) {
    expect_standard_normal(deviates[k], names[k]);
    for (std::size_t other = 0; other < k; ++other) {
      double product = 0.0;
      for (std::size_t i = 0; i < kSeeds; ++i) product += deviates[k][i] * deviates[other][i];
      EXPECT_LT(std::abs(product) / std::sqrt(kSeeds), 4.0) << names[k] << " with " << names[other];
    }
  }
}

TEST(RigErrors, AreOfSequenceRigAndCameraAndOfNoOrder) {
  RigOptions rig = turned_rig({});
  rig.cameras.push_back(test::camera_options("other", 64, 48, 50.0));
  rig.cameras.push_back(test::camera_options("third", 64, 48, 50.0));
  rig.errors = {.focal_length_sd_px = 0.5, .azimuth_sd_deg = 0.2, .offset_sd_mm = {1.0, 1.0, 1.0}};
  RigOptions twin = rig;
  twin.name = "twin";
  RigOptions reversed = rig;
  std::reverse(reversed.cameras.begin(), reversed.cameras.end());
  const auto draw_all = [](const std::vector<RigOptions>& rigs, std::int64_t seed,
                           const std::string& sequence) {
    return draw_true_rigs(rigs, build_cameras(rigs), seed, sequence).cameras;
  };
  const auto cameras = draw_all({rig, twin}, 3, "P000");
  const auto others = draw_all({twin, reversed}, 3, "P000");
  ASSERT_EQ(cameras.size(), 6u);
  for (const CameraCalibration& camera : cameras)
    EXPECT_EQ(std::count(others.begin(), others.end(), camera), 1)
        << camera.rig << "/" << camera.name;
  // All of it is drawn again for another camera, rig, sequence and seed.
  std::vector<double> focal_lengths_px;
  for (const auto& list :
       {cameras, draw_all({rig, twin}, 3, "P001"), draw_all({rig, twin}, 4, "P000")})
    for (const CameraCalibration& camera : list)
      focal_lengths_px.push_back(camera.intrinsics.parameters[0]);
  std::sort(focal_lengths_px.begin(), focal_lengths_px.end());
  EXPECT_EQ(std::unique(focal_lengths_px.begin(), focal_lengths_px.end()), focal_lengths_px.end());
}

TEST(RigErrors, OfTheFocalLengthInMillimetresAreOfTheOpticsInPixels) {
  RigOptions rig = turned_rig({});
  rig.cameras[0].fx_px = 0.0;
  rig.cameras[0].focal_length_mm = 20.0;
  rig.cameras[0].image_plane_width_mm = 16.0;
  rig.cameras[0].pixel_aspect = 1.25;
  rig.errors.focal_length_sd_mm = 0.1;
  RigOptions in_px = rig;
  in_px.errors = {.focal_length_sd_px = 0.1 * 64.0 / 16.0};  // Nu / d
  const std::vector<double> p = draw(rig, 5).intrinsics.parameters;
  const std::vector<double> q = draw(in_px, 5).intrinsics.parameters;
  EXPECT_NE(p[0], 80.0);
  EXPECT_NEAR(p[0], q[0], 1e-12);
  EXPECT_NEAR(p[0] / p[1], 1.25, 1e-12);
  EXPECT_EQ(p[2], 32.0);
}

TEST(RigErrors, OffsetsAreAlongTheAxesOfTheFile) {
  RigOptions rig = turned_rig({});
  rig.axes = "rdf";
  rig.errors.offset_sd_mm = {1.0, 0.0, 0.0};
  const Vector3d error = draw(rig, 1).rig_from_camera.translation -
                         build_cameras({rig})[0].rig_from_camera.translation;
  EXPECT_NE(error.y(), 0.0);  // right and left
  EXPECT_EQ(error.x(), 0.0);
  EXPECT_EQ(error.z(), 0.0);
}

TEST(RigErrors, OfACameraThatLooksStraightUpTurnItsAxisByThePitchAlone) {
  RigOptions rig = turned_rig({25.0, -90.0, 0.0});
  rig.errors.azimuth_sd_deg = 1.0;
  const CameraCalibration believed = build_cameras({rig})[0];
  const CameraCalibration camera = draw(rig, 1);
  EXPECT_LT((camera.rig_from_camera.rotation * Vector3d::UnitZ() - Vector3d::UnitZ()).norm(),
            1e-12);
  EXPECT_GT(camera.rig_from_camera.rotation.angularDistance(believed.rig_from_camera.rotation),
            1e-3);
  rig.errors.pitch_sd_deg = 1.0;
  const Vector3d axis = draw(rig, 1).rig_from_camera.rotation * Vector3d::UnitZ();
  EXPECT_GT(std::acos(axis.z()), 1e-3);
}

TEST(RigErrors, StampsAreOfTheClock) {
  const CameraCalibration camera = build_cameras({turned_rig({})})[0];
  const capture::CameraClock clock{.offset_s = 0.25, .drift = 1e-4};
  EXPECT_DOUBLE_EQ(capture::stamp_s(clock, camera, 1, "P000", 30, 3.0), 3.0 + 0.25 + 3e-4);
  EXPECT_EQ(stamp_s({}, camera, 1, "P000", 30, 3.0), 3.0);
  std::vector<double> deviates;
  for (int frame = 0; frame < kSeeds; ++frame)
    deviates.push_back((stamp_s({.jitter_sd_s = 0.02}, camera, 1, "P000", frame, 0.0)) / 0.02);
  expect_standard_normal(deviates, "jitter");
}

TEST(RigErrors, ThatCannotBeAreRefused) {
  const auto message_of = [](const RigOptions& rig, std::int64_t seed) -> std::string {
    try {
      draw(rig, seed);
    } catch (const core::Error& error) {
      EXPECT_EQ(error.kind(), core::ErrorKind::Config);
      return error.what();
    }
    return "";
  };
  RigOptions rig = turned_rig({});
  rig.errors.focal_length_sd_mm = 0.1;
  EXPECT_NE(message_of(rig, 1).find("states no focal_length_mm"), std::string::npos);
  // Half of all draws are negative, and most of these longer than the focal length.
  rig.errors = {.focal_length_sd_px = 500.0};
  int num_refused = 0;
  for (int seed = 0; seed < 20; ++seed)
    num_refused += message_of(rig, seed).find("which leaves none") != std::string::npos ? 1 : 0;
  EXPECT_GT(num_refused, 0);
  EXPECT_LT(num_refused, 20);
}

/// Ranges of a capture that was rendered with errors, carried to the ground by a pinhole of this test's
/// own.
TEST(RigErrors, AreRenderedWith) {
  const test::ScratchFolder scratch;
  const world::TileStore store = test::make_hills(scratch / "world");
  RigOptions rig = turned_rig({0.0, 30.0, 0.0});
  rig.errors.focal_length_sd_px = 2.0;
  rig.errors.clock_offset_sd_s = 0.5;
  render::SequencePlan plan = test::small_plan(2, 64, 48);
  plan.believed_cameras = build_cameras({rig});
  const TrueRigs drawn = draw_true_rigs({rig}, plan.believed_cameras, plan.seed, plan.name);
  plan.cameras = drawn.cameras;
  plan.clocks = drawn.clocks;
  const core::Log log("test", core::LogLevel::Off);
  render::run_render_stage(store, plan, {}, {}, scratch / "capture", {.log = log});

  const auto capture = capture::SequenceReader::open(scratch / "capture");
  EXPECT_EQ(capture.info().cameras, plan.cameras);
  EXPECT_EQ(capture.info().believed_cameras, plan.believed_cameras);
  EXPECT_EQ(capture.info().clocks, plan.clocks);
  const capture::FrameRecord& record = capture.frames()[1];
  EXPECT_EQ(record.time_s, plan.states[1].time_s);
  EXPECT_DOUBLE_EQ(record.stamp_s(0), record.time_s + plan.clocks[0].offset_s);

  const double true_px = plan.cameras[0].intrinsics.parameters[0];
  ASSERT_GT(std::abs(true_px - 50.0), 0.5);
  const world::RayQuery query(
      store,
      world::choose_cut(store, render::viewpoints_of(plan.states, plan.cameras), plan.detail), {});
  const geo::Rigid3d pose = capture.world_from_camera(1, 0);
  const core::ImageF range_m = capture.read_camera(1, 0).range_m;
  const auto heights_off_m = [&](double focal_px) {
    std::vector<double> off_m;
    for (int y = 0; y < range_m.height(); ++y)
      for (int x = 0; x < range_m.width(); ++x) {
        if (std::isinf(range_m(x, y))) continue;
        const Vector3d ray((x + 0.5 - 32.0) / focal_px, (y + 0.5 - 24.0) / focal_px, 1.0);
        const Vector3d place = pose * (ray.normalized() * static_cast<double>(range_m(x, y)));
        const auto ground_z = query.surface_z_world(place.x(), place.y());
        if (ground_z) off_m.push_back(std::abs(place.z() - *ground_z));
      }
    std::sort(off_m.begin(), off_m.end());
    return off_m;
  };
  const std::vector<double> truth = heights_off_m(true_px);
  ASSERT_GT(truth.size(), 2000u);
  EXPECT_LT(truth.back(), 1e-3);  // ranges are float32
  const std::vector<double> believed = heights_off_m(50.0);
  EXPECT_GT(believed[believed.size() / 2], 0.1);
}

}  // namespace
}  // namespace terracast::rigs
