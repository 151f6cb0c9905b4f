// Labels where things move, against slabs, bisection and brute force: a thing with a bar that turns on it passes behind
// a wall, another before a tower, one leaves the image, one is gone in the next frame. A camera that moves sees them
// with all lines at once, and another with one after the other.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <numbers>
#include <optional>
#include <sstream>

#include "capture/object_labels.h"
#include "core/atomic_file.h"
#include "core/image_io.h"
#include "core/instance_id.h"
#include "core/json.h"
#include "core/log.h"
#include "core/toml_reader.h"
#include "export/exporter.h"
#include "geo/frames.h"
#include "render/labels/shown_objects.h"
#include "tests/labels/boxes_world.h"
#include "tests/labels/pose.h"
#include "tests/support/expect_error.h"
#include "tests/support/test_data.h"

namespace terracast::test {
namespace {

namespace fs = std::filesystem;
using capture::ObjectLabels;
using capture::ObjectView;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kWidth = 200, kHeight = 160;
constexpr double kLineTime_s = 2e-4;

const std::vector<WorldBox> kStill = {
    {.instance_id = 11,
     .semantic_class = core::SemanticClass::Wall,
     .low = {100, -5, 40},
     .high = {110, 5, 60}},
    {.instance_id = 12, .low = {180, -60, 30}, .high = {200, -10, 70}},
};
constexpr std::uint32_t kVan = core::kFirstMovingId, kCart = kVan + 1, kTruck = kVan + 2,
                        kGone = kVan + 3;

struct Body {
  std::uint32_t instance_id;
  Vector3d low, high;
};
/// In the order of the sequence: the van has a bar.
const std::vector<Body> kBodies = {
    {kVan, {-6.0, -3.0, 0.0}, {8.0, 3.0, 5.0}},   {kVan, {-5.0, -0.5, -0.25}, {5.0, 0.5, 0.25}},
    {kCart, {-2.0, -1.0, -1.0}, {2.0, 1.0, 1.5}}, {kTruck, {-4.0, -3.0, -2.0}, {4.0, 3.0, 2.0}},
    {kGone, {-2.0, -2.0, -2.0}, {2.0, 2.0, 2.0}},
};
const Vector3d kBarOrigin(1.0, 0.5, 6.0);

geo::BodyState state_of(int frame, const Vector3d& place, double turn_rad, const Vector3d& velocity,
                        const Vector3d& turning) {
  geo::BodyState state;
  state.time_s = 0.1 * frame;
  state.world_from_body = {
      Eigen::Quaterniond(Eigen::AngleAxisd(turn_rad, Vector3d(0.1, -0.2, 1.0).normalized())),
      place};
  state.velocity_world_mps = velocity;
  state.acceleration_world_mps2 = {4.0, -6.0, 2.0};
  state.angular_velocity_body_radps = turning;
  return state;
}

std::vector<render::MovingThing> moving_things() {
  const auto thing = [](const char* name, std::size_t body, core::SemanticClass semantic_class) {
    return render::MovingThing{
        .name = name,
        .shape = moving_box(kBodies[body].low, kBodies[body].high, semantic_class),
        .semantic_id = static_cast<std::uint32_t>(semantic_class),
        .parts = {},
        .states = {},
        .gone_m = {0.0, 0.0}};
  };
  std::vector<render::MovingThing> things = {
      thing("van", 0, core::SemanticClass::Van), thing("cart", 2, core::SemanticClass::Car),
      thing("truck", 3, core::SemanticClass::Truck), thing("gone", 4, core::SemanticClass::Drone)};
  things[0].parts = {
      {.name = "bar",
       .shape = moving_box(kBodies[1].low, kBodies[1].high, core::SemanticClass::Van),
       .origin_m = kBarOrigin,
       .axis = Vector3d::UnitZ(),
       .rate_radps = 20.0}};
  for (int frame = 0; frame < 2; ++frame) {
    things[0].states.push_back(state_of(frame, Vector3d(150.0, 8.0 - 3.0 * frame, 46.0),
                                        0.5 + 0.2 * frame, {5.0, -40.0, 3.0}, {0.2, 0.1, 1.5}));
    things[1].states.push_back(state_of(frame, Vector3d(60.0, -9.0 - 2.0 * frame, 51.0),
                                        1.0 + 0.3 * frame, {-10.0, -20.0, 1.0}, {0.0, 0.5, 2.0}));
    things[2].states.push_back(state_of(frame, Vector3d(80.0, -41.0 + 2.0 * frame, 55.0),
                                        -0.4 + 0.1 * frame, {3.0, 15.0, 0.0}, {0.3, 0.0, -1.0}));
  }
  things[3].states = {state_of(0, {70.0, 20.0, 52.0}, 0.3, {5.0, 5.0, 0.0}, {0.0, 0.0, 0.5}),
                      std::nullopt};
  return things;
}

/// Two frames by two cameras of one rig, the second of which reads out line by line.
render::SequencePlan plan_of(const std::vector<render::MovingThing>& things) {
  render::SequencePlan plan = level_plan(2);
  for (std::size_t i = 0; i < 2; ++i) {
    geo::BodyState& state = plan.states[i];
    state.world_from_body.translation = Vector3d(0.5 * double(i), 0.3, 50.0);
    state.world_from_body.rotation = Eigen::AngleAxisd(0.02 * double(i), Vector3d::UnitZ());
    state.velocity_world_mps = {12.0, 3.0, -2.0};
    state.acceleration_world_mps2 = {0.0, 5.0, 1.0};
    state.angular_velocity_body_radps = {0.1, -0.2, 0.4};
  }
  plan.cameras.push_back(plan.cameras[0]);
  plan.cameras[1].name = "cam1";
  plan.cameras[1].shutter = {.line_time_s = kLineTime_s};
  plan.moving = things;
  return plan;
}

/// What a sequence shows, known by closed forms.
struct Truth {
  const capture::SequenceReader& sequence;

