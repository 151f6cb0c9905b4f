// What a user of terracast's own format does with it: the ten lines of docs/formats/terracast.md, with an npy reader of
// their own; no model of a camera anywhere.

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <sstream>

#include "core/json.h"
#include "tests/export/exported.h"
#include "tests/export/readers.h"

namespace terracast::test {
namespace {

namespace fs = std::filesystem;
using core::ErrorKind;
using core::Json;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

const TinyCaptureOptions kFlight{.num_frames = 3, .has_tartan2 = false};

/// The values of an npy of one type, and its shape as the header has it.
template <class Value>
std::vector<Value> values_of(const fs::path& file, const std::string& type,
                             const std::string& shape) {
  const std::string bytes = slurp(file);
  const std::size_t start =
      10 + (static_cast<unsigned char>(bytes.at(8)) |
            static_cast<std::size_t>(static_cast<unsigned char>(bytes.at(9))) << 8);
  const std::string header = bytes.substr(10, start - 10);
  EXPECT_THAT(header, testing::HasSubstr("'descr': '" + type + "'")) << file;
  EXPECT_THAT(header, testing::HasSubstr("'shape': " + shape)) << file;
  std::vector<Value> values((bytes.size() - start) / sizeof(Value));
  std::memcpy(values.data(), bytes.data() + start, values.size() * sizeof(Value));
  return values;
}

struct Pose {
  double time_s;
  Matrix3d rotation;
  Vector3d translation;
};

struct TerracastFormat : testing::Test {
  static inline std::unique_ptr<ScratchFolder> folder;
  void SetUp() override {
    if (folder) return;
    folder = std::make_unique<ScratchFolder>();
    write_tiny_capture(*folder / "capture", kFlight);
    run_export(*folder / "capture", "format = \"terracast\"", *folder / "out");
  }
  static void TearDownTestSuite() { folder.reset(); }

  static fs::path root() { return *folder / "out/terracast"; }
  static fs::path sequence() { return root() / "valley"; }

  /// By "frame,camera".
  static std::map<std::string, Pose> poses(const fs::path& file) {
    std::map<std::string, Pose> all;
    std::istringstream text(slurp(file));
    std::string line;
    std::getline(text, line);
    EXPECT_EQ(line, "frame,camera,time_s,x_m,y_m,z_m,qw,qx,qy,qz");
    while (std::getline(text, line)) {
      const auto second = line.find(',', line.find(',') + 1);
      const std::string key = line.substr(0, second);
      for (char& c : line)
        if (c == ',') c = ' ';
      std::istringstream numbers(line.substr(second));
      double n[8];
      for (double& value : n) numbers >> value;
      EXPECT_TRUE(numbers && numbers.eof()) << line;
      const double w = n[4], x = n[5], y = n[6], z = n[7];
      Matrix3d r;
      r << 1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),  //
          2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),   //
          2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y);
      all[key] = {n[0], r, {n[1], n[2], n[3]}};
    }
    return all;
  }
  static geo::Geodetic origin() {
    const Json json =
        Json::read(root() / "dataset.json").at("sequences").at(std::size_t{0}).at("origin");
    return {json.at("lat_deg").number(), json.at("lon_deg").number(), json.at("height_m").number()};
  }

  TinyScene scene;
  capture::SequenceInfo info = tiny_sequence(kFlight);
};

