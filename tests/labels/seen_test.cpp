// What a sequence saw: its cloud of points, and how much its images show of each other.

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <map>
#include <set>
#include <sstream>

#include "capture/channel.h"
#include "capture/object_labels.h"
#include "core/atomic_file.h"
#include "core/hash.h"
#include "core/image_io.h"
#include "core/json.h"
#include "core/toml_reader.h"
#include "labels/label.h"
#include "labels/matches.h"
#include "tests/labels/boxes_world.h"
#include "tests/support/expect_error.h"
#include "tests/support/test_data.h"

namespace terracast::test {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector2d;
using Eigen::Vector3d;

const std::vector<WorldBox> kBoxes = {
    {.instance_id = 11, .low = {100, -5, 0}, .high = {110, 5, 60}},
    {.instance_id = 12, .low = {180, -40, 0}, .high = {220, 20, 40}},
};

/// Three frames that go aside and turn.
render::SequencePlan moving_plan() {
  render::SequencePlan plan = level_plan(3);
  for (int i = 0; i < 3; ++i) {
    plan.states[static_cast<std::size_t>(i)].world_from_body.translation = {5.0 * i, -25.0 * i,
                                                                            50.0};
    plan.states[static_cast<std::size_t>(i)].world_from_body.rotation =
        Eigen::AngleAxisd(0.1 * i, Vector3d::UnitZ()) * Eigen::AngleAxisd(0.1, Vector3d::UnitY());
  }
  return plan;
}

/// What a pixel of the pinhole of level_plan() shows, by the capture's range.
Vector3d point_of(const capture::SequenceReader& sequence, int frame,
                  const capture::CameraFrame& facts, int x, int y) {
  const geo::Rigid3d pose = sequence.world_from_camera(frame, 0);
  const Vector3d ray = Vector3d((x + 0.5 - 100.0) / 200.0, (y + 0.5 - 80.0) / 200.0, 1.0);
  return pose * (ray.normalized() * double{facts.range_m(x, y)});
}

struct PlyPoint {
  double x, y, z;
  float nx, ny, nz;
  std::uint8_t red, green, blue, semantic_class;
  std::uint32_t instance;
  float range;
};

std::vector<PlyPoint> read_ply(const fs::path& file) {
  const std::string text = core::read_text_file(file);
  const std::size_t end = text.find("end_header\n") + 11;
  const std::size_t at = text.find("element vertex ") + 15;
  const std::size_t count = std::stoul(text.substr(at));
  constexpr std::size_t kBytes = 48;
  EXPECT_EQ(text.size(), end + kBytes * count);
  std::vector<PlyPoint> points(count);
  for (std::size_t i = 0; i < count; ++i) {
    const char* from = text.data() + end + kBytes * i;
    const auto take = [&](auto& value) {
      std::memcpy(&value, from, sizeof value);
      from += sizeof value;
    };
    PlyPoint& p = points[i];
    take(p.x), take(p.y), take(p.z), take(p.nx), take(p.ny), take(p.nz), take(p.red);
    take(p.green), take(p.blue), take(p.semantic_class), take(p.instance), take(p.range);
  }
  return points;
}

TEST(Clouds, HoldTheNearestPointOfEachVoxelThatWasSeen) {
  const ScratchFolder folder;
  const auto store = make_boxes_world(folder / "world", kBoxes);
  const auto sequence = render_plan(store, moving_plan(), folder / "boxes");
  constexpr double kVoxel_m = 4.0;
  make_labels_with(sequence, store, "kind = \"cloud\"\nvoxel_m = 4.0\n");
  struct Nearest {
    float range_m;
    Vector3d place;
    std::uint32_t instance;
    int red;
  };
  std::map<std::array<long, 3>, Nearest> truth;
  for (int frame = 0; frame < 3; ++frame) {
    const auto facts = sequence.read_camera(frame, 0);
    for (int y = 0; y < 160; ++y)
      for (int x = 0; x < 200; ++x) {
        if (!std::isfinite(facts.range_m(x, y))) continue;
        const Vector3d place = point_of(sequence, frame, facts, x, y);
        // A plane's points may come to lie in either of two voxels.
        if ((place / kVoxel_m - (place / kVoxel_m).array().round().matrix()).cwiseAbs().minCoeff() <
            1e-6)
          continue;
        const std::array<long, 3> voxel = {std::lround(std::floor(place.x() / kVoxel_m)),
                                           std::lround(std::floor(place.y() / kVoxel_m)),
                                           std::lround(std::floor(place.z() / kVoxel_m))};
        const auto known = truth.find(voxel);
        if (known == truth.end() || facts.range_m(x, y) < known->second.range_m)
          truth[voxel] = {facts.range_m(x, y), place, facts.instance_id(x, y),
                          facts.color(x, y, 0)};
      }
  }
  const auto points = read_ply(folder / "boxes" / "labels/cloud/cloud.ply");
  std::size_t num_found = 0;
  std::array<long, 3> last = {std::numeric_limits<long>::min(), 0, 0};
  for (const PlyPoint& point : points) {
    const Vector3d place(point.x, point.y, point.z);
    const std::array<long, 3> voxel = {std::lround(std::floor(place.x() / kVoxel_m)),
                                       std::lround(std::floor(place.y() / kVoxel_m)),
                                       std::lround(std::floor(place.z() / kVoxel_m))};
    EXPECT_LT(last, voxel);  // one each, in order
    last = voxel;
    // Ranges are floats: of 2 km 0.1 mm.
    double off_m = std::abs(place.z());
    for (const WorldBox& box : kBoxes) {
      const Vector3d outside = (box.low - place).cwiseMax(place - box.high);
      off_m = std::min(off_m, std::abs(outside.maxCoeff()));
    }
    EXPECT_LT(off_m, 1e-3);
    EXPECT_NEAR(Vector3d(double{point.nx}, double{point.ny}, double{point.nz}).norm(), 1.0, 1e-6);
    const auto known = truth.find(voxel);
    if (known == truth.end()) continue;
    ++num_found;
    if (point.range != known->second.range_m) continue;  // one on the voxel's border is nearer
    EXPECT_LE((place - known->second.place).norm(), 1e-9);
    EXPECT_EQ(point.instance, known->second.instance);
    EXPECT_EQ(point.red, known->second.red);
  }
  EXPECT_EQ(num_found, truth.size());
  EXPECT_GT(num_found, 300U);  // not those of the ground, which lies on the border of voxels
}

TEST(Clouds, SameBytesForAnyThreadsAndOnlyMadeOnce) {
  const ScratchFolder folder;
  const auto store = make_boxes_world(folder / "world", kBoxes);
  const auto sequence = render_plan(store, moving_plan(), folder / "boxes");
  const fs::path file = folder / "boxes" / "labels/cloud/cloud.ply";
  make_labels(sequence, store, "cloud", 1);
  const std::string whole = core::content_hash_of_file(file);
  const auto time = fs::last_write_time(file);
  make_labels(sequence, store, "cloud", 2);
  EXPECT_EQ(fs::last_write_time(file), time);
  fs::remove_all(file.parent_path());
  make_labels(sequence, store, "cloud", 2);
  EXPECT_EQ(core::content_hash_of_file(file), whole);
  fs::resize_file(file, 1000);
  make_labels(sequence, store, "cloud");
  EXPECT_EQ(core::content_hash_of_file(file), whole);
  // Another size of voxels is another cloud.
  make_labels_with(sequence, store, "kind = \"cloud\"\nvoxel_m = 2.0\n");
  EXPECT_NE(core::content_hash_of_file(file), whole);
}

struct Row {
  std::int64_t asked, in_image, seen;
};
using Table = std::map<std::pair<int, int>, Row>;

Table read_table(const fs::path& file) {
  std::istringstream in(core::read_text_file(file));
  std::string line;
  std::getline(in, line);
  EXPECT_EQ(line, "frame,camera,other_frame,other_camera,asked,in_image,seen,share_seen");
  Table table;
  while (std::getline(in, line)) {
    for (char& c : line)
      if (c == ',') c = ' ';
    std::istringstream words(line);
    int frame, other;
    std::string camera, other_camera;
    Row row;
    double share;
    EXPECT_TRUE(words >> frame >> camera >> other >> other_camera >> row.asked >> row.in_image >>
                row.seen >> share);
    EXPECT_NEAR(share, double(row.seen) / double(row.asked), 1e-6);
    table[{frame, other}] = row;
  }
  return table;
}

// The capture has visibility bits of its own, made while rendering, for frames that follow each other.
TEST(Covisibility, OfFramesThatFollowIsThatOfTheCapturesBits) {
  const ScratchFolder folder;
  const auto store = make_boxes_world(folder / "world", kBoxes);
  const auto sequence = render_plan(store, moving_plan(), folder / "boxes");
  make_labels_with(sequence, store, "kind = \"covisibility\"\nstep_px = 1\nreach_frames = 1\n");
  const Table table = read_table(folder / "boxes" / "labels/covisibility/covisibility.csv");
  EXPECT_EQ(table.size(), 4U);
  for (const auto& [frames, row] : table) {
    const auto facts = sequence.read_camera(frames.first, 0, capture::SequenceReader::kFacts);
    const std::uint32_t bit =
        frames.second > frames.first ? capture::kVisibleNext : capture::kVisiblePrevious;
    std::int64_t num_seen = 0;
    for (const std::uint32_t flags : facts.flags.data()) num_seen += (flags & bit) != 0 ? 1 : 0;
    EXPECT_EQ(row.asked, 200 * 160);
    EXPECT_EQ(row.seen, num_seen);
    EXPECT_GT(row.seen, 1000);
    EXPECT_LT(row.seen, row.in_image);
  }
}

// Of frames far apart: by the boxes' slabs. The ground hides nothing.
TEST(Covisibility, OfAnyFramesIsThatOfTheSlabs) {
  const ScratchFolder folder;
  const auto store = make_boxes_world(folder / "world", kBoxes);
  const auto sequence = render_plan(store, moving_plan(), folder / "boxes");
  make_labels_with(sequence, store, "kind = \"covisibility\"\nstep_px = 7\n");
  const Table table = read_table(folder / "boxes" / "labels/covisibility/covisibility.csv");
  EXPECT_EQ(table.size(), 6U);
  for (const auto& [frames, row] : table) {
    const auto facts = sequence.read_camera(frames.first, 0, capture::SequenceReader::kFacts);
    const geo::Rigid3d other = sequence.world_from_camera(frames.second, 0);
    std::int64_t num_asked = 0, num_in_image = 0, num_seen = 0;
    for (int y = 3; y < 160; y += 7)
      for (int x = 3; x < 200; x += 7) {
        ++num_asked;
        if (!std::isfinite(facts.range_m(x, y))) continue;
        const Vector3d point = point_of(sequence, frames.first, facts, x, y);
        const Vector3d at = other.inverse() * point;
        const Vector2d pixel(100.0 + 200.0 * at.x() / at.z(), 80.0 + 200.0 * at.y() / at.z());
        if (!(at.z() > 0.0) || !(pixel.x() >= 0.0) || !(pixel.y() >= 0.0) || pixel.x() >= 200.0 ||
            pixel.y() >= 160.0)
          continue;
        ++num_in_image;
        // Up to a millimetre before it, which floats leave.
        const Vector3d way = point - other.translation;
        const Vector3d short_way = way * (1.0 - 1e-3 / way.norm());
        bool is_hidden = false;
        for (const WorldBox& box : kBoxes) {
          double t_in = 0.0, t_out = 1.0;
          for (int axis = 0; axis < 3; ++axis) {
            const double a = (box.low[axis] - other.translation[axis]) / short_way[axis];
            const double b = (box.high[axis] - other.translation[axis]) / short_way[axis];
            t_in = std::max(t_in, std::min(a, b));
            t_out = std::min(t_out, std::max(a, b));
          }
          is_hidden = is_hidden || t_in < t_out;
        }
        num_seen += is_hidden ? 0 : 1;
      }
    EXPECT_EQ(row.asked, num_asked);
    EXPECT_EQ(row.in_image, num_in_image);
    EXPECT_EQ(row.seen, num_seen);
  }
}

/// Channels of a file of pairs.
core::ExrImage read_pair(const fs::path& file) {
  auto parts = core::decode_exr(core::read_file(file), file.string());
  EXPECT_EQ(parts.size(), 1U);
  return parts.at(0);
}

// Of a rectified pair disparity is f b / z, by the capture's range; what is seen, by the capture's own bits.
TEST(Pairs, HaveTheDisparityAndTheSightOfEachPixel) {
  const ScratchFolder folder;
  const auto store = make_boxes_world(folder / "world", kBoxes);
  render::SequencePlan plan = moving_plan();
  plan.cameras.push_back(plan.cameras[0]);
  plan.cameras[1].name = "cam1";
  plan.cameras[1].rig_from_camera.translation = {0.0, -2.0, 0.0};  // to the right
  const auto sequence = render_plan(store, plan, folder / "boxes");
  make_labels(sequence, store, "pairs");
  const fs::path pairs = folder / "boxes" / "labels/pairs";
  for (const bool is_left : {true, false}) {
    const int camera = is_left ? 0 : 1;
    const fs::path file = is_left ? pairs / "mcs4/cam0/mcs4/cam1/000001_000001.exr"
                                  : pairs / "mcs4/cam1/mcs4/cam0/000001_000001.exr";
    const core::ExrImage pair = read_pair(file);
    const auto facts = sequence.read_camera(1, camera, capture::SequenceReader::kFacts);
    std::int64_t num_hidden = 0, num_out_of_view = 0;
    for (int y = 0; y < 160; ++y)
      for (int x = 0; x < 200; ++x) {
        const std::uint32_t sight = pair.uint_channels.at("sight")(x, y);
        const float flow_x = pair.float_channels.at("flow.x")(x, y);
        const double range_m = double{facts.range_m(x, y)};
        const Vector3d ray((x + 0.5 - 100.0) / 200.0, (y + 0.5 - 80.0) / 200.0, 1.0);
        const double disparity = 200.0 * 2.0 / (range_m / ray.norm());
        const double there = x + 0.5 + (is_left ? -disparity : disparity);
        const bool is_inside = std::isfinite(range_m) && there >= 0.0 && there < 200.0;
        if (!std::isfinite(range_m)) {  // the sky, which two cameras that look one way see alike
          ASSERT_EQ(sight, 0U);
          ASSERT_NEAR(double{flow_x}, 0.0, 1e-9);
          continue;
        }
        ASSERT_EQ(sight == 1 || sight == 2, is_inside);
        if (!is_inside) {
          ASSERT_EQ(sight, 3U);
          ++num_out_of_view;
        }
        const bool has_bit = (facts.flags(x, y) & capture::visible_in_camera(1 - camera)) != 0;
        ASSERT_EQ(sight == 2, has_bit);
        num_hidden += sight == 1 ? 1 : 0;
        // Ranges and flows are floats. Beyond the border flow goes on.
        ASSERT_NEAR(double{flow_x}, there - (x + 0.5), 1e-5);
        ASSERT_NEAR(double{pair.float_channels.at("flow.y")(x, y)}, 0.0, 1e-5);
      }
    EXPECT_GT(num_hidden, 20);
    EXPECT_GT(num_out_of_view, 100);
  }
  // Pairs that are asked for, frames apart; none of others is left.
  core::write_file(pairs / ".terracast-tmp-other", "another writer's");
  make_labels_with(sequence, store,
                   "kind = \"pairs\"\ncameras = [\"mcs4/cam0 mcs4/cam0\"]\nframes_apart = [1]\n");
  std::set<std::string> left;
  for (const auto& entry : fs::recursive_directory_iterator(pairs))
    left.insert(entry.path().lexically_relative(pairs).string());
  const std::string of_camera = "mcs4/cam0/mcs4/cam0";
  EXPECT_EQ(left,
            (std::set<std::string>{".terracast-tmp-other", "pairs.json", "mcs4", "mcs4/cam0",
                                   "mcs4/cam0/mcs4", of_camera, of_camera + "/000000_000001.exr",
                                   of_camera + "/000001_000002.exr"}));
  // The index says which there are.
  const core::Json index = core::Json::read(pairs / "pairs.json");
  EXPECT_EQ(index.at("capture").string(), capture::labels_source(sequence));
  ASSERT_EQ(index.at("pairs").size(), 1U);
  const core::Json& listed = index.at("pairs").at(std::size_t{0});
  EXPECT_EQ(listed.at("camera").string(), "mcs4/cam0");
  EXPECT_EQ(listed.at("other_camera").string(), "mcs4/cam0");
  EXPECT_EQ(listed.at("frames_apart").integer(), 1);
  EXPECT_EQ(listed.at("differs_in").string(), "frame");
  ASSERT_EQ(listed.at("files").size(), 2U);
  EXPECT_EQ(listed.at("files").at(std::size_t{1}).string(), of_camera + "/000001_000002.exr");
  const core::ExrImage next = read_pair(pairs / "mcs4/cam0/mcs4/cam0/000001_000002.exr");
  const auto facts = sequence.read_camera(1, 0, capture::SequenceReader::kFacts);
  for (int y = 0; y < 160; ++y)
    for (int x = 0; x < 200; ++x)
      ASSERT_EQ(next.uint_channels.at("sight")(x, y) == 2,
                (facts.flags(x, y) & capture::kVisibleNext) != 0);
  // What is there is kept, what was cut is made again.
  const fs::path kept = pairs / "mcs4/cam0/mcs4/cam0/000000_000001.exr";
  const fs::path cut = pairs / "mcs4/cam0/mcs4/cam0/000001_000002.exr";
  const auto time = fs::last_write_time(kept);
  const std::string whole = core::content_hash_of_file(cut);
  fs::resize_file(cut, 5000);
  make_labels_with(sequence, store,
                   "kind = \"pairs\"\ncameras = [\"mcs4/cam0 mcs4/cam0\"]\nframes_apart = [1]\n");
  EXPECT_EQ(core::content_hash_of_file(cut), whole);
  EXPECT_EQ(fs::last_write_time(kept), time);
  expect_error(core::ErrorKind::Config, {"mcs4/cam9", "mcs4/cam0"}, [&] {
    make_labels_with(sequence, store, "kind = \"pairs\"\ncameras = [\"mcs4/cam0 mcs4/cam9\"]\n");
  });
}

// Before anything is rendered.
TEST(Pairs, OptionsThatMakeNothingAreRefusedByName) {
  const auto outline = [](const std::string& name, int num_frames, int num_cameras) {
    labels::SequenceOutline sequence{.name = name, .cameras = {}, .num_frames = num_frames};
    for (int i = 0; i < num_cameras; ++i) {
      sequence.cameras.emplace_back().rig = "v";
      sequence.cameras.back().name = std::string(1, static_cast<char>('c' + i));
    }
    return sequence;
  };
  const auto check = [](const std::string& keys,
                        const std::vector<labels::SequenceOutline>& sequences) {
    std::vector<labels::LabelOptions> options(1);
    core::TomlDocument::parse("kind = \"pairs\"\n" + keys, "test.toml").read(options[0]);
    options[0].validate();
    labels::check_labels(options, sequences, core::Log("label", core::LogLevel::Off));
  };
  const std::vector two = {outline("short", 3, 2), outline("long", 2000, 2)};
  const auto refuses = [&](const std::string& keys, const std::vector<std::string>& words,
                           const std::vector<labels::SequenceOutline>& sequences) {
    expect_error(core::ErrorKind::Config, words, [&] { check(keys, sequences); });
  };
  refuses("cameras = [\"v/c v/x\"]\n", {"v/x", "v/c", "checking the labels pairs"}, two);
  for (const char* malformed : {"v/c", "v/c  v/d", "v v/c", "v/c/d v/c", "", "v/c v/d v/c"})
    refuses(fmt::format("cameras = [\"{}\"]\n", malformed), {"is no pair", "RIG/NAME RIG/NAME"},
            two);
  refuses("cameras = [\"v/c v/c\"]\n", {"\"v/c v/c\"", "image with itself"}, two);
  refuses("frames_apart = []\n", {"frames_apart is empty"}, two);
  refuses("frames_apart = [1, -2000]\n", {"frames_apart = -2000", "long, has 2000 frames"}, two);
  refuses("", {"no camera has another beside it"}, {outline("alone", 3, 1)});
  EXPECT_NO_THROW(check("", two));
  EXPECT_NO_THROW(check("frames_apart = [1000]\n", two));  // `short` is warned about
  EXPECT_NO_THROW(check("cameras = [\"v/c v/c\"]\nframes_apart = [0, 1]\n", two));
  EXPECT_NO_THROW(check("frames_apart = [1]\n", {outline("alone", 3, 1)}));
}

TEST(Pairs, SightOfParallelRaysStartsWhereEachOfThemDoes) {
  // A wall, and a box before it: along the axis it hides another part of the wall than it does from the camera's
  // place.
  const std::vector<WorldBox> boxes = {
      {.instance_id = 11, .low = {100, -40, 10}, .high = {102, 40, 90}},
      {.instance_id = 12, .low = {50, 15, 45}, .high = {52, 20, 55}}};
  const ScratchFolder folder;
  const auto store = make_boxes_world(folder / "world", boxes);
  render::SequencePlan plan = level_plan();
  plan.cameras.push_back(plan.cameras[0]);
  plan.cameras[1].name = "map";
  plan.cameras[1].intrinsics.model = "orthographic";
  plan.cameras[1].intrinsics.parameters = {2.0, 2.0, 100.0,
                                           70.0};  // the wall's lowest 5 m lie below it
  const auto sequence = render_plan(store, plan, folder / "boxes");
  make_labels(sequence, store, "pairs");
  const core::ExrImage pair =
      read_pair(folder / "boxes" / "labels/pairs/mcs4/cam0/mcs4/map/000000_000000.exr");
  const auto facts = sequence.read_camera(0, 0, capture::SequenceReader::kFacts);
  int num_hidden = 0, num_seen = 0, num_outside = 0;
  for (int y = 0; y < 160; ++y)
    for (int x = 0; x < 200; ++x) {
      if (std::isinf(facts.range_m(x, y))) {  // it has no one image where rays are parallel
        ASSERT_EQ(pair.uint_channels.at("sight")(x, y), 0U);
        ASSERT_TRUE(std::isnan(pair.float_channels.at("flow.x")(x, y)));
      }
      if (facts.instance_id(x, y) != 11) continue;
      const Vector3d point = point_of(sequence, 0, facts, x, y);
      const Vector2d there(100.0 - 2.0 * point.y(), 70.0 - 2.0 * (point.z() - 50.0));
      const double to_edge = std::min({there.x(), there.y(), 200.0 - there.x(), 160.0 - there.y()});
      if (std::abs(to_edge) < 1e-3) continue;  // ranges are floats
      // Not at the very rim of the box's shadow.
      const double past =
          std::max(std::abs(point.y() - 17.5) - 2.5, std::abs(point.z() - 50.0) - 5.0);
      if (std::abs(past) < 1e-3) continue;
      const std::uint32_t sight = pair.uint_channels.at("sight")(x, y);
      if (to_edge < 0.0) {
        ASSERT_EQ(sight, 3U) << x << " " << y;
        ++num_outside;
      }
      // Ranges of 130 m and flows are floats: 8e-6 m at 2 px a metre, and 4e-6 px.
      ASSERT_NEAR(double{pair.float_channels.at("flow.x")(x, y)}, there.x() - (x + 0.5), 3e-5);
      ASSERT_NEAR(double{pair.float_channels.at("flow.y")(x, y)}, there.y() - (y + 0.5), 3e-5);
      if (to_edge < 0.0) continue;
      const bool is_hidden = boxes[1].is_met({0.0, point.y(), point.z()}, Vector3d::UnitX());
      ASSERT_EQ(sight, is_hidden ? 1U : 2U) << x << " " << y;
      ++(is_hidden ? num_hidden : num_seen);
    }
  EXPECT_GT(num_outside, 1000);
  EXPECT_GT(num_hidden, 100);
  EXPECT_GT(num_seen, 1000);
}

TEST(Matches, AreWhereAnotherCameraSeesThePoint) {
  const ScratchFolder folder;
  const auto store = make_boxes_world(folder / "world", kBoxes);
  const auto sequence = render_plan(store, moving_plan(), folder / "boxes");
  const scene::MovingBodies none;
  const labels::Matcher matcher(sequence, store, none);
  const auto facts = sequence.read_camera(0, 0, capture::SequenceReader::kFacts);
  const std::vector<Eigen::Vector2i> pixels = {{100, 60}, {20, 150}, {180, 120}, {100, 0}};
  const auto points = matcher.points({0, 0}, pixels);
  std::vector<labels::ShownPoint> there;
  for (std::size_t i = 0; i < 3; ++i) {
    ASSERT_TRUE(points[i]);
    there.push_back(*points[i]);
    EXPECT_FALSE(points[i]->body);
    EXPECT_LE((points[i]->point_world - point_of(sequence, 0, facts, pixels[i].x(), pixels[i].y()))
                  .norm(),
              1e-3);
  }
  EXPECT_FALSE(points[3]);  // sky
  const auto sightings = matcher.follow(there, {1, 0});
  const geo::Rigid3d other = sequence.world_from_camera(1, 0);
  for (std::size_t i = 0; i < 3; ++i) {
    const Vector3d at = other.inverse() * there[i].point_world;
    const Vector2d pixel(100.0 + 200.0 * at.x() / at.z(), 80.0 + 200.0 * at.y() / at.z());
    const bool is_inside = at.z() > 0.0 && pixel.x() >= 0.0 && pixel.y() >= 0.0 &&
                           pixel.x() < 200.0 && pixel.y() < 160.0;
    ASSERT_EQ(sightings[i].has_value(), at.z() > 0.0);
    if (!sightings[i]) continue;
    EXPECT_EQ(sightings[i]->is_in_image, is_inside);
    EXPECT_LE((sightings[i]->pixel - pixel).norm(), 1e-9);
  }
  // Another world's rays meet something else.
  std::vector<WorldBox> moved = kBoxes;
  moved[0].low.x() -= 1.0;
  const auto other_store = make_boxes_world(folder / "other", moved);
  expect_error(core::ErrorKind::Input, {"rendered from"},
               [&] { const labels::Matcher refused(sequence, other_store, none); });
}

}  // namespace
}  // namespace terracast::test
