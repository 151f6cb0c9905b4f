// Disparity against closed forms of a plane and boxes.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <span>

#include "capture/channel.h"
#include "core/json.h"
#include "core/log.h"
#include "core/toml_reader.h"
#include "labels/label.h"
#include "tests/labels/named_scene.h"
#include "tests/support/expect_error.h"

namespace terracast::test {
namespace {

namespace fs = std::filesystem;
using namespace named_scene;
using core::Json;
using Eigen::Vector2d;
using Eigen::Vector3d;

TEST_F(NamedLabels, DisparityIsThatOfTheScene) {
  make_labels(*sequence, *store, "disparity");
  const Json index = Json::read(labels("disparity") / "disparity.json");
  // The pair of global shutters and that of rolling ones, both ways; a global and a rolling one are no pair.
  std::map<std::string, double> baselines;
  for (std::size_t i = 0; i < index.at("pairs").size(); ++i) {
    const Json& pair = index.at("pairs").at(i);
    EXPECT_TRUE(pair.at("is_rectified").boolean());
    EXPECT_EQ(pair.at("focal_length_px").number(), 100.0);
    EXPECT_EQ(pair.at("offset_px").number(), 0.0);
    baselines[pair.at("camera").string() + " " + pair.at("other_camera").string()] =
        pair.at("baseline_m").number();
  }
  ASSERT_EQ(baselines.size(), 4U);
  EXPECT_NEAR(baselines.at("mcs4/left mcs4/right"), 2.0, 1e-12);
  EXPECT_NEAR(baselines.at("mcs4/right mcs4/left"), -2.0, 1e-12);
  EXPECT_NEAR(baselines.at("mcs4/rolling mcs4/beside"), 1.0, 1e-12);
  EXPECT_NEAR(baselines.at("mcs4/beside mcs4/rolling"), -1.0, 1e-12);
  int num_sure = 0, num_hidden = 0, num_out_of_view = 0, num_sky = 0;
  for (const auto& [names, baseline_m] : baselines) {
    SCOPED_TRACE(names);
    const std::string first = names.substr(0, names.find(' '));
    const std::string second = names.substr(names.find(' ') + 1);
    const int camera = sequence->info().camera_index("mcs4", first.substr(5));
    const int other = sequence->info().camera_index("mcs4", second.substr(5));
    for (int frame = 0; frame < 2; ++frame) {
      const core::ExrImage file =
          read_exr(labels("disparity") / first / second / fmt::format("{:06}.exr", frame));
      EXPECT_FALSE(file.float_channels.contains("disparity.y"));
      const Truth truth{*sequence, frame, camera};
      const auto facts = read_facts(*sequence, frame, camera);
      for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x) {
          const float disparity = file.float_channels.at("disparity.x")(x, y);
          const std::uint32_t sight = file.uint_channels.at("sight")(x, y);
          const bool has_bit =
              (facts.uint_channels.at("flags")(x, y) & capture::visible_in_camera(other)) != 0;
          ASSERT_EQ(sight == 2, has_bit);
          const auto hit = sure_hit(truth, facts, x, y);
          if (!hit) continue;
          if (std::isinf(hit->range_m)) {
            ++num_sky;
            ASSERT_EQ(disparity, 0.0f);
            ASSERT_EQ(sight, 0U);
            continue;
          }
          const double depth_m = hit->range_m * truth.ray_camera(x + 0.5, y + 0.5).direction.z();
          // Floats of up to 8 px.
          const double wanted_px = 100.0 * baseline_m / depth_m;
          ASSERT_NEAR(double{disparity}, wanted_px, 1e-6) << x << " " << y;
          const double there = x + 0.5 - wanted_px;
          if (std::abs(there) < 1e-6 || std::abs(there - kWidth) < 1e-6) continue;
          ASSERT_EQ(sight == 3, there < 0.0 || there > kWidth);
          ++num_sure;
          num_out_of_view += sight == 3 ? 1 : 0;
          num_hidden += sight == 1 ? 1 : 0;
          if (sight != 1) {
            ASSERT_EQ(file.uint_channels.at("occluder")(x, y), 0U);
          }
        }
    }
  }
  EXPECT_GT(num_sure, 20000);
  EXPECT_GT(num_hidden, 50);
  EXPECT_GT(num_out_of_view, 100);
  EXPECT_GT(num_sky, 5000);