  static double time_of(int camera, double y) {
    return camera == 0 ? 0.0 : kLineTime_s * (y - 0.5 * kHeight);
  }
  Pose camera_pose(int frame, double t) const {
    const capture::FrameRecord& record = sequence.frames()[static_cast<std::size_t>(frame)];
    Pose pose({.time_s = 0.0,
               .world_from_body = record.world_from_body,
               .velocity_world_mps = record.velocity_world_mps,
               .acceleration_world_mps2 = record.acceleration_world_mps2,
               .angular_velocity_body_radps = record.angular_velocity_body_radps},
              t);
    pose.rotation = pose.rotation * geo::rig_from_rdf();
    return pose;
  }
  const std::optional<geo::BodyState>& body(int frame, std::size_t i) const {
    return sequence.frames()[static_cast<std::size_t>(frame)].moving[i];
  }
  static Vector3d ray_of(double x, double y) {
    return {(x - 100.0) / 200.0, (y - 80.0) / 200.0, 1.0};
  }
  static double slabs(const Vector3d& low, const Vector3d& high, const Vector3d& origin,
                      const Vector3d& direction) {
    double in = 0.0, out = std::numeric_limits<double>::infinity();
    for (int axis = 0; axis < 3; ++axis) {
      const double a = (low[axis] - origin[axis]) / direction[axis];
      const double b = (high[axis] - origin[axis]) / direction[axis];
      in = std::max(in, std::min(a, b));
      out = std::min(out, std::max(a, b));
    }
    return in <= out ? in : std::numeric_limits<double>::infinity();
  }

  struct Hit {
    double t = std::numeric_limits<double>::infinity();
    std::uint32_t instance_id = 0;
    int body = -1;
  };
  /// t of a body alone.
  double meet_body(int frame, std::size_t i, double time, const Vector3d& origin,
                   const Vector3d& direction, double grown = 0.0) const {
    if (!body(frame, i)) return std::numeric_limits<double>::infinity();
    const Pose pose(*body(frame, i), time);
    const Vector3d more = Vector3d::Constant(grown);
    return slabs(kBodies[i].low - more, kBodies[i].high + more, pose.own(origin),
                 pose.rotation.transpose() * direction);
  }
  Hit meet(int frame, double time, const Vector3d& origin, const Vector3d& direction,
           double grown = 0.0) const {
    Hit hit;
    if (direction.z() < 0.0) hit.t = -origin.z() / direction.z();
    const Vector3d more = Vector3d::Constant(grown);
    for (const WorldBox& box : kStill) {
      const double t = slabs(box.low - more, box.high + more, origin, direction);
      if (t < hit.t) hit = {t, box.instance_id, -1};
    }
    for (std::size_t i = 0; i < kBodies.size(); ++i) {
      const double t = meet_body(frame, i, time, origin, direction, grown);
      if (t < hit.t) hit = {t, kBodies[i].instance_id, static_cast<int>(i)};
    }
    return hit;
  }

