// What a user of TartanAir reads: images by OpenCV, npz by a zip library, poses as text, in the
// format's own frames.

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <map>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <sstream>

#include "core/error.h"
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

const TinyCaptureOptions kPair{.num_frames = 3, .has_mcs4 = false};

/// The capture is drawn and exported once for all tests of a process.
struct TartanAir : testing::Test {
  static inline std::unique_ptr<ScratchFolder> folder;
  void SetUp() override {
    if (folder) return;
    folder = std::make_unique<ScratchFolder>();
    write_tiny_capture(*folder / "capture", kPair);
    run_export(*folder / "capture", "format = \"tartanair\"", *folder / "out");
  }
  static void TearDownTestSuite() { folder.reset(); }

  fs::path root() const { return *folder / "out" / "tartanair"; }
  fs::path trajectory() const { return root() / "TinyWorld" / "Data_easy" / "P000"; }
  geo::Geodetic origin() const {
    const Json json =
        Json::read(root() / "dataset.json").at("sequences").at(std::size_t{0}).at("origin");
    return {json.at("lat_deg").number(), json.at("lon_deg").number(), json.at("height_m").number()};
  }
  TinyScene scene;

  /// As the dataset's Python reader does: OpenCV's four bytes of a pixel are a little-endian float.
  cv::Mat depth(const std::string& camera, int frame) const {
    const std::string file =
        (trajectory() / ("depth_" + camera) / fmt::format("{:06}_{}_depth.png", frame, camera))
            .string();
    const cv::Mat rgba = cv::imread(file, cv::IMREAD_UNCHANGED);
    EXPECT_EQ(rgba.type(), CV_8UC4) << file;
    cv::Mat depth_m(rgba.rows, rgba.cols, CV_32F);
    std::memcpy(depth_m.data, rgba.data, rgba.total() * 4);
    return depth_m;
  }

  /// Takes points of the world (the capture's) into the dataset's NED frame.
  Vector3d ned_from_world(const Vector3d& point_world) const {
    const Vector3d enu = tangent_change(scene.origin, origin())(point_world);
    return {enu.y(), enu.x(), -enu.z()};
  }
  std::function<Vector3d(const Vector3d&)> world_from_ned() const {
    const TangentChange world_from_local = tangent_change(origin(), scene.origin);
    return [=](const Vector3d& ned) { return world_from_local({ned.y(), ned.x(), -ned.z()}); };
  }

  struct Pose {
    Vector3d position;
    Matrix3d ned_from_frd;
    Vector3d frd_from_ned(const Vector3d& point) const {
      return ned_from_frd.transpose() * (point - position);
    }
  };
  std::vector<Pose> poses(const std::string& camera) const {
    std::vector<Pose> result;
    for (const auto& row : read_rows(trajectory() / ("pose_" + camera + ".txt"))) {
      EXPECT_EQ(row.size(), 7U);
      const Eigen::Quaterniond q(row[6], row[3], row[4], row[5]);
      EXPECT_NEAR(q.norm(), 1.0, 1e-14);
      result.push_back({{row[0], row[1], row[2]}, q.toRotationMatrix()});
    }
    return result;
  }
};

TEST_F(TartanAir, LayoutIsTheFormats) {
  for (const char* camera : {"lcam_front", "rcam_front"}) {
    for (const char* kind : {"image", "depth", "seg"}) {
      int num_files = 0;
      for (const auto& entry :
           fs::directory_iterator(trajectory() / (std::string(kind) + "_" + camera))) {
        ++num_files;
        EXPECT_EQ(entry.path().extension(), ".png");
      }
      EXPECT_EQ(num_files, 3) << kind << camera;  // readers pair files by their place in the list
    }
    EXPECT_EQ(poses(camera).size(), 3U);
  }
  EXPECT_TRUE(fs::exists(trajectory() / "flow_lcam_front/000000_000001_lcam_front_flow.npz"));
  EXPECT_TRUE(fs::exists(trajectory() / "flow_lcam_front/000001_000002_lcam_front_flow.npz"));
  EXPECT_FALSE(fs::exists(trajectory() / "flow_lcam_front/000002_000003_lcam_front_flow.npz"));
  const Json labels = Json::read(root() / "TinyWorld/seg_label_map.json").at("name_map");
  EXPECT_EQ(labels.at("sky").integer(), 0);
  EXPECT_EQ(labels.at("soil").integer(), 6);
}

