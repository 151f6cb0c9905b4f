// The validator's lenses against OpenCV's, which counts pixels from their centres.

#include "validate/lens.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/calib3d.hpp>

#include "core/random.h"

namespace terracast::validate {
namespace {

std::vector<Eigen::Vector2d> places_within(double radius) {
  std::vector<Eigen::Vector2d> places;
  for (std::uint64_t i = 0; i < 500; ++i) {
    const double r = radius * std::sqrt(core::random_unit(7, 1, i));
    const double around = 6.283 * core::random_unit(7, 2, i);
    places.emplace_back(r * std::cos(around), r * std::sin(around));
  }
  return places;
}

Eigen::Vector2d by_opencv(const Eigen::Vector2d& place, const std::vector<double>& distortion) {
  std::vector<cv::Point2d> result;
  cv::projectPoints(std::vector<cv::Point3d>{{place.x(), place.y(), 1.0}}, cv::Vec3d(), cv::Vec3d(),
                    cv::Mat::eye(3, 3, CV_64F), distortion, result);
  return {result[0].x, result[0].y};
}

Eigen::Vector2d by_opencv_fisheye(const Eigen::Vector2d& place, const cv::Vec4d& distortion) {
  std::vector<cv::Vec2d> result;
  cv::fisheye::projectPoints(std::vector<cv::Vec3d>{{place.x(), place.y(), 1.0}}, result,
                             cv::Vec3d(), cv::Vec3d(), cv::Mat::eye(3, 3, CV_64F), distortion);
  return {result[0][0], result[0][1]};
}

TEST(Lens, IsThatOfOpenCv) {
  const std::vector<double> full{0.3, -0.1, 3e-3, -2e-3, 0.02, 0.6, 0.1, 0.01};
  const auto opencv = colmap_intrinsics("OPENCV", {1, 1, 0, 0, -0.2, 0.05, 3e-3, -2e-3});
  std::vector<double> parameters{1, 1, 0, 0};
  parameters.insert(parameters.end(), full.begin(), full.end());
  const auto rational = colmap_intrinsics("FULL_OPENCV", parameters);
  const auto fisheye =
      colmap_intrinsics("OPENCV_FISHEYE", {1, 1, 0, 0, 0.03, -0.01, 0.004, -0.0007});
  for (const Eigen::Vector2d& place : places_within(0.8)) {
    EXPECT_LT((opencv->lens.distorted(place) - by_opencv(place, {-0.2, 0.05, 3e-3, -2e-3})).norm(),
              1e-14);
    EXPECT_LT((rational->lens.distorted(place) - by_opencv(place, full)).norm(), 1e-14);
  }
  for (const Eigen::Vector2d& place : places_within(5.0))
    EXPECT_LT(
        (fisheye->lens.distorted(place) - by_opencv_fisheye(place, {0.03, -0.01, 0.004, -0.0007}))
            .norm(),
        1e-14);
}

TEST(Lens, ThereAndBackIsTheSamePlace) {
  for (const auto& [model, parameters] : std::vector<std::pair<std::string, std::vector<double>>>{
           {"PINHOLE", {1, 1, 0, 0}},
           {"SIMPLE_RADIAL", {1, 0, 0, -0.15}},
           {"RADIAL", {1, 0, 0, -0.2, 0.04}},
           {"OPENCV", {1, 1, 0, 0, -0.2, 0.05, 3e-3, -2e-3}},
           {"FULL_OPENCV", {1, 1, 0, 0, 0.3, -0.1, 3e-3, -2e-3, 0.02, 0.6, 0.1, 0.01}},
           {"OPENCV_FISHEYE", {1, 1, 0, 0, 0.03, -0.01, 0.004, -0.0007}},
           {"FOV", {1, 1, 0, 0, 0.9}},
           {"THIN_PRISM_FISHEYE",
            {1, 1, 0, 0, 0.02, -0.01, 1e-3, -8e-4, 0.002, -0.0004, 1e-3, -2e-3}}}) {
    SCOPED_TRACE(model);
    const auto known = colmap_intrinsics(model, parameters);
    ASSERT_TRUE(known);
    for (const Eigen::Vector2d& place : places_within(0.9))
      EXPECT_LT((known->lens.undistorted(known->lens.distorted(place)) - place).norm(), 1e-11);
    EXPECT_FALSE(colmap_intrinsics(model, {1, 2}));
    const auto [said, numbers] = colmap_model(*known);
    const auto again = colmap_intrinsics(said, numbers);
    ASSERT_TRUE(again) << said;
    EXPECT_EQ(again->lens, known->lens);
    EXPECT_EQ(again->fy_px, known->fy_px);
  }
  EXPECT_FALSE(colmap_intrinsics("UNHEARD_OF", {1, 1, 0, 0}));
}

TEST(Lens, BeyondItsFoldNothingComesIn) {
  const auto barrel = colmap_intrinsics("SIMPLE_RADIAL", {1, 0, 0, -0.3});
  const double farthest = 2.0 / 3.0 / std::sqrt(0.9);
  EXPECT_TRUE(barrel->lens.undistorted({farthest - 1e-3, 0.0}).allFinite());
  EXPECT_FALSE(barrel->lens.undistorted({farthest + 1e-3, 0.0}).allFinite());
  EXPECT_FALSE(
      colmap_intrinsics("FOV", {1, 1, 0, 0, 1.0})->lens.undistorted({1.6, 0.0}).allFinite());
}

}  // namespace
}  // namespace terracast::validate
