// Ground truth that is chosen by its name and follows from facts: against closed forms of a plane, of boxes and of cameras
// that the test has by itself (tests/labels/named_scene.h).

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <map>
#include <set>

#include "capture/object_labels.h"
#include "core/hash.h"
#include "core/json.h"
#include "tests/labels/named_scene.h"
#include "tests/support/expect_error.h"
#include "validate/npy.h"

namespace terracast::test {
namespace {

namespace fs = std::filesystem;
using namespace named_scene;
using core::Json;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

TEST_F(NamedLabels, DepthRangeAndPointsAreThoseOfTheScene) {
  for (const char* kind : {"depth", "range", "points"}) make_labels(*sequence, *store, kind);
  int num_sure = 0, num_behind = 0, num_without_ray = 0, num_sky = 0;
  for_each_image([&](int frame, int camera, const Truth& truth) {
    const auto facts = read_facts(*sequence, frame, camera);
    const core::ExrImage depth_file = read_exr(labels("depth") / image_name(frame, camera, ".exr"));
    const core::ImageF& depth = depth_file.float_channels.at("depth.Z");
    const core::ExrImage range_file = read_exr(labels("range") / image_name(frame, camera, ".exr"));
    const core::ImageF& range = range_file.float_channels.at("range_m");
    const fs::path points_file = labels("points") / image_name(frame, camera, ".npy");
    const validate::NpyArray points =
        validate::parse_npy(core::read_file(points_file), points_file.string());
    EXPECT_EQ(points.kind, 'f');
    ASSERT_EQ(points.item_size, 8U);
    ASSERT_EQ(points.shape, (std::vector<std::size_t>{static_cast<std::size_t>(range.height()),
                                                      static_cast<std::size_t>(range.width()), 3}));
    for (int y = 0; y < range.height(); ++y)
      for (int x = 0; x < range.width(); ++x) {
        Vector3d point;
        std::memcpy(point.data(),
                    points.bytes.data() + 24 * static_cast<std::size_t>(y * range.width() + x), 24);
        const float of_capture = facts.float_channels.at("range_m")(x, y);
        ASSERT_EQ(std::memcmp(&range(x, y), &of_capture, sizeof of_capture), 0);
        const Truth::Ray own = truth.ray_camera(x + 0.5, y + 0.5);
        if (!own.direction.allFinite()) {
          ++num_without_ray;
          ASSERT_TRUE(std::isnan(depth(x, y)) && std::isnan(range(x, y)) && point.hasNaN());
          continue;
        }
        const auto hit = sure_hit(truth, facts, x, y);
        if (!hit) continue;
        if (std::isinf(hit->range_m)) {
          ++num_sky;
          ASSERT_EQ(depth(x, y), std::numeric_limits<float>::infinity());
          ASSERT_EQ(range(x, y), std::numeric_limits<float>::infinity());
          ASSERT_TRUE(point.array().isNaN().all());
          continue;
        }
        ++num_sure;
        num_behind += own.direction.z() < 0.0 ? 1 : 0;
        ASSERT_NEAR(double{range(x, y)}, hit->range_m, kFloat * hit->range_m + 1e-9);
        ASSERT_NEAR(double{depth(x, y)}, hit->range_m * own.direction.z(),
                    2.0 * kFloat * hit->range_m + 1e-9);
        const Truth::Ray ray = Truth::moved(truth.pose(y + 0.5), own);
        ASSERT_LE((point - (ray.origin + hit->range_m * ray.direction)).norm(),
                  kFloat * hit->range_m + 1e-9)
            << x << " " << y;
      }
  });
  EXPECT_GT(num_sure, 40000);
  EXPECT_GT(num_behind, 1000);
  EXPECT_GT(num_without_ray, 500);
  EXPECT_GT(num_sky, 10000);
  const Json index = Json::read(labels("points") / "points.json");
  EXPECT_EQ(index.at("capture").string(), capture::labels_source(*sequence));
  EXPECT_EQ(index.at("world_origin").at("lat_deg").number(), 46.0);
  EXPECT_EQ(index.at("world_origin").at("lon_deg").number(), 8.0);
}

TEST_F(NamedLabels, NormalsAreThoseOfFacesInBothFrames) {
  make_labels(*sequence, *store, "normals");
  int num_sure = 0, num_on_thing = 0;
  for_each_image([&](int frame, int camera, const Truth& truth) {
    const auto facts = read_facts(*sequence, frame, camera);
    const core::ExrImage file = read_exr(labels("normals") / image_name(frame, camera, ".exr"));
    for (int y = 0; y < file.height; ++y)
      for (int x = 0; x < file.width; ++x) {
        const auto normal_in = [&](const std::string& where) {
          return Vector3d(double{file.float_channels.at("normal_" + where + ".x")(x, y)},
                          double{file.float_channels.at("normal_" + where + ".y")(x, y)},
                          double{file.float_channels.at("normal_" + where + ".z")(x, y)});
        };
        const Vector3d world = normal_in("world"), in_camera = normal_in("camera");
        if (!std::isfinite(facts.float_channels.at("range_m")(x, y))) {
          ASSERT_TRUE(world.array().isNaN().all() && in_camera.array().isNaN().all());
          continue;
        }
        const Matrix3d world_from_camera = truth.pose(y + 0.5).linear();
        // Floats of length 1.
        ASSERT_LE((world_from_camera.transpose() * world - in_camera).norm(), 3e-7);
        ASSERT_NEAR(world.norm(), 1.0, 3e-7);
        if (facts.uint_channels.at("instance_id")(x, y) == kThing.instance_id) {
          // Along its own axes, which it has turned; the capture's halves are 5e-4 apart.
          const Vector3d own = Eigen::AngleAxisd(-kThing.heading_rad, Vector3d::UnitZ()) * world;
          ASSERT_NEAR(own.cwiseAbs().maxCoeff(), 1.0, 1e-6);
          ++num_on_thing;
          continue;
        }
        const auto hit = sure_hit(truth, facts, x, y);
        if (!hit || std::isinf(hit->range_m)) continue;
        ++num_sure;  // halves hold axes as they are
        ASSERT_EQ(world, hit->normal_world) << x << " " << y;
      }
  });
  EXPECT_GT(num_sure, 40000);
  EXPECT_GT(num_on_thing, 300);

  // Frames that are not asked for are not there, and those are that are.
  const fs::path file = labels("normals") / image_name(0, 0, ".exr");
  const core::ExrImage both = read_exr(file);
  make_labels_with(*sequence, *store, "kind = \"normals\"\nframes = [\"camera\"]\n");
  const core::ExrImage one = read_exr(file);
  EXPECT_EQ(one.float_channels.size(), 3U);
  const auto bytes_of = [](const core::ImageF& image) { return std::as_bytes(image.data()); };
  const auto now = bytes_of(one.float_channels.at("normal_camera.y"));
  const auto before = bytes_of(both.float_channels.at("normal_camera.y"));
  EXPECT_TRUE(std::equal(now.begin(), now.end(), before.begin(), before.end()));
  for (const char* frames : {"[]", "[\"body\"]"})
    expect_error(core::ErrorKind::Config, {"frames"}, [&] {
      make_labels_with(*sequence, *store, fmt::format("kind = \"normals\"\nframes = {}\n", frames));
    });
}

/// A PNG as libpng reads it.
core::Image8 read_png(const fs::path& file) {
  return std::get<core::Image8>(core::decode_png(core::read_file(file), file.string()));
}

TEST_F(NamedLabels, ClassesAndInstancesAreThoseOfTheScene) {
  make_labels(*sequence, *store, "semantic");
  make_labels(*sequence, *store, "instance");
  std::map<std::uint32_t, int> num_of;
  for_each_image([&](int frame, int camera, const Truth& truth) {
    const auto facts = read_facts(*sequence, frame, camera);
    const core::Image8 classes = read_png(labels("semantic") / image_name(frame, camera, ".png"));
    ASSERT_EQ(classes.channels(), 1);
    const core::ExrImage file = read_exr(labels("instance") / image_name(frame, camera, ".exr"));
    const core::ImageU32& instances = file.uint_channels.at("instance_id");
    for (int y = 0; y < file.height; ++y)
      for (int x = 0; x < file.width; ++x) {
        ASSERT_EQ(classes(x, y), facts.uint_channels.at("semantic_id")(x, y));
        ASSERT_EQ(instances(x, y), facts.uint_channels.at("instance_id")(x, y));
        if (!truth.ray_camera(x + 0.5, y + 0.5).direction.allFinite()) {
          ASSERT_EQ(classes(x, y), static_cast<int>(core::SemanticClass::Nothing));
          continue;
        }
        const auto hit = sure_hit(truth, facts, x, y);
        if (!hit) continue;
        ASSERT_EQ(instances(x, y), hit->instance_id);
        ++num_of[hit->instance_id];
        if (std::isinf(hit->range_m)) {
          ASSERT_EQ(classes(x, y), static_cast<int>(core::SemanticClass::Sky));
        }
        for (const WorldBox& box : kBoxes)
          if (box.instance_id == hit->instance_id) {
            ASSERT_EQ(classes(x, y), static_cast<int>(box.semantic_class));
          }
      }
  });
  for (const WorldBox& box : kBoxes) EXPECT_GT(num_of[box.instance_id], 50) << box.instance_id;
  const Json index = Json::read(labels("instance") / "instance.json");
  std::map<std::int64_t, std::string> listed;
  for (std::size_t i = 0; i < index.at("instances").size(); ++i) {
    const Json& one = index.at("instances").at(i);
    listed[one.at("id").integer()] = one.at("class").string();
    EXPECT_EQ(one.at("layer").string(), "town");
  }
  EXPECT_EQ(listed,
            (std::map<std::int64_t, std::string>{
                {11, "truck"}, {12, "building"}, {13, "building"}, {14, "river"}, {70, "car"}}));
  const Json classes = Json::read(labels("semantic") / "semantic.json");
  ASSERT_EQ(classes.at("classes").size(), core::kNumSemanticClasses);
  EXPECT_EQ(classes.at("classes").at(std::size_t{34}).at("name").string(), "truck");
  EXPECT_EQ(classes.at("classes").at(std::size_t{34}).at("id").integer(), 34);
}

// By panopticapi's rule: every pixel's number is a segment of its image, whose area and box are those of its pixels.
TEST_F(NamedLabels, PanopticSegmentsArePixelsOfThingsAndClasses) {
  make_labels(*sequence, *store, "panoptic");
  const Json index = Json::read(labels("panoptic") / "panoptic.json");
  std::map<std::int64_t, std::string> names;
  for (std::size_t i = 0; i < index.at("categories").size(); ++i)
    names[index.at("categories").at(i).at("id").integer()] =
        index.at("categories").at(i).at("name").string();
  ASSERT_EQ(index.at("annotations").size(), static_cast<std::size_t>(2 * num_cameras()));
  std::map<std::uint32_t, std::set<std::int64_t>> numbers_of_things;
  std::size_t at = 0;
  for_each_image([&](int frame, int camera, const Truth&) {
    const Json& annotation = index.at("annotations").at(at);
    EXPECT_EQ(index.at("images").at(at).at("id").integer(), annotation.at("image_id").integer());
    ++at;
    ASSERT_EQ(annotation.at("file_name").string(), image_name(frame, camera, ".png"));
    const core::Image8 png = read_png(labels("panoptic") / annotation.at("file_name").string());
    ASSERT_EQ(png.channels(), 3);
    const auto facts = read_facts(*sequence, frame, camera);
    struct Seen {
      std::int64_t area = 0;
      Eigen::AlignedBox2d box;
      std::set<std::uint32_t> classes, instances;
    };
    std::map<std::int64_t, Seen> seen;
    for (int y = 0; y < png.height(); ++y)
      for (int x = 0; x < png.width(); ++x) {
        const std::int64_t number = png(x, y, 0) + 256 * png(x, y, 1) + 65536 * png(x, y, 2);
        const std::uint32_t semantic = facts.uint_channels.at("semantic_id")(x, y);
        ASSERT_EQ(number == 0,
                  semantic == static_cast<std::uint32_t>(core::SemanticClass::Nothing));
        if (number == 0) continue;
        Seen& one = seen[number];
        ++one.area;
        one.box.extend(Vector2d(x, y));
        one.box.extend(Vector2d(x + 1, y + 1));
        one.classes.insert(semantic);
        one.instances.insert(facts.uint_channels.at("instance_id")(x, y));
      }
    ASSERT_EQ(annotation.at("segments_info").size(), seen.size());
    for (std::size_t i = 0; i < seen.size(); ++i) {
      const Json& segment = annotation.at("segments_info").at(i);
      const std::int64_t number = segment.at("id").integer();
      ASSERT_TRUE(seen.contains(number));
      const Seen& one = seen[number];
      EXPECT_EQ(segment.at("area").integer(), one.area);
      EXPECT_EQ(segment.at("bbox").numbers(),
                (std::vector<double>{one.box.min().x(), one.box.min().y(), one.box.sizes().x(),
                                     one.box.sizes().y()}));
      // All of one class; of a thing one instance, of stuff none that can be counted.
      EXPECT_EQ(one.classes, (std::set<std::uint32_t>{
                                 static_cast<std::uint32_t>(segment.at("category_id").integer())}));
      if (!segment.has("instance_id")) {
        EXPECT_LT(number, 1000);
        for (const std::uint32_t id : {11U, 12U, 13U, 70U})
          EXPECT_FALSE(one.instances.contains(id));
        continue;
      }
      EXPECT_GE(number, 1000);
      const auto id = static_cast<std::uint32_t>(segment.at("instance_id").integer());
      EXPECT_EQ(one.instances, (std::set<std::uint32_t>{id}));
      numbers_of_things[id].insert(number);
    }
  });
  ASSERT_EQ(numbers_of_things.size(), 4U);  // not the river
  for (const auto& [id, numbers] : numbers_of_things) EXPECT_EQ(numbers.size(), 1U) << id;
  EXPECT_EQ(names.at(34), "truck");
}

// Each kind makes one file an image or pair and its index, the same bytes by one thread, and touches no image that is as
// it shall be.
TEST_F(NamedLabels, AreMadeOnceAndAgainWhereTheyAreDamaged) {
  for (const std::string kind : {"depth", "range", "points", "normals", "semantic", "instance",
                                 "panoptic", "flow", "scene_flow", "disparity"}) {
    SCOPED_TRACE(kind);
    fs::remove_all(labels(kind));
    make_labels(*sequence, *store, kind, 2);
    std::map<fs::path, std::pair<std::string, fs::file_time_type>> made;
    for (const auto& entry : fs::recursive_directory_iterator(labels(kind)))
      if (entry.is_regular_file())
        made[entry.path()] = {core::content_hash_of_file(entry.path()),
                              fs::last_write_time(entry.path())};
    const std::size_t num_images = kind == "flow"         ? 12  // both ways
                                   : kind == "scene_flow" ? 6   // frame 0 to 1
                                   : kind == "disparity"  ? 8   // 4 pairs
                                                          : 12;  // 2 frames by 6 cameras
    EXPECT_EQ(made.size(), num_images + 1);
    const fs::path index = labels(kind) / (kind + ".json");
    ASSERT_TRUE(made.contains(index));
    EXPECT_EQ(Json::read(index).at("format").string(), "terracast " + kind);
    EXPECT_EQ(Json::read(index).at("capture").string(), capture::labels_source(*sequence));
    const fs::path damaged =
        made.begin()->first == index ? std::next(made.begin())->first : made.begin()->first;
    fs::resize_file(damaged, fs::file_size(damaged) / 2);
    const fs::path missing = std::prev(made.end())->first;
    fs::remove(missing);
    core::write_file(labels(kind) / "mcs4/left/stale.exr", "of other options");
    make_labels(*sequence, *store, kind, 1);
    EXPECT_FALSE(fs::exists(labels(kind) / "mcs4/left/stale.exr"));
    for (const auto& [file, was] : made) {
      ASSERT_EQ(core::content_hash_of_file(file), was.first) << file;
      if (file != damaged && file != missing && file != index) {
        ASSERT_EQ(fs::last_write_time(file), was.second) << file;
      }
    }
  }
}

// A write that fails stands for a run that is cut off there.
TEST_F(NamedLabels, CutOffMidwayHaveNoIndex) {
  for (const std::string kind : {"range", "flow"}) {
    SCOPED_TRACE(kind);
    make_labels(*sequence, *store, kind);
    const fs::path index = labels(kind) / (kind + ".json");
    const std::string of_index = core::content_hash_of_file(index);
    std::set<fs::path> images;
    for (const auto& entry : fs::recursive_directory_iterator(labels(kind) / "mcs4/left"))
      images.insert(entry.path());
    ASSERT_EQ(images.size(), 2U);
    const auto time = fs::last_write_time(index);
    make_labels(*sequence, *store, kind);
    EXPECT_EQ(fs::last_write_time(index), time);

    fs::remove(*images.begin());
    fs::remove(*images.rbegin());
    fs::create_directories(*images.rbegin() / "in_the_way");
    expect_error(core::ErrorKind::Io, {}, [&] { make_labels(*sequence, *store, kind, 1); });
    EXPECT_TRUE(fs::exists(*images.begin()));
    EXPECT_FALSE(fs::exists(index));
    fs::remove_all(*images.rbegin());
    make_labels(*sequence, *store, kind);
    EXPECT_EQ(core::content_hash_of_file(index), of_index);
  }
}

}  // namespace
}  // namespace terracast::test
