// Every camera model under the laws of cameras (plugins/laws/camera.cpp): narrow and wide ones, and images that hold more
// than the model sees.

#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

#include "plugins/laws/laws.h"

namespace terracast::test {
namespace {

using geo::CameraIntrinsics;
using geo::make_camera;

/// A table of another camera's rays.
/// first   image point of the first node; they go on to as far from the other border
CameraIntrinsics table_of(const CameraIntrinsics& camera, double first, int columns, int rows) {
  const auto model = make_camera(camera);
  const double step_x = (camera.width_px - 2 * first) / (columns - 1);
  const double step_y = (camera.height_px - 2 * first) / (rows - 1);
  CameraIntrinsics table{"tabulated",
                         camera.width_px,
                         camera.height_px,
                         {step_x, step_y, first, first, 1.0 * columns, 1.0 * rows}};
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      const Eigen::Vector3d ray = model->ray_from_pixel({first + i * step_x, first + j * step_y});
      table.parameters.insert(table.parameters.end(), ray.begin(), ray.end());
    }
  }
  return table;
}

/// A camera of each model, or several, that the laws are tried on: narrow and wide ones, and images
/// that hold more than the model sees.
const std::vector<CameraIntrinsics>& examples() {
  constexpr double kSphere_px = 1024 / (2 * std::numbers::pi);
  static const std::vector<CameraIntrinsics> table{
      {"cylindrical", 1024, 300, {kSphere_px, kSphere_px, 512, 150}},
      {"cylindrical", 720, 640, {300.0, 310.0, 371.3, 318.9}},
      {"double_sphere", 720, 640, {300.0, 310.0, 371.3, 318.9, -0.2, 0.6}},
      {"double_sphere", 720, 640, {180.0, 180.0, 371.3, 318.9, 0.4, 0.7}},
      {"equirectangular", 1024, 512, {kSphere_px, kSphere_px, 512, 256}},
      {"equirectangular", 720, 640, {300.0, 310.0, 371.3, 318.9}},
      {"extended_unified", 720, 640, {300.0, 310.0, 371.3, 318.9, 0.4, 1.1}},
      {"extended_unified", 720, 640, {180.0, 180.0, 371.3, 318.9, 0.65, 0.9}},
      {"fov", 720, 640, {400.0, 410.0, 371.3, 318.9, 0.9}},
      {"full_opencv",
       720,
       640,
       {500.0, 510.0, 371.3, 318.9, 0.3, -0.1, 1e-3, -8e-4, 0.02, 0.6, 0.1, 0.01}},
      {"opencv", 720, 640, {500.0, 510.0, 371.3, 318.9, -0.2, 0.05, 2e-3, -1e-3}},
      {"opencv_fisheye", 720, 640, {220.0, 221.0, 371.3, 318.9, 0.01, -0.005, 0.001, -0.0002}},
      {"opencv_fisheye", 720, 640, {150.0, 150.0, 360.0, 320.0, -0.05, 0.0, 0.0, 0.0}},
      {"orthographic", 720, 640, {4.0, 5.0, 371.3, 318.9}},
      {"pinhole", 720, 640, {720.5, 640.25, 371.3, 318.9}},
      {"pushbroom", 720, 640, {720.5, 3.5, 371.3, 318.9}},
      {"radial", 720, 640, {500.0, 510.0, 371.3, 318.9, -0.25, 0.06}},
      {"simple_radial", 720, 640, {500.0, 500.0, 371.3, 318.9, -0.15}},
      {"simple_radial", 720, 640, {300.0, 300.0, 371.3, 318.9, -0.15}},
      table_of({"opencv", 720, 640, {500.0, 510.0, 371.3, 318.9, -0.2, 0.05, 2e-3, -1e-3}}, 0.0, 19,
               17),
      table_of({"double_sphere", 720, 640, {300.0, 310.0, 371.3, 318.9, -0.2, 0.6}}, 12.0, 31, 29),
      {"thin_prism_fisheye",
       720,
       640,
       {250.0, 251.0, 371.3, 318.9, 0.02, -0.01, 1e-3, -8e-4, 0.002, -0.0004, 1e-3, -2e-3}},
      {"unified", 720, 640, {500.0, 510.0, 371.3, 318.9, 0.9, -0.2, 0.05, 1e-3, -8e-4}},
      {"unified", 720, 640, {350.0, 350.0, 371.3, 318.9, 1.3, 0.0, 0.0, 0.0, 0.0}},
  };
  return table;
}

class CameraLaws : public testing::TestWithParam<CameraIntrinsics> {};

TEST_P(CameraLaws, AllHold) {
  plugins::LawReport report;
  plugins::try_camera(GetParam(), report);
  EXPECT_EQ(report.text(), "");
  // Of a camera whose rays start at many places no radian is a pixel's alone.
  EXPECT_EQ(report.laws().size(), make_camera(GetParam())->is_central() ? 10U : 9U);
}

INSTANTIATE_TEST_SUITE_P(AllModels, CameraLaws, testing::ValuesIn(examples()),
                         [](const auto& example) {
                           return fmt::format("{}_{}", example.param.model, example.index);
                         });

TEST(CameraModels, EachIsTriedByTheLaws) {
  for (const geo::CameraModelInfo& info : geo::camera_models())
    EXPECT_TRUE(std::any_of(examples().begin(), examples().end(), [&](const CameraIntrinsics& e) {
      return e.model == info.name;
    })) << info.name;
}

}  // namespace
}  // namespace terracast::test