// accumulate_pointcloud's formula: (d, (u - cx) / f d, (v - cy) / f d) in x forward, y right, z
// down.
TEST_F(TartanAir, DepthsBackProjectOntoTheScene) {
  const auto to_world = world_from_ned();
  for (const char* camera : {"lcam_front", "rcam_front"}) {
    const std::vector<Pose> pose = poses(camera);
    for (int frame = 0; frame < 3; ++frame) {
      const cv::Mat depth_m = depth(camera, frame);
      int num_sky = 0;
      for (int v = 3; v < 640; v += 11) {
        for (int u = 2; u < 640; u += 13) {
          const double d = static_cast<double>(depth_m.at<float>(v, u));
          ASSERT_TRUE(d > 0.0);
          if (d >= 1e5) {
            EXPECT_EQ(d, 1e5);
            ++num_sky;
            continue;
          }
          const Vector3d frd(d, (u + 0.5 - 320.0) / 320.0 * d, (v + 0.5 - 320.0) / 320.0 * d);
          const auto& at = pose[static_cast<std::size_t>(frame)];
          const Vector3d world = to_world(at.ned_from_frd * frd + at.position);
          // float32 range and depth: 1.2e-7 of the range; the text of the pose: 1e-9 m and 1e-15.
          EXPECT_LE(scene.distance_to_surface(world), 1.3e-7 * frd.norm() + 1e-7)
              << camera << " " << frame << " " << u << " " << v;
        }
      }
      EXPECT_GT(num_sky, 0);
    }
  }
}

TEST_F(TartanAir, SkyStandsBeyondTheGroundOrIsRefused) {
  run_export(*folder / "capture", "format = \"tartanair\"\nsky_depth_m = 1e6", *folder / "far");
  const fs::path path = "tartanair/TinyWorld/Data_easy/P000/depth_lcam_front";
  const std::string name = "000000_lcam_front_depth.png";
  const cv::Mat coded = cv::imread((*folder / "far" / path / name).string(), cv::IMREAD_UNCHANGED);
  ASSERT_EQ(coded.type(), CV_8UC4);
  const cv::Mat usual = depth("lcam_front", 0);
  float farthest_m = 0.0F;
  for (int v = 0; v < 640; ++v) {
    for (int u = 0; u < 640; ++u) {
      float value_m = 0.0F;
      std::memcpy(&value_m, coded.ptr(v, u), 4);
      const float expected_m = usual.at<float>(v, u);
      ASSERT_EQ(value_m, expected_m == 1e5F ? 1e6F : expected_m);
      if (expected_m != 1e5F) farthest_m = std::max(farthest_m, expected_m);
    }
  }
  EXPECT_EQ(Json::read(*folder / "far/tartanair/dataset.json").at("sky_depth_m").number(), 1e6);
  const std::string near =
      fmt::format("format = \"tartanair\"\nsky_depth_m = {}", static_cast<double>(farthest_m) / 2);
  EXPECT_THROW(run_export(*folder / "capture", near, *folder / "near"), core::Error);
}

