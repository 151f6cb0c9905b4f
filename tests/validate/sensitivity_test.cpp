#include <gtest/gtest.h>

#include <map>

#include "core/log.h"
#include "tests/support/test_data.h"
#include "tests/validate/analytic_dataset.h"
#include "validate/check.h"

/// A right dataset passes; the smallest errors that the checks promise to find are found, each by
/// the check that says so.
namespace terracast::validate {
namespace {

using test::Mistake;
using test::Recording;

const Recording& kitti_flight() {
  static const Recording recording = test::record_flight(test::kitti_cameras(), 6);
  return recording;
}
const Recording& kitti_raw_flight() {
  static const Recording recording = test::record_smooth_flight(test::kitti_raw_cameras(), 8);
  return recording;
}
const Recording& colmap_flight() {
  static const Recording recording = test::record_flight(test::colmap_cameras(), 6);
  return recording;
}
const Recording& tartanair_flight() {
  static const Recording recording = test::record_flight(test::tartanair_cameras(), 4);
  return recording;
}

const Recording& tartanair_v1_flight() {
  static const Recording recording = test::record_flight(test::tartanair_v1_cameras(), 4);
  return recording;
}

using Results = std::map<std::string, CheckResult>;

Results validate_folder(const std::filesystem::path& folder, const std::filesystem::path& report) {
  const core::Log log("validate", core::LogLevel::Off);
  ValidateOptions options;
  options.samples_per_image = 4000;
  Results results;
  for (CheckResult& result : run_validate_stage(folder, options, report, {log}))
    results[result.name] = std::move(result);
  return results;
}

std::string failures(const Results& results) {
  std::string text;
  for (const auto& [name, result] : results)
    if (!result.ok)
      text += fmt::format("{} = {:.4g} {} (bound {:.4g}): {}\n", name, result.value, result.unit,
                          result.bound, result.worst);
  return text;
}

std::string values(const Results& results) {
  std::string text;
  for (const auto& [name, result] : results)
    text += fmt::format("{} {} = {:.4g} {} (bound {:.4g}): {}\n",
                        result.ok ? result.skipped ? "skip" : "ok  " : "BAD ", name, result.value,
                        result.unit, result.bound, result.worst);
  return text;
}

struct Case {
  std::string name;
  const char* format;
  Mistake mistake;
  std::vector<std::string> checks;  ///< those that name it
};

Results results_of(const std::string& format, const Mistake& mistake) {
  const test::ScratchFolder scratch;
  if (format == "kitti") test::write_kitti(kitti_flight(), scratch / "data", mistake);
  if (format == "kitti_raw") test::write_kitti_raw(kitti_raw_flight(), scratch / "data", mistake);
  if (format == "colmap") test::write_colmap(colmap_flight(), scratch / "data", mistake);
  if (format == "tartanair") test::write_tartanair(tartanair_flight(), scratch / "data", mistake);
  if (format == "tartanair_v1")
    test::write_tartanair_v1(tartanair_v1_flight(), scratch / "data", mistake);
  return validate_folder(scratch / "data", scratch / "report");
}

void PrintTo(const Case& one, std::ostream* out) {
  *out << one.format << ": " << fmt::format("{}", fmt::join(one.checks, ", "));
}

class Right : public testing::TestWithParam<const char*> {};

TEST_P(Right, DatasetPassesEveryCheck) {
  const Results results = results_of(GetParam(), {});
  EXPECT_EQ(failures(results), "") << values(results);
  EXPECT_TRUE(results.contains("structure"));
  EXPECT_TRUE(results.contains("reprojection_principal_point"));
  EXPECT_FALSE(results.at("reprojection_principal_point").skipped) << values(results);
  EXPECT_FALSE(results.at("reprojection_scale").skipped) << values(results);
  EXPECT_FALSE(results.at("reprojection_time").skipped) << values(results);
  EXPECT_FALSE(results.at("reprojection_rotation").skipped) << values(results);
  if (GetParam() == std::string("kitti_raw")) {
    for (const char* name : {"oxts_velocity", "oxts_acceleration", "oxts_turn_rate",
                             "oxts_levelled", "oxts_pose_position", "oxts_pose_rotation"})
      EXPECT_FALSE(results.at(name).skipped) << name << "\n" << values(results);
  }
  if (std::getenv("TERRACAST_SHOW_VALUES") != nullptr) std::fputs(values(results).c_str(), stdout);
}

INSTANTIATE_TEST_SUITE_P(Formats, Right,
                         testing::Values("kitti", "kitti_raw", "colmap", "tartanair",
                                         "tartanair_v1"),
                         [](const auto& one) { return one.param; });

// Of how many points were asked for a dataset says nothing: 899 of 18 images, of which 50 each are wanted.
TEST(RightFew, ColmapModelOfFewPointsIsNotCalledWrong) {
  const Results results = results_of("colmap", {.colmap = {.most_points = 899}});
  EXPECT_EQ(failures(results), "") << values(results);
  EXPECT_TRUE(results.at("colmap_points").is_unseen) << values(results);
}

/// Ground as a world has it: triangles of a few pixels with rough corners, which no smooth
/// interpolation follows.
TEST(RightFacets, RoughTrianglesPassEveryCheck) {
  const test::ScratchFolder scratch;
  test::write_colmap(test::record_flight(test::colmap_cameras(), 6, test::Ground::Facets),
                     scratch / "data");
  const Results results = validate_folder(scratch / "data", scratch / "report");
  EXPECT_EQ(failures(results), "") << values(results);
  if (std::getenv("TERRACAST_SHOW_VALUES") != nullptr) std::fputs(values(results).c_str(), stdout);
}

/// Frames of which only every eighth was taken, half a turn's ground apart: what few pixels show of
/// the same ground from near and far is no mistake.
TEST(RightFacets, FramesFarApartPassEveryCheck) {
  const test::ScratchFolder scratch;
  test::write_colmap(test::record_flight(test::colmap_cameras(), 6, test::Ground::Facets, 8),
                     scratch / "data");
  const Results results = validate_folder(scratch / "data", scratch / "report");
  EXPECT_EQ(failures(results), "") << values(results);
}

TEST(WrongFacets, SmallErrorsAreFoundOnRoughTrianglesToo) {
  static const Recording recording =
      test::record_flight(test::colmap_cameras(), 6, test::Ground::Facets);
  const std::vector<std::pair<Mistake, std::string>> cases = {
      {{.principal_x_px = 0.1}, "reprojection_principal_point"},
      {{.principal_y_px = 0.1}, "reprojection_principal_point"},
      {{.depth_relative = 1e-3}, "reprojection_scale"},
      {{.pose_frame = 3, .pose_turn_deg = {0.0, 0.01, 0.0}}, "reprojection_rotation"},
      {{.mount_yaw_deg = 0.01}, "reprojection_rotation"},
      {{.pose_shift_frames = 1}, "reprojection_time"}};
  for (const auto& [mistake, check] : cases) {
    const test::ScratchFolder scratch;
    test::write_colmap(recording, scratch / "data", mistake);
    const Results results = validate_folder(scratch / "data", scratch / "report");
    EXPECT_FALSE(results.at(check).ok) << check << "\n" << values(results);
  }
}

/// From far up a pair's disparities are a score of steps, unevenly spread over each.
TEST(CoarseDisparities, ShowTheirScaleAllTheSame) {
  std::vector<test::SceneCamera> cameras = test::kitti_cameras();
  cameras[1].offset_body =
      cameras[0].offset_body + 0.1 * (cameras[1].offset_body - cameras[0].offset_body);
  const Recording recording = test::record_flight(cameras, 3);
  for (const double relative : {0.0, 1e-3, -1e-3}) {
    const test::ScratchFolder scratch;
    test::write_kitti(recording, scratch / "data", {.disparity_relative = relative});
    const Results results = validate_folder(scratch / "data", scratch / "report");
    const CheckResult& scale = results.at("stereo_scale");
    EXPECT_FALSE(scale.skipped) << scale.worst;
    EXPECT_EQ(scale.ok, relative == 0.0) << scale.worst;
    EXPECT_NEAR(scale.value, 100.0 * std::abs(relative), 0.02);
  }
}

class Wrong : public testing::TestWithParam<Case> {};

TEST_P(Wrong, IsFoundByTheNamedCheck) {
  const Case& wrong = GetParam();
  const Results results = results_of(wrong.format, wrong.mistake);
  for (const std::string& check : wrong.checks) {
    ASSERT_TRUE(results.contains(check)) << check << "\n" << values(results);
    EXPECT_FALSE(results.at(check).ok) << check << "\n" << values(results);
  }
  EXPECT_TRUE(results.at("structure").ok)
      << "the files themselves are sound: " << results.at("structure").worst;
}

const Case kCases[] = {
    {"KittiPrincipalX", "kitti", {.principal_x_px = 0.1}, {"reprojection_principal_point"}},
    {"KittiPrincipalY", "kitti", {.principal_y_px = -0.1}, {"reprojection_principal_point"}},
    {"KittiPrincipalOfColors", "kitti", {.principal_x_px = 0.5}, {"photometric_principal_point"}},
    {"KittiFocal", "kitti", {.focal_relative = 1e-3}, {"reprojection_focal_length"}},
    {"KittiDepthScale", "kitti", {.depth_relative = 1e-3}, {"reprojection_scale", "stereo_scale"}},
    {"KittiDepthOfOneFrame",
     "kitti",
     {.depth_relative = -0.02, .depth_frame = 3},
     {"reprojection_see_through"}},
    {"KittiDisparityScale", "kitti", {.disparity_relative = 1e-3}, {"stereo_scale"}},
    {"KittiOneDisparity", "kitti", {.one_disparity_counts = 2}, {"stereo_disparity"}},
    {"KittiOneDisparityLess", "kitti", {.is_one_disparity_missing = true}, {"stereo_disparity"}},
    {"KittiNoDisparity", "kitti", {.disparity_relative = -1.0}, {"stereo_disparity"}},
    {"KittiOneFrameOfTime", "kitti", {.pose_shift_frames = 1}, {"reprojection_time"}},
    {"KittiPoseTwice", "kitti", {.pose_order = {0, 1, 2, 2, 4, 5}}, {"reprojection"}},
    {"KittiPosesSwapped",
     "kitti",
     {.pose_order = {0, 1, 3, 2, 4, 5}},
     {"reprojection"}},
    {"KittiPoseFlipped",
     "kitti",
     {.pose_frame = 3, .pose_turn_deg = {0.0, 0.0, 180.0}},
     {"trajectory_turns"}},
    {"KittiEntryOfOnePose",
     "kitti",
     {.pose_frame = 3, .pose_entry = 1e-5},
     {"trajectory_rotations"}},
    {"KittiRotationOfOneFrame",
     "kitti",
     {.pose_frame = 3, .pose_turn_deg = {0.01, 0.0, 0.0}},
     {"reprojection_rotation"}},
    {"KittiRollOfOneFrame",
     "kitti",
     {.pose_frame = 2, .pose_turn_deg = {0.0, 0.0, 0.01}},
     {"reprojection_rotation"}},
    {"KittiTurnOfOneFrameInColors",
     "kitti",
     {.pose_frame = 3, .pose_turn_deg = {0.0, 0.05, 0.0}},
     {"photometric_rotation"}},
    {"KittiPoseAgainstGeoreference",
     "kitti",
     {.pose_frame = 3, .pose_turn_deg = {0.0, 0.01, 0.0}, .poses_only_in_format = true},
     {"georeference_rotation"}},
    {"KittiPlaceAgainstGeoreference",
     "kitti",
     {.pose_frame = 3, .pose_move_m = {0.0, 0.002, 0.0}, .poses_only_in_format = true},
     {"georeference_position"}},
    {"KittiPositionOfOneFrame",
     "kitti",
     {.pose_frame = 3, .pose_move_m = {0.12, 0.0, 0.0}},
     {"reprojection_position"}},
    {"KittiColorsOfTheFrameBefore",
     "kitti",
     {.color_shift_frames = 1},
     {"photometric_correlation"}},
    {"KittiRightImageShifted", "kitti", {.color_offset_px = {0.2, 0.0}}, {"stereo_shift"}},
    {"KittiRightImageLower", "kitti", {.color_offset_px = {0.0, 0.2}}, {"stereo_vertical"}},
    {"KittiTimes", "kitti", {.times_relative = 1e-2}, {"georeference_time"}},
    {"KittiRawPrincipalX", "kitti_raw", {.principal_x_px = 0.1}, {"reprojection_principal_point"}},
    {"KittiRawOneFrameOfTime", "kitti_raw", {.pose_shift_frames = 1}, {"reprojection_time"}},
    {"KittiRawTimes", "kitti_raw", {.times_relative = 1e-2}, {"georeference_time"}},
    {"KittiRawRightImageShifted", "kitti_raw", {.color_offset_px = {0.2, 0.0}}, {"stereo_shift"}},
    {"KittiRawRotationOfOnePacket",
     "kitti_raw",
     {.pose_frame = 3, .pose_turn_deg = {0.01, 0.0, 0.0}, .poses_only_in_format = true},
     {"georeference_rotation", "oxts_pose_rotation"}},
    // 1 km of another place's axes are 0.012 deg; the axes of a world's origin are often 25 km off.
    {"KittiRawAnglesInAxesOfAnotherPlace",
     "kitti_raw",
     {.oxts = {.axes_east_m = 1000.0}},
     {"georeference_rotation", "oxts_pose_position"}},
    {"KittiRawAnglesInAxesOfAFarPlace",
     "kitti_raw",
     {.oxts = {.axes_east_m = 25000.0}},
     {"georeference_rotation", "oxts_pose_position"}},
    {"KittiRawAltitude", "kitti_raw", {.oxts = {.altitude_m = 0.002}}, {"georeference_position"}},
    {"KittiRawVelocity", "kitti_raw", {.oxts = {.velocity_relative = 1e-3}}, {"oxts_velocity"}},
    {"KittiRawVelocityOfTheNextFrame",
     "kitti_raw",
     {.oxts = {.velocity_shift_frames = 1}},
     {"oxts_velocity"}},
    {"KittiRawForce", "kitti_raw", {.oxts = {.force_mps2 = 0.1}}, {"oxts_acceleration"}},
    {"KittiRawNoGravity", "kitti_raw", {.oxts = {.gravity = 0.0}}, {"oxts_acceleration"}},
    {"KittiRawTurnRate", "kitti_raw", {.oxts = {.rate_degps = 0.1}}, {"oxts_turn_rate"}},
    {"KittiRawOneLevelVelocity",
     "kitti_raw",
     {.oxts = {.level_left_mps = 1e-5}},
     {"oxts_levelled"}},
    {"ColmapPrincipalX", "colmap", {.principal_x_px = 0.1}, {"reprojection_principal_point"}},
    {"ColmapPrincipalY", "colmap", {.principal_y_px = 0.1}, {"reprojection_principal_point"}},
    {"ColmapFocal", "colmap", {.focal_relative = -1e-3}, {"reprojection_focal_length"}},
    {"ColmapDepthScale", "colmap", {.depth_relative = -1e-3}, {"reprojection_scale"}},
    {"ColmapMount", "colmap", {.mount_yaw_deg = 0.01}, {"reprojection_rotation"}},
    {"ColmapOneFrameOfTime", "colmap", {.pose_shift_frames = 1}, {"reprojection_time"}},
    {"ColmapImageShifted", "colmap", {.color_offset_px = {0.2, 0.0}}, {"photometric_shift"}},
    {"ColmapStatedPrincipal", "colmap", {.stated_principal_px = 1e-5}, {"calibration_intrinsics"}},
    {"ColmapStatedMount",
     "colmap",
     {.stated_mount_yaw_deg = 0.01, .stated_mount_move_m = 0.002},
     {"calibration_rotation", "calibration_position", "georeference_rigidity"}},
    {"ColmapObservation", "colmap", {.colmap = {.observation_px = 1e-5}}, {"colmap_reprojection"}},
    {"ColmapTrack", "colmap", {.colmap = {.track_index = 1}}, {"colmap_tracks"}},
    {"ColmapRig", "colmap", {.colmap = {.rig_move_m = 1e-5}}, {"colmap_rigs"}},
    {"ColmapImageWithoutFrame",
     "colmap",
     {.colmap = {.is_last_image_without_frame = true}},
     {"colmap_frames"}},
    {"ColmapShortTracks", "colmap", {.colmap = {.most_images = 2}}, {"colmap_complete_tracks"}},
    {"ColmapPointsUnderGround",
     "colmap",
     {.colmap = {.point_depth_relative = 0.03}},
     {"colmap_depth"}},
    {"ColmapPointsBesideGround",
     "colmap",
     {.colmap = {.point_depth_relative = 0.003}},
     {"colmap_depth_residual"}},
    {"ColmapColors", "colmap", {.colmap = {.color_levels = 40}}, {"colmap_color"}},
    {"TartanAirRotationOfOneFrame",
     "tartanair",
     {.pose_frame = 2, .pose_turn_deg = {0.0, 0.01, 0.0}},
     {"flow", "flow_rotation", "reprojection_rotation"}},
    {"TartanAirFlowSign", "tartanair", {.flow_sign = -1.0}, {"flow"}},
    {"TartanAirFlowPrincipal", "tartanair", {.principal_x_px = 0.1}, {"flow_principal_point"}},
    {"TartanAirFlowFocal", "tartanair", {.focal_relative = 1e-3}, {"flow_focal_length"}},
    {"TartanAirDepthScale", "tartanair", {.depth_relative = 1e-3}, {"flow_scale"}},
    {"TartanAirOneFrameOfTime",
     "tartanair",
     {.pose_shift_frames = 1},
     {"flow", "reprojection_time"}},
    {"TartanAirAllCovisible", "tartanair", {.covisible = true}, {"flow_masks"}},
    {"TartanAirNoneCovisible", "tartanair", {.covisible = false}, {"flow_covisible"}},
    {"TartanAirV1RotationOfOneFrame",
     "tartanair_v1",
     {.pose_frame = 2, .pose_turn_deg = {0.0, 0.01, 0.0}},
     {"flow", "flow_rotation", "reprojection_rotation"}},
    {"TartanAirV1FlowSign", "tartanair_v1", {.flow_sign = -1.0}, {"flow"}},
    {"TartanAirV1DepthScale", "tartanair_v1", {.depth_relative = 1e-3}, {"flow_scale"}},
    {"TartanAirV1AllCovisible", "tartanair_v1", {.covisible = true}, {"flow_masks"}},
};

INSTANTIATE_TEST_SUITE_P(Mistakes, Wrong, testing::ValuesIn(kCases),
                         [](const auto& one) { return one.param.name; });

}  // namespace
}  // namespace terracast::validate