  /// Where and when a point is seen by a camera, by halving the time.
  template <class PointAt>
  std::pair<Vector2d, double> seen(int frame, int camera, const PointAt& point_at) const {
    const auto pixel_at = [&](double t) -> Vector2d {
      const Vector3d at = camera_pose(frame, t).own(point_at(t));
      return {100.0 + 200.0 * at.x() / at.z(), 80.0 + 200.0 * at.y() / at.z()};
    };
    if (camera == 0) return {pixel_at(0.0), 0.0};
    double low = -0.2, high = 0.2;  // lines that the image does not have follow on
    for (int i = 0; i < 60; ++i) {
      const double middle = 0.5 * (low + high);
      (time_of(camera, pixel_at(middle).y()) > middle ? low : high) = middle;
    }
    return {pixel_at(low), low};
  }
};

struct MovingLabels : testing::Test {
  static inline std::unique_ptr<ScratchFolder> folder;
  static inline std::optional<world::TileStore> store;
  static inline std::optional<capture::SequenceReader> sequence;
  static inline std::vector<render::MovingThing> things;

  void SetUp() override {
    if (folder) return;
    folder = std::make_unique<ScratchFolder>();
    store = make_boxes_world(*folder / "world", kStill);
    things = moving_things();
    sequence = render_plan(*store, plan_of(things), *folder / "boxes");
  }
  static void TearDownTestSuite() {
    sequence.reset();
    store.reset();
    folder.reset();
  }
};

TEST_F(MovingLabels, PixelsBoxesAndMotionsFollowFromTheScene) {
  make_labels(*sequence, *store, "objects", 0, things);
  const ObjectLabels labels = ObjectLabels::open(*sequence);
  ASSERT_EQ(labels.objects().size(), 6U);
  const capture::LabelledObject& van = labels.objects()[labels.index_of(kVan)];
  EXPECT_EQ(van.moving, "van");
  EXPECT_EQ(van.prototype, "box");
  EXPECT_EQ(van.semantic_class, core::SemanticClass::Van);
  EXPECT_EQ(labels.objects()[labels.index_of(11)].moving, "");
  // The bar sweeps a disc of its half diagonal about (1, 0.5), up to z = 6.25.
  const double radius = std::hypot(5.0, 0.5);
  const Vector3d low(-6.0, std::min(-3.0, 0.5 - radius), 0.0),
      high(8.0, std::max(3.0, 0.5 + radius), 6.25);
  EXPECT_LE((van.box.half_size_m - 0.5 * (high - low)).norm(), 1e-12);

  const Truth truth{*sequence};
  std::map<std::uint32_t, int> num_hidden;
  for (int frame = 0; frame < 2; ++frame)
    for (int camera = 0; camera < 2; ++camera) {
      SCOPED_TRACE(testing::Message() << "frame " << frame << " camera " << camera);
      struct Counts {
        std::int64_t own = 0, visible = 0, unsure = 0;
      };
      std::map<std::uint32_t, Counts> counts;
      for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x) {
          const double t = Truth::time_of(camera, y + 0.5);
          const Pose pose = truth.camera_pose(frame, t);
          const Vector3d ray = pose.rotation * Truth::ray_of(x + 0.5, y + 0.5);
          const auto shown = truth.meet(frame, t, pose.place, ray).instance_id;
          if (shown != 0) ++counts[shown].visible;
          // What a ray passes by less than a micrometre may fall to either side.
          const auto with = truth.meet(frame, t, pose.place, ray, 1e-6).instance_id;
          const auto without = truth.meet(frame, t, pose.place, ray, -1e-6).instance_id;
          if (with != without) {
            if (with != 0) ++counts[with].unsure;
            if (without != 0) ++counts[without].unsure;
          }
          std::map<std::uint32_t, bool> met;
          for (const WorldBox& box : kStill)
            met[box.instance_id] |= std::isfinite(Truth::slabs(box.low, box.high, pose.place, ray));
          for (std::size_t i = 0; i < kBodies.size(); ++i)
            met[kBodies[i].instance_id] |=
                std::isfinite(truth.meet_body(frame, i, t, pose.place, ray));
          for (const auto& [id, is_met] : met) counts[id].own += is_met ? 1 : 0;
        }
      int num_views = 0;
      for (const ObjectView& view : labels.views(frame, camera)) {
        ++num_views;
        const Counts& count = counts.at(view.instance_id);
        EXPECT_NEAR(double(view.num_visible), double(count.visible), double(count.unsure));
        EXPECT_NEAR(double(view.num_own), double(count.own), double(count.unsure));
        EXPECT_LE(count.unsure, 3);
        if (view.num_own > view.num_visible) ++num_hidden[view.instance_id];
        EXPECT_EQ(view.motion.has_value(), core::is_moving_id(view.instance_id));
        if (!view.motion) continue;

        // The box around its edges, each point where its line sees it.
        Eigen::AlignedBox2d around;
        for (std::size_t i = 0; i < kBodies.size(); ++i) {
          if (kBodies[i].instance_id != view.instance_id) continue;
          const geo::BodyState state = *truth.body(frame, i);
          for (int axis = 0; axis < 3; ++axis)
            for (int corner = 0; corner < 4; ++corner)
              for (int k = 0; k <= 100; ++k) {
                Vector3d share;
                share[axis] = k / 100.0;
                share[(axis + 1) % 3] = corner % 2;
                share[(axis + 2) % 3] = corner / 2;
                const Vector3d point =
                    kBodies[i].low + share.cwiseProduct(kBodies[i].high - kBodies[i].low);
                around.extend(
                    truth.seen(frame, camera, [&](double t) { return Pose(state, t).world(point); })
                        .first);
              }
        }
        constexpr double kPromised_px = 0.02 + 0.01;  // and what a hundredth of an edge may miss
        EXPECT_NEAR(view.whole_px.left, std::clamp(around.min().x(), 0.0, 200.0), kPromised_px);
        EXPECT_NEAR(view.whole_px.right, std::clamp(around.max().x(), 0.0, 200.0), kPromised_px);
        EXPECT_NEAR(view.whole_px.top, std::clamp(around.min().y(), 0.0, 160.0), kPromised_px);
        EXPECT_NEAR(view.whole_px.bottom, std::clamp(around.max().y(), 0.0, 160.0), kPromised_px);
        EXPECT_EQ(view.truncation > 0.0, around.max().x() > 200.0);

        // In the world and in the camera at the frame's time.
        const std::size_t thing = view.instance_id == kVan ? 0 : view.instance_id - kVan + 1;
        const geo::BodyState& state = *truth.body(frame, thing);
        const Pose pose(state, 0.0);
        const Vector3d center = view.instance_id == kVan
                                    ? Vector3d(0.5 * (low + high))
                                    : Vector3d(0.5 * (kBodies[thing].low + kBodies[thing].high));
        EXPECT_LE((view.motion->world_from_box.translation - pose.world(center)).norm(), 1e-9);
        EXPECT_LE((view.motion->world_from_box.rotation.toRotationMatrix() - pose.rotation).norm(),
                  1e-9);
        EXPECT_LE((view.camera_from_box.translation -
                   truth.camera_pose(frame, 0.0).own(pose.world(center)))
                      .norm(),
                  1e-9);
        EXPECT_EQ(view.motion->angular_velocity_box_radps, state.angular_velocity_body_radps);
        constexpr double kShort_s = 1e-5;  // of which the square moves nothing by 1e-4 m/s
        const Vector3d rate =
            (Pose(state, kShort_s).world(center) - Pose(state, -kShort_s).world(center)) /
            (2.0 * kShort_s);
        EXPECT_LE((view.motion->velocity_world_mps - rate).norm(), 1e-4);
      }
      EXPECT_EQ(num_views, frame == 0 ? 6 : 5);  // one of them is gone
    }
  EXPECT_GE(num_hidden[kVan], 2) << "behind the wall";
  EXPECT_GE(num_hidden[12], 2) << "behind the cart";
}

TEST_F(MovingLabels, TruncationIsTheShareOfSolidAngleOutside) {
  make_labels(*sequence, *store, "objects", 0, things);
  const Truth truth{*sequence};
  const Pose pose = truth.camera_pose(0, 0.0);
  double all = 0.0, outside = 0.0;
  constexpr int kSteps = 1000;
  for (int j = 0; j < kSteps; ++j)
    for (int i = 0; i < kSteps; ++i) {
      const double x = 150.0 + 100.0 * (i + 0.5) / kSteps, y = 40.0 + 60.0 * (j + 0.5) / kSteps;
      const Vector3d ray = Truth::ray_of(x, y);
      if (!std::isfinite(truth.meet_body(0, 3, 0.0, pose.place, pose.rotation * ray))) continue;
      const double weight = std::pow(ray.norm(), -3.0);
      all += weight;
      outside += x > 200.0 ? weight : 0.0;
    }
  for (const ObjectView& view : ObjectLabels::open(*sequence).views(0, 0))
    if (view.instance_id == kTruck) {
      EXPECT_NEAR(view.truncation, outside / all, 1.0 / 128.0);
      EXPECT_GT(view.truncation, 0.1);
      return;
    }
  ADD_FAILURE() << "the truck is not seen";
}

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
        num_in += sight > 0 ? 1 : 0;
        num_seen += sight == 2 ? 1 : 0;
        const double t = Truth::time_of(one.camera, y + 0.5);
        const Pose pose = truth.camera_pose(0, t);
        const Vector3d ray = pose.rotation * Truth::ray_of(x + 0.5, y + 0.5);
        const Truth::Hit hit = truth.meet(0, t, pose.place, ray);
        if (truth.meet(0, t, pose.place, ray, 1e-6).instance_id != hit.instance_id ||
            truth.meet(0, t, pose.place, ray, -1e-6).instance_id != hit.instance_id) {
          ++num_unsure;
          continue;
        }
        const Vector3d point = pose.place + hit.t * ray;
        if (!point.allFinite() || point.head<2>().norm() > 900.0) continue;  // sky, the world's end
        const bool is_moving = hit.body >= 0;
        if (is_moving && !truth.body(one.other_frame, static_cast<std::size_t>(hit.body))) {
          ++num_gone;
          EXPECT_EQ(sight, 0U);
          EXPECT_TRUE(std::isnan(pair.float_channels.at("flow.x")(x, y)));
          continue;
        }
        const auto point_at = [&](double time) -> Vector3d {
          if (!is_moving) return point;
          const auto i = static_cast<std::size_t>(hit.body);
          return Pose(*truth.body(one.other_frame, i), time)
              .world(Pose(*truth.body(0, i), t).own(point));
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
        ASSERT_EQ(sight > 0, is_in) << x << " " << y;
        if (!is_in) continue;
        // Flows are floats of up to 200 px.
        ASSERT_NEAR(double{pair.float_channels.at("flow.x")(x, y)}, pixel.x() - (x + 0.5), 3e-5);
        ASSERT_NEAR(double{pair.float_channels.at("flow.y")(x, y)}, pixel.y() - (y + 0.5), 3e-5);
        const Pose there = truth.camera_pose(one.other_frame, time);
        const Vector3d way = point_at(time) - there.place;
        const auto first = [&](double grown) {
          return truth.meet(one.other_frame, time, there.place, way, grown);
        };
        const auto is_point = [&](const Truth::Hit& met) {
          return met.body == hit.body && met.instance_id == hit.instance_id &&
                 std::abs(met.t - 1.0) < 1e-6;
        };
        if (is_point(first(1e-6)) != is_point(first(-1e-6))) {
          ++num_unsure;
          continue;
        }
        const Truth::Hit met = first(0.0);
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

TEST_F(MovingLabels, CloudsAreOfWhatStands) {
  make_labels_with(*sequence, *store, "kind = \"cloud\"\nvoxel_m = 1.0\n", things);
  std::int64_t num_moving = 0;
  for (int frame = 0; frame < 2; ++frame)
    for (int camera = 0; camera < 2; ++camera) {
      const auto facts = sequence->read_camera(frame, camera, capture::SequenceReader::kFacts);
      for (const std::uint32_t id : facts.instance_id.data())
        num_moving += core::is_moving_id(id) ? 1 : 0;
    }
  const fs::path file = *folder / "boxes/labels/cloud/cloud.ply";
  EXPECT_EQ(core::Json::read(*folder / "boxes/labels/cloud/cloud.json")
                .at("moving_pixels_left_out")
                .integer(),
            num_moving);
  EXPECT_GT(num_moving, 1000);
  const std::string text = core::read_text_file(file);
  constexpr std::size_t kBytes = 48, kInstanceAt = 40;
  std::size_t num_points = 0;
  for (std::size_t at = text.find("end_header\n") + 11; at < text.size(); at += kBytes) {
    std::uint32_t id = 0;
    std::memcpy(&id, text.data() + at + kInstanceAt, sizeof id);
    EXPECT_FALSE(core::is_moving_id(id));
    ++num_points;
  }
  EXPECT_GT(num_points, 1000U);
}

// The box of what leans is the upright one, of its heading, around its own: here around its corners.
TEST_F(MovingLabels, KittiRowsOfWhatLeansHoldIt) {
  make_labels(*sequence, *store, "objects", 0, things);
  exporters::ExportOptions options;
  core::TomlDocument::parse("format = \"kitti_object\"\nrig = \"mcs4\"\ncamera = \"cam0\"\n",
                            "test.toml")
      .read(options);
  const core::Log log("export", core::LogLevel::Off);
  exporters::run_export_stage({capture::SequenceReader::open(*folder / "boxes")}, {options},
                              *folder / "out", {.log = log});
  std::istringstream rows(
      core::read_text_file(*folder / "out/kitti_object/training/label_2/000000.txt"));
  const Truth truth{*sequence};
  const Pose camera = truth.camera_pose(0, 0.0);  // level: it looks along +x
  const std::map<std::string, std::size_t> bodies = {{"Car", 2}, {"Truck", 3}, {"Misc", 4}};
  int num_rows = 0;
  for (std::string row; std::getline(rows, row);) {
    std::istringstream words(row);
    std::string type;
    words >> type;
    std::array<double, 14> field{};  // from the truncation on
    for (double& value : field) words >> value;
    if (!bodies.contains(type)) continue;
    ++num_rows;
    SCOPED_TRACE(row);
    const Body& body = kBodies[bodies.at(type)];
    const Pose pose(*truth.body(0, bodies.at(type)), 0.0);
    const Vector3d heading = camera.rotation.transpose() * pose.rotation.col(0);
    const double turn = std::atan2(-heading.z(), heading.x());
    const Vector3d along(std::cos(turn), 0.0, -std::sin(turn)),
        left(std::sin(turn), 0.0, std::cos(turn));
    Eigen::AlignedBox3d around;
    for (int corner = 0; corner < 8; ++corner) {
      const Vector3d place =
          camera.own(pose.world({(corner & 1) != 0 ? body.high.x() : body.low.x(),
                                 (corner & 2) != 0 ? body.high.y() : body.low.y(),
                                 (corner & 4) != 0 ? body.high.z() : body.low.z()}));
      around.extend(Vector3d(along.dot(place), left.dot(place), -place.y()));
    }
    const Vector3d foot = around.center().x() * along + around.center().y() * left -
                          around.min().z() * Vector3d::UnitY();
    // Up leans by 2e-5 over these 80 m; four decimals.
    constexpr double kTolerance = 6e-3;
    EXPECT_NEAR(field[7], around.sizes().z(), kTolerance);
    EXPECT_NEAR(field[8], around.sizes().y(), kTolerance);
    EXPECT_NEAR(field[9], around.sizes().x(), kTolerance);
    EXPECT_NEAR(field[10], foot.x(), kTolerance);
    EXPECT_NEAR(field[11], foot.y(), kTolerance);
    EXPECT_NEAR(field[12], foot.z(), kTolerance);
    EXPECT_NEAR(std::remainder(field[13] - turn, 2.0 * std::numbers::pi), 0.0, 1e-4);
  }
  EXPECT_EQ(num_rows, 3);
}

// Of a thousand vehicles few differ.
TEST(MovingObjects, ThingsThatShareAShapeAreLookedAtWithOne) {
  std::vector<render::MovingThing> things = moving_things();
  things[3].shape = things[1].shape;
  things[3].parts = things[0].parts;
  const auto objects =
      render::moving_objects(things, std::vector<std::uint32_t>{kVan, kCart, kGone});
  ASSERT_EQ(objects.size(), 3U);
  EXPECT_EQ(objects[1].parts[0].shape, objects[2].parts[0].shape);
  EXPECT_EQ(objects[0].parts.at(1).shape, objects[2].parts.at(1).shape);
  EXPECT_NE(objects[0].parts[0].shape, objects[1].parts[0].shape);
  // Bodies are the sequence's own: the van, its bar, the cart, the truck, and what is gone, with its bar.
  EXPECT_EQ(objects[1].parts[0].body, 2U);
  EXPECT_EQ(objects[2].parts[0].body, 4U);
  EXPECT_EQ(objects[2].parts[1].body, 5U);
  // Where parts turn on it, its box holds them; the cart's own reaches from -2 to 2 m.
  EXPECT_EQ(objects[1].label.box.half_size_m, Vector3d(2.0, 1.0, 1.25));
  EXPECT_GT(objects[2].label.box.half_size_m.y(), 4.0);
}

TEST_F(MovingLabels, OtherThingsThanTheCapturesAreRefused) {
  std::vector<render::MovingThing> others = things;
  others[1].name = "dog";
  expect_error(core::ErrorKind::Input, {"boxes", "render it again"},
               [&] { make_labels(*sequence, *store, "objects", 0, others); });
}

}  // namespace
}  // namespace terracast::test
