// What a user of TartanAir V1 reads: images by OpenCV, arrays by an npy reader, poses as text.

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

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

const TinyCaptureOptions kPair{
    .num_frames = 3, .has_tartan2 = false, .has_mcs4 = false, .has_tartan_v1 = true};

/// The capture is drawn and exported once for all tests of a process.
struct TartanAirV1 : testing::Test {
  static inline std::unique_ptr<ScratchFolder> folder;
  void SetUp() override {
    if (folder) return;
    folder = std::make_unique<ScratchFolder>();
    write_tiny_capture(*folder / "capture", kPair);
    run_export(*folder / "capture", "format = \"tartanair_v1\"", *folder / "out");
  }
  static void TearDownTestSuite() { folder.reset(); }

  fs::path root() const { return *folder / "out/tartanair_v1"; }
  fs::path trajectory() const { return root() / "TinyWorld/Easy/P000"; }
  Array array(const std::string& path) const { return parse_npy(slurp(trajectory() / path)); }
  TinyScene scene;

  struct Pose {
    Vector3d position;
    Matrix3d ned_from_frd;
  };
  std::vector<Pose> poses(const std::string& camera) const {
    std::vector<Pose> result;
    for (const auto& row : read_rows(trajectory() / ("pose_" + camera + ".txt"))) {
      EXPECT_EQ(row.size(), 7U);
      result.push_back({{row[0], row[1], row[2]},
                        Eigen::Quaterniond(row[6], row[3], row[4], row[5]).toRotationMatrix()});
    }
    return result;
  }
  Vector3d world_from_ned(const Vector3d& ned) const {
    const Json json =
        Json::read(root() / "dataset.json").at("sequences").at(std::size_t{0}).at("origin");
    const geo::Geodetic origin{json.at("lat_deg").number(), json.at("lon_deg").number(),
                               json.at("height_m").number()};
    return tangent_change(origin, scene.origin)({ned.y(), ned.x(), -ned.z()});
  }
};

TEST_F(TartanAirV1, LayoutIsTheFormats) {
  for (const char* side : {"left", "right"}) {
    for (int frame = 0; frame < 3; ++frame) {
      const auto file = [&](const char* kind, const char* suffix) {
        return trajectory() / fmt::format("{0}_{1}/{2:06}_{1}{3}", kind, side, frame, suffix);
      };
      const cv::Mat image = cv::imread(file("image", ".png").string(), cv::IMREAD_UNCHANGED);
      EXPECT_EQ(image.type(), CV_8UC3);
      EXPECT_EQ(image.size(), cv::Size(640, 480));
      EXPECT_EQ(parse_npy(slurp(file("depth", "_depth.npy"))).type, "<f4");
      EXPECT_EQ(parse_npy(slurp(file("seg", "_seg.npy"))).type, "|u1");
    }
    EXPECT_EQ(poses(side).size(), 3U);
  }
  int num_files = 0;
  for ([[maybe_unused]] const auto& entry : fs::directory_iterator(trajectory() / "flow"))
    ++num_files;
  EXPECT_EQ(num_files, 4);  // two pairs of frames, flow and mask
  EXPECT_EQ(
      Json::read(root() / "TinyWorld/seg_label_map.json").at("name_map").at("grass").integer(), 5);
}

TEST_F(TartanAirV1, DepthsBackProjectOntoTheSceneAndClassesAreTheCaptures) {
  const capture::SequenceInfo info = tiny_sequence(kPair);
  for (int k = 0; k < 2; ++k) {
    const std::string side = info.cameras[static_cast<std::size_t>(k)].name;
    const Pose at = poses(side).at(1);
    const Array depth = array("depth_" + side + "/000001_" + side + "_depth.npy");
    const Array seg = array("seg_" + side + "/000001_" + side + "_seg.npy");
    ASSERT_EQ(depth.shape, (std::vector<int>{480, 640}));
    ASSERT_EQ(seg.shape, depth.shape);
    const capture::CameraFrame truth = tiny_frame(kPair, info, 1, k);
    int num_sky = 0;
    for (int v = 1; v < 480; v += 7) {
      for (int u = 3; u < 640; u += 7) {
        const auto i = static_cast<std::size_t>(640 * v + u);
        EXPECT_EQ(seg.values[i], static_cast<float>(truth.semantic_id(u, v)));
        const double d = static_cast<double>(depth.values[i]);
        if (d == 1e5) {
          ++num_sky;
          EXPECT_EQ(seg.values[i], 0.0F);
          continue;
        }
        const Vector3d frd(d, (u + 0.5 - 320.0) / 320.0 * d, (v + 0.5 - 240.0) / 320.0 * d);
        // float32 range and depth, and the text of the pose.
        EXPECT_LE(scene.distance_to_surface(world_from_ned(at.ned_from_frd * frd + at.position)),
                  1.3e-7 * frd.norm() + 1e-7);
      }
    }
    EXPECT_GT(num_sky, 100);
  }
}