  // Any pair that is named: its flow's opposite, along both axes.
  make_labels_with(*sequence, *store,
                   "kind = \"disparity\"\ncameras = [\"mcs4/left mcs4/fisheye\"]\n");
  make_labels_with(*sequence, *store, "kind = \"pairs\"\ncameras = [\"mcs4/left mcs4/fisheye\"]\n");
  EXPECT_FALSE(fs::exists(labels("disparity") / "mcs4/right"));
  const core::ExrImage named = read_exr(labels("disparity") / "mcs4/left/mcs4/fisheye/000001.exr");
  const Truth truth{*sequence, 1, 0}, fisheye{*sequence, 1, 4};
  const auto facts = read_facts(*sequence, 1, 0);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const auto hit = sure_hit(truth, facts, x, y);
      if (!hit || std::isinf(hit->range_m)) continue;
      const Truth::Ray ray = Truth::moved(truth.pose(0.0), truth.ray_camera(x + 0.5, y + 0.5));
      const Vector3d at = fisheye.pose(0.0).inverse() * (ray.origin + hit->range_m * ray.direction);
      const double angle = std::atan2(at.head<2>().norm(), at.z());
      const Vector2d there =
          Vector2d(60.0, 60.0) + kFisheyeFocal_px * angle * at.head<2>().normalized();
      ASSERT_NEAR(double{named.float_channels.at("disparity.x")(x, y)}, x + 0.5 - there.x(), 1e-5);
      ASSERT_NEAR(double{named.float_channels.at("disparity.y")(x, y)}, y + 0.5 - there.y(), 1e-5);
    }
}

// Vehicles may carry different rigs: beside one with pairs stands one with none.
TEST_F(NamedLabels, DisparityOfASequenceWithoutPairsIsAnIndexOfNone) {
  render::SequencePlan plan = level_plan();
  plan.name = "alone";
  plan.cameras[0].rig = "eye";
  std::vector<capture::SequenceReader> captures = {*sequence};
  captures.push_back(render_plan(*store, plan, *folder / "alone"));
  std::vector<labels::SequenceOutline> outlines;
  for (const capture::SequenceReader& one : captures)
    outlines.push_back({.name = one.info().name, .cameras = one.info().cameras, .num_frames = 1});
  const core::Log log("label", core::LogLevel::Info), quiet("label", core::LogLevel::Warn);
  const auto no_things = [](const capture::SequenceInfo&) {
    return std::vector<scene::MovingThing>();
  };
  for (const std::string keys : {"", "cameras = [\"mcs4/right mcs4/left\"]\n"}) {
    SCOPED_TRACE(keys);
    std::vector<labels::LabelOptions> options(1);
    core::TomlDocument::parse("kind = \"disparity\"\n" + keys, "test.toml").read(options[0]);
    testing::internal::CaptureStderr();
    labels::check_labels(options, outlines, log);
    const std::string told = testing::internal::GetCapturedStderr();
    EXPECT_NE(told.find("no pair of cameras in 1 of 2 sequences, which get none: alone"),
              std::string::npos)
        << told;
    EXPECT_EQ(std::count(told.begin(), told.end(), '\n'), 1) << told;
    // Nobody need be warned of what was meant; that there is no pair at all is refused.
    testing::internal::CaptureStderr();
    labels::check_labels(options, outlines, quiet);
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
    expect_error(core::ErrorKind::Config, {keys.empty() ? "rectified" : "mcs4"},
                 [&] { labels::check_labels(options, std::span(outlines).last(1), quiet); });
    for (const capture::SequenceReader& one : captures)
      labels::run_label_stage(one, *store, {}, options, {.log = quiet},
                              {.sequences = captures, .things_of = no_things});
    EXPECT_EQ(Json::read(labels("disparity") / "disparity.json").at("pairs").size(),
              keys.empty() ? 4U : 1U);
    const fs::path of_alone = *folder / "alone/labels/disparity";
    EXPECT_EQ(Json::read(of_alone / "disparity.json").at("pairs").size(), 0U);
    EXPECT_EQ(std::distance(fs::directory_iterator(of_alone), fs::directory_iterator()), 1);
  }
}

