// Labels where things move (tests/labels/moving_scene.h), against slabs, bisection and brute force.

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
#include "labels/shown_objects.h"
#include "tests/labels/moving_scene.h"
#include "tests/support/expect_error.h"

namespace terracast::test {
namespace {

namespace fs = std::filesystem;
using namespace moving_scene;
using capture::ObjectLabels;
using capture::ObjectView;
using Eigen::Vector3d;

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
          const Vector3d ray = pose.rotation * ray_of(x + 0.5, y + 0.5);
          const auto shown = truth.meet(frame, t, pose.place, ray).instance_id;
          if (shown != 0) ++counts[shown].visible;
          // What a ray passes by less than a micrometre may fall to either side.
          const auto with = truth.meet(frame, t, pose.place, ray, kRim_m).instance_id;
          const auto without = truth.meet(frame, t, pose.place, ray, -kRim_m).instance_id;
          if (with != without) {
            if (with != 0) ++counts[with].unsure;
            if (without != 0) ++counts[without].unsure;
          }
          std::map<std::uint32_t, bool> met;
          for (const WorldBox& box : kStill)
            met[box.instance_id] |= std::isfinite(slabs(box.low, box.high, pose.place, ray));
          for (std::size_t i = 0; i < kBodies.size(); ++i)
            met[kBodies[i].instance_id] |=
                std::isfinite(truth.meet_body(frame, static_cast<int>(i), t, pose.place, ray));
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
          const geo::BodyState state = *truth.state(frame, static_cast<int>(i));
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
        const geo::BodyState& state = *truth.state(frame, static_cast<int>(thing));
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
      const Vector3d ray = ray_of(x, y);
      if (!std::isfinite(truth.meet_body(0, kTruckBody, 0.0, pose.place, pose.rotation * ray)))
        continue;
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
  const std::map<std::string, int> bodies = {{"Car", 2}, {"Truck", 3}, {"Misc", 4}};
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
    const Body& body = kBodies[static_cast<std::size_t>(bodies.at(type))];
    const Pose pose(*truth.state(0, bodies.at(type)), 0.0);
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
  std::vector<scene::MovingThing> things = moving_things();
  things[3].shape = things[1].shape;
  things[3].parts = things[0].parts;
  const auto objects =
      labels::moving_objects(things, std::vector<std::uint32_t>{kVan, kCart, kGone});
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

TEST(MovingObjects, BoxesHoldWhatSwingsAsFarAsItDoes) {
  std::vector<scene::MovingThing> things = moving_things();
  scene::TurningPart& part = things[0].parts.at(0);
  part.rate_radps = 0.0;
  part.axis = Vector3d(0.2, 1.0, -0.1).normalized();
  part.per_metre_rad = 3.0;
  for (const double swing_rad : {0.3, 1.2, 2.5}) {
    part.swing_rad = swing_rad;
    const auto objects = labels::moving_objects(things, std::vector<std::uint32_t>{kVan});
    geo::Box3d box;
    const auto add = [&](const scene::MovingShape& shape, const auto& placed) {
      for (const Eigen::Vector3i& vertex : shape.shown->shape.vertices_steps)
        box.extend(placed(vertex.cast<double>() * world::kHeightStep_m));
    };
    add(things[0].shape, [](const Vector3d& at) { return at; });
    for (int k = -2000; k <= 2000; ++k)
      add(part.shape, [&](const Vector3d& at) -> Vector3d {
        return part.origin_m + Eigen::AngleAxisd(swing_rad * k / 2000.0, part.axis) * at;
      });
    EXPECT_LT((objects.at(0).label.box.half_size_m - 0.5 * box.sizes()).cwiseAbs().maxCoeff(), 1e-4)
        << swing_rad;
  }
}

TEST_F(MovingLabels, OtherThingsThanTheCapturesAreRefused) {
  std::vector<scene::MovingThing> others = things;
  others[1].name = "dog";
  expect_error(core::ErrorKind::Input, {"boxes", "render it again"},
               [&] { make_labels(*sequence, *store, "objects", 0, others); });
}

}  // namespace
}  // namespace terracast::test