TEST_F(TartanAir, PosesAreTheFlights) {
  const capture::SequenceInfo info = tiny_sequence(kPair);
  for (int k = 0; k < 2; ++k) {
    const std::vector<Pose> pose = poses(info.cameras[static_cast<std::size_t>(k)].name);
    for (int frame = 0; frame < 3; ++frame) {
      const geo::Rigid3d truth =
          tiny_world_from_camera(kPair, frame, info.cameras[static_cast<std::size_t>(k)]);
      const auto& at = pose[static_cast<std::size_t>(frame)];
      // Two passages through ecef: 1e-9 m each, and the text.
      EXPECT_LE((at.position - ned_from_world(truth.translation)).norm(), 1e-8);
      // A point 100 m ahead, 3 m right and 2 m below the axis.
      const Vector3d ahead = truth * Vector3d(3.0, 2.0, 100.0);
      EXPECT_LE((at.frd_from_ned(ned_from_world(ahead)) - Vector3d(100.0, 3.0, 2.0)).norm(), 1e-8);
    }
  }
  const auto left = poses("lcam_front"), right = poses("rcam_front");
  for (std::size_t i = 0; i < 3; ++i)
    EXPECT_LE((left[i].frd_from_ned(right[i].position) - Vector3d(0.0, 0.25, 0.0)).norm(), 5e-9);
}

// Everything from the files: a pixel's point, by depth and pose, projects where the flow says;
// masks are the scene's.
TEST_F(TartanAir, FlowIsWhereTheNextFrameSeesThePoint) {
  const std::vector<Pose> pose = poses("lcam_front");
  const auto to_world = world_from_ned();
  int num_covisible = 0, num_hidden = 0, num_left = 0;
  for (int frame = 0; frame + 1 < 3; ++frame) {
    const auto arrays =
        read_npz(trajectory() /
                 fmt::format("flow_lcam_front/{:06}_{:06}_lcam_front_flow.npz", frame, frame + 1));
    ASSERT_EQ(arrays.size(), 6U);
    for (const auto& [direction, from, to] :
         {std::tuple("fwd", frame, frame + 1), std::tuple("bwd", frame + 1, frame)}) {
      const Array& flow = arrays.at(std::string("flow_") + direction);
      const Array& fov = arrays.at(std::string("fov_mask_") + direction);
      const Array& covisible = arrays.at(std::string("covisible_mask_") + direction);
      EXPECT_EQ(flow.type, "<f4");
      EXPECT_EQ(flow.shape, (std::vector<int>{1, 2, 640, 640}));
      EXPECT_EQ(fov.shape, (std::vector<int>{1, 640, 640}));
      EXPECT_EQ(covisible.type, "|b1");
      const cv::Mat depth_m = depth("lcam_front", from);
      const auto& here = pose[static_cast<std::size_t>(from)];
      const auto& there = pose[static_cast<std::size_t>(to)];
      for (int v = 1; v < 640; v += 7) {
        for (int u = 4; u < 640; u += 7) {
          const auto i = static_cast<std::size_t>(v * 640 + u);
          const double d = static_cast<double>(depth_m.at<float>(v, u));
          const Vector3d ray(1.0, (u + 0.5 - 320.0) / 320.0, (v + 0.5 - 320.0) / 320.0);
          const bool is_sky = d >= 1e5;
          const Vector3d frd =
              is_sky ? Vector3d(there.ned_from_frd.transpose() * here.ned_from_frd * ray)
                     : there.frd_from_ned(here.ned_from_frd * (ray * d) + here.position);
          ASSERT_GT(frd.x(), 0.0);
          const double u_to = 320.0 + 320.0 * frd.y() / frd.x(),
                       v_to = 320.0 + 320.0 * frd.z() / frd.x();
          // float32 of depth (3e-8 relative, at most 10 px of parallax) and of the flow itself.
          EXPECT_NEAR(static_cast<double>(flow.values[i]), u_to - (u + 0.5), 2e-5);
          EXPECT_NEAR(static_cast<double>(flow.values[640 * 640 + i]), v_to - (v + 0.5), 2e-5);
          const double border = std::min({u_to, v_to, 640.0 - u_to, 640.0 - v_to});
          if (std::abs(border) > 1e-4) {
            EXPECT_EQ(fov.values[i] != 0.0F, border > 0.0);
          }
          num_left += border < 0.0 ? 1 : 0;
          if (is_sky) {
            EXPECT_EQ(covisible.values[i], 0.0F);
            continue;
          }
          const Vector3d place = to_world(here.ned_from_frd * (ray * d) + here.position);
          const Vector3d eye = to_world(there.position);
          const bool is_hidden = scene.is_hidden(eye, eye + (place - eye) * (1.0 - 1e-5));
          if (std::abs(border) > 1e-4) {
            EXPECT_EQ(covisible.values[i] != 0.0F, border > 0.0 && !is_hidden);
          }
          (covisible.values[i] != 0.0F ? num_covisible : num_hidden) += 1;
        }
      }
    }
  }
  EXPECT_GT(num_covisible, 1000);
  EXPECT_GT(num_hidden, 100);  // behind the wall or out of view
  EXPECT_GT(num_left, 100);
}