TEST_F(NamedLabels, DisparityThatCannotBeIsRefused) {
  const auto check = [](const std::string& keys, std::vector<capture::CameraCalibration> cameras) {
    std::vector<labels::LabelOptions> options(1);
    core::TomlDocument::parse("kind = \"disparity\"\n" + keys, "test.toml").read(options[0]);
    options[0].validate();
    const std::vector<labels::SequenceOutline> outlines = {
        {.name = "s", .cameras = std::move(cameras), .num_frames = 2}};
    labels::check_labels(options, outlines, core::Log("label", core::LogLevel::Off));
  };
  const std::vector<capture::CameraCalibration> all = plan_of_all().cameras;
  EXPECT_NO_THROW(check("", {all[0], all[1]}));
  const auto refuses = [&](const auto& change) {
    std::vector<capture::CameraCalibration> pair = {all[0], all[1]};
    change(pair[1]);
    expect_error(core::ErrorKind::Config, {"rectified", "cameras = ["}, [&] { check("", pair); });
    EXPECT_NO_THROW(check(fmt::format("cameras = [\"mcs4/left {}/right\"]\n", pair[1].rig), pair));
  };
  refuses([](auto& camera) { camera.rig_from_camera.translation.z() = 0.001; });
  refuses([](auto& camera) { camera.rig_from_camera.translation.x() = 0.001; });
  refuses([](auto& camera) { camera.rig_from_camera.translation.y() = 0.0; });
  refuses([](auto& camera) {
    camera.rig_from_camera.rotation =
        camera.rig_from_camera.rotation * Eigen::AngleAxisd(1e-4, Vector3d::UnitY());
  });
  refuses([](auto& camera) { camera.intrinsics.parameters[0] = 100.01; });
  refuses([](auto& camera) { camera.intrinsics.parameters[3] = 40.5; });
  refuses([](auto& camera) { camera.intrinsics.model = "orthographic"; });
  refuses([](auto& camera) { camera.shutter.line_time_s = 1e-6; });
  refuses([](auto& camera) { camera.rig = "other"; });
  // Columns that follow each other are not of one time in both images.
  std::vector<capture::CameraCalibration> columns = {all[2], all[3]};
  EXPECT_NO_THROW(check("", columns));
  for (auto& camera : columns) camera.shutter.readout = geo::Readout::Right;
  expect_error(core::ErrorKind::Config, {"rectified"}, [&] { check("", columns); });
  expect_error(core::ErrorKind::Config, {"image with itself"},
               [&] { check("cameras = [\"mcs4/left mcs4/left\"]\n", all); });
  expect_error(core::ErrorKind::Config, {"mcs4/lef", "mcs4/left"},
               [&] { check("cameras = [\"mcs4/lef mcs4/right\"]\n", all); });
  expect_error(core::ErrorKind::Config, {"is no pair", "labels disparity"},
               [&] { check("cameras = [\"mcs4/left\"]\n", all); });
  expect_error(core::ErrorKind::Config, {"two sequences", "pairs"},
               [&] { check("cameras = [\"s/mcs4/left t/mcs4/right\"]\n", all); });
}

}  // namespace
}  // namespace terracast::test