TEST_F(TerracastFormat, RaysTimesRangesAreTheScene) {
  const auto all_poses = poses(sequence() / "poses.csv");
  EXPECT_EQ(all_poses.size(), 3 * info.cameras.size());
  const auto world_from_local = tangent_change(origin(), scene.origin);
  const Json classes = Json::read(root() / "classes.json").at("classes");
  EXPECT_EQ(classes.at("grass").integer(), 5);
  int num_sky = 0;
  for (std::size_t c = 0; c < info.cameras.size(); ++c) {
    const capture::CameraCalibration& camera = info.cameras[c];
    const std::string name = camera.rig + "/" + camera.name;
    SCOPED_TRACE(name);
    const int width = camera.intrinsics.width_px, height = camera.intrinsics.height_px;
    const fs::path at = sequence() / name;
    EXPECT_FALSE(fs::exists(at / "origins.npy"));
    const std::string size = fmt::format("({}, {})", height, width);
    const std::string vectors = fmt::format("({}, {}, 3)", height, width);
    const auto rays = values_of<double>(at / "rays.npy", "<f8", vectors);
    const auto range_m = values_of<float>(at / "range/000001.npy", "<f4", size);
    const auto instances = values_of<std::uint32_t>(at / "instance/000001.npy", "<u4", size);
    const auto normals = values_of<float>(at / "normal/000001.npy", "<f4", vectors);
    const cv::Mat class_image =
        cv::imread((at / "class/000001.png").string(), cv::IMREAD_UNCHANGED);
    ASSERT_EQ(class_image.type(), CV_8UC1);
    ASSERT_EQ(cv::imread((at / "image/000001.png").string(), cv::IMREAD_UNCHANGED).type(), CV_8UC3);
    const Pose& pose = all_poses.at("1," + name);
    EXPECT_EQ(pose.time_s, 1.0 / info.rate_hz);
    const capture::CameraFrame truth = tiny_frame(kFlight, info, 1, static_cast<int>(c));
    int num_ground = 0;
    for (int v = 0; v < height; v += 3)
      for (int u = 0; u < width; u += 3) {
        const auto i = static_cast<std::size_t>(v * width + u);
        const Vector3d ray(rays[3 * i], rays[3 * i + 1], rays[3 * i + 2]);
        ASSERT_NEAR(ray.norm(), 1.0, 1e-15);
        ASSERT_LT((ray - tiny_ray(camera, u + 0.5, v + 0.5).normalized()).norm(), 1e-15);
        ASSERT_EQ(instances[i], truth.instance_id(u, v));
        ASSERT_EQ(class_image.at<std::uint8_t>(v, u), truth.semantic_id(u, v));
        const Vector3d normal(static_cast<double>(normals[3 * i]),
                              static_cast<double>(normals[3 * i + 1]),
                              static_cast<double>(normals[3 * i + 2]));
        if (std::isinf(range_m[i])) {
          ++num_sky;
          ASSERT_EQ(truth.semantic_id(u, v), 0U);
          ASSERT_TRUE(normal.array().isNaN().all());
          continue;
        }
        ++num_ground;
        const double range = static_cast<double>(range_m[i]);
        const Vector3d point = pose.rotation * (ray * range) + pose.translation;
        // float32 of the range, in one place.
        ASSERT_LE(scene.distance_to_surface(world_from_local(point)), 6.1e-8 * range + 1e-7);
        const Vector3d expected(static_cast<double>(truth.normal_world(u, v, 0)),
                                static_cast<double>(truth.normal_world(u, v, 1)),
                                static_cast<double>(truth.normal_world(u, v, 2)));
        // Captures keep normals as half floats.
        ASSERT_LT((world_from_local.rotation * normal - expected).norm(), 5e-4);
        ASSERT_NEAR(normal.norm(), 1.0, 1e-6);
      }
    EXPECT_GT(num_ground, 200);
  }
  EXPECT_GT(num_sky, 20);
}

TEST_F(TerracastFormat, FlowIsWhereTheOtherFrameSeesThePoint) {
  const auto all_poses = poses(sequence() / "poses.csv");
  const capture::CameraCalibration& camera = info.cameras[0];
  const std::string name = camera.rig + "/" + camera.name;
  const int width = camera.intrinsics.width_px, height = camera.intrinsics.height_px;
  const fs::path at = sequence() / name;
  const std::string size = fmt::format("({}, {})", height, width);
  EXPECT_FALSE(fs::exists(at / "flow_forward/000002.npy"));
  EXPECT_FALSE(fs::exists(at / "flow_backward/000000.npy"));
  const auto rays =
      values_of<double>(at / "rays.npy", "<f8", fmt::format("({}, {}, 3)", height, width));
  const auto range_m = values_of<float>(at / "range/000001.npy", "<f4", size);
  const capture::CameraFrame truth = tiny_frame(kFlight, info, 1, 0);
  const Pose& here = all_poses.at("1," + name);
  for (const bool is_forward : {true, false}) {
    const fs::path stem = at / (is_forward ? "flow_forward/000001" : "flow_backward/000001");
    const auto flow =
        values_of<float>(stem.string() + ".npy", "<f4", fmt::format("({}, {}, 2)", height, width));
    const cv::Mat mask = cv::imread(stem.string() + "_mask.png", cv::IMREAD_UNCHANGED);
    ASSERT_EQ(mask.type(), CV_8UC1);
    const Pose& there = all_poses.at((is_forward ? "2," : "0,") + name);
    const std::uint32_t flag = is_forward ? capture::kVisibleNext : capture::kVisiblePrevious;
    std::map<int, int> counts;
    for (int v = 0; v < height; ++v)
      for (int u = 0; u < width; ++u) {
        const auto i = static_cast<std::size_t>(v * width + u);
        const Vector3d ray(rays[3 * i], rays[3 * i + 1], rays[3 * i + 2]);
        const bool is_sky = std::isinf(range_m[i]);
        const Vector3d point = there.rotation.transpose() *
                               (is_sky ? Vector3d(here.rotation * ray)
                                       : Vector3d(here.rotation * (ray * double(range_m[i])) +
                                                  here.translation - there.translation));
        const int value = mask.at<std::uint8_t>(v, u);
        ++counts[value];
        Vector2d target;
        const bool is_in_view = tiny_sees(camera, point, &target);
        if (!(point.z() > 0.0)) {
          EXPECT_TRUE(std::isnan(flow[2 * i]) && std::isnan(flow[2 * i + 1]));
          EXPECT_EQ(value, 0);
          continue;
        }
        const Vector2d found(u + 0.5 + double(flow[2 * i]), v + 0.5 + double(flow[2 * i + 1]));
        // float32 of ranges and of flow of some 100 px; more where a point comes near the camera.
        if (is_in_view) {
          ASSERT_LT((found - target).norm(), 1e-4) << u << " " << v;
        }
        const bool is_at_border =
            std::min({std::abs(target.x()), std::abs(target.y()), std::abs(target.x() - width),
                      std::abs(target.y() - height)}) < 1e-3;
        if (is_at_border) continue;
        const bool is_seen = !is_sky && (truth.flags(u, v) & flag) != 0;
        ASSERT_EQ(value, is_seen ? 3 : is_in_view ? 1 : 0) << u << " " << v;
      }
    for (const int value : {0, 1, 3}) EXPECT_GT(counts[value], 0) << value;
    EXPECT_EQ(counts.size(), 3U);
  }
}