TEST_F(TartanAir, ImagesAndClassesAreTheCaptures) {
  const capture::SequenceInfo info = tiny_sequence(kPair);
  const capture::CameraFrame truth = tiny_frame(kPair, info, 1, 1);
  const cv::Mat image = cv::imread(
      (trajectory() / "image_rcam_front/000001_rcam_front.png").string(), cv::IMREAD_UNCHANGED);
  const cv::Mat seg = cv::imread(
      (trajectory() / "seg_rcam_front/000001_rcam_front_seg.png").string(), cv::IMREAD_UNCHANGED);
  ASSERT_EQ(image.type(), CV_8UC3);
  ASSERT_EQ(seg.type(), CV_8UC1);
  for (int v = 0; v < 640; v += 3) {
    for (int u = 0; u < 640; u += 3) {
      for (int k = 0; k < 3; ++k)
        ASSERT_EQ(image.at<cv::Vec3b>(v, u)[2 - k], truth.color(u, v, k));  // OpenCV: B, G, R
      ASSERT_EQ(seg.at<std::uint8_t>(v, u), truth.semantic_id(u, v));
    }
  }
}

TEST_F(TartanAir, PngFlowIsTheOlderForm) {
  const auto arrays = read_npz(trajectory() / "flow_lcam_front/000000_000001_lcam_front_flow.npz");
  run_export(*folder / "capture", "format = \"tartanair\"\nflow = \"png\"", *folder / "png");
  const fs::path file =
      *folder / "png/tartanair/TinyWorld/Data_easy/P000/flow_lcam_front/000000_000001_flow.png";
  const cv::Mat png = cv::imread(file.string(), cv::IMREAD_UNCHANGED);
  ASSERT_EQ(png.type(), CV_16UC3);
  int num_masks[256] = {};
  for (int v = 0; v < 640; ++v) {
    for (int u = 0; u < 640; ++u) {
      const auto i = static_cast<std::size_t>(v * 640 + u);
      const auto& counts =
          png.at<cv::Vec3w>(v, u);  // the reader takes [0] as u, [1] as v, [2] as mask
      const std::uint16_t mask = counts[2];
      ASSERT_LT(mask, 256);
      ++num_masks[mask];
      if (mask == 200) continue;
      ASSERT_NEAR((counts[0] - 32768.0) / 64.0, arrays.at("flow_fwd").values[i], 0.5 / 64.0 + 1e-4);
      ASSERT_NEAR((counts[1] - 32768.0) / 64.0, arrays.at("flow_fwd").values[640 * 640 + i],
                  0.5 / 64.0 + 1e-4);
      ASSERT_EQ(mask == 0, arrays.at("covisible_mask_fwd").values[i] != 0.0F);
      ASSERT_EQ(mask == 100, arrays.at("fov_mask_fwd").values[i] == 0.0F);
    }
  }
  EXPECT_GT(num_masks[0], 0);
  EXPECT_GT(num_masks[1], 0);
  EXPECT_GT(num_masks[100], 0);
}

