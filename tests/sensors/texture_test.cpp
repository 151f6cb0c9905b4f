#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "capture/channel.h"
#include "sensors/camera/frame_renderer.h"
#include "tests/support/hills_flight.h"
#include "tests/support/test_data.h"

namespace terracast::sensors {
namespace {

/// Mountains of 3 km to 20 m.
double mountains_m(double x, double y) {
  double height_m = 600.0;
  double wavelength_m = 6000.0;
  for (int octave = 0; octave < 9; ++octave, wavelength_m *= 0.5) {
    const double turn = 0.9 * octave;
    const double u = (std::cos(turn) * x - std::sin(turn) * y) / wavelength_m * 6.28;
    const double v = (std::sin(turn) * x + std::cos(turn) * y) / wavelength_m * 6.28;
    height_m += 0.04 * wavelength_m * std::sin(u + 1.3 * octave) * std::cos(v + 0.7 * octave);
  }
  return height_m;
}

/// As fine as a camera at a height can tell.
world::TileStore make_mountains(const std::filesystem::path& folder, double agl_m) {
  test::TinyWorldOptions options;
  options.finest_level = agl_m > 1000.0 ? 2 : 0;
  options.coarsest_level = 6;
  options.refine = [](const world::TileId& id) {
    const Eigen::Vector2d away = id.center_world().cwiseAbs();
    return away.maxCoeff() < 0.8 * id.side_m();
  };
  options.moisture = [](double x, double y) {
    return 0.5 + 0.3 * std::sin(x * 0.0021) * std::cos(y * 0.0017);
  };
  return test::make_tiny_world(folder, mountains_m, options);
}

cv::Mat grey_of(const core::Image8& image) {
  cv::Mat rgb(image.height(), image.width(), CV_8UC3,
              const_cast<std::uint8_t*>(image.data().data()));
  cv::Mat grey;
  cv::cvtColor(rgb, grey, cv::COLOR_RGB2GRAY);
  return grey;
}

class Texture : public testing::TestWithParam<double> {};

// What feature-based methods need of a frame with half its pixels on the ground: 1000 keypoints,
// and 150 matches to the next frame that the epipolar geometry confirms.
TEST_P(Texture, HasKeypointsThatMatchInTheNextFrame) {
  const double agl_m = GetParam();
  const test::ScratchFolder folder;
  const world::TileStore store = make_mountains(folder / "world", agl_m);
  render::SequencePlan plan = test::small_plan(2, 720, 640);
  plan.cameras.resize(1);
  plan.cameras[0] = test::small_rig(720, 640, 40.0)[0];
  plan.detail = {.cell_px = 2.0, .finest_spacing_m = 1.0};
  plan.conditions.color_samples = 2;  // half the default: noisier, hence harder
  // A tenth of the height on, and a degree of turn.
  for (int i = 0; i < 2; ++i) {
    geo::BodyState& state = plan.states[static_cast<std::size_t>(i)];
    state.world_from_body.translation = {0.1 * agl_m * i, 0.01 * agl_m * i,
                                         mountains_m(0.0, 0.0) + agl_m};
    state.world_from_body.rotation = Eigen::AngleAxisd(0.017 * i, Eigen::Vector3d::UnitZ());
  }
  const test::TracedPlan scene(store, plan);
  const TruthFrame truth = scene.renderer.truth(0, 0);
  std::size_t num_ground = 0;
  for (const double range_m : truth.range_m) num_ground += std::isinf(range_m) ? 0u : 1u;
  ASSERT_GT(2 * num_ground, truth.range_m.size());

  const auto sift = cv::SIFT::create();
  std::vector<cv::KeyPoint> keypoints[2];
  cv::Mat descriptors[2];
  for (int i = 0; i < 2; ++i)
    sift->detectAndCompute(grey_of(scene.renderer.color(i, 0)), cv::noArray(), keypoints[i],
                           descriptors[i]);
  EXPECT_GE(keypoints[0].size(), 1000u);

  std::vector<std::vector<cv::DMatch>> nearest;
  cv::FlannBasedMatcher().knnMatch(descriptors[0], descriptors[1], nearest, 2);
  std::vector<cv::Point2f> from;
  std::vector<cv::Point2f> to;
  for (const auto& match : nearest) {
    if (match.size() < 2 || match[0].distance > 0.75f * match[1].distance) continue;
    from.push_back(keypoints[0][static_cast<std::size_t>(match[0].queryIdx)].pt);
    to.push_back(keypoints[1][static_cast<std::size_t>(match[0].trainIdx)].pt);
  }
  ASSERT_GE(from.size(), 150u);
  std::vector<std::uint8_t> is_inlier;
  cv::findFundamentalMat(from, to, cv::FM_RANSAC, 1.0, 0.999, is_inlier);
  int num_verified = 0;
  for (const std::uint8_t inlier : is_inlier) num_verified += inlier;
  EXPECT_GE(num_verified, 150);
  RecordProperty("keypoints", static_cast<int>(keypoints[0].size()));
  RecordProperty("verified", num_verified);

  // Truth agrees with what is seen: the matches move as the flow of the hit points says. The median
  // of SIFT's own localisation is a few tenths of a pixel.
  const View& next = scene.renderer.views().at(1, 0);
  std::vector<double> errors_px;
  for (std::size_t i = 0; i < from.size(); ++i) {
    if (is_inlier[i] == 0) continue;
    const auto pixel = static_cast<std::size_t>(from[i].y + 0.5f) * 720u +
                       static_cast<std::size_t>(from[i].x + 0.5f);
    if (pixel >= truth.range_m.size() || std::isinf(truth.range_m[pixel])) continue;
    const auto predicted = next.project(truth.point_world[pixel]);
    if (!predicted) continue;
    const Eigen::Vector2d center(std::floor(static_cast<double>(from[i].x) + 0.5) + 0.5,
                                 std::floor(static_cast<double>(from[i].y) + 0.5) + 0.5);
    const Eigen::Vector2d moved = *predicted - center;
    const Eigen::Vector2d seen(static_cast<double>(to[i].x - from[i].x),
                               static_cast<double>(to[i].y - from[i].y));
    errors_px.push_back((moved - seen).norm());
  }
  std::nth_element(errors_px.begin(), errors_px.begin() + static_cast<long>(errors_px.size() / 2),
                   errors_px.end());
  EXPECT_LT(errors_px[errors_px.size() / 2], 0.3);
  RecordProperty("median_flow_error_px_x1000",
                 static_cast<int>(1000 * errors_px[errors_px.size() / 2]));
}

INSTANTIATE_TEST_SUITE_P(From, Texture, testing::Values(20.0, 200.0, 2000.0));

}  // namespace
}  // namespace terracast::sensors
