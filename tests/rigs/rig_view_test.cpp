#include "rigs/rig_view.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>

#include "core/registry.h"
#include "core/toml_reader.h"
#include "geo/units.h"
#include "rigs/picture/panels.h"
#include "rigs/picture/rig_picture.h"
#include "rigs/picture/stroke_font.h"
#include "rigs/rig_format.h"
#include "tests/rigs/shipped_rigs.h"

namespace terracast::rigs {
namespace {

rigs::RigOptions rig_from(const std::string& toml) {
  rigs::RigOptions rig;
  core::TomlDocument::parse(toml, "rig.toml").read(rig);
  return rig;
}

TEST(FieldOfView, IsThatOfThePaperOptics) {
  const RigView aces9(shipped_rig("aces9"));
  const FieldOfView view = field_of_view(aces9.model(0));
  // 2 atan(d / 2 f), and of 360 rows of square pixels.
  EXPECT_NEAR(view.horizontal_deg, 2.0 * geo::degrees_from_radians(std::atan(5.568 / 2.0 / 3.240)),
              1e-9);
  EXPECT_NEAR(view.vertical_deg,
              2.0 * geo::degrees_from_radians(std::atan(5.568 * 360.0 / 640.0 / 2.0 / 3.240)),
              1e-9);
}

TEST(RigView, SharesOfTheSphereAreThoseOfPyramids) {
  const RigView aces9(shipped_rig("aces9"));
  const FieldOfView view = field_of_view(aces9.model(0));
  // Solid angle of a right pyramid over a rectangle.
  const double steradians =
      4.0 * std::asin(std::sin(0.5 * geo::radians_from_degrees(view.horizontal_deg)) *
                      std::sin(0.5 * geo::radians_from_degrees(view.vertical_deg)));
  double seen = 0.0;
  for (int count = 1; count <= 9; ++count) seen += count * aces9.share_seen_by(count);
  EXPECT_NEAR(seen, 9.0 * steradians / (4.0 * std::numbers::pi), 9.0 * 0.0005);
}

TEST(RigView, ACubeSeesEveryDirectionOnce) {
  const RigView cube(
      rig_from("name = \"c\"\ntemplate = \"cube\"\n[[cameras]]\nname = \"cam\"\nwidth_px = 64\n"
               "height_px = 64\nfx_px = 32.0\n"));
  EXPECT_NEAR(cube.share_seen_by(1), 1.0,
              1e-3);  // rays along edges may fall to both sides, or none
  EXPECT_NEAR(cube.overlap(0, 1), 0.0, 1e-3);
  EXPECT_EQ(cube.overlap(3, 3), 1.0);
}

TEST(RigView, OverlapsAreThoseOfTheImages) {
  const RigView pair(
      rig_from("name = \"p\"\ntemplate = \"stereo\"\nvergence_deg = 45.0\n[[cameras]]\nname = "
               "\"cam\"\nwidth_px = 400\n"
               "height_px = 100\nfx_px = 200.0\n"));
  EXPECT_NEAR(field_of_view(pair.model(0)).horizontal_deg, 90.0, 1e-9);
  const double shared = pair.overlap(0, 1);
  EXPECT_NEAR(shared, pair.overlap(1, 0), 0.01);
  // By numerical integration over the pixels of one image: solid angle of each that the other one sees.
  double both = 0.0, all = 0.0;
  const Eigen::Quaterniond right_from_left =
      pair.cameras()[1].rig_from_camera.rotation.conjugate() *
      pair.cameras()[0].rig_from_camera.rotation;
  for (int y = 0; y < 100; ++y)
    for (int x = 0; x < 400; ++x) {
      const Eigen::Vector3d ray((x + 0.5 - 200.0) / 200.0, (y + 0.5 - 50.0) / 200.0, 1.0);
      const double angle = std::pow(ray.norm(), -3.0);
      const Eigen::Vector3d other = right_from_left * ray;
      all += angle;
      if (other.z() > 0.0 && std::abs(other.x() / other.z()) < 1.0 &&
          std::abs(other.y() / other.z()) < 0.25)
        both += angle;
    }
  EXPECT_NEAR(shared, both / all, 0.005);
}

TEST(RigText, PrintsKTAndTheFieldOfView) {
  const std::string text = rig_text(RigView(shipped_rig("mcs4")));
  EXPECT_THAT(text, testing::HasSubstr("camera 3 cam3"));
  EXPECT_THAT(text, testing::HasSubstr("53.130 x 47.925 deg"));  // 2 atan(1/2), 2 atan(320/720)
  EXPECT_THAT(text, testing::HasSubstr("    720.000000       0.000000     360.000000"));
  EXPECT_THAT(text, testing::HasSubstr("   -0.500000000"));
}

TEST(RigView, TellsSwathsWhereRaysStartAtManyPlaces) {
  const RigView rig(rig_from(
      "name = \"mapper\"\nmount_pitch_deg = 90.0\n"
      "[[cameras]]\nname = \"ortho\"\nmodel = \"orthographic\"\nwidth_px = 400\nheight_px = 300\n"
      "fx_px = 2.0\n"
      "[[cameras]]\nname = \"scanner\"\nmodel = \"pushbroom\"\nwidth_px = 400\n"
      "height_px = 300\nfx_px = 200.0\nfy_px = 1.5\n"));
  const Swath ortho = swath_of(rig.model(0)), scanner = swath_of(rig.model(1));
  EXPECT_NEAR(ortho.width_m, 200.0, 1e-9);
  EXPECT_NEAR(ortho.height_m, 150.0, 1e-9);
  EXPECT_EQ(scanner.width_m, 0.0);
  EXPECT_NEAR(scanner.height_m, 200.0, 1e-9);
  const std::string text = rig_text(rig);
  EXPECT_THAT(text, testing::HasSubstr("200.000 x 150.000 m, horizontally and vertically, at any"));
  EXPECT_THAT(text, testing::HasSubstr("90.000 deg across the way, 200.000 m of it"));
  // What is far beyond them they see no share of.
  EXPECT_EQ(rig.share_seen_by(0), 1.0);
  EXPECT_EQ(rig.overlap(0, 1), 0.0);
  // A box, and a sheet that opens: as wide where its rays start, and twice as wide as it is deep at a depth.
  const std::vector<BorderRay> border = border_of(rig.model(0), 4);
  ASSERT_EQ(border.size(), 16U);
  EXPECT_LT((border[0].origin_camera - Eigen::Vector3d(-100.0, -75.0, 0.0)).norm(), 1e-9);
  EXPECT_LT((border[4].origin_camera - Eigen::Vector3d(100.0, -75.0, 0.0)).norm(), 1e-9);
  for (const BorderRay& ray : border) EXPECT_EQ(ray.direction_camera, Eigen::Vector3d::UnitZ());
  const std::vector<BorderRay> sheet = border_of(rig.model(1), 4);
  EXPECT_LT((sheet[0].origin_camera - Eigen::Vector3d(0.0, -100.0, 0.0)).norm(), 1e-9);
  EXPECT_LT((sheet[0].direction_camera - Eigen::Vector3d(-1.0, 0.0, 1.0)).norm(), 1e-12);
  const std::string svg = draw_rig(rig).svg();
  EXPECT_EQ(svg.find("nan"), std::string::npos);
  EXPECT_THAT(svg, testing::HasSubstr("200 m"));
}

TEST(RigPicture, HoldsEveryCameraInBothForms) {
  for (const std::filesystem::path& file : shipped_rigs()) {
    const RigView rig(read_rig(file));
    const Drawing drawing = draw_rig(rig);
    const std::string svg = drawing.svg();
    EXPECT_EQ(svg, draw_rig(rig).svg());
    EXPECT_LT(svg.size(), 400000U) << file;
    EXPECT_EQ(svg.find("nan"), std::string::npos) << file;
    for (const auto& camera : rig.cameras())
      EXPECT_THAT(svg, testing::HasSubstr(camera.name.substr(0, 10))) << file;
    EXPECT_EQ(drawing.raster().width(), 1200);
  }
}

TEST(RigPicture, DrawsEveryCameraInItsOwnColor) {
  const RigView rig(shipped_rig("mcs4"));
  const core::Image8 image = draw_rig(rig).raster();
  for (std::size_t i = 0; i < rig.cameras().size(); ++i) {
    const Color color = color_of_camera(i);
    int num_pixels = 0;
    for (int y = 0; y < image.height(); ++y)
      for (int x = 0; x < image.width(); ++x)
        num_pixels += image(x, y, 0) == color.red && image(x, y, 1) == color.green &&
                              image(x, y, 2) == color.blue
                          ? 1
                          : 0;
    // The dot of its centre alone has a diameter of 7 pixels.
    EXPECT_GE(num_pixels, 20) << i;
  }
}

TEST(StrokeFont, HasAllLettersThatNamesTake) {
  for (char c = '0'; c <= 'z'; ++c) {
    if (std::isalnum(static_cast<unsigned char>(c)) == 0 && c != '_') continue;
    const StrokedText text = stroked_text(std::string(1, c), 16.0);
    ASSERT_FALSE(text.strokes.empty()) << c;
    for (const auto& stroke : text.strokes) {
      EXPECT_GE(stroke.size(), 2U) << c;
      for (const auto& point : stroke) {
        EXPECT_GE(point.x(), 0.0) << c;
        EXPECT_LE(point.x(), 8.0) << c;
        EXPECT_LE(std::abs(point.y()), 12.0) << c;
      }
    }
  }
}

TEST(RigOpencv, OpencvReadsAndProjectsAlike) {
  const std::filesystem::path file = test_folder("opencv") / "rig.yaml";
  const std::string compound_eye =
      "name = \"r\"\ntemplate = \"compound_eye\"\nring_cameras = [1, 8]\nring_pitch_deg = [0.0, "
      "54.0]\n"
      "[[cameras]]\nname = \"c\"\nwidth_px = 640\nheight_px = 360\nfx_px = 372.0\nfy_px = 370.0\n"
      "principal_point_px = [321.0, 179.0]\n";
  for (const std::string lens :
       {"", "model = \"opencv\"\nk1 = -0.1\nk2 = 0.01\np1 = 1e-3\np2 = -2e-3\n",
        "model = \"full_opencv\"\nk1 = -0.1\nk2 = 0.01\np1 = 1e-3\np2 = -2e-3\nk3 = 3e-3\nk4 = "
        "-0.02\n"
        "k5 = 4e-3\nk6 = 5e-4\n",
        "model = \"opencv_fisheye\"\nk1 = 0.01\nk2 = -2e-3\nk3 = 1e-3\nk4 = -1e-4\n"}) {
    SCOPED_TRACE(lens);
    const rigs::RigOptions rig = rig_from(compound_eye + lens);
    core::find_registered(rig_formats(), "format", "opencv").write(rig, file);
    const RigView view(rig);
    const cv::FileStorage storage(file.string(), cv::FileStorage::READ);
    ASSERT_EQ(storage["cameras"].size(), 9U);
    for (std::size_t i = 0; i < 9; ++i) {
      const cv::FileNode node = storage["cameras"][static_cast<int>(i)];
      cv::Mat k, distortion, r, t, rotation_vector;
      node["camera_matrix"] >> k;
      node["distortion_coefficients"] >> distortion;
      node["R"] >> r;
      node["T"] >> t;
      EXPECT_EQ(static_cast<int>(node["image_width"]), 640);
      cv::Rodrigues(r, rotation_vector);
      // A point of the rig before the camera, in OpenCV's axes of the rig: x right, y down, z forward.
      const geo::Rigid3d& rig_from_camera = view.cameras()[i].rig_from_camera;
      const Eigen::Vector3d point_camera(0.3, -0.2, 2.0);
      const Eigen::Vector3d p = rig_from_camera * point_camera;
      const std::vector<cv::Point3d> points = {{-p.y(), -p.z(), p.x()}};
      std::vector<cv::Point2d> pixels;
      if (static_cast<int>(node["fisheye_model"]) != 0)
        cv::fisheye::projectPoints(points, pixels, rotation_vector, t, k, distortion);
      else
        cv::projectPoints(points, rotation_vector, t, k, distortion, pixels);
      const Eigen::Vector2d expected = *view.model(i).pixel_from_ray(point_camera);
      // Rodrigues' vector and back keeps a nanopixel.
      EXPECT_NEAR(pixels[0].x + 0.5, expected.x(), 1e-8);
      EXPECT_NEAR(pixels[0].y + 0.5, expected.y(), 1e-8);
    }
  }
}

}  // namespace
}  // namespace terracast::rigs