TEST_F(TartanAirV1, FlowIsWhereTheNextFrameSeesThePoint) {
  const std::vector<Pose> pose = poses("left");
  int num_seen = 0, num_hidden = 0, num_out = 0;
  for (std::size_t frame = 0; frame < 2; ++frame) {
    const std::string stem = fmt::format("flow/{:06}_{:06}", frame, frame + 1);
    const Array flow = array(stem + "_flow.npy"), mask = array(stem + "_mask.npy");
    const Array depth = array(fmt::format("depth_left/{:06}_left_depth.npy", frame));
    ASSERT_EQ(flow.type, "<f4");
    ASSERT_EQ(flow.shape, (std::vector<int>{480, 640, 2}));
    ASSERT_EQ(mask.type, "|u1");
    ASSERT_EQ(mask.shape, (std::vector<int>{480, 640}));
    const Pose& here = pose[frame];
    const Pose& there = pose[frame + 1];
    for (int v = 1; v < 480; v += 5) {
      for (int u = 4; u < 640; u += 5) {
        const auto i = static_cast<std::size_t>(640 * v + u);
        const double d = static_cast<double>(depth.values[i]);
        const bool is_sky = d == 1e5;
        const Vector3d ray(1.0, (u + 0.5 - 320.0) / 320.0, (v + 0.5 - 240.0) / 320.0);
        const Vector3d ned = here.ned_from_frd * (ray * d) + here.position;
        const Vector3d frd = there.ned_from_frd.transpose() *
                             (is_sky ? Vector3d(here.ned_from_frd * ray) : ned - there.position);
        ASSERT_GT(frd.x(), 0.0);
        const double u_to = 320.0 + 320.0 * frd.y() / frd.x(),
                     v_to = 240.0 + 320.0 * frd.z() / frd.x();
        // float32 of depth (3e-8 relative, at most 10 px of parallax) and of the flow itself.
        EXPECT_NEAR(static_cast<double>(flow.values[2 * i]), u_to - (u + 0.5), 2e-5);
        EXPECT_NEAR(static_cast<double>(flow.values[2 * i + 1]), v_to - (v + 0.5), 2e-5);
        const double border = std::min({u_to, v_to, 640.0 - u_to, 480.0 - v_to});
        if (std::abs(border) < 1e-4) continue;
        const Vector3d eye = world_from_ned(there.position);
        const Vector3d place = world_from_ned(ned);
        const bool is_hidden = is_sky || scene.is_hidden(eye, eye + (place - eye) * (1.0 - 1e-5));
        const float expected = border < 0.0 ? 100.0F : is_hidden ? 1.0F : 0.0F;
        EXPECT_EQ(mask.values[i], expected) << frame << " " << u << " " << v;
        (border < 0.0 ? num_out : is_hidden ? num_hidden : num_seen) += 1;
      }
    }
  }
  EXPECT_GT(num_seen, 1000);
  EXPECT_GT(num_hidden, 100);
  EXPECT_GT(num_out, 100);
}

TEST(TartanAirV1Check, OnlyTheFormatsCamerasFit) {
  const auto cameras = tiny_sequence(kPair).cameras;
  const auto options = export_options("format = \"tartanair_v1\"");
  const auto refuse = [&](const std::vector<std::string>& words, auto&& change) {
    auto changed = cameras;
    change(changed);
    expect_error(ErrorKind::Config, words, [&] { options.exporter().check(changed); });
  };
  EXPECT_NO_THROW(options.exporter().check(cameras));
  refuse({"640 x 640", "640 x 480"}, [](auto& c) { c[0].intrinsics.height_px = 640; });
  refuse({"239.5", "(320, 240)"}, [](auto& c) { c[1].intrinsics.parameters[3] = 239.5; });
  refuse({"0.3 m", "0.25 m"}, [](auto& c) { c[1].rig_from_camera.translation.y() -= 0.05; });
  refuse({"tartan_v1"}, [](auto& c) { c[0].rig = c[1].rig = "tartan"; });
  expect_error(ErrorKind::Config, {"a/b"}, [&] {
    export_options("format = \"tartanair_v1\"\nenvironment = \"a/b\"").exporter().check(cameras);
  });
}

TEST_F(TartanAirV1, GroundAsDeepAsTheSkyIsRefused) {
  expect_error(ErrorKind::Input, {"tartanair_v1", "frame", "pixel", "sky_depth_m"}, [&] {
    run_export(*folder / "capture", "format = \"tartanair_v1\"\nsky_depth_m = 100",
               *folder / "near");
  });
}

}  // namespace
}  // namespace terracast::test