// Half a step both ways is what a pixel of the older form may be off by, beside float32.
TEST_F(TartanAir, BoundsOfPngFlowHoldItsSteps) {
  const fs::path data = "tartanair/TinyWorld/Data_easy/P000";
  run_export(*folder / "capture", "format = \"tartanair\"\nflow = \"png\"", *folder / "png");
  const auto flow_rounding = [&](const fs::path& root) {
    std::map<std::string, double> cells;  // by frame and camera
    std::istringstream lines(slurp(root / data / "bounds.csv"));
    std::string line;
    std::getline(lines, line);
    while (std::getline(lines, line)) {
      std::istringstream row(line);
      std::vector<std::string> parts;
      for (std::string part; std::getline(row, part, ',');) parts.push_back(part);
      cells[parts.at(0) + "," + parts.at(1)] = std::strtod(parts.at(5).c_str(), nullptr);
    }
    return cells;
  };
  const auto floats = flow_rounding(*folder / "out"), steps = flow_rounding(*folder / "png");
  ASSERT_EQ(floats.size(), 6U);
  ASSERT_EQ(steps.size(), 6U);
  for (const auto& [row, rounding_px] : floats) {
    SCOPED_TRACE(row);
    const bool is_stored = row.ends_with("lcam_front");
    const double half_step_px = is_stored ? std::sqrt(2.0) / 128.0 : 0.0;
    EXPECT_GE(steps.at(row), rounding_px / 1.01 + half_step_px);
    EXPECT_LE(steps.at(row), 1.01 * (rounding_px + half_step_px));
  }

  const auto arrays = read_npz(trajectory() / "flow_lcam_front/000000_000001_lcam_front_flow.npz");
  const std::vector<float>& floats_px = arrays.at("flow_fwd").values;
  const std::vector<double> truth(floats_px.begin(), floats_px.end());
  const fs::path file = *folder / "png" / data / "flow_lcam_front/000000_000001_flow.png";
  const cv::Mat png = cv::imread(file.string(), cv::IMREAD_UNCHANGED);
  double largest_px = 0.0;
  for (int v = 0; v < 640; ++v)
    for (int u = 0; u < 640; ++u) {
      const auto& counts = png.at<cv::Vec3w>(v, u);
      const auto i = static_cast<std::size_t>(v * 640 + u);
      if (counts[2] >= 100) continue;
      largest_px =
          std::max(largest_px, std::hypot((counts[0] - 32768.0) / 64.0 - truth[i],
                                          (counts[1] - 32768.0) / 64.0 - truth[640 * 640 + i]));
    }
  EXPECT_LE(largest_px, steps.at("0,lcam_front"));
  EXPECT_GT(largest_px, 0.5 * steps.at("0,lcam_front"));
}

// 512 px is as far as the older form goes: a jump from frame to frame must not wrap around.
TEST(TartanAirFlow, PngMarksWhatIsOverRange) {
  ScratchFolder scratch;
  const TinyCaptureOptions jump{.num_frames = 2, .has_mcs4 = false, .step_m = 130.0};
  const fs::path capture = write_tiny_capture(scratch / "capture", jump).parent_path();
  run_export(capture, "format = \"tartanair\"\nflow = \"png\"", scratch / "png");
  run_export(capture, "format = \"tartanair\"", scratch / "npz");
  const fs::path flow = "tartanair/TinyWorld/Data_easy/P000/flow_lcam_front";
  const cv::Mat png = cv::imread((scratch / "png" / flow / "000000_000001_flow.png").string(),
                                 cv::IMREAD_UNCHANGED);
  const auto arrays = read_npz(scratch / "npz" / flow / "000000_000001_lcam_front_flow.npz");
  const std::vector<float>& truth = arrays.at("flow_fwd").values;
  int num_over = 0, num_behind = 0;
  for (int v = 0; v < 640; ++v) {
    for (int u = 0; u < 640; ++u) {
      const auto i = static_cast<std::size_t>(v * 640 + u);
      const float du = truth[i], dv = truth[640 * 640 + i];
      ASSERT_TRUE(std::isfinite(du) && std::isfinite(dv));
      const bool is_over = std::abs(du) > 512.5F || std::abs(dv) > 512.5F;
      if (is_over) {
        ASSERT_EQ(png.at<cv::Vec3w>(v, u)[2], 200);
        ++num_over;
      }
      if (du == 0.0F && dv == 0.0F && arrays.at("fov_mask_fwd").values[i] == 0.0F) {
        ASSERT_EQ(png.at<cv::Vec3w>(v, u)[2], 100);
        ++num_behind;
      }
    }
  }
  EXPECT_GT(num_over, 0);
  EXPECT_GT(num_behind, 0);
}

