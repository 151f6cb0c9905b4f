// What a user of KITTI reads: calib, poses and times as text, images by OpenCV, depth by an npy
// reader.

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "core/json.h"
#include "tests/export/exported.h"
#include "tests/export/readers.h"

namespace terracast::test {
namespace {

namespace fs = std::filesystem;
using core::ErrorKind;
using core::Json;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using Projection = Eigen::Matrix<double, 3, 4>;

const TinyCaptureOptions kSmall{.num_frames = 4, .has_tartan2 = false};

struct Kitti : testing::Test {
  ScratchFolder scratch;
  fs::path capture = write_tiny_capture(scratch / "capture", kSmall).parent_path();
  fs::path root = scratch / "out" / "kitti";
  fs::path sequence = root / "dataset/sequences/00";
  capture::SequenceInfo info = tiny_sequence(kSmall);
  TinyScene scene;

  void run(const std::string& more = "") {
    run_export(capture, "format = \"kitti\"\n" + more, scratch / "out");
  }
  Array depth(int frame) const {
    return parse_npy(slurp(sequence / fmt::format("depth_2/{:06}.npy", frame)));
  }
  cv::Mat disparity(int frame) const {
    return cv::imread((sequence / fmt::format("disp_2/{:06}.png", frame)).string(),
                      cv::IMREAD_UNCHANGED);
  }
  std::map<std::string, Projection> calibration() const {
    std::map<std::string, Projection> matrices;
    std::istringstream lines(slurp(sequence / "calib.txt"));
    for (std::string line; std::getline(lines, line);) {
      std::istringstream words(line.substr(line.find(": ") + 2));
      Projection& matrix = matrices[line.substr(0, line.find(": "))];
      for (int i = 0; i < 12; ++i) EXPECT_TRUE(words >> matrix(i / 4, i % 4)) << line;
    }
    return matrices;
  }
  const capture::CameraFrame& facts(int frame) {
    const auto found = facts_.find(frame);
    if (found != facts_.end()) return found->second;
    return facts_[frame] = tiny_frame(kSmall, info, frame, 0);
  }
  std::map<int, capture::CameraFrame> facts_;
  struct Pose {
    Matrix3d rotation;
    Vector3d translation;
  };
  std::vector<Pose> poses() const {
    std::vector<Pose> result;
    for (const auto& row : read_rows(root / "dataset/poses/00.txt")) {
      EXPECT_EQ(row.size(), 12U);
      Projection matrix;
      for (int i = 0; i < 12; ++i) matrix(i / 4, i % 4) = row[static_cast<std::size_t>(i)];
      result.push_back({matrix.leftCols<3>(), matrix.col(3)});
    }
    return result;
  }
};

TEST_F(Kitti, LayoutIsTheFormats) {
  run();
  for (const char* name : {"image_0", "image_1", "image_2", "image_3", "disp_2"})
    for (int frame = 0; frame < 4; ++frame)
      EXPECT_TRUE(fs::exists(sequence / name / fmt::format("{:06}.png", frame))) << name;
  const auto times = read_rows(sequence / "times.txt");
  ASSERT_EQ(times.size(), 4U);
  for (std::size_t i = 0; i < 4; ++i)
    EXPECT_NEAR(times[i].at(0), 0.1 * static_cast<double>(i), 1e-9);
}

TEST_F(Kitti, CalibrationHasCentresAtWholeNumbersAndNegativeRightCameras) {
  run();
  const auto matrices = calibration();
  ASSERT_EQ(matrices.size(), 5U);
  for (int k = 0; k < 4; ++k) {
    Projection expected;
    expected << 90, 0, 44.5, k % 2 == 1 ? -90 * 0.5 : 0, 0, 90, 39.5, 0, 0, 0, 1, 0;
    EXPECT_TRUE(matrices.at(fmt::format("P{}", k)).isApprox(expected, 1e-12)) << k;
  }
  // A velodyne's forward is the camera's z, its left the camera's -x, its up the camera's -y.
  const Projection& velodyne = matrices.at("Tr");
  EXPECT_TRUE((velodyne * Eigen::Vector4d(1, 2, 3, 1)).isApprox(Vector3d(-2, -3, 1)));
}

TEST_F(Kitti, PosesBeginWithTheIdentityAndAreTheFlights) {
  run();
  EXPECT_EQ(slurp(root / "dataset/poses/00.txt").substr(0, 37),
            "1.000000000000e+00 0.000000000000e+00");
  const std::vector<Pose> pose = poses();
  ASSERT_EQ(pose.size(), 4U);
  const geo::Rigid3d first = tiny_world_from_camera(kSmall, 0, info.cameras[0]);
  for (int frame = 0; frame < 4; ++frame) {
    const auto& at = pose[static_cast<std::size_t>(frame)];
    EXPECT_LE((at.rotation.transpose() * at.rotation - Matrix3d::Identity()).norm(), 1e-11);
    const geo::Rigid3d truth = tiny_world_from_camera(kSmall, frame, info.cameras[0]);
    const Vector3d point(4.0, -2.0, 60.0);
    const Vector3d in_first = first.rotation.conjugate() * (truth * point - first.translation);
    EXPECT_LE((at.rotation * point + at.translation - in_first).norm(),
              2e-10);  // 12 digits of 60 m
  }
}

TEST_F(Kitti, DepthsOfConsecutiveFramesAgree) {
  run();
  const Projection p2 = calibration().at("P2");
  const std::vector<Pose> pose = poses();
  int num_compared = 0;
  for (int frame = 0; frame + 1 < 4; ++frame) {
    const Array here = depth(frame), there = depth(frame + 1);
    ASSERT_EQ(here.type, "<f4");
    ASSERT_EQ(here.shape, (std::vector<int>{80, 90}));
    const auto& a = pose[static_cast<std::size_t>(frame)];
    const auto& b = pose[static_cast<std::size_t>(frame) + 1];
    const geo::Rigid3d world = tiny_world_from_camera(kSmall, 0, info.cameras[0]);
    for (int v = 0; v < 80; ++v) {
      for (int u = 0; u < 90; ++u) {
        const double d = static_cast<double>(here.values[static_cast<std::size_t>(90 * v + u)]);
        if (d == 0.0) continue;
        const Vector3d point((u - p2(0, 2)) / p2(0, 0) * d, (v - p2(1, 2)) / p2(1, 1) * d, d);
        const Vector3d in_first = a.rotation * point + a.translation;
        EXPECT_LE(scene.distance_to_surface(world * in_first), 1.3e-7 * point.norm() + 1e-8);
        const Vector3d next = b.rotation.transpose() * (in_first - b.translation);
        // On the plane 1 / z is linear in the pixel: interpolating it is exact where all four are
        // ground.
        const double x = p2(0, 0) * next.x() / next.z() + p2(0, 2),
                     y = p2(1, 1) * next.y() / next.z() + p2(1, 2);
        if (!(next.z() > 0.0) || !(x >= 0.0) || !(y >= 0.0) || !(x < 89.0) || !(y < 79.0)) continue;
        const int x0 = static_cast<int>(x), y0 = static_cast<int>(y);
        const capture::CameraFrame& next_facts = facts(frame + 1);
        double inverse = 0.0;
        bool is_ground = true;
        for (int k = 0; k < 4; ++k) {
          const int xk = x0 + k % 2, yk = y0 + k / 2;
          is_ground = is_ground && next_facts.semantic_id(xk, yk) > 3;
          const double weight =
              (k % 2 == 1 ? x - x0 : x0 + 1 - x) * (k / 2 == 1 ? y - y0 : y0 + 1 - y);
          inverse +=
              weight / static_cast<double>(there.values[static_cast<std::size_t>(90 * yk + xk)]);
        }
        if (!is_ground || facts(frame).semantic_id(u, v) <= 3) continue;
        EXPECT_NEAR(inverse * next.z(), 1.0, 3e-7) << frame << " " << u << " " << v;
        ++num_compared;
      }
    }
  }
  EXPECT_GT(num_compared, 3000);
}

TEST_F(Kitti, DisparityIsFocalLengthTimesBaselineOverDepth) {
  run("max_relative_depth_error = 0.05");
  int num_held = 0, num_far = 0;
  double worst = 0.0;
  for (int frame = 0; frame < 4; ++frame) {
    const cv::Mat counts = disparity(frame);
    ASSERT_EQ(counts.type(), CV_16UC1);
    const Array depth_m = depth(frame);
    for (int v = 0; v < 80; ++v) {
      for (int u = 0; u < 90; ++u) {
        const double z = static_cast<double>(depth_m.values[static_cast<std::size_t>(90 * v + u)]);
        const int count = counts.at<std::uint16_t>(v, u);
        if (z == 0.0) {
          EXPECT_EQ(count, 0);
          continue;
        }
        const double exact = 256.0 * 90.0 * 0.5 / z;
        if (exact < 9.5) {  // 10 is the least count whose half step is 5 %
          EXPECT_EQ(count, 0);
          ++num_far;
          continue;
        }
        EXPECT_EQ(count, static_cast<int>(std::lround(exact)));
        worst = std::max(worst, std::abs(exact / count - 1.0));
        ++num_held;
      }
    }
  }
  EXPECT_LE(worst, 0.05 + 1e-12);
  EXPECT_GT(num_far, 100);
  const Json stated = Json::read(root / "dataset.json").at("disparity");
  EXPECT_TRUE(stated.at("stored").boolean());
  EXPECT_EQ(stated.at("num_held").integer(), num_held);
  EXPECT_EQ(stated.at("num_too_far").integer(), num_far);
  EXPECT_EQ(stated.at("min_count").integer(), 10);
  EXPECT_NEAR(stated.at("worst_relative_depth_error").number(), worst, 1e-12);
}

TEST_F(Kitti, DisparityThatCannotBeHeldIsLeftOutOrRefused) {
  // Half a count within 0.1 %: 500 counts, which is 23 m at these small cameras.
  const std::string strict = "max_relative_depth_error = 0.001\n";
  run(strict);
  EXPECT_FALSE(fs::exists(sequence / "disp_2"));
  EXPECT_FALSE(Json::read(root / "dataset.json").at("disparity").at("stored").boolean());
  EXPECT_EQ(slurp(root / "dataset.json").find("disp_2/0"), std::string::npos);
  expect_error(ErrorKind::Input, {"frame", "pixel", " m", "max_relative_depth_error"},
               [&] { run(strict + "disparity = \"required\""); });
  EXPECT_FALSE(fs::exists(root / "dataset.json"));  // nothing unfinished looks finished
  run(strict + "disparity = \"off\"");
  EXPECT_FALSE(fs::exists(sequence / "disp_2"));
  EXPECT_TRUE(fs::exists(root / "dataset.json"));
}

TEST_F(Kitti, ImagesAreTheCapturesInColourAndGrey) {
  run();
  for (const auto& [grey_name, color_name, index] :
       {std::tuple("image_0", "image_2", 0), std::tuple("image_1", "image_3", 3)}) {
    const cv::Mat color =
        cv::imread((sequence / color_name / "000002.png").string(), cv::IMREAD_UNCHANGED);
    const cv::Mat grey =
        cv::imread((sequence / grey_name / "000002.png").string(), cv::IMREAD_UNCHANGED);
    ASSERT_EQ(color.type(), CV_8UC3);
    ASSERT_EQ(grey.type(), CV_8UC1);
    const capture::CameraFrame truth = tiny_frame(kSmall, info, 2, index);
    cv::Mat expected;
    cv::cvtColor(color, expected, cv::COLOR_BGR2GRAY);
    for (int v = 0; v < 80; ++v) {
      for (int u = 0; u < 90; ++u) {
        for (int k = 0; k < 3; ++k)
          ASSERT_EQ(color.at<cv::Vec3b>(v, u)[2 - k], truth.color(u, v, k));
        ASSERT_NEAR(grey.at<std::uint8_t>(v, u), expected.at<std::uint8_t>(v, u),
                    1);  // a tie's rounding
      }
    }
  }
}

TEST_F(Kitti, SequencesAreNumberedFromTheGivenOne) {
  run("sequence = \"07\"");
  EXPECT_TRUE(fs::exists(root / "dataset/sequences/07/calib.txt"));
  EXPECT_TRUE(fs::exists(root / "dataset/poses/07.txt"));
  EXPECT_EQ(
      Json::read(root / "dataset.json").at("sequences").at(std::size_t{0}).at("name").string(),
      "07");
}

TEST(KittiCheck, OnlyARectifiedPairFits) {
  const auto cameras = tiny_sequence(kSmall).cameras;
  const auto refuse = [&](const std::string& toml, const std::vector<std::string>& words,
                          auto&& change) {
    auto changed = cameras;
    change(changed);
    expect_error(ErrorKind::Config, words,
                 [&] { export_options("format = \"kitti\"\n" + toml).exporter().check(changed); });
  };
  const auto same = [](auto&) {};
  EXPECT_NO_THROW(export_options("format = \"kitti\"").exporter().check(cameras));
  refuse("right = \"cam1\"", {"turned by", "parallel"}, same);
  refuse("right = \"cam7\"", {"cam7", "cam3"}, same);
  refuse("rig = \"mcs5\"", {"mcs5", "mcs4"}, same);
  refuse("left = \"cam3\"\nright = \"cam0\"", {"+x"}, same);
  refuse("sequence = \"0\"", {"two digits"}, same);
  refuse("", {"differ"}, [](auto& c) { c[3].intrinsics.parameters[0] = 91.0; });
  refuse("", {"+x"}, [](auto& c) { c[3].rig_from_camera.translation.z() += 1e-6; });
}

TEST(KittiCheck, OblongPixelsAreHeld) {
  auto cameras = tiny_sequence(kSmall).cameras;
  for (auto& camera : cameras) camera.intrinsics.parameters[1] = 80.0;
  EXPECT_NO_THROW(export_options("format = \"kitti\"").exporter().check(cameras));
}

}  // namespace
}  // namespace terracast::test