TEST_F(TerracastFormat, StatesWhatIsBelievedOrWhatIsTrue) {
  TinyCaptureOptions options = kFlight;
  options.has_camera_errors = true;
  write_tiny_capture(*folder / "wrong", options);
  const capture::SequenceInfo wrong = tiny_sequence(options);
  for (const bool is_believed : {false, true}) {
    const fs::path out = *folder / (is_believed ? "believed" : "true");
    run_export(*folder / "wrong",
               fmt::format("format = \"terracast\"\ncalibration = \"{}\"",
                           is_believed ? "believed" : "true"),
               out);
    const fs::path at = out / "terracast/valley";
    const auto& stated = is_believed ? wrong.believed() : wrong.cameras;
    const Json cameras = Json::read(at / "cameras.json").at("cameras");
    const auto all_poses = poses(at / "poses.csv");
    for (std::size_t c = 0; c < stated.size(); ++c) {
      const Json& json = cameras.at(c);
      const std::string name = stated[c].rig + "/" + stated[c].name;
      EXPECT_EQ(json.at("name").string(), name);
      EXPECT_EQ(json.at("parameters").numbers(), stated[c].intrinsics.parameters);
      EXPECT_EQ(json.at("parameter_names").string(), "fx, fy, cx, cy");
      const auto rays = values_of<double>(at / name / "rays.npy", "<f8",
                                          fmt::format("({}, {}, 3)", stated[c].intrinsics.height_px,
                                                      stated[c].intrinsics.width_px));
      EXPECT_LT(
          (Vector3d(rays[0], rays[1], rays[2]) - tiny_ray(stated[c], 0.5, 0.5).normalized()).norm(),
          1e-15);
      const geo::Rigid3d world = tiny_world_from_camera(options, 2, stated[c]);
      const Pose& pose = all_poses.at("2," + name);
      const Json origin = Json::read(out / "terracast/dataset.json")
                              .at("sequences")
                              .at(std::size_t{0})
                              .at("origin");
      const geo::Geodetic place{origin.at("lat_deg").number(), origin.at("lon_deg").number(),
                                origin.at("height_m").number()};
      EXPECT_LT((tangent_change(place, scene.origin)(pose.translation) - world.translation).norm(),
                1e-7);
    }
    EXPECT_TRUE(fs::exists(at / "calibration_believed.json"));
  }
}

TEST_F(TerracastFormat, HoldsWhatIsAskedForAndRefusesWhatIsNot) {
  run_export(*folder / "capture",
             "format = \"terracast\"\nrigs = [\"mcs4\"]\nmodalities = [\"range\"]",
             *folder / "few");
  const fs::path at = *folder / "few/terracast/valley/mcs4/cam0";
  EXPECT_TRUE(fs::exists(at / "range/000002.npy"));
  for (const char* other : {"image", "class", "instance", "normal", "flow_forward"})
    EXPECT_FALSE(fs::exists(at / other)) << other;
  const auto check = [&](const std::string& keys) {
    export_options("format = \"terracast\"\n" + keys).exporter().check(info.cameras);
  };
  expect_error(ErrorKind::Config, {"modality", "rnge", "range"},
               [&] { check("modalities = [\"rnge\"]"); });
  expect_error(ErrorKind::Config, {"modalities = []", "image"}, [&] { check("modalities = []"); });
  expect_error(ErrorKind::Config, {"mcs5", "mcs4"}, [&] { check("rigs = [\"mcs5\"]"); });
}

}  // namespace
}  // namespace terracast::test