TEST(TartanAirCheck, OnlyTheFormatsCamerasFit) {
  const auto cameras = tiny_sequence(kPair).cameras;
  const auto options = export_options("format = \"tartanair\"");
  const auto refuse = [&](const std::vector<std::string>& words, auto&& change) {
    auto changed = cameras;
    change(changed);
    expect_error(ErrorKind::Config, words, [&] { options.exporter().check(changed); });
  };
  EXPECT_NO_THROW(options.exporter().check(cameras));
  refuse({"640 x 480", "640 x 640"}, [](auto& c) { c[0].intrinsics.height_px = 480; });
  refuse({"319.5", "(320, 320)"}, [](auto& c) { c[1].intrinsics.parameters[2] = 319.5; });
  refuse({"0.3 m", "0.25 m"}, [](auto& c) { c[1].rig_from_camera.translation.y() -= 0.05; });
  refuse({"+x"}, [](auto& c) { std::swap(c[0].rig_from_camera, c[1].rig_from_camera); });
  refuse({"turned"}, [](auto& c) {
    c[1].rig_from_camera.rotation = c[1].rig_from_camera.rotation *
                                    Eigen::Quaterniond(Eigen::AngleAxisd(1e-6, Vector3d::UnitY()));
  });
  refuse({"lcam_front", "known"}, [](auto& c) { c[0].name = "front"; });
  refuse({"tartan2"}, [](auto& c) { c[0].rig = c[1].rig = "tartan"; });
  expect_error(ErrorKind::Config, {"a/b"}, [&] {
    export_options("format = \"tartanair\"\nenvironment = \"a/b\"").exporter().check(cameras);
  });
}

// TartanGround's names, and the faces beside the front: what a pixel shows stands where its name
// says.
TEST(TartanAirFaces, DepthsOfEveryFaceBackProjectOntoTheScene) {
  ScratchFolder scratch;
  const TinyCaptureOptions options{
      .num_frames = 1, .has_mcs4 = false, .faces = {"lcam_left", "rcam_bottom", "lcam_top"}};
  write_tiny_capture(scratch / "capture", options);
  run_export(scratch / "capture", "format = \"tartanair\"\ndifficulty = \"diff\"", scratch / "out");
  const fs::path trajectory = scratch / "out/tartanair/TinyWorld/Data_diff/P1000";
  const Json sequence =
      Json::read(scratch / "out/tartanair/dataset.json").at("sequences").at(std::size_t{0});
  EXPECT_EQ(sequence.at("name").string(), "P1000");
  ASSERT_EQ(sequence.at("cameras").size(), 5U);
  const auto pose_of = [&](const std::string& camera) {
    return read_rows(trajectory / ("pose_" + camera + ".txt")).at(0);
  };
  const TinyScene scene;
  const Json& place = sequence.at("origin");
  const geo::Geodetic origin{place.at("lat_deg").number(), place.at("lon_deg").number(),
                             place.at("height_m").number()};
  const TangentChange world_from_local = tangent_change(origin, scene.origin);
  int num_ground = 0;
  for (const std::string camera : {"lcam_front", "lcam_left", "rcam_bottom", "lcam_top"}) {
    const std::vector<double> row = pose_of(camera), front = pose_of(camera.substr(0, 5) + "front");
    for (std::size_t k = 0; k < 3; ++k) EXPECT_EQ(row[k], front[k]) << camera;
    const Matrix3d ned = Eigen::Quaterniond(row[6], row[3], row[4], row[5]).toRotationMatrix();
    const Matrix3d ned_front =
        Eigen::Quaterniond(front[6], front[3], front[4], front[5]).toRotationMatrix();
    // Forward and down of the face in forward, right, down of the front.
    const Matrix3d face = ned_front.transpose() * ned;
    if (camera == "lcam_left") {
      EXPECT_LE((face.col(0) - Vector3d(0, -1, 0)).norm(), 1e-12);
      EXPECT_LE((face.col(2) - Vector3d(0, 0, 1)).norm(), 1e-12);
    } else if (camera == "rcam_bottom") {
      EXPECT_LE((face.col(0) - Vector3d(0, 0, 1)).norm(), 1e-12);
      EXPECT_LE((face.col(2) - Vector3d(-1, 0, 0)).norm(), 1e-12);
    } else if (camera == "lcam_top") {
      EXPECT_LE((face.col(0) - Vector3d(0, 0, -1)).norm(), 1e-12);
      EXPECT_LE((face.col(2) - Vector3d(1, 0, 0)).norm(), 1e-12);
    }
    const cv::Mat coded = cv::imread(
        (trajectory / ("depth_" + camera) / ("000000_" + camera + "_depth.png")).string(),
        cv::IMREAD_UNCHANGED);
    ASSERT_EQ(coded.type(), CV_8UC4);
    for (int v = 3; v < 640; v += 17) {
      for (int u = 2; u < 640; u += 19) {
        float d = 0.0F;
        std::memcpy(&d, coded.ptr(v, u), 4);
        if (d == 1e5F) continue;
        ++num_ground;
        const Vector3d frd(1.0, (u + 0.5 - 320.0) / 320.0, (v + 0.5 - 320.0) / 320.0);
        const Vector3d at = ned * (static_cast<double>(d) * frd) + Vector3d(row[0], row[1], row[2]);
        const Vector3d world = world_from_local({at.y(), at.x(), -at.z()});
        EXPECT_LE(scene.distance_to_surface(world),
                  1.3e-7 * static_cast<double>(d) * frd.norm() + 1e-7)
            << camera << " " << u << " " << v;
      }
    }
  }
  EXPECT_GT(num_ground, 2000);
}

