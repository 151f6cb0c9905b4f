// Ground truth that is chosen by its name and follows from facts: against closed forms of a plane, of boxes and of four
// cameras (global and rolling shutters, a fisheye, parallel rays) that the test has by itself.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <numbers>
#include <set>

#include "capture/object_labels.h"
#include "core/atomic_file.h"
#include "core/hash.h"
#include "core/image_io.h"
#include "core/json.h"
#include "core/log.h"
#include "core/toml_reader.h"
#include "export/exporter.h"
#include "geo/frames.h"
#include "tests/labels/boxes_world.h"
#include "tests/support/expect_error.h"
#include "tests/support/test_data.h"
#include "validate/npy.h"

namespace terracast::test {
namespace {

namespace fs = std::filesystem;
using core::Json;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr int kWidth = 100, kHeight = 80;
constexpr int kWideSize = 120;
constexpr double kFisheyeFocal_px = 18.0;
constexpr double kLineTime_s = 5e-4;

/// The last is as the wall of a class that is stuff.
const std::vector<WorldBox> kBoxes = {
    {.instance_id = 11,
     .semantic_class = core::SemanticClass::Truck,
     .low = {100, -5, 40},
     .high = {110, 5, 60}},
    {.instance_id = 12, .low = {180, -60, 0}, .high = {200, -10, 70}},
    {.instance_id = 13,
     .semantic_class = core::SemanticClass::Building,
     .low = {-80, -30, 0},
     .high = {-60, 30, 65}},
    {.instance_id = 14,
     .semantic_class = core::SemanticClass::River,
     .low = {60, 20, 45},
     .high = {62, 30, 55}},
};
const WorldThing kThing{
    .instance_id = 70, .place = {50.0, -14.0, 44.0}, .heading_rad = 0.3, .scale = 3.0};

capture::CameraCalibration camera_of(const std::string& name, const std::string& model, int width,
                                     int height, std::vector<double> parameters) {
  return {.rig = "mcs4",
          .name = name,
          .intrinsics = {.model = model,
                         .width_px = width,
                         .height_px = height,
                         .parameters = std::move(parameters)},
          .rig_from_camera = {Eigen::Quaterniond(geo::rig_from_rdf()), Vector3d::Zero()},
          .body_from_rig = {}};
}

/// Two frames of a body that flies and turns; of the cameras two are a pair, one a pair with a rolling one.
render::SequencePlan plan_of_all() {
  render::SequencePlan plan = level_plan(2);
  for (std::size_t i = 0; i < plan.states.size(); ++i) {
    geo::BodyState& state = plan.states[i];
    state.world_from_body = {
        Eigen::Quaterniond(Eigen::AngleAxisd(0.1 + 0.05 * double(i), Vector3d::UnitZ()) *
                           Eigen::AngleAxisd(0.08, Vector3d::UnitY())),
        Vector3d(3.0 * double(i), 0.5, 50.0)};
    state.velocity_world_mps = {30.0, 4.0, -3.0};
    state.acceleration_world_mps2 = {0.0, 5.0, 1.0};
    state.angular_velocity_body_radps = {0.3, -0.2, 0.5};
  }
  const std::vector<double> pinhole = {100.0, 100.0, 50.0, 40.0};
  plan.cameras = {
      camera_of("left", "pinhole", kWidth, kHeight, pinhole),
      camera_of("right", "pinhole", kWidth, kHeight, pinhole),
      camera_of("rolling", "pinhole", kWidth, kHeight, pinhole),
      camera_of("beside", "pinhole", kWidth, kHeight, pinhole),
      camera_of("fisheye", "opencv_fisheye", kWideSize, kWideSize,
                {kFisheyeFocal_px, kFisheyeFocal_px, 60.0, 60.0, 0, 0, 0, 0}),
      camera_of("map", "orthographic", kWidth, kHeight, {2.0, 2.0, 50.0, 40.0}),
  };
  plan.cameras[1].rig_from_camera.translation = {0.0, -2.0, 0.0};  // to the right
  plan.cameras[3].rig_from_camera.translation = {0.0, -1.0, 0.0};
  for (const std::size_t rolling : {2U, 3U})
    plan.cameras[rolling].shutter = {.line_time_s = kLineTime_s};
  return plan;
}

/// What a camera of the plan sees, from the definitions.
struct Truth {
  const capture::SequenceReader& sequence;
  int frame = 0;
  int camera = 0;

