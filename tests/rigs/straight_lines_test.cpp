#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <map>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/registry.h"
#include "rigs/rig_file.h"
#include "rigs/rig_format.h"
#include "tests/labels/boxes_world.h"
#include "tests/support/colmap_program.h"
#include "tests/support/hills_flight.h"
#include "tests/support/run_program.h"
#include "tests/support/test_data.h"

/// Bars before the sky, rendered through lenses; other programs undistort the images by the calibration that we export, and the
/// bars' edges must come out straight, and where a pinhole would see them.
namespace terracast::rigs {
namespace {

namespace fs = std::filesystem;

constexpr int kWidth_px = 240;
constexpr int kHeight_px = 180;
constexpr double kPlane_m = 100.0;  // of the bars' undersides above the camera
constexpr double kPeriod_m = 20.0;  // from bar to bar; a bar is half of it wide
constexpr int kNumBars = 9;
constexpr double kTurn_deg = 27.0;  // of the bars against the image's columns

/// Where the edges lie: lines y = offset of the world, at the height of the undersides.
std::vector<double> edges_m() {
  std::vector<double> edges;
  for (int bar = 0; bar < kNumBars; ++bar) {
    const double low = (bar - 0.5 * (kNumBars - 1)) * kPeriod_m - 0.25 * kPeriod_m;
    edges.push_back(low);
    edges.push_back(low + 0.5 * kPeriod_m);
  }
  return edges;
}

world::TileStore make_bars(const fs::path& folder) {
  std::vector<test::WorldBox> bars;
  const std::vector<double> edges = edges_m();
  for (std::size_t i = 0; i < edges.size(); i += 2)
    bars.push_back({.instance_id = static_cast<std::uint32_t>(i + 1),
                    .semantic_class = core::SemanticClass::Building,
                    .low = {-400.0, edges[i], 50.0 + kPlane_m},
                    .high = {400.0, edges[i + 1], 50.01 + kPlane_m}});
  return test::make_boxes_world(folder, bars);
}

/// The rotation that takes the camera's x right, y down, z forward into the world, x east and y north: it looks straight up.
Eigen::Matrix3d world_from_camera() {
  const double turn = kTurn_deg * std::acos(-1.0) / 180.0;
  Eigen::Matrix3d rotation;
  rotation.col(0) << std::sin(turn), std::cos(turn), 0.0;
  rotation.col(2) << 0.0, 0.0, 1.0;
  rotation.col(1) = rotation.col(2).cross(Eigen::Vector3d(rotation.col(0)));
  return rotation;
}

capture::CameraCalibration camera_of(const geo::CameraIntrinsics& lens) {
  // The body looks along x with z up; its pose here is the identity.
  return {.rig = "r",
          .name = "up",
          .intrinsics = lens,
          .rig_from_camera = {Eigen::Quaterniond(world_from_camera()), Eigen::Vector3d::Zero()},
          .body_from_rig = {}};
}

/// The image through a lens, its levels proportional to the light.
cv::Mat render(const world::TileStore& store, const geo::CameraIntrinsics& lens) {
  render::SequencePlan plan = test::level_plan();
  plan.cameras = {camera_of(lens)};
  plan.conditions.color_samples = 100;
  plan.conditions.exposure = 1.2;
  plan.conditions.sun_elevation_deg = 8.0;
  plan.conditions.sun_azimuth_deg = 270.0;  // along the bars: across them the sky is nearly even
  sensors::ImagingOptions imaging;
  imaging.color.curve = "gamma";
  imaging.color.gamma = 1.0;
  plan.imaging = {imaging};
  const test::TracedPlan scene(store, plan);
  const core::Image8 color = scene.renderer.color(0, 0);
  cv::Mat image(kHeight_px, kWidth_px, CV_8UC3);
  for (int y = 0; y < kHeight_px; ++y)
    for (int x = 0; x < kWidth_px; ++x)
      image.at<cv::Vec3b>(y, x) = {color(x, y, 2), color(x, y, 1), color(x, y, 0)};
  return image;
}

/// An undistorted image and the pinhole that it is of; principal point from the image's corner.
struct Undistorted {
  cv::Mat image;
  double fx_px = 0.0, fy_px = 0.0, cx_px = 0.0, cy_px = 0.0;
};

/// Of each edge how far from a straight line, and from where it belongs, its places are; px.
struct Straightness {
  int num_edges = 0;
  double off_line_px = 0.0;
  double off_place_px = 0.0;
};

/// Where an edge crosses a row near x: what of the light between both sides' levels lies left of it. Nothing where the window leaves the image or
/// holds what the program left empty.
std::optional<double> edge_in_row(const cv::Mat& gray, int row, double near_px) {
  constexpr int kHalf = 4;
  const int first = static_cast<int>(std::floor(near_px)) - kHalf;
  if (first < 0 || first + 2 * kHalf >= gray.cols) return std::nullopt;
  double sum = 0.0;
  for (int i = 0; i < 2 * kHalf; ++i) {
    const double level = gray.at<double>(row, first + i);
    if (level < 2.0) return std::nullopt;
    sum += level;
  }
  const double left = 0.5 * (gray.at<double>(row, first) + gray.at<double>(row, first + 1));
  const double right = 0.5 * (gray.at<double>(row, first + 2 * kHalf - 2) +
                              gray.at<double>(row, first + 2 * kHalf - 1));
  return first + (sum - 2 * kHalf * right) / (left - right);
}

/// Means of eight places at a time: what pixels and the program's interpolation leave of a place, 0.05 px, is not the lens's.
std::vector<Eigen::Vector2d> averaged(const std::vector<Eigen::Vector2d>& places) {
  constexpr std::size_t kRows = 8;
  std::vector<Eigen::Vector2d> means;
  for (std::size_t first = 0; first + kRows <= places.size(); first += kRows) {
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    for (std::size_t i = first; i < first + kRows; ++i) sum += places[i];
    means.emplace_back(sum / kRows);
  }
  return means;
}

/// How far the places (x, y) of an edge lie from the straight line of least squares through them.
double distance_from_line(const std::vector<Eigen::Vector2d>& places) {
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& place : places) mean += place / static_cast<double>(places.size());
  double xy = 0.0, yy = 0.0;
  for (const Eigen::Vector2d& place : places) {
    xy += (place - mean).x() * (place - mean).y();
    yy += (place - mean).y() * (place - mean).y();
  }
  const double slope = xy / yy;
  double worst = 0.0;
  for (const Eigen::Vector2d& place : places)
    worst = std::max(
        worst, std::abs((place - mean).x() - slope * (place - mean).y()) / std::hypot(1.0, slope));
  return worst;
}

Straightness straightness(const Undistorted& undistorted) {
  cv::Mat gray;
  cv::cvtColor(undistorted.image, gray, cv::COLOR_BGR2GRAY);
  gray.convertTo(gray, CV_64F);
  const Eigen::Matrix3d world_from = world_from_camera();
  Straightness result;
  for (const double edge : edges_m()) {
    const double slope =
        world_from(1, 1) / world_from(1, 0) * undistorted.fx_px / undistorted.fy_px;
    // Ray (a, b, 1) of a row's middle: the place on the plane has world y = edge.
    const auto expected_px = [&](double row) {
      const double b = (row - undistorted.cy_px) / undistorted.fy_px;
      const double a = (edge / kPlane_m - b * world_from(1, 1)) / world_from(1, 0);
      return undistorted.fx_px * a + undistorted.cx_px;
    };
    std::vector<Eigen::Vector2d> found;
    for (int row = 0; row < gray.rows; ++row)
      if (const auto place_px = edge_in_row(gray, row, expected_px(row + 0.5)))
        found.emplace_back(*place_px, row + 0.5);
    const std::vector<Eigen::Vector2d> places = averaged(found);
    if (places.size() < 8) continue;
    ++result.num_edges;
    result.off_line_px = std::max(result.off_line_px, distance_from_line(places));
    for (const Eigen::Vector2d& place : places)
      result.off_place_px =
          std::max(result.off_place_px,
                   std::abs(place.x() - expected_px(place.y())) / std::hypot(1.0, slope));
  }
  return result;
}

std::vector<geo::CameraIntrinsics> lenses() {
  const std::pair<const char*, std::vector<double>> own[] = {
      {"simple_radial", {-0.18}},
      {"radial", {-0.2, 0.05}},
      {"opencv", {-0.2, 0.05, 3e-3, -4e-3}},
      {"full_opencv", {-0.1, 0.04, 3e-3, -4e-3, 0.01, 0.08, 0.02, 5e-3}},
      {"opencv_fisheye", {0.03, -8e-3, 3e-3, -1e-3}},
      {"thin_prism_fisheye", {0.03, -8e-3, 2e-3, -3e-3, 3e-3, -1e-3, 4e-3, -3e-3}},
      {"fov", {0.9}},
  };
  std::vector<geo::CameraIntrinsics> lenses;
  for (const auto& [model, parameters] : own) {
    geo::CameraIntrinsics& lens = lenses.emplace_back(
        geo::CameraIntrinsics{model, kWidth_px, kHeight_px, {170.0, 170.0, 123.5, 88.0}});
    lens.parameters.insert(lens.parameters.end(), parameters.begin(), parameters.end());
  }
  return lenses;
}

class StraightLines : public testing::TestWithParam<geo::CameraIntrinsics> {
 protected:
  static void TearDownTestSuite() {
    store_.reset();
    folder_.reset();
  }