TEST(TartanAirFaces, OfRollingShuttersAreRefusedAndTheirPairIsNot) {
  for (const bool has_face : {false, true}) {
    TinyCaptureOptions options{.has_mcs4 = false};
    if (has_face) options.faces = {"lcam_top"};
    auto cameras = tiny_sequence(options).cameras;
    for (auto& camera : cameras) camera.shutter.line_time_s = 3e-5;
    const auto check = [&] { export_options("format = \"tartanair\"").exporter().check(cameras); };
    if (has_face)
      expect_error(ErrorKind::Config,
                   {"tartanair", "rolling shutter", "line_time_us = 30", "seams"}, check);
    else
      EXPECT_NO_THROW(check());
  }
}

TEST(TartanAirFaces, OnlyWhereTheirNamesSay) {
  const TinyCaptureOptions all{
      .has_mcs4 = false,
      .faces = {"lcam_left", "lcam_right", "lcam_back", "lcam_top", "lcam_bottom", "rcam_left",
                "rcam_right", "rcam_back", "rcam_top", "rcam_bottom"}};
  const auto cameras = tiny_sequence(all).cameras;
  const auto options = export_options("format = \"tartanair\"");
  EXPECT_NO_THROW(options.exporter().check(cameras));
  for (std::size_t i = 2; i < cameras.size(); ++i) {
    SCOPED_TRACE(cameras[i].name);
    auto turned = cameras, moved = cameras, swapped = cameras, smaller = cameras;
    turned[i].rig_from_camera.rotation =
        turned[i].rig_from_camera.rotation *
        Eigen::Quaterniond(Eigen::AngleAxisd(M_PI_2, Vector3d::UnitZ()));
    moved[i].rig_from_camera.translation.x() += 1e-3;
    swapped[i].rig_from_camera = cameras[0].rig_from_camera;
    smaller[i].intrinsics.width_px = 320;
    for (const auto& wrong : {turned, moved, swapped})
      expect_error(ErrorKind::Config, {cameras[i].name, "tartan12"},
                   [&] { options.exporter().check(wrong); });
    expect_error(ErrorKind::Config, {cameras[i].name, "640 x 640"},
                 [&] { options.exporter().check(smaller); });
  }
}

}  // namespace
}  // namespace terracast::test