  const capture::CameraCalibration& calibration() const {
    return sequence.info().cameras[static_cast<std::size_t>(camera)];
  }
  bool is_rolling() const { return calibration().shutter.line_time_s > 0.0; }

  /// The camera when the line through a row is exposed.
  Eigen::Isometry3d pose(double row) const {
    const capture::FrameRecord& record = sequence.frames()[static_cast<std::size_t>(frame)];
    const double t = is_rolling() ? kLineTime_s * (row - 0.5 * kHeight) : 0.0;
    Eigen::Isometry3d body = Eigen::Isometry3d::Identity();
    const Vector3d turned = t * record.angular_velocity_body_radps;
    body.linear() = record.world_from_body.rotation.toRotationMatrix();
    if (turned.norm() > 0.0)
      body.linear() =
          body.linear() * Eigen::AngleAxisd(turned.norm(), turned.normalized()).toRotationMatrix();
    body.translation() = record.world_from_body.translation + t * record.velocity_world_mps +
                         0.5 * t * t * record.acceleration_world_mps2;
    Eigen::Isometry3d camera_on_body = Eigen::Isometry3d::Identity();
    camera_on_body.linear() = geo::rig_from_rdf();
    camera_on_body.translation() = calibration().rig_from_camera.translation;
    return body * camera_on_body;
  }

  struct Ray {
    Vector3d origin, direction;  ///< of length 1; NaN: none comes in
  };
  Ray ray_camera(double u, double v) const {
    const Vector2d at = camera == 4 ? Vector2d(u - 60.0, v - 60.0) : Vector2d(u - 50.0, v - 40.0);
    if (camera == 5) return {{at.x() / 2.0, at.y() / 2.0, 0.0}, Vector3d::UnitZ()};
    if (camera != 4)
      return {Vector3d::Zero(), Vector3d(at.x() / 100.0, at.y() / 100.0, 1.0).normalized()};
    const double angle = at.norm() / kFisheyeFocal_px;  // r = f t
    if (angle > std::numbers::pi) return {Vector3d::Zero(), Vector3d::Constant(std::nan(""))};
    const Vector2d side = at.normalized() * std::sin(angle);
    return {Vector3d::Zero(), {side.x(), side.y(), std::cos(angle)}};
  }

  struct Hit {
    double range_m = kInfinity;
    std::uint32_t instance_id = 0;
    Vector3d normal_world = Vector3d::UnitZ();
    bool operator==(const Hit&) const = default;
  };
  /// Of boxes larger by so much on all sides.
  static Hit meet(const Ray& ray, double grown = 0.0) {
    Hit hit;
    if (ray.direction.z() < 0.0) hit.range_m = -ray.origin.z() / ray.direction.z();
    for (const WorldBox& box : kBoxes) {
      double in = -kInfinity, out = kInfinity;
      Vector3d normal = Vector3d::Zero();
      for (int axis = 0; axis < 3; ++axis) {
        const double a = (box.low[axis] - grown - ray.origin[axis]) / ray.direction[axis];
        const double b = (box.high[axis] + grown - ray.origin[axis]) / ray.direction[axis];
        if (std::min(a, b) > in) {
          in = std::min(a, b);
          normal = Vector3d::Zero();
          normal[axis] = ray.direction[axis] > 0.0 ? -1.0 : 1.0;
        }
        out = std::min(out, std::max(a, b));
      }
      if (in <= out && in > 0.0 && in < hit.range_m) hit = {in, box.instance_id, normal};
    }
    return hit;
  }
  static Ray moved(const Eigen::Isometry3d& pose, const Ray& ray) {
    return {pose * ray.origin, pose.linear() * ray.direction};
  }
};

core::ExrImage read_exr(const fs::path& file) {
  auto parts = core::decode_exr(core::read_file(file), file.string());
  EXPECT_EQ(parts.size(), 1U);
  return parts.at(0);
}

/// What the facts of the capture's own file hold.
core::ExrImage read_facts(const capture::SequenceReader& sequence, int frame, int camera) {
  return read_exr(sequence.folder() / sequence.frames()[static_cast<std::size_t>(frame)]
                                          .cameras[static_cast<std::size_t>(camera)]
                                          .facts.path);
}

/// Everything is rendered once.
struct NamedLabels : testing::Test {
  static inline std::unique_ptr<ScratchFolder> folder;
  static inline std::optional<world::TileStore> store;
  static inline std::optional<capture::SequenceReader> sequence;

