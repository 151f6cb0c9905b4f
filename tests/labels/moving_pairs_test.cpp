// Where what moves is in other images, and whether it is seen there: pairs, flow, scene flow and the table of
// co-visibility, against slabs and bisection.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <sstream>

#include "core/atomic_file.h"
#include "core/image_io.h"
#include "core/log.h"
#include "core/toml_reader.h"
#include "export/exporter.h"
#include "labels/label.h"
#include "tests/labels/moving_scene.h"
#include "tests/support/expect_error.h"
#include "validate/npy.h"

namespace terracast::test {
namespace {

namespace fs = std::filesystem;
using namespace moving_scene;
using Eigen::Vector2d;
using Eigen::Vector3d;

TEST_F(MovingLabels, PairsAndTheTableFollowWhatMovesAndWhatItHides) {
  make_labels_with(*sequence, *store,
                   "kind = \"pairs\"\ncameras = [\"mcs4/cam0 mcs4/cam0\", \"mcs4/cam0 "
                   "mcs4/cam1\", \"mcs4/cam1 mcs4/cam0\"]\nframes_apart = [0, 1]\n",
                   things);
  make_labels_with(*sequence, *store, "kind = \"covisibility\"\nstep_px = 1\n", things);
  std::map<std::string, std::array<std::int64_t, 2>> table;  // in the image, seen
  std::istringstream rows(
      core::read_text_file(*folder / "boxes/labels/covisibility/covisibility.csv"));
  std::string row;
  while (std::getline(rows, row)) {
    std::vector<std::string> words;
    std::istringstream in(row);
    for (std::string word; std::getline(in, word, ',');) words.push_back(word);
    if (words[0] != "frame")
      table[words[0] + words[1] + words[2] + words[3]] = {std::stol(words[5]), std::stol(words[6])};
  }
  const Truth truth{*sequence};
  struct Case {
    int camera, other_camera, other_frame;
  };
  for (const Case& one : {Case{0, 0, 1}, Case{0, 1, 0}, Case{0, 1, 1}, Case{1, 0, 1}}) {
    SCOPED_TRACE(testing::Message() << "camera " << one.camera << " to frame " << one.other_frame
                                    << " camera " << one.other_camera);
    const fs::path file =
        *folder / fmt::format("boxes/labels/pairs/mcs4/cam{}/mcs4/cam{}/000000_{:06}.exr",
                              one.camera, one.other_camera, one.other_frame);
    const core::ExrImage pair = core::decode_exr(core::read_file(file), file.string()).at(0);
    std::int64_t num_moving_seen = 0, num_moving_hidden = 0, num_moved = 0;
    std::int64_t num_gone = 0, num_hidden_by_moving = 0, num_in = 0, num_seen = 0, num_unsure = 0;
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) {
        const std::uint32_t sight = pair.uint_channels.at("sight")(x, y);
        num_in += sight == 1 || sight == 2 ? 1 : 0;
        num_seen += sight == 2 ? 1 : 0;
        const double t = Truth::time_of(one.camera, y + 0.5);
        const Pose pose = truth.camera_pose(0, t);
        const Vector3d ray = pose.rotation * ray_of(x + 0.5, y + 0.5);
        const Hit hit = truth.meet(0, t, pose.place, ray);
        if (truth.meet(0, t, pose.place, ray, kRim_m).instance_id != hit.instance_id ||
            truth.meet(0, t, pose.place, ray, -kRim_m).instance_id != hit.instance_id) {
          ++num_unsure;
          continue;
        }
        const Vector3d point = pose.place + hit.t * ray;
        if (!point.allFinite()) {
          ASSERT_EQ(sight, 0U);
        }
        if (!point.allFinite() || point.head<2>().norm() > 900.0) continue;  // sky, the world's end
        const bool is_moving = hit.body >= 0;
        if (is_moving && !truth.state(one.other_frame, hit.body)) {
          ++num_gone;
          EXPECT_EQ(sight, 4U);
          EXPECT_TRUE(std::isnan(pair.float_channels.at("flow.x")(x, y)));
          continue;
        }
        const auto point_at = [&](double time) -> Vector3d {
          if (!is_moving) return point;
          return Pose(*truth.state(one.other_frame, hit.body), time)
              .world(Pose(*truth.state(0, hit.body), t).own(point));
        };
        // To the time of the frame; floats of up to 60 m.
        const Vector3d motion = point_at(0.0) - point;
        for (int axis = 0; axis < 3; ++axis)
          ASSERT_NEAR(
              double{pair.float_channels.at(fmt::format("scene_flow.{}", "xyz"[axis]))(x, y)},
              motion[axis], 1e-5);
        num_moved += motion.norm() > 0.1 ? 1 : 0;
        const auto [pixel, time] = truth.seen(one.other_frame, one.other_camera, point_at);
        if (std::min({std::abs(pixel.x()), std::abs(pixel.y()), std::abs(pixel.x() - kWidth),
                      std::abs(pixel.y() - kHeight)}) < 1e-4) {
          ++num_unsure;
          continue;
        }
        const bool is_in =
            pixel.x() > 0.0 && pixel.y() > 0.0 && pixel.x() < kWidth && pixel.y() < kHeight;
        ASSERT_EQ(sight == 1 || sight == 2, is_in) << x << " " << y;
        if (!is_in) {
          ASSERT_EQ(sight, 3U) << x << " " << y;
        }
        // Flows are floats of up to 200 px. Beyond the border they go on.
        ASSERT_NEAR(double{pair.float_channels.at("flow.x")(x, y)}, pixel.x() - (x + 0.5), 3e-5);
        ASSERT_NEAR(double{pair.float_channels.at("flow.y")(x, y)}, pixel.y() - (y + 0.5), 3e-5);
        if (!is_in) continue;
        const Pose there = truth.camera_pose(one.other_frame, time);
        const Vector3d way = point_at(time) - there.place;
        const auto first = [&](double grown) {
          return truth.meet(one.other_frame, time, there.place, way, grown);
        };
        const auto is_point = [&](const Hit& met) {
          return met.body == hit.body && met.instance_id == hit.instance_id &&
                 std::abs(met.t - 1.0) < 1e-6;
        };
        if (is_point(first(kRim_m)) != is_point(first(-kRim_m))) {
          ++num_unsure;
          continue;
        }
        const Hit met = first(0.0);
        ASSERT_EQ(sight == 2, is_point(met)) << x << " " << y;
        ASSERT_EQ(pair.uint_channels.at("occluder")(x, y), sight == 2 ? 0U : met.instance_id)
            << x << " " << y;
        if (is_moving) ++(sight == 2 ? num_moving_seen : num_moving_hidden);
        if (!is_moving && sight == 1 && met.body >= 0) ++num_hidden_by_moving;
      }
    EXPECT_GT(num_moving_seen, 100);
    EXPECT_LT(num_unsure, 300);
    if (one.other_frame == 1) {
      EXPECT_GT(num_hidden_by_moving, 5);
      EXPECT_GT(num_moving_hidden, 5);
      EXPECT_GT(num_gone, 20);
      EXPECT_GT(num_moved, 100);
    }
    const auto& counted = table.at(
        fmt::format("0mcs4/cam{}{}mcs4/cam{}", one.camera, one.other_frame, one.other_camera));
    EXPECT_EQ(counted[0], num_in);
    EXPECT_EQ(counted[1], num_seen);
  }
}

/// Arrays of floats as another reader has them.
std::vector<float> read_floats(const fs::path& file) {
  return validate::parse_npy(core::read_file(file), file.string()).floats(file.string());
}

// That format's flow follows from the capture's ranges and bits and casts no ray again.
TEST_F(MovingLabels, FlowIsThatOfTheTerracastFormatAndSceneFlowThatOfThePairs) {
  make_labels(*sequence, *store, "flow", 0, things);
  make_labels(*sequence, *store, "scene_flow", 0, things);
  make_labels_with(*sequence, *store,
                   "kind = \"pairs\"\ncameras = [\"mcs4/cam0 mcs4/cam0\", \"mcs4/cam1 "
                   "mcs4/cam1\"]\nframes_apart = [1, -1]\n",
                   things);
  exporters::ExportOptions options;
  core::TomlDocument::parse("format = \"terracast\"\nmodalities = [\"flow\"]\n", "test.toml")
      .read(options);
  const core::Log log("export", core::LogLevel::Off);
  exporters::run_export_stage({*sequence}, {options}, *folder / "flow_out", {.log = log});
  std::array<int, 5> num_of{};
  for (const int camera : {0, 1})
    for (const int frame : {0, 1}) {
      SCOPED_TRACE(testing::Message() << "frame " << frame << ", camera " << camera);
      const auto facts = sequence->read_camera(frame, camera, capture::SequenceReader::kFacts);
      const std::string name = fmt::format("{:06}_{:06}.exr", frame, 1 - frame);
      const auto read = [&](const std::string& path) {
        const fs::path file = *folder / "boxes/labels" / path / name;
        return core::decode_exr(core::read_file(file), file.string()).at(0);
      };
      const std::string of_camera = fmt::format("mcs4/cam{}", camera);
      const core::ExrImage flow = read("flow/" + of_camera);
      EXPECT_EQ(flow.float_channels.size() + flow.uint_channels.size(), 4U);
      const fs::path there = *folder / "flow_out/terracast/boxes" / of_camera /
                             (frame == 0 ? "flow_forward" : "flow_backward");
      const std::vector<float> exported = read_floats(there / fmt::format("{:06}.npy", frame));
      const fs::path mask_file = there / fmt::format("{:06}_mask.png", frame);
      const auto mask =
          std::get<core::Image8>(core::decode_png(core::read_file(mask_file), mask_file.string()));
      for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x) {
          const std::size_t place = 2 * static_cast<std::size_t>(y * kWidth + x);
          const std::uint32_t sight = flow.uint_channels.at("sight")(x, y);
          ++num_of.at(sight);
          for (const std::size_t axis : {0U, 1U}) {
            const float own = flow.float_channels.at(axis == 0 ? "flow.x" : "flow.y")(x, y);
            const float other = exported.at(place + axis);
            ASSERT_EQ(std::isnan(own), std::isnan(other)) << x << " " << y;
            // Ranges of 400 m that are floats, and floats of up to 500 px.
            if (!std::isnan(own)) {
              ASSERT_NEAR(double{own}, double{other}, 5e-5) << x << " " << y;
            }
          }
          ASSERT_EQ(sight == 0, std::isinf(facts.range_m(x, y)));
          if (sight == 0) continue;
          ASSERT_EQ(mask(x, y), sight == 2 ? 3 : sight == 1 ? 1 : 0) << x << " " << y;
        }
      const core::ExrImage pair = read("pairs/" + of_camera + "/" + of_camera);
      const auto expect_same = [&](const core::ExrImage& one) {
        for (const auto& [channel, image] : one.float_channels)
          EXPECT_EQ(std::memcmp(image.data().data(), pair.float_channels.at(channel).data().data(),
                                image.data().size_bytes()),
                    0)
              << channel;
        for (const auto& [channel, image] : one.uint_channels)
          EXPECT_EQ(std::memcmp(image.data().data(), pair.uint_channels.at(channel).data().data(),
                                image.data().size_bytes()),
                    0)
              << channel;
      };
      expect_same(flow);
      if (frame == 0) {
        const core::ExrImage scene_flow = read("scene_flow/" + of_camera);
        EXPECT_EQ(scene_flow.float_channels.size() + scene_flow.uint_channels.size(), 4U);
        expect_same(scene_flow);
      }
    }
  for (const int num : num_of) EXPECT_GT(num, 20);
  for (const char* kind : {"flow", "scene_flow"})
    for (const char* apart : {"[]", "[0]", "[1, 5]"})
      expect_error(core::ErrorKind::Config, {kind, "frames_apart"}, [&] {
        std::vector<labels::LabelOptions> wanted(1);
        core::TomlDocument::parse(fmt::format("kind = \"{}\"\nframes_apart = {}\n", kind, apart),
                                  "test.toml")
            .read(wanted[0]);
        wanted[0].validate();
        const std::vector<labels::SequenceOutline> outlines = {
            {.name = "s", .cameras = sequence->info().cameras, .num_frames = 2}};
        labels::check_labels(wanted, outlines, core::Log("label", core::LogLevel::Off));
      });
}

}  // namespace
}  // namespace terracast::test
