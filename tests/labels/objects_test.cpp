// Labels of objects against closed forms, slabs and brute force.

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>

#include "capture/labels.h"
#include "capture/object_labels.h"
#include "core/atomic_file.h"
#include "core/hash.h"
#include "core/random.h"
#include "labels/object_outline.h"
#include "labels/shown_objects.h"
#include "tests/labels/boxes_world.h"
#include "tests/support/expect_error.h"
#include "tests/support/test_data.h"

namespace terracast::test {
namespace {

namespace fs = std::filesystem;
using capture::ObjectLabels;
using capture::ObjectView;
using core::ErrorKind;
using Eigen::Vector2d;
using Eigen::Vector3d;

/// Up leans by 1/6378000 a metre; the boxes stand within 220 m of the origin.
constexpr double kLean_rad = 4e-5;
constexpr double kStep_m = world::kHeightStep_m;

/// Seen from (0, 0, 50): the front box covers columns 90 to 110 and rows 60 to 100; the one behind it columns 100 to
/// 120 and rows 70 to 90, of which the front one hides half; half of the plate lies beyond column 200.
const std::vector<WorldBox> kBoxes = {
    {.instance_id = 11,
     .semantic_class = core::SemanticClass::Truck,
     .low = {100, -5, 40},
     .high = {110, 5, 60}},
    {.instance_id = 12,
     .semantic_class = core::SemanticClass::Building,
     .low = {200, -20, 40},
     .high = {220, 0, 60}},
    {.instance_id = 13,
     .semantic_class = core::SemanticClass::Wall,
     .low = {100, -60, 45},
     .high = {100.0625, -40, 55}},
};

std::map<std::uint32_t, ObjectView> by_id(const std::vector<ObjectView>& views) {
  std::map<std::uint32_t, ObjectView> all;
  for (const ObjectView& view : views) all[view.instance_id] = view;
  return all;
}

void expect_box(const capture::ImageBox& box, double left, double top, double right, double bottom,
                double tolerance_px) {
  EXPECT_NEAR(box.left, left, tolerance_px);
  EXPECT_NEAR(box.top, top, tolerance_px);
  EXPECT_NEAR(box.right, right, tolerance_px);
  EXPECT_NEAR(box.bottom, bottom, tolerance_px);
}

/// Solid angle of the rectangle from the axis to (a, b) at a distance (van Oosterom's formula for a right angle).
double corner_angle(double a, double b, double distance) {
  return std::atan(a * b / (distance * std::sqrt(a * a + b * b + distance * distance)));
}

struct ObjectLabelling : testing::Test {
  ScratchFolder folder;
};

TEST_F(ObjectLabelling, BoxesOcclusionAndTruncationFollowFromTheScene) {
  const auto store = make_boxes_world(folder / "world", kBoxes);
  const auto sequence = render_plan(store, level_plan(), folder / "boxes");
  make_labels(sequence, store, "objects");
  const ObjectLabels labels = ObjectLabels::open(sequence);
  ASSERT_EQ(labels.objects().size(), 3U);
  const auto views = by_id(labels.views(0, 0));
  ASSERT_EQ(views.size(), 3U);
  // Corners lie on a lattice of 2^-10 m, which is 0.002 px at 100 m.
  constexpr double kLattice_px = 4e-3;

  const ObjectView& front = views.at(11);
  expect_box(front.visible_px, 90, 60, 110, 100, 0.0);
  expect_box(front.whole_px, 90, 60, 110, 100, kLattice_px);
  EXPECT_EQ(front.num_visible, 20 * 40);
  EXPECT_EQ(front.num_own, 20 * 40);
  EXPECT_EQ(front.occlusion(), 0.0);
  EXPECT_EQ(front.truncation, 0.0);
  // The pixel next to the axis looks half a pixel aside both ways.
  EXPECT_NEAR(front.nearest_m, 100.0 * std::sqrt(1.0 + 2.0 * std::pow(0.5 / 200.0, 2)), 1e-3);

  const ObjectView& behind = views.at(12);
  expect_box(behind.visible_px, 110, 70, 120, 90, 0.0);
  expect_box(behind.whole_px, 100, 70, 120, 90, kLattice_px);
  EXPECT_EQ(behind.num_visible, 10 * 20);
  EXPECT_EQ(behind.num_own, 20 * 20);
  EXPECT_EQ(behind.occlusion(), 0.5);
  EXPECT_EQ(behind.truncation, 0.0);

  const ObjectView& plate = views.at(13);
  EXPECT_EQ(plate.visible_px.right, 200.0);
  // Its inner side appears beside its face, at a depth of 100.0625 m.
  expect_box(plate.whole_px, 100.0 + 200.0 * 40.0 / 100.0625, 70, 200, 90, kLattice_px);
  const double face = corner_angle(60, 5, 100) - corner_angle(40, 5, 100);
  const double outside = corner_angle(60, 5, 100) - corner_angle(50, 5, 100);
  EXPECT_NEAR(plate.truncation, outside / face, 1.0 / 128.0);
  EXPECT_EQ(plate.occlusion(), 0.0);
}

// Parallel rays, at two pixels a metre, show all three as large from any distance: the front box in columns 90 to 110
// and rows 60 to 100, the one behind it in columns 100 to 140. A line scanner sees them so along its way alone.
TEST_F(ObjectLabelling, BoxesOcclusionAndTruncationFollowWhereRaysStartAtManyPlaces) {
  const auto store = make_boxes_world(folder / "world", kBoxes);
  constexpr double kLattice_px = 4e-3;
  render::SequencePlan plan = level_plan();
  plan.cameras[0].intrinsics.model = "orthographic";
  plan.cameras[0].intrinsics.parameters = {2.0, 2.0, 100.0, 80.0};
  const auto parallel = render_plan(store, plan, folder / "parallel");
  make_labels(parallel, store, "objects");
  auto views = by_id(ObjectLabels::open(parallel).views(0, 0));
  ASSERT_EQ(views.size(), 3U);
  expect_box(views.at(11).whole_px, 90, 60, 110, 100, kLattice_px);
  EXPECT_EQ(views.at(11).num_visible, 20 * 40);
  EXPECT_NEAR(views.at(11).nearest_m, 100.0, 1e-3);
  EXPECT_EQ(views.at(11).truncation, 0.0);
  expect_box(views.at(12).whole_px, 100, 60, 140, 100, kLattice_px);
  expect_box(views.at(12).visible_px, 110, 60, 140, 100, 0.0);
  EXPECT_EQ(views.at(12).num_own, 40 * 40);
  EXPECT_EQ(views.at(12).occlusion(), 0.25);
  EXPECT_EQ(views.at(12).truncation, 0.0);
  expect_box(views.at(13).whole_px, 180, 70, 200, 90, kLattice_px);
  EXPECT_NEAR(views.at(13).truncation, 0.5, 1.0 / 128.0);

  plan.cameras[0].intrinsics.model = "pushbroom";
  plan.cameras[0].intrinsics.parameters = {200.0, 2.0, 100.0, 80.0};
  const auto scanned = render_plan(store, plan, folder / "scanned");
  make_labels(scanned, store, "objects");
  views = by_id(ObjectLabels::open(scanned).views(0, 0));
  ASSERT_EQ(views.size(), 3U);
  expect_box(views.at(11).whole_px, 90, 60, 110, 100, kLattice_px);
  EXPECT_EQ(views.at(11).num_own, 20 * 40);
  // At 200 m its 20 m are 20 px across the way, and 40 rows of it.
  expect_box(views.at(12).whole_px, 100, 60, 120, 100, kLattice_px);
  EXPECT_EQ(views.at(12).num_own, 20 * 40);
  EXPECT_EQ(views.at(12).occlusion(), 0.5);
  expect_box(views.at(13).whole_px, 100.0 + 200.0 * 40.0 / 100.0625, 70, 200, 90, kLattice_px);
  EXPECT_NEAR(views.at(13).truncation, 0.5, 1.0 / 128.0);
}

TEST_F(ObjectLabelling, ObjectsSayWhatTheyAreAndWhereTheyCameFrom) {
  const auto store = make_boxes_world(folder / "world", kBoxes);
  const auto sequence = render_plan(store, level_plan(), folder / "boxes");
  make_labels(sequence, store, "objects");
  const ObjectLabels labels = ObjectLabels::open(sequence);
  for (std::size_t i = 0; i < kBoxes.size(); ++i) {
    const capture::LabelledObject& object = labels.objects()[i];
    EXPECT_EQ(object.instance_id, kBoxes[i].instance_id);
    EXPECT_EQ(labels.index_of(object.instance_id), i);
    EXPECT_EQ(object.semantic_class, kBoxes[i].semantic_class);
    EXPECT_EQ(object.layer, "town");
    EXPECT_EQ(object.feature, 1000U + kBoxes[i].instance_id);
    EXPECT_EQ(object.prototype, "");
    // The longer side of its ground lies along x of its box; up is that of WGS84 there.
    const Vector3d size = kBoxes[i].high - kBoxes[i].low;
    const bool is_along_x = size.x() >= size.y();
    const double reach_m = size.norm();
    EXPECT_NEAR(object.box.half_size_m.x(), 0.5 * std::max(size.x(), size.y()),
                kStep_m + kLean_rad * reach_m);
    EXPECT_NEAR(object.box.half_size_m.y(), 0.5 * std::min(size.x(), size.y()),
                kStep_m + kLean_rad * reach_m);
    EXPECT_NEAR(object.box.half_size_m.z(), 0.5 * size.z(), kStep_m + kLean_rad * reach_m);
    const Vector3d middle = 0.5 * (kBoxes[i].low + kBoxes[i].high);
    EXPECT_LE((object.box.world_from_box.translation - middle).norm(),
              kStep_m + kLean_rad * reach_m);
    if (size.x() != size.y()) {
      const Vector3d along = object.box.world_from_box.rotation * Vector3d::UnitX();
      EXPECT_NEAR(std::abs(is_along_x ? along.x() : along.y()), 1.0, 1e-6);
    }
    EXPECT_NEAR((object.box.world_from_box.rotation * Vector3d::UnitZ()).z(), 1.0, 1e-8);
  }
  expect_error(ErrorKind::Input, {"no object 99"}, [&] { labels.index_of(99); });
}

TEST_F(ObjectLabelling, InstancesHaveTheirPrototypesAxes) {
  // Heads north-west, one and a half times as large.
  const WorldThing thing{.instance_id = 70,
                         .place = {120.0, 8.0, 48.0},
                         .heading_rad = 0.75 * std::numbers::pi,
                         .scale = 1.5};
  const auto store = make_boxes_world(folder / "world", {}, {thing});
  const auto sequence = render_plan(store, level_plan(), folder / "boxes");
  make_labels(sequence, store, "objects");
  const ObjectLabels labels = ObjectLabels::open(sequence);
  ASSERT_EQ(labels.objects().size(), 1U);
  const capture::LabelledObject& object = labels.objects()[0];
  EXPECT_EQ(object.prototype, "cart");
  EXPECT_EQ(object.semantic_class, core::SemanticClass::Car);
  EXPECT_LE((object.box.half_size_m - 0.75 * (kPrototypeHigh - kPrototypeLow)).norm(), 1e-12);
  // East and north there are turned by less than 1e-4 about the axes of the world.
  const Vector3d along = object.box.world_from_box.rotation * Vector3d::UnitX();
  EXPECT_LE((along - Vector3d(-std::sqrt(0.5), std::sqrt(0.5), 0.0)).norm(), 1e-4);
  const Vector3d middle = thing.place + 1.5 * (1.0 * along + Vector3d(0.0, 0.0, 0.75));
  EXPECT_LE((object.box.world_from_box.translation - middle).norm(), 1e-3);
  // Camera: x right is -y of the world, y down is -z, z forward is x.
  const ObjectView view = labels.views(0, 0).at(0);
  EXPECT_LE(
      (view.camera_from_box.translation - Vector3d(-middle.y(), 50.0 - middle.z(), middle.x()))
          .norm(),
      1e-3);
  EXPECT_LE((view.camera_from_box.rotation * Vector3d::UnitX() -
             Vector3d(-along.y(), -along.z(), along.x()))
                .norm(),
            1e-9);
}

TEST_F(ObjectLabelling, PixelsAreThoseOfBruteForce) {
  const auto store = make_boxes_world(folder / "world", kBoxes);
  render::SequencePlan plan = level_plan(2);
  plan.states[1].world_from_body.translation = {30.0, -12.0, 57.0};
  plan.states[1].world_from_body.rotation =
      Eigen::AngleAxisd(0.2, Vector3d::UnitY()) * Eigen::AngleAxisd(-0.1, Vector3d::UnitX());
  const auto sequence = render_plan(store, plan, folder / "boxes");
  make_labels(sequence, store, "objects");
  const ObjectLabels labels = ObjectLabels::open(sequence);
  int num_seen = 0;
  for (int frame = 0; frame < 2; ++frame) {
    const auto facts = sequence.read_camera(frame, 0, capture::SequenceReader::kFacts);
    const geo::Rigid3d pose = sequence.world_from_camera(frame, 0);
    const auto views = by_id(labels.views(frame, 0));
    for (const WorldBox& box : kBoxes) {
      std::int64_t num_own = 0, num_visible = 0;
      Eigen::AlignedBox2d visible;
      for (int y = 0; y < 160; ++y)
        for (int x = 0; x < 200; ++x) {
          const Vector3d ray((x + 0.5 - 100.0) / 200.0, (y + 0.5 - 80.0) / 200.0, 1.0);
          num_own += box.is_met(pose.translation, pose.rotation * ray) ? 1 : 0;
          if (facts.instance_id(x, y) != box.instance_id) continue;
          ++num_visible;
          visible.extend(Vector2d(x, y));
          visible.extend(Vector2d(x + 1, y + 1));
        }
      ASSERT_EQ(views.count(box.instance_id), num_visible > 0 ? 1U : 0U);
      if (num_visible == 0) continue;
      ++num_seen;
      const ObjectView& view = views.at(box.instance_id);
      EXPECT_EQ(view.num_visible, num_visible);
      EXPECT_EQ(view.num_own, num_own);
      expect_box(view.visible_px, visible.min().x(), visible.min().y(), visible.max().x(),
                 visible.max().y(), 0.0);
    }
  }
  EXPECT_GE(num_seen, 5);
}

/// An object of one box, without a world.
struct LoneBox {
  std::unique_ptr<const labels::LoneShape> shape;
  labels::Placement placement;
};
LoneBox lone_box(const WorldBox& box) {
  world::Shape shape;
  for (const Vector3d& corner : box.corners())
    shape.vertices_steps.push_back((corner / kStep_m).array().round().matrix().cast<int>());
  constexpr std::uint32_t kFaces[12][3] = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6},
                                           {0, 1, 4}, {1, 5, 4}, {2, 6, 3}, {3, 6, 7},
                                           {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  for (const auto& face : kFaces)
    shape.triangles.push_back({.corners = {face[0], face[1], face[2]}, .finish = 0});
  shape.finishes.emplace_back();
  LoneBox object{std::make_unique<const labels::LoneShape>(shape, Eigen::Vector3i::Zero()), {}};
  object.placement.parts = {{.shape = object.shape.get()}};
  return object;
}

struct OutlineCase {
  std::string name;
  geo::CameraIntrinsics intrinsics;
  bool is_rolling = false;
};

class Outlines : public testing::TestWithParam<OutlineCase> {};

// The truth: a million points on the twelve edges and the six faces.
TEST_P(Outlines, HoldAllOfTheObjectAndNoMore) {
  const auto model = geo::make_camera(GetParam().intrinsics);
  for (std::uint64_t trial = 0; trial < 12; ++trial) {
    SCOPED_TRACE(trial);
    const auto draw = [&](double low, double high, std::uint64_t index) {
      return core::random_between(low, high, 20261125, trial, index);
    };
    const Vector3d middle(draw(-25.0, 25.0, 0), draw(-15.0, 15.0, 1), draw(12.0, 40.0, 2));
    const Vector3d half(draw(1.0, 8.0, 3), draw(1.0, 8.0, 4), draw(1.0, 8.0, 5));
    const auto on_lattice = [](const Vector3d& place) {
      return Vector3d((place / kStep_m).array().round() * kStep_m);
    };
    const WorldBox box{.low = on_lattice(middle - half), .high = on_lattice(middle + half)};
    const LoneBox object = lone_box(box);
    capture::CameraView view{.model = *model, .world_from_camera = {}};
    if (GetParam().is_rolling) {
      geo::BodyState state;
      state.velocity_world_mps = {6.0, -3.0, 2.0};
      state.angular_velocity_body_radps = {0.2, 0.3, -0.4};
      view.motion = geo::CameraMotion{
          .state = state, .body_from_camera = {}, .shutter = {.line_time_s = 1e-4}};
    }
    const labels::Outline outline = labels::outline_of(object.placement, view);
    ASSERT_TRUE(outline.is_whole);
    Eigen::AlignedBox2d truth;
    constexpr int kSteps = 100;
    for (int axis = 0; axis < 3; ++axis)
      for (int i = 0; i <= kSteps; ++i)
        for (int j = 0; j <= kSteps; ++j)
          for (const double side : {0.0, 1.0}) {
            Vector3d share;
            share[axis] = side;
            share[(axis + 1) % 3] = i / double(kSteps);
            share[(axis + 2) % 3] = j / double(kSteps);
            const auto pixel =
                capture::project(view, box.low + share.cwiseProduct(box.high - box.low));
            ASSERT_TRUE(pixel);
            truth.extend(*pixel);
          }
    // What it promises, and what the truth may miss between its steps.
    constexpr double kTolerance_px = 0.02 + 0.01;
    expect_box(outline.box_px, truth.min().x(), truth.min().y(), truth.max().x(), truth.max().y(),
               kTolerance_px);
  }
}

INSTANTIATE_TEST_SUITE_P(
    Cameras, Outlines,
    testing::Values(
        OutlineCase{"pinhole", {"pinhole", 400, 300, {300, 300, 200, 150}}},
        OutlineCase{"opencv",
                    {"opencv", 400, 300, {300, 300, 200, 150, -0.05, 0.004, 1e-3, -1e-3}}},
        OutlineCase{"fisheye",
                    {"opencv_fisheye", 400, 300, {180, 180, 200, 150, 0.02, -0.003, 0.0, 0.0}}},
        OutlineCase{"panorama",
                    {"equirectangular", 800, 400, {800 / (2 * M_PI), 400 / M_PI, 400, 200}}},
        OutlineCase{"rolling", {"pinhole", 400, 300, {300, 300, 200, 150}}, true}),
    [](const auto& one) { return one.param.name; });

TEST(OutlineEdges, OfWhatPassesTheCameraReachToTheImagesEdge) {
  const auto model = geo::make_camera({"pinhole", 400, 300, {300, 300, 200, 150}});
  const capture::CameraView view{.model = *model, .world_from_camera = {}};
  // Beside the camera, from behind it to before it.
  const auto object = lone_box({.low = {2, -1, -10}, .high = {4, 1, 10}});
  const labels::Outline outline = labels::outline_of(object.placement, view);
  EXPECT_FALSE(outline.is_whole);
  EXPECT_NEAR(outline.box_px.left, 200.0 + 300.0 * 2.0 / 10.0, 0.1);
  EXPECT_GT(outline.box_px.right, 400.0);
  // Its side at x = 2 is all that is seen of it; the image shows z > 3 m of that.
  const double all = 4.0 * corner_angle(1, 10, 2);
  const double inside = 2.0 * (corner_angle(1, 10, 2) - corner_angle(1, 3, 2));
  EXPECT_NEAR(labels::truncation_of(object.placement, view, outline), 1.0 - inside / all,
              1.0 / 128.0);
}

TEST(OutlineEdges, OfWhatHoldsThePoleOfAPanoramaReachIt) {
  // Above the camera: its edges go round the pole, its face holds it.
  const auto model =
      geo::make_camera({"equirectangular", 80, 40, {80 / (2 * M_PI), 40 / M_PI, 40, 20}});
  const capture::CameraView view{.model = *model, .world_from_camera = {}};
  const auto object = lone_box({.low = {-8, -6, -8}, .high = {8, -5, 8}});
  const labels::Outline outline = labels::outline_of(object.placement, view);
  const labels::PixelRays rays(view);
  const auto own =
      labels::own_pixels(object.placement, rays, outline, [](int, int) { return false; });
  EXPECT_EQ(own.top, 0.5);  // the centre of the first row
  EXPECT_EQ(own.left, 0.5);
  EXPECT_EQ(own.right, 79.5);
}

// All turns by hundredths of a degree.
TEST(SmallestUprightBox, IsThatOfBruteForce) {
  for (std::uint64_t trial = 0; trial < 20; ++trial) {
    std::vector<Vector3d> points;
    for (std::uint64_t i = 0; i < 12; ++i)
      points.emplace_back(3e4 + core::random_between(-9, 9, 5, trial, 3 * i),
                          -2e4 + core::random_between(-4, 4, 5, trial, 3 * i + 1),
                          core::random_between(0, 7, 5, trial, 3 * i + 2));
    const auto box = labels::smallest_upright_box(points, Eigen::Matrix3d::Identity());
    double least = std::numeric_limits<double>::infinity();
    for (int step = 0; step < 9000; ++step) {
      const double turn = step * 1e-4 * std::numbers::pi / 1.8;
      Eigen::AlignedBox2d bounds;
      for (const Vector3d& point : points)
        bounds.extend(Vector2d(std::cos(turn) * point.x() + std::sin(turn) * point.y(),
                               -std::sin(turn) * point.x() + std::cos(turn) * point.y()));
      least = std::min(least, bounds.volume());
    }
    const double area = 4.0 * box.half_size_m.x() * box.half_size_m.y();
    EXPECT_LE(area, least + 1e-6);
    // A hundredth of a degree makes it larger by 0.0002 of its sides' squares.
    EXPECT_GE(area, least - 2e-4 * 20.0 * 20.0);
    EXPECT_GE(box.half_size_m.x(), box.half_size_m.y());
    Vector3d most = Vector3d::Zero();
    for (const Vector3d& point : points)
      most = most.cwiseMax((box.world_from_box.inverse() * point).cwiseAbs());
    EXPECT_LE((most - box.half_size_m).cwiseAbs().maxCoeff(), 1e-9);
  }
}

std::map<std::string, std::string> label_files(const fs::path& sequence) {
  std::map<std::string, std::string> hashes;
  for (const auto& entry : fs::recursive_directory_iterator(sequence / "labels"))
    if (entry.is_regular_file())
      hashes[fs::relative(entry.path(), sequence).string()] =
          core::content_hash_of_file(entry.path());
  return hashes;
}

TEST_F(ObjectLabelling, SameBytesForAnyThreadsAndInterruptions) {
  const auto store = make_boxes_world(folder / "world", kBoxes);
  const auto sequence = render_plan(store, level_plan(3), folder / "boxes");
  make_labels(sequence, store, "objects", 1);
  const auto whole = label_files(folder / "boxes");
  EXPECT_EQ(whole.size(), 4U);
  fs::remove_all(folder / "boxes" / "labels");
  make_labels(sequence, store, "objects", 2);
  EXPECT_EQ(label_files(folder / "boxes"), whole);
  // As a kill leaves it; and one that was cut in two.
  fs::remove(folder / "boxes" / capture::kObjectsFile);
  const fs::path kept = folder / "boxes" / "labels/objects/mcs4/cam0/000000.json";
  const fs::path cut = folder / "boxes" / "labels/objects/mcs4/cam0/000001.json";
  const auto time = fs::last_write_time(kept);
  fs::resize_file(cut, 100);
  fs::remove(folder / "boxes" / "labels/objects/mcs4/cam0/000002.json");
  expect_error(ErrorKind::Input, {"not labelled", "terracast label"},
               [&] { ObjectLabels::open(sequence); });
  make_labels(sequence, store, "objects");
  EXPECT_EQ(label_files(folder / "boxes"), whole);
  EXPECT_EQ(fs::last_write_time(kept), time);
  // What is finished but damaged is made again, and only that.
  fs::resize_file(cut, 100);
  make_labels(sequence, store, "objects");
  EXPECT_EQ(label_files(folder / "boxes"), whole);
  EXPECT_EQ(fs::last_write_time(kept), time);
}

TEST_F(ObjectLabelling, AnotherWorldOrCaptureIsRefused) {
  const auto store = make_boxes_world(folder / "world", kBoxes);
  const auto sequence = render_plan(store, level_plan(), folder / "boxes");
  std::vector<WorldBox> moved = kBoxes;
  moved[0].high.z() += 1.0;
  const auto other = make_boxes_world(folder / "other", moved);
  expect_error(ErrorKind::Input, {"tile", "rendered from", "labels objects"},
               [&] { make_labels(sequence, other, "objects"); });
  make_labels(sequence, store, "objects");
  // Labels beside a capture that they are not of.
  const auto again = render_plan(store, level_plan(2), folder / "longer");
  fs::copy(folder / "boxes" / "labels", folder / "longer" / "labels", fs::copy_options::recursive);
  expect_error(ErrorKind::Input, {"another capture"}, [&] { ObjectLabels::open(again); });
}

TEST_F(ObjectLabelling, ForgedFilesAreRefused) {
  const auto store = make_boxes_world(folder / "world", kBoxes);
  const auto sequence = render_plan(store, level_plan(), folder / "boxes");
  make_labels(sequence, store, "objects");
  const fs::path views = folder / "boxes" / "labels/objects/mcs4/cam0/000000.json";
  const std::string text = core::read_text_file(views);
  const auto expect_refusal = [&](const std::string& from, const std::string& to) {
    SCOPED_TRACE(to);
    std::string forged = text;
    ASSERT_NE(forged.find(from), std::string::npos);
    forged.replace(forged.find(from), from.size(), to);
    core::write_file(views, forged);
    expect_error(ErrorKind::Input, {"000000.json"},
                 [&] { ObjectLabels::open(sequence).views(0, 0); });
  };
  expect_refusal("\"instance_id\":11", "\"instance_id\":-1");
  expect_refusal("\"instance_id\":11", "\"instance_id\":13");
  expect_refusal("\"visible_pixels\":800", "\"visible_pixels\":801");
  expect_refusal("\"visible_pixels\":800", "\"visible_pixels\":799");
  expect_refusal("\"truncation\":0.0", "\"truncation\":1.5");
  expect_refusal("terracast object labels", "terracast object lables");
  core::write_file(views, text);
  EXPECT_EQ(ObjectLabels::open(sequence).views(0, 0).size(), 3U);
}

}  // namespace
}  // namespace terracast::test