  void SetUp() override {
    if (folder) return;
    folder = std::make_unique<ScratchFolder>();
    store = make_boxes_world(*folder / "world", kBoxes, {kThing});
    sequence = render_plan(*store, plan_of_all(), *folder / "boxes");
  }
  static void TearDownTestSuite() {
    sequence.reset();
    store.reset();
    folder.reset();
  }

  static fs::path labels(const std::string& kind) { return *folder / "boxes/labels" / kind; }
  static std::string image_name(int frame, int camera, const std::string& extension) {
    return fmt::format("mcs4/{}/{:06}{}",
                       sequence->info().cameras[static_cast<std::size_t>(camera)].name, frame,
                       extension);
  }
  static int num_cameras() { return static_cast<int>(sequence->info().cameras.size()); }

  /// Calls visit(frame, camera, truth) for every image.
  template <class Visit>
  static void for_each_image(const Visit& visit) {
    for (int frame = 0; frame < 2; ++frame)
      for (int camera = 0; camera < num_cameras(); ++camera) {
        SCOPED_TRACE(testing::Message() << "frame " << frame << ", camera " << camera);
        visit(frame, camera, Truth{*sequence, frame, camera});
      }
  }
};

/// What the scene says of a pixel; nothing: it is at the rim of something, on the thing, or at the world's end.
std::optional<Truth::Hit> sure_hit(const Truth& truth, const core::ExrImage& facts, int x, int y) {
  if (facts.uint_channels.at("instance_id")(x, y) == kThing.instance_id) return std::nullopt;
  const Truth::Ray ray = Truth::moved(truth.pose(y + 0.5), truth.ray_camera(x + 0.5, y + 0.5));
  const Truth::Hit hit = Truth::meet(ray);
  constexpr double kRim_m = 1e-6;
  for (const double grown : {kRim_m, -kRim_m}) {
    const Truth::Hit other = Truth::meet(ray, grown);
    if (other.instance_id != hit.instance_id || other.normal_world != hit.normal_world)
      return std::nullopt;
  }
  const bool is_far =
      std::isfinite(hit.range_m) &&
      (ray.origin + hit.range_m * ray.direction).head<2>().cwiseAbs().maxCoeff() > 1000.0;
  // At the horizon the world's end and its apron differ from a plane.
  if (is_far || (std::isinf(hit.range_m) && ray.direction.z() < 0.02)) return std::nullopt;
  return hit;
}

// The capture's ranges are floats: half a step is 6e-8 of them. What is derived is rounded once more.
constexpr double kFloat = 6e-8;

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

TEST_F(NamedLabels, DisparityThatCannotBeIsRefused) {
  const auto check = [](const std::string& keys, std::vector<capture::CameraCalibration> cameras) {
    std::vector<render::LabelOptions> options(1);
    core::TomlDocument::parse("kind = \"disparity\"\n" + keys, "test.toml").read(options[0]);
    options[0].validate();
    const std::vector<render::SequenceOutline> outlines = {
        {.name = "s", .cameras = std::move(cameras), .num_frames = 2}};
    render::check_labels(options, outlines, core::Log("label", core::LogLevel::Off));
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
  expect_error(core::ErrorKind::Config, {"two sequences", "pairs"},
               [&] { check("cameras = [\"s/mcs4/left t/mcs4/right\"]\n", all); });
}

// Each kind makes one file an image or pair and its index, the same bytes by one thread, and touches nothing that is as it
// shall be.
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
      if (file != damaged && file != missing) {
        ASSERT_EQ(fs::last_write_time(file), was.second) << file;
      }
    }
  }
}

}  // namespace
}  // namespace terracast::test
