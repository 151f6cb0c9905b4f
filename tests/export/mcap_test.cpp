// MCAP: what @mcap/core reads, by the definitions that the file itself has, against the capture.

#include <cmath>
#include <cstring>
#include <sstream>

#include "core/atomic_file.h"
#include "core/image_io.h"
#include "export/mcap/bag_plan.h"
#include "export/mcap/cdr.h"
#include "export/mcap/mcap_file.h"
#include "export/mcap/ros_definitions.h"
#include "export/utc_stamps.h"
#include "tests/export/exported.h"
#include "tests/export/readers.h"
#include "tests/support/bag_reader.h"

namespace terracast::test {
namespace {

namespace fs = std::filesystem;
using core::ErrorKind;
using core::Json;
using Eigen::Vector3d;
using testing::ElementsAre;

TinyCaptureOptions small_bag() {
  TinyCaptureOptions options;
  options.num_frames = 3;
  options.has_tartan2 = false;
  return options;
}

struct Mcap : testing::Test {
  ScratchFolder scratch;

  fs::path run(const TinyCaptureOptions& options, const std::string& keys = "") {
    write_tiny_capture(scratch / "capture", options);
    run_export(scratch / "capture", "format = \"mcap\"\n" + keys, scratch / "out");
    return scratch / "out/mcap/valley/valley.mcap";
  }
};

Vector3d vector_of(const Json& json) {
  return {json.at("x").number(), json.at("y").number(), json.at("z").number()};
}

geo::Rigid3d rigid_of(const Json& transform) {
  const Json& q = transform.at("rotation");
  return {Eigen::Quaterniond(q.at("w").number(), q.at("x").number(), q.at("y").number(),
                             q.at("z").number()),
          vector_of(transform.at("translation"))};
}

/// The transform into a frame's parent among those of a message.
geo::Rigid3d transform_of(const Json& message, const std::string& child) {
  const Json& transforms = message.at("fields").at("transforms");
  for (std::size_t i = 0; i < transforms.size(); ++i)
    if (transforms.at(i).at("child_frame_id").string() == child)
      return rigid_of(transforms.at(i).at("transform"));
  ADD_FAILURE() << "no transform of " << child;
  return {};
}

std::int64_t start_ns() {
  return exporters::unix_nanoseconds(tiny_sequence(small_bag()).utc_start, 0.0);
}

TEST_F(Mcap, AnotherReaderFindsEveryMessageInOrder) {
  TinyCaptureOptions options = small_bag();
  options.has_sensor = true;
  const Bag bag = read_bag(run(options));
  EXPECT_EQ(bag.summary.at("profile").string(), "ros2");
  const Json& statistics = bag.summary.at("statistics");
  EXPECT_EQ(statistics.at("messages").integer(), static_cast<std::int64_t>(bag.messages.size()));
  EXPECT_EQ(statistics.at("channels").integer(), 3 + 1 + 4 * 3);
  EXPECT_EQ(statistics.at("schemas").integer(), 6);
  EXPECT_EQ(bag.summary.at("counts").at("Chunk").integer(), statistics.at("chunks").integer());
  EXPECT_EQ(std::stoll(statistics.at("start").string()), start_ns());
  EXPECT_EQ(std::stoll(statistics.at("end").string()), start_ns() + 200'000'000);
  EXPECT_NE(bag.summary.at("data_crc").integer(), 0);
  EXPECT_NE(bag.summary.at("summary_crc").integer(), 0);
  EXPECT_EQ(bag.summary.at("metadata").at("terracast").at("sequence").string(), "valley");
  for (const auto& [topic, channel] : bag.summary.at("topics").members()) {
    SCOPED_TRACE(topic);
    const auto messages = bag.of(topic);
    EXPECT_EQ(channel.at("count").integer(), static_cast<std::int64_t>(messages.size()));
    EXPECT_FALSE(messages.empty());
    EXPECT_EQ(channel.at("encoding").string(), "cdr");
    EXPECT_EQ(channel.at("schema").string(), "ros2msg");
    EXPECT_TRUE(channel.at("qos").string().starts_with("- history: 1\n"));
    const bool is_latched = channel.at("qos").string().find("durability: 1") != std::string::npos;
    EXPECT_EQ(is_latched, topic == "/tf_static");
    for (std::size_t i = 0; i < messages.size(); ++i)
      EXPECT_EQ(messages[i]->at("sequence").integer(), static_cast<std::int64_t>(i));
  }
  std::int64_t last_ns = 0;
  for (const Json& message : bag.messages) {
    const std::int64_t log_ns = std::stoll(message.at("log_ns").string());
    EXPECT_GE(log_ns, last_ns);
    EXPECT_EQ(message.at("publish_ns").string(), message.at("log_ns").string());
    if (message.at("fields").has("header")) {
      EXPECT_EQ(stamp_ns(message), log_ns);
    }
    last_ns = log_ns;
  }
  // The laser's samples, 40 ms apart, among frames that are 100 ms apart.
  const auto ranges = bag.of("/mcs4/laser");
  ASSERT_EQ(ranges.size(), 6U);
  for (std::size_t i = 0; i < ranges.size(); ++i) {
    const double time_s = 0.04 * static_cast<double>(i);
    EXPECT_EQ(stamp_ns(*ranges[i]), start_ns() + static_cast<std::int64_t>(i) * 40'000'000);
    const double right = tiny_samples({time_s}).values[0];
    const Json& range = ranges[i]->at("fields").at("range");
    if (std::isfinite(right))
      EXPECT_EQ(static_cast<float>(range.number()), static_cast<float>(right));
    else
      EXPECT_EQ(range.string(), "Infinity");
    EXPECT_EQ(ranges[i]->at("fields").at("max_range").number(), 2000.0);
  }
}

TEST_F(Mcap, RosbagsOwnRecordSaysThatPoliciesAreNumbers) {
  const fs::path path = run(small_bag(), "depth = false\n");
  // Without the record, or of another version, rosbag2 takes "history: 1" for a policy's name.
  const std::string description =
      read_bag(path).summary.at("metadata").at("rosbag2").at("serialized_metadata").string();
  EXPECT_TRUE(description.starts_with("version: 5\nstorage_identifier: mcap\n"));
  EXPECT_THAT(description, testing::HasSubstr("\nrelative_file_paths:\n  - valley.mcap\nfiles:\n"));
  // metadata.yaml says the same, a level deeper.
  std::istringstream yaml(core::read_text_file(path.parent_path() / "metadata.yaml"));
  std::string line, same;
  std::getline(yaml, line);
  EXPECT_EQ(line, "rosbag2_bagfile_information:");
  while (std::getline(yaml, line)) {
    ASSERT_TRUE(line.starts_with("  ")) << line;
    same += line.substr(2) + "\n";
  }
  EXPECT_EQ(description, same);
}

TEST_F(Mcap, ImagesAndDepthAreTheCaptures) {
  const TinyCaptureOptions options = small_bag();
  const Bag bag = read_bag(run(options));
  const capture::SequenceInfo info = tiny_sequence(options);
  for (int c = 0; c < 4; ++c) {
    const std::string topic = fmt::format("/mcs4/cam{}", c);
    const auto images = bag.of(topic + "/image_raw/compressed"), depths = bag.of(topic + "/depth"),
               infos = bag.of(topic + "/camera_info");
    ASSERT_EQ(images.size(), 3U);
    ASSERT_EQ(depths.size(), 3U);
    ASSERT_EQ(infos.size(), 3U);
    const capture::CameraCalibration& camera = info.cameras[static_cast<std::size_t>(c)];
    for (int f = 0; f < 3; ++f) {
      const auto frame = static_cast<std::size_t>(f);
      const capture::CameraFrame right = tiny_frame(options, info, f, c);
      const Json& image = images[frame]->at("fields");
      EXPECT_EQ(image.at("format").string(), "rgb8; png compressed bgr8");
      EXPECT_EQ(std::get<core::Image8>(
                    core::decode_png(bytes_of_hex(image.at("data").string()), "image")),
                right.color);
      const Json& depth = depths[frame]->at("fields");
      EXPECT_EQ(depth.at("encoding").string(), "32FC1");
      EXPECT_EQ(depth.at("step").integer(), 4 * 90);
      const std::vector<std::byte> bytes = bytes_of_hex(depth.at("data").string());
      ASSERT_EQ(bytes.size(), 4U * 90U * 80U);
      for (int y = 0; y < 80; ++y)
        for (int x = 0; x < 90; ++x) {
          float depth_m = 0.0F;
          std::memcpy(&depth_m, &bytes[static_cast<std::size_t>(4 * (90 * y + x))], 4);
          const Vector3d ray = tiny_ray(camera, x + 0.5, y + 0.5);
          const double right_m = static_cast<double>(right.range_m(x, y)) * ray.normalized().z();
          if (std::isinf(right_m))
            ASSERT_TRUE(std::isinf(depth_m) && depth_m > 0.0F);
          else
            ASSERT_NEAR(depth_m, right_m, 1e-7 * right_m);
        }
      const Json& lens = infos[frame]->at("fields");
      EXPECT_EQ(lens.at("distortion_model").string(), "plumb_bob");
      EXPECT_THAT(lens.at("d").numbers(), ElementsAre(0, 0, 0, 0, 0));
      const double cx = camera.intrinsics.parameters[2] - 0.5,
                   cy = camera.intrinsics.parameters[3] - 0.5;
      EXPECT_THAT(lens.at("k").numbers(), ElementsAre(90, 0, cx, 0, 90, cy, 0, 0, 1));
      EXPECT_THAT(lens.at("p").numbers(), ElementsAre(90, 0, cx, 0, 0, 90, cy, 0, 0, 0, 1, 0));
      EXPECT_EQ(lens.at("height").integer(), 80);
      EXPECT_EQ(lens.at("width").integer(), 90);
      EXPECT_EQ(lens.at("header").at("frame_id").string(), fmt::format("mcs4/cam{}_optical", c));
    }
  }
}

TEST_F(Mcap, TransformsLeadFromTheEarthToEachCamera) {
  const TinyCaptureOptions options = small_bag();
  const Bag bag = read_bag(run(options));
  const auto fixed = bag.of("/tf_static"), moving = bag.of("/tf"),
             odometry = bag.of("/truth/odometry");
  ASSERT_EQ(fixed.size(), 1U);
  ASSERT_EQ(moving.size(), 3U);
  ASSERT_EQ(odometry.size(), 3U);
  const geo::Geodetic origin = TinyScene().origin;
  const Eigen::Matrix3d ecef_from_world = Wgs84::ecef_from_enu(origin.lat_deg, origin.lon_deg);
  const Vector3d world_ecef = Wgs84::ecef(origin.lat_deg, origin.lon_deg, origin.height_m);
  const geo::Rigid3d earth_from_map = transform_of(*fixed[0], "map");
  for (int f = 0; f < 3; ++f) {
    const auto frame = static_cast<std::size_t>(f);
    const geo::Rigid3d earth_from_body = earth_from_map * transform_of(*moving[frame], "base_link");
    for (const capture::CameraCalibration& camera : tiny_sequence(options).cameras) {
      const geo::Rigid3d found =
          earth_from_body * transform_of(*fixed[0], "mcs4/" + camera.name + "_optical");
      const geo::Rigid3d right = tiny_world_from_camera(options, f, camera);
      EXPECT_LT((found.translation - world_ecef - ecef_from_world * right.translation).norm(),
                1e-8);
      EXPECT_LT(
          (found.rotation.toRotationMatrix() - ecef_from_world * right.rotation.toRotationMatrix())
              .norm(),
          1e-13);
    }
    const Json& state = odometry[frame]->at("fields");
    EXPECT_EQ(state.at("child_frame_id").string(), "base_link");
    EXPECT_LT((vector_of(state.at("pose").at("pose").at("position")) -
               transform_of(*moving[frame], "base_link").translation)
                  .norm(),
              1e-12);
    // Straight and steady: so far in a tenth of a second.
    EXPECT_LT((tiny_world_from_body(options, f).rotation *
                   vector_of(state.at("twist").at("twist").at("linear")) -
               10.0 * tiny_step(options))
                  .norm(),
              1e-9);
  }
}

TEST_F(Mcap, OdometryTurnsAsTheTransformsDoAlongTheBodysAxes) {
  const Bag bag = read_bag(run(small_bag(), "depth = false\n"));
  const auto moving = bag.of("/tf"), odometry = bag.of("/truth/odometry");
  ASSERT_EQ(moving.size(), 3U);
  ASSERT_EQ(odometry.size(), 3U);
  const auto turn = [&](std::size_t from, std::size_t to) -> Vector3d {
    const Eigen::AngleAxisd by(transform_of(*moving[from], "base_link").rotation.conjugate() *
                               transform_of(*moving[to], "base_link").rotation);
    return by.angle() * by.axis();
  };
  // Of the steps before and after the middle frame, 0.1 s each.
  const Vector3d right_radps = (turn(0, 1) + turn(1, 2)) / 0.2;
  const Vector3d found_radps =
      vector_of(odometry[1]->at("fields").at("twist").at("twist").at("angular"));
  EXPECT_GT(right_radps.norm(), 0.05);
  EXPECT_LT((found_radps - right_radps).norm(), 1e-3 * right_radps.norm())
      << found_radps.transpose() << " rather than " << right_radps.transpose();
  // The same along the map's axes would be another vector.
  EXPECT_GT((transform_of(*moving[1], "base_link").rotation * right_radps - right_radps).norm(),
            5e-3 * right_radps.norm());
}

TEST_F(Mcap, BelievedClocksStampImagesWhichAreLoggedWhenTheyWereTaken) {
  TinyCaptureOptions options = small_bag();
  options.has_clock_errors = true;
  const Bag bag = read_bag(run(options, "calibration = \"believed\"\ndepth = false\n"));
  const auto images = bag.of("/mcs4/cam1/image_raw/compressed");
  ASSERT_EQ(images.size(), 3U);
  EXPECT_TRUE(bag.of("/mcs4/cam1/depth").empty());
  for (std::size_t f = 0; f < 3; ++f) {
    const double time_s = 0.1 * static_cast<double>(f);
    EXPECT_EQ(stamp_ns(*images[f]), start_ns() + std::llround(1e9 * tiny_stamp_s(1, time_s)));
    EXPECT_EQ(std::stoll(images[f]->at("log_ns").string()),
              start_ns() + std::llround(1e9 * time_s));
  }
}

TEST_F(Mcap, RawImagesArePackedNumbers) {
  const TinyCaptureOptions options = small_bag();
  const Bag bag = read_bag(run(options, "encoding = \"raw\"\ndepth = false\n"));
  const auto images = bag.of("/mcs4/cam0/image_raw");
  ASSERT_EQ(images.size(), 3U);
  const Json& image = images[1]->at("fields");
  EXPECT_EQ(image.at("encoding").string(), "rgb8");
  EXPECT_EQ(image.at("step").integer(), 3 * 90);
  EXPECT_EQ(image.at("is_bigendian").integer(), 0);
  const core::Image8 right = tiny_frame(options, tiny_sequence(options), 1, 0).color;
  const std::vector<std::byte> found = bytes_of_hex(image.at("data").string());
  ASSERT_EQ(found.size(), right.data().size());
  EXPECT_EQ(std::memcmp(found.data(), right.data().data(), found.size()), 0);
}

TEST_F(Mcap, OtherModelsAreRefusedWithAWayOut) {
  auto cameras = tiny_sequence(small_bag()).cameras;
  for (const char* model :
       {"pinhole", "simple_radial", "radial", "opencv", "full_opencv", "opencv_fisheye"}) {
    cameras[0].intrinsics.model = model;
    EXPECT_NO_THROW(export_options("format = \"mcap\"").exporter().check(cameras));
  }
  cameras[0].intrinsics.model = "double_sphere";
  expect_error(ErrorKind::Config, {"mcap", "mcs4/cam0", "double_sphere", "CameraInfo", "terracast"},
               [&] { export_options("format = \"mcap\"").exporter().check(cameras); });
}

TEST_F(Mcap, LongSequencesAreCutIntoChunksThatAreFoundByTheIndex) {
  const fs::path path = scratch / "long.mcap";
  exporters::McapFile file(
      path, "test",
      {{"/a", "sensor_msgs/msg/CompressedImage",
        exporters::ros_definition("sensor_msgs/msg/CompressedImage")},
       {"/none", "sensor_msgs/msg/Imu", exporters::ros_definition("sensor_msgs/msg/Imu")}});
  for (int i = 0; i < 5; ++i) {
    const std::vector<std::byte> bytes(std::size_t{1'500'000}, static_cast<std::byte>(i));
    exporters::CdrWriter cdr;
    cdr.put(std::int32_t{i}).put(std::uint32_t{0}).text("f").text("png").sequence(bytes);
    file.write(0, 1000 * i, cdr.take());
  }
  file.finish();
  const Bag bag = read_bag(path);
  EXPECT_EQ(bag.summary.at("statistics").at("chunks").integer(), 3);
  EXPECT_EQ(bag.summary.at("topics").at("/none").at("count").integer(), 0);
  ASSERT_EQ(bag.messages.size(), 5U);
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_EQ(stamp_ns(bag.messages[i]), static_cast<std::int64_t>(i) * 1'000'000'000);
    EXPECT_EQ(bag.messages[i].at("fields").at("data").string().substr(0, 2),
              fmt::format("{:02x}", i));
  }
}

TEST(McapCdr, NumbersStandAtMultiplesOfTheirSizeAfterTheHead) {
  exporters::CdrWriter cdr;
  cdr.put(std::uint8_t{7}).put(2.0).text("ab").put(std::uint16_t{513});
  std::vector<int> bytes;
  for (const std::byte byte : cdr.take()) bytes.push_back(std::to_integer<int>(byte));
  EXPECT_THAT(bytes, ElementsAre(0, 1, 0, 0, 7, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 64,  //
                                 3, 0, 0, 0, 'a', 'b', 0, 0, 1, 2));
}

TEST(McapPlan, SensorsWithoutAMessageAreNamedAndNamesMayNotMeet) {
  capture::SequenceInfo info = tiny_sequence(small_bag());
  info.streams.push_back({.rig = "mcs4",
                          .name = "nose",
                          .kind = "acme.nose",
                          .rate_hz = 1.0,
                          .channels = {{.name = "smell", .unit = ""}},
                          .rig_from_sensor = {},
                          .body_from_rig = {},
                          .settings_toml = ""});
  const exporters::ExportOptions options = export_options("format = \"mcap\"");
  EXPECT_THAT(exporters::plan_bag(options.exporter(), info, {}).left_out,
              ElementsAre("mcs4/nose (acme.nose)"));
  EXPECT_EQ(exporters::ros_word("3d-eye"), "n3d_eye");
  info.cameras[0].name = "a-b";
  info.cameras[1].name = "a_b";
  expect_error(ErrorKind::Config, {"valley", "/mcs4/a_b/camera_info", "other names"},
               [&] { exporters::plan_bag(options.exporter(), info, {}); });
}

}  // namespace
}  // namespace terracast::test