  void SetUp() override {
    if (folder_ == nullptr) {
      folder_ = std::make_unique<test::ScratchFolder>();
      store_ = std::make_unique<world::TileStore>(make_bars(folder_->path() / "world"));
    }
    cv::Mat& image = images_[GetParam().model];
    if (image.empty()) image = render(*store_, GetParam());
    image_ = image;
  }
  void write_rig(const char* format, const fs::path& path) const {
    core::find_registered(rig_formats(), "format", format)
        .write(rig_of_cameras("r", {camera_of(GetParam())}), path);
  }

  static void expect_straight(const Undistorted& undistorted) {
    const Straightness found = straightness(undistorted);
    EXPECT_GE(found.num_edges, 6);
    EXPECT_LT(found.off_line_px, 0.1);
    EXPECT_LT(found.off_place_px, 0.1);
    testing::Test::RecordProperty("off_line_px", fmt::format("{:.4f}", found.off_line_px));
    testing::Test::RecordProperty("off_place_px", fmt::format("{:.4f}", found.off_place_px));
  }

  static std::unique_ptr<test::ScratchFolder> folder_;
  static std::unique_ptr<world::TileStore> store_;
  static std::map<std::string, cv::Mat> images_;  // of each model, rendered once
  cv::Mat image_;
};
std::unique_ptr<test::ScratchFolder> StraightLines::folder_;
std::unique_ptr<world::TileStore> StraightLines::store_;
std::map<std::string, cv::Mat> StraightLines::images_;

TEST_P(StraightLines, AreCurvedInTheImageItself) {
  // What the other tests undo: without it an edge is off by pixels.
  const std::vector<double>& p = GetParam().parameters;
  const Straightness found = straightness({image_, p[0], p[1], p[2], p[3]});
  EXPECT_GT(found.off_place_px, 1.0);
}

TEST_P(StraightLines, ComeOutOfOpenCv) {
  const std::string& model = GetParam().model;
  if (model != "opencv" && model != "full_opencv" && model != "opencv_fisheye") return;
  const fs::path file = folder_->path() / (model + ".yaml");
  write_rig("opencv", file);
  const cv::FileStorage storage(file.string(), cv::FileStorage::READ);
  const cv::FileNode camera =
      storage["cameras"].empty() ? storage.root() : *storage["cameras"].begin();
  cv::Mat matrix, distortion, image;
  camera["camera_matrix"] >> matrix;
  camera["distortion_coefficients"] >> distortion;
  ASSERT_EQ(matrix.rows, 3);
  ASSERT_GE(distortion.total(), 4U);
  if (model == "opencv_fisheye")
    cv::fisheye::undistortImage(image_, image, matrix, distortion, matrix);
  else
    cv::undistort(image_, image, matrix, distortion);
  // OpenCV counts from the first pixel's middle.
  expect_straight({image, matrix.at<double>(0, 0), matrix.at<double>(1, 1),
                   matrix.at<double>(0, 2) + 0.5, matrix.at<double>(1, 2) + 0.5});
}

TEST_P(StraightLines, ComeOutOfColmap) {
  TERRACAST_NEEDS_COLMAP();
  const fs::path work = folder_->path() / ("colmap_" + GetParam().model);
  fs::create_directories(work / "images");
  fs::create_directories(work / "made");
  write_rig("colmap", work / "model");
  ASSERT_TRUE(cv::imwrite(work / "images" / "up.png", image_));
  std::ofstream(work / "model" / "images.txt") << "1 1 0 0 0 0 0 0 1 up.png\n\n";
  std::ofstream(work / "model" / "points3D.txt") << "";
  const auto run = test::run_command(
      test::kColmap, {"image_undistorter", "--image_path", work / "images", "--input_path",
                      work / "model", "--output_path", work / "made", "--output_type", "COLMAP"});
  ASSERT_EQ(run.status, 0) << run.output;
  const auto converted = test::run_command(
      test::kColmap, {"model_converter", "--input_path", work / "made" / "sparse", "--output_path",
                      work / "made" / "sparse", "--output_type", "TXT"});
  ASSERT_EQ(converted.status, 0) << converted.output;
  Undistorted undistorted;
  undistorted.image = cv::imread(work / "made" / "images" / "up.png");
  ASSERT_FALSE(undistorted.image.empty());
  std::ifstream cameras(work / "made" / "sparse" / "cameras.txt");
  std::string line;
  while (std::getline(cameras, line) && line.starts_with("#")) continue;
  std::istringstream words(line);
  std::string id, model;
  int width = 0, height = 0;
  words >> id >> model >> width >> height >> undistorted.fx_px >> undistorted.fy_px >>
      undistorted.cx_px >> undistorted.cy_px;
  ASSERT_EQ(model, "PINHOLE");
  ASSERT_EQ(width, undistorted.image.cols);
  expect_straight(undistorted);
}

INSTANTIATE_TEST_SUITE_P(Lenses, StraightLines, testing::ValuesIn(lenses()),
                         [](const auto& lens) { return lens.param.model; });

}  // namespace
}  // namespace terracast::rigs
