// Pairs of cameras of two vehicles, each a sequence of its own: against slabs and bisection where things move and each
// is in the other's view, and against all triangles of hilly ground.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <map>
#include <optional>

#include "capture/object_labels.h"
#include "core/atomic_file.h"
#include "core/hash.h"
#include "core/image_io.h"
#include "core/json.h"
#include "core/log.h"
#include "core/parallel.h"
#include "core/toml_reader.h"
#include "labels/label.h"
#include "render/checked_plan.h"
#include "tests/labels/moving_bodies.h"
#include "tests/support/brute_terrain.h"
#include "tests/support/expect_error.h"
#include "tests/support/test_data.h"
#include "tests/support/tiny_world.h"

namespace terracast::test {
namespace {

namespace fs = std::filesystem;
using namespace moving_bodies;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Captures = std::vector<capture::SequenceReader>;
using Things = std::map<std::string, std::vector<scene::MovingThing>>;

constexpr double kWorldHalf_m = 1024.0;  // the tiny world's square ends there

/// As a job labels its sequences.
void label_all(const Captures& captures, const world::TileStore& store, const Things& things,
               const std::string& toml, int num_threads = 0) {
  const core::Log log("label", core::LogLevel::Off);
  const core::ThreadLimit limit(num_threads);
  std::vector<labels::LabelOptions> options(1);
  core::TomlDocument::parse(toml, "test.toml").read(options[0]);
  const auto things_of = [&](const capture::SequenceInfo& info) {
    return things.contains(info.name) ? things.at(info.name) : std::vector<scene::MovingThing>();
  };
  for (const capture::SequenceReader& sequence : captures)
    labels::run_label_stage(sequence, store, things_of(sequence.info()), options,
                            {.log = log, .num_threads = num_threads},
                            {.sequences = captures, .things_of = things_of});
}

core::ExrImage read_pair(const fs::path& file) {
  auto parts = core::decode_exr(core::read_file(file), file.string());
  EXPECT_EQ(parts.size(), 1U);
  return parts.at(0);
}

/// Their numbers are each sequence's own.
const std::map<std::string, Body> kBodies = {
    {"cart", {0, {-3.0, -2.0, -2.0}, {3.0, 2.0, 2.0}}},
    {"uav1", {0, {-2.0, -3.0, -1.0}, {2.0, 3.0, 1.5}}},
    {"uav2", {0, {-1.5, -2.0, -1.0}, {1.5, 2.0, 1.0}}},
};
const std::vector<WorldBox> kTowers = {
    {.instance_id = 11, .low = {100, -5, 0}, .high = {110, 5, 60}},
    {.instance_id = 12, .low = {180, -40, 0}, .high = {220, 20, 40}},
};

geo::BodyState state_of(const std::string& name, int frame) {
  if (name == "cart")
    return leaning_state(frame, {60.0, -9.0 + 3.0 * frame, 51.0}, 1.0 + 0.3 * frame,
                         {-10.0, 30.0, 1.0}, {0.0, 0.5, 2.0});
  const Vector3d turning(0.1, -0.2, 0.4);
  if (name == "uav1")
    return leaning_state(frame, {1.5 * frame, 0.2 * frame, 50.0}, 0.02 * frame, {15.0, 2.0, 0.0},
                         turning);
  return leaning_state(frame, {-30.0 + 1.2 * frame, 8.0 - 1.0 * frame, 53.0}, -0.08 + 0.03 * frame,
                       {12.0, -10.0, 1.0}, turning);
}

constexpr int kFrames1 = 3, kFrames2 = 2;

scene::MovingThing thing_of(const std::string& name, int num_frames) {
  scene::MovingThing thing = thing_of_body(name, kBodies.at(name), core::SemanticClass::Drone,
                                           static_cast<std::size_t>(num_frames));
  for (int frame = 0; frame < num_frames; ++frame) thing.states.push_back(state_of(name, frame));
  return thing;
}

/// One follows the other, which it has in view; the other looks ahead, past a cart.
render::SequencePlan plan_of(const std::string& name, const Things& things) {
  const bool is_first = name == "uav1";
  render::SequencePlan plan = level_plan(is_first ? kFrames1 : kFrames2);
  plan.name = name;
  plan.moving = things.at(name);
  for (std::size_t i = 0; i < plan.states.size(); ++i)
    plan.states[i] = state_of(name, static_cast<int>(i));
  if (!is_first) plan.cameras[0].shutter = {.line_time_s = kLineTime_s};
  if (is_first) {
    plan.cameras.push_back(plan.cameras[0]);
    plan.cameras[1].name = "back";
    plan.cameras[1].rig_from_camera.rotation =
        Eigen::Quaterniond(Eigen::AngleAxisd(std::acos(-1.0), Vector3d::UnitZ())) *
        plan.cameras[0].rig_from_camera.rotation;
  }
  return plan;
}

/// What a camera of a sequence sees, known by closed forms. Camera 1 looks back.
struct Truth {
  const capture::SequenceReader& sequence;
  int camera = 0;

  double time_of(double y) const { return sequence.info().name == "uav1" ? 0.0 : exposed_s(y); }
  Pose camera_pose(int frame, double t) const {
    Pose pose(state_of(sequence.info().name, frame), t);
    Matrix3d body_from_camera = geo::rig_from_rdf();
    if (camera == 1) body_from_camera = Vector3d(-1, -1, 1).asDiagonal() * body_from_camera;
    pose.rotation = pose.rotation * body_from_camera;
    return pose;
  }

  struct Hit {
    double t = kInfinity;
    std::uint32_t instance_id = 0;
    std::string body;
  };
  /// The first thing that a ray meets in the sequence's world, in which its own body is not.
  Hit meet(int frame, double time, const Vector3d& origin, const Vector3d& direction,
           double grown = 0.0) const {
    Hit hit;
    if (direction.z() < 0.0) hit.t = -origin.z() / direction.z();
    if (std::isfinite(hit.t) &&
        (origin + hit.t * direction).head<2>().cwiseAbs().maxCoeff() > kWorldHalf_m)
      hit.t = kInfinity;
    const Vector3d more = Vector3d::Constant(grown);
    for (const WorldBox& box : kTowers) {
      const double t = slabs(box.low - more, box.high + more, origin, direction);
      if (t < hit.t) hit = {t, box.instance_id, {}};
    }
    for (const capture::MovingBody& body : sequence.info().moving) {
      const Pose pose(state_of(body.name, frame), time);
      const Body& box = kBodies.at(body.name);
      const double t =
          slabs(box.low - more, box.high + more, pose.own(origin), pose.turned(direction));
      if (t < hit.t) hit = {t, body.instance_id, body.name};
    }
    return hit;
  }
  Hit meet_pixel(int frame, int x, int y, double grown = 0.0) const {
    const double t = time_of(y + 0.5);
    const Pose pose = camera_pose(frame, t);
    return meet(frame, t, pose.place, pose.rotation * ray_of(x + 0.5, y + 0.5), grown);
  }
  Vector3d direction_of(int frame, int x, int y) const {
    return camera_pose(frame, time_of(y + 0.5)).rotation * ray_of(x + 0.5, y + 0.5);
  }
  Vector3d point_of(int frame, int x, int y, double t_hit) const {
    return camera_pose(frame, time_of(y + 0.5)).world(t_hit * ray_of(x + 0.5, y + 0.5));
  }
};

/// How many pixels of each kind a pair's file was seen to have.
struct Tally {
  int seen = 0, hidden = 0, outside = 0, sky = 0, unsure = 0;
  int hidden_by_own_body = 0;  ///< of the first vehicle
  int on_other_body = 0;       ///< of the second vehicle, which it does not see
  int on_cart = 0;
};

/// at   where it is in the camera's frame
template <class At>
double time_seen_by(const Truth& to, const At& at) {
  if (to.sequence.info().name == "uav1") return 0.0;  // all lines at once
  return time_seen(0.1, [&](double t) { return pixel_of(at(t)).y(); });
}

/// Flow to what may lie beyond the border: behind the camera there is none.
template <class At>
void check_flow(const core::ExrImage& pair, int x, int y, const Truth& to, const At& at) {
  const float flow_x = pair.float_channels.at("flow.x")(x, y);
  const float flow_y = pair.float_channels.at("flow.y")(x, y);
  if (at(0.0).z() <= 0.0) {
    EXPECT_TRUE(std::isnan(flow_x) && std::isnan(flow_y));
    return;
  }
  const Vector2d there = pixel_of(at(time_seen_by(to, at)));
  // Lines far beyond the image's are not followed.
  if (there.cwiseAbs().maxCoeff() > 4.0 * kWidth) return;
  EXPECT_NEAR(double{flow_x}, there.x() - (x + 0.5), 5e-5);
  EXPECT_NEAR(double{flow_y}, there.y() - (y + 0.5), 5e-5);
}

/// Holds a file against the scene, pixel by pixel.
Tally check_pair(const fs::path& file, const Truth& from, int from_frame, const Truth& to,
                 int to_frame) {
  const core::ExrImage pair = read_pair(file);
  const auto& flow_x = pair.float_channels.at("flow.x");
  const std::string& other = to.sequence.info().name;
  Tally tally;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      if (testing::Test::HasFailure()) return tally;
      SCOPED_TRACE(testing::Message() << file << " at " << x << " " << y);
      const Truth::Hit shown = from.meet_pixel(from_frame, x, y);
      const auto near_rim = [&](double grown) {
        const Truth::Hit hit = from.meet_pixel(from_frame, x, y, grown);
        return hit.instance_id != shown.instance_id;
      };
      if (near_rim(kRim_m) || near_rim(-kRim_m)) {
        ++tally.unsure;
        continue;
      }
      const std::uint32_t sight = pair.uint_channels.at("sight")(x, y);
      const Vector3d scene_flow(double{pair.float_channels.at("scene_flow.x")(x, y)},
                                double{pair.float_channels.at("scene_flow.y")(x, y)},
                                double{pair.float_channels.at("scene_flow.z")(x, y)});
      if (!std::isfinite(shown.t)) {
        EXPECT_EQ(sight, 0U);
        EXPECT_TRUE(std::isnan(scene_flow.x()));
        const Vector3d direction = from.direction_of(from_frame, x, y);
        check_flow(pair, x, y, to,
                   [&](double t) { return to.camera_pose(to_frame, t).turned(direction); });
        ++tally.sky;
        continue;
      }
      const Vector3d point = from.point_of(from_frame, x, y, shown.t);
      Vector3d own = point;
      if (!shown.body.empty())
        own = Pose(state_of(shown.body, from_frame), from.time_of(y + 0.5)).own(point);
      const auto point_at = [&](double t) -> Vector3d {
        return shown.body.empty() ? own : Pose(state_of(shown.body, to_frame), t).world(own);
      };
      // Coordinates of 250 m and flows of 200 px are floats.
      // Where the other's body is then is known by the first sequence's own frames alone.
      const bool is_known =
          shown.body != other || to_frame < static_cast<int>(from.sequence.frames().size());
      if (is_known) {
        EXPECT_LE((scene_flow - (point_at(0.0) - point)).norm(), 1e-5);
      }
      EXPECT_EQ(std::isnan(scene_flow.x()), !is_known);
      if (shown.body == other) {
        EXPECT_EQ(sight, 4U);
        EXPECT_TRUE(std::isnan(flow_x(x, y)));
        ++tally.on_other_body;
        continue;
      }
      const auto at = [&](double t) { return to.camera_pose(to_frame, t).own(point_at(t)); };
      const double t = time_seen_by(to, at);
      const Vector2d there = pixel_of(at(t));
      const double to_edge =
          std::min({there.x(), there.y(), kWidth - there.x(), kHeight - there.y()});
      if (std::abs(to_edge) < 1e-6) {
        ++tally.unsure;
        continue;
      }
      if (to_edge < 0.0 || at(t).z() <= 0.0) {
        EXPECT_EQ(sight, 3U);
        check_flow(pair, x, y, to, at);
        ++tally.outside;
        continue;
      }
      EXPECT_NEAR(double{flow_x(x, y)}, there.x() - (x + 0.5), 2e-5);
      EXPECT_NEAR(double{pair.float_channels.at("flow.y")(x, y)}, there.y() - (y + 0.5), 2e-5);
      const Vector3d eye = to.camera_pose(to_frame, t).place;
      const Vector3d way = point_at(t) - eye;
      const auto before = [&](double grown) {
        const Truth::Hit hit = to.meet(to_frame, t, eye, way, grown);
        return hit.t < 1.0 - 3e-5 ? hit : Truth::Hit{};
      };
      const Truth::Hit hider = before(0.0);
      if (before(kRim_m).instance_id != hider.instance_id ||
          before(-kRim_m).instance_id != hider.instance_id) {
        ++tally.unsure;
        continue;
      }
      const bool is_hidden = std::isfinite(hider.t);
      EXPECT_EQ(sight, is_hidden ? 1U : 2U);
      EXPECT_EQ(pair.uint_channels.at("occluder")(x, y), is_hidden ? hider.instance_id : 0U);
      ++(is_hidden ? tally.hidden : tally.seen);
      if (is_hidden && hider.body == from.sequence.info().name) ++tally.hidden_by_own_body;
      if (!is_hidden && shown.body == "cart") ++tally.on_cart;
    }
  return tally;
}

// Each sequence numbers what moves in its own way, and has the other's body, and not its own.
TEST(Vehicles, PairsAcrossThemAreThoseOfTheScene) {
  const ScratchFolder folder;
  const auto store = make_boxes_world(folder / "world", kTowers);
  const Things things = {{"uav1", {thing_of("cart", kFrames1), thing_of("uav2", kFrames1)}},
                         {"uav2", {thing_of("uav1", kFrames2), thing_of("cart", kFrames2)}}};
  Captures captures;
  for (const char* name : {"uav1", "uav2"})
    captures.push_back(render_plan(store, plan_of(name, things), folder / name));
  const std::string toml =
      "kind = \"pairs\"\nframes_apart = [-1, 0, 1]\ncameras = [\"uav1/mcs4/cam0 "
      "uav2/mcs4/cam0\", \"uav2/mcs4/cam0 uav1/mcs4/cam0\", \"uav1/mcs4/back uav2/mcs4/cam0\"]\n";
  label_all(captures, store, things, toml);

  const fs::path first = folder / "uav1/labels/pairs/mcs4", second = folder / "uav2/labels/pairs";
  const Truth ahead{captures[0]}, back{captures[0], 1}, follower{captures[1]};
  const Tally now =
      check_pair(first / "cam0/uav2/mcs4/cam0/000001_000001.exr", ahead, 1, follower, 1);
  EXPECT_GT(now.hidden_by_own_body, 100);
  EXPECT_GT(now.hidden, now.hidden_by_own_body + 20);
  EXPECT_GT(now.seen, 5000);
  EXPECT_GT(now.on_cart, 20);
  EXPECT_GT(now.sky, 1000);
  EXPECT_LT(now.unsure, 20);
  const Tally earlier =
      check_pair(first / "cam0/uav2/mcs4/cam0/000002_000001.exr", ahead, 2, follower, 1);
  EXPECT_GT(earlier.hidden_by_own_body, 100);
  EXPECT_GT(earlier.on_cart, 20);
  const Tally later =
      check_pair(second / "mcs4/cam0/uav1/mcs4/cam0/000001_000002.exr", follower, 1, ahead, 2);
  EXPECT_GT(later.on_other_body, 100);
  EXPECT_EQ(later.hidden_by_own_body, 0);
  EXPECT_GT(later.seen, 5000);
  EXPECT_GT(later.on_cart, 20);
  const Tally before =
      check_pair(second / "mcs4/cam0/uav1/mcs4/cam0/000001_000000.exr", follower, 1, ahead, 0);
  EXPECT_GT(before.on_other_body, 100);
  const Tally behind =
      check_pair(first / "back/uav2/mcs4/cam0/000000_000001.exr", back, 0, follower, 1);
  EXPECT_GT(behind.on_other_body, 50);
  EXPECT_EQ(behind.seen, 0);

  // As many as there are frames so many apart, and no others; the same bytes of one thread, kept once there.
  std::map<std::string, std::string> hashes;
  for (const char* name : {"uav1", "uav2"})
    for (const auto& entry : fs::recursive_directory_iterator(folder / name / "labels/pairs"))
      if (entry.is_regular_file())
        hashes[entry.path().string()] = core::content_hash_of_file(entry.path());
  EXPECT_EQ(hashes.size(), 3U * (2 + 2 + 1) + 2);  // an index each
  const core::Json index = core::Json::read(folder / "uav1/labels/pairs/pairs.json");
  ASSERT_EQ(index.at("pairs").size(), 6U);
  const core::Json& listed = index.at("pairs").at(std::size_t{0});
  EXPECT_EQ(listed.at("other_sequence").string(), "uav2");
  EXPECT_EQ(listed.at("other_capture").string(), capture::labels_source(captures[1]));
  EXPECT_EQ(listed.at("differs_in").string(), "camera and frame");
  const fs::path kept = first / "cam0/uav2/mcs4/cam0/000001_000001.exr";
  const auto time = fs::last_write_time(kept);
  label_all(captures, store, things, toml);
  EXPECT_EQ(fs::last_write_time(kept), time);
  for (const auto& [file, hash] : hashes) fs::remove(file);
  label_all(captures, store, things, toml, 1);
  for (const auto& [file, hash] : hashes) EXPECT_EQ(core::content_hash_of_file(file), hash) << file;
}

double hill_m(double x, double y) { return 30.0 * std::sin(x / 18.0) * std::cos(y / 25.0); }

/// One low over hills with a fine camera, one beside it with a coarse one.
std::vector<render::SequencePlan> hill_plans(bool has_one_geometry) {
  std::vector<render::SequencePlan> plans = {level_plan(1), level_plan(1)};
  for (std::size_t i = 0; i < 2; ++i) {
    plans[i].name = i == 0 ? "low" : "beside";
    plans[i].detail = {.cell_px = 4.0, .finest_spacing_m = 1.0};
    plans[i].states[0].world_from_body = {
        Eigen::Quaterniond(Eigen::AngleAxisd(i == 0 ? 0.3 : 1.1, Vector3d::UnitZ()) *
                           Eigen::AngleAxisd(i == 0 ? 0.2 : 0.35, Vector3d::UnitY())),
        i == 0 ? Vector3d(-60.0, -20.0, 55.0) : Vector3d(40.0, -180.0, 120.0)};
  }
  plans[1].cameras[0].intrinsics.width_px = kWidth / 2;
  plans[1].cameras[0].intrinsics.height_px = kHeight / 2;
  plans[1].cameras[0].intrinsics.parameters = {60.0, 60.0, 50.0, 40.0};
  if (!has_one_geometry) return plans;
  auto all = std::make_shared<std::vector<world::Viewpoint>>();
  for (const auto& plan : plans)
    for (const world::Viewpoint& one : render::viewpoints_of(plan.states, plan.cameras))
      all->push_back(one);
  for (auto& plan : plans) plan.shared_viewpoints = all;
  return plans;
}

// Sight over hills by all triangles of the one geometry that both show.
TEST(Vehicles, SeeEachOthersGroundThroughOneGeometry) {
  const ScratchFolder folder;
  TinyWorldOptions options;
  options.refine = [](const world::TileId& id) {
    const Vector2d middle =
        id.corner_world() + Vector2d::Constant(0.5 * world::kTileCells * id.spacing_m());
    return middle.cwiseAbs().maxCoeff() < 700.0;
  };
  const auto store = make_tiny_world(folder / "world", hill_m, options);
  const std::string toml = "kind = \"pairs\"\ncameras = [\"low/mcs4/cam0 beside/mcs4/cam0\"]\n";
  const auto capture_all = [&](const char* name, bool has_one_geometry) {
    Captures captures;
    for (const render::SequencePlan& plan : hill_plans(has_one_geometry))
      captures.push_back(render_plan(store, plan, folder / name / plan.name));
    return captures;
  };
  const Captures apart = capture_all("apart", false);
  EXPECT_GT(apart[0].info().geometry.tiles.size(), apart[1].info().geometry.tiles.size());
  expect_error(core::ErrorKind::Config, {"shared_geometry = true"},
               [&] { label_all(apart, store, {}, toml); });

  const Captures shared = capture_all("shared", true);
  EXPECT_EQ(shared[0].info().geometry.tiles.size(), shared[1].info().geometry.tiles.size());
  EXPECT_GE(shared[0].info().geometry.tiles.size(), apart[0].info().geometry.tiles.size());
  label_all(shared, store, {}, toml);
  const core::ExrImage pair =
      read_pair(folder / "shared/low/labels/pairs/mcs4/cam0/beside/mcs4/cam0/000000_000000.exr");

  std::vector<world::CutTile> cut;
  for (const capture::ShownTile& tile : shared[1].info().geometry.tiles)
    cut.push_back({{.level = tile.level, .x = tile.x, .y = tile.y}});
  const BruteTerrain ground(store, cut);
  const geo::Rigid3d low = shared[0].world_from_camera(0, 0);
  const geo::Rigid3d beside = shared[1].world_from_camera(0, 0);
  const Vector3d eye = low.translation, other_eye = beside.translation;
  int num_seen = 0, num_hidden = 0, num_outside = 0;
  for (int y = 3; y < kHeight; y += 8)
    for (int x = 1; x < kWidth; x += 8) {
      SCOPED_TRACE(testing::Message() << "at " << x << " " << y);
      const Vector3d ray = low.rotation * ray_of(x + 0.5, y + 0.5);
      const double t = ground.first_crossing(eye, ray, 0.0, 5000.0);
      const std::uint32_t sight = pair.uint_channels.at("sight")(x, y);
      const float flow_x = pair.float_channels.at("flow.x")(x, y);
      const Vector3d point = eye + t * ray;
      const Vector3d at = beside.inverse() * point;
      const Vector2d there(50.0 + 60.0 * at.x() / at.z(), 40.0 + 60.0 * at.y() / at.z());
      const bool is_inside = std::isfinite(t) && at.z() > 0.0 && there.x() >= 0.0 &&
                             there.y() >= 0.0 && there.x() < kWidth / 2 && there.y() < kHeight / 2;
      ASSERT_EQ(sight == 1 || sight == 2, is_inside);
      if (!is_inside) {
        ASSERT_EQ(sight, std::isfinite(t) ? 3U : 0U);
        if (std::isfinite(t)) {
          ASSERT_EQ(std::isnan(flow_x), at.z() <= 0.0);
        }
        ++num_outside;
        continue;
      }
      ASSERT_NEAR(double{flow_x}, there.x() - (x + 0.5), 2e-5);
      ASSERT_NEAR(double{pair.float_channels.at("flow.y")(x, y)}, there.y() - (y + 0.5), 2e-5);
      // A millimetre before the point nothing of the ground around it is met.
      const Vector3d way = point - other_eye;
      const double crossing = ground.first_crossing(other_eye, way, 0.0, 1.0 - 1e-3 / way.norm());
      ASSERT_EQ(sight, std::isfinite(crossing) ? 1U : 2U);
      ++(sight == 2 ? num_seen : num_hidden);
    }
  EXPECT_GT(num_seen, 50);
  EXPECT_GT(num_hidden, 20);
  EXPECT_GT(num_outside, 20);
}

TEST(Vehicles, PairsThatCannotBeAreRefusedBeforeRendering) {
  const auto cameras = level_plan().cameras;
  using Outlines = std::vector<labels::SequenceOutline>;
  const auto outline = [&](const char* name, int num_frames, double rate_hz) {
    return labels::SequenceOutline{.name = name,
                                   .cameras = cameras,
                                   .num_frames = num_frames,
                                   .rate_hz = rate_hz,
                                   .shares_geometry = true};
  };
  const Outlines job = {outline("uav1", 3, 10.0), outline("uav2", 2, 10.0),
                        outline("slow", 3, 2.0)};
  const core::Log log("label", core::LogLevel::Off);
  const auto check = [&](const std::string& pair, const Outlines& of,
                         const std::string& more = {}) {
    std::vector<labels::LabelOptions> options(1);
    core::TomlDocument::parse("kind = \"pairs\"\ncameras = [\"" + pair + "\"]\n" + more, "job.toml")
        .read(options[0]);
    labels::check_labels(options, of, log);
  };
  const auto refused = [&](const std::string& pair, const std::vector<std::string>& words,
                           const std::string& more = {}) {
    expect_error(core::ErrorKind::Config, words, [&] { check(pair, job, more); });
  };
  check("uav1/mcs4/cam0 uav2/mcs4/cam0", job);
  check("mcs4/cam0 mcs4/cam0", job, "frames_apart = [1]\n");
  check("uav1/mcs4/cam0 uav2/mcs4/cam0", job, "frames_apart = [-2, 2]\n");
  refused("uav1/mcs4/cam0 uav3/mcs4/cam0", {"sequence", "uav3", "uav2"});
  refused("uav1/mcs4/cam0 uav2/mcs4/cam7", {"cam7", "mcs4/cam0"});
  refused("uav1/mcs5/cam0 uav2/mcs4/cam0", {"mcs5/cam0", "mcs4/cam0"});
  refused("mcs4/cam0 mcs4/cam7", {"cam7", "mcs4/cam0"});
  refused("uav1/mcs4/cam0 mcs4/cam0", {"is no pair", "SEQUENCE/RIG/NAME"});
  refused("uav1/mcs4/cam0", {"is no pair", "labels pairs"});
  refused("cam0 uav2/mcs4/cam0", {"RIG/NAME"});
  refused("a/uav1/mcs4/cam0 uav2/mcs4/cam0", {"SEQUENCE/RIG/NAME"});
  refused("uav1/mcs4/cam0 slow/mcs4/cam0", {"uav1 has rate_hz = 10", "slow has 2"});
  refused("uav1/mcs4/cam0 uav2/mcs4/cam0", {"uav1 has 3", "uav2 has 2", "[2, -3]"},
          "frames_apart = [2, -3]\n");
  // What some frames apart make nothing of is told, once for two sequences.
  const auto warnings = [&](const std::string& frames_apart) {
    const core::Log loud("label", core::LogLevel::Warn);
    std::vector<labels::LabelOptions> options(1);
    core::TomlDocument::parse(
        "kind = \"pairs\"\ncameras = [\"uav1/mcs4/cam0 uav2/mcs4/cam0\", "
        "\"uav1/mcs4/cam0 uav2/mcs4/cam0\"]\nframes_apart = " +
            frames_apart,
        "job.toml")
        .read(options[0]);
    testing::internal::CaptureStderr();
    labels::check_labels(options, job, loud);
    return testing::internal::GetCapturedStderr();
  };
  EXPECT_EQ(warnings("[-2, 1]\n"), "");  // frame 2 with 0, and 0 with 1
  const std::string told = warnings("[0, 2, 2]\n");
  EXPECT_NE(told.find("frames_apart = 2: sequence uav1 has 3 frames and uav2 has 2"),
            std::string::npos)
      << told;
  EXPECT_EQ(std::count(told.begin(), told.end(), '\n'), 1) << told;
  Outlines apart = job;
  for (labels::SequenceOutline& sequence : apart) sequence.shares_geometry = false;
  expect_error(core::ErrorKind::Config, {"shared_geometry = true", "uav1", "uav2"},
               [&] { check("uav1/mcs4/cam0 uav2/mcs4/cam0", apart); });
  check("uav1/mcs4/cam0 uav1/mcs4/cam0", apart, "frames_apart = [1]\n");
}

// Each vehicle has pairs of its own cameras.
TEST(Vehicles, PairsOfOneRigAreOfThoseThatCarryIt) {
  const auto outline = [](const char* name, const std::vector<std::string>& cameras,
                          int num_frames) {
    labels::SequenceOutline sequence{
        .name = name, .cameras = {}, .num_frames = num_frames, .shares_geometry = true};
    for (const std::string& camera : cameras) {
      sequence.cameras.emplace_back().rig = camera.substr(0, camera.find('/'));
      sequence.cameras.back().name = camera.substr(camera.find('/') + 1);
    }
    return sequence;
  };
  const std::vector fleet = {outline("uav1", {"stereo/left", "stereo/right"}, 3),
                             outline("uav2", {"wide/cam0", "wide/cam1", "eye/cam"}, 9)};
  const core::Log log("label", core::LogLevel::Warn);
  const auto check = [&](const std::string& keys) {
    std::vector<labels::LabelOptions> options(1);
    core::TomlDocument::parse("kind = \"pairs\"\n" + keys, "job.toml").read(options[0]);
    labels::check_labels(options, fleet, log);
  };
  const auto refused = [&](const std::string& keys, const std::vector<std::string>& words) {
    expect_error(core::ErrorKind::Config, words, [&] { check(keys); });
  };
  check("cameras = [\"stereo/left stereo/right\", \"wide/cam0 eye/cam\"]\n");
  check("cameras = [\"uav1/stereo/right uav2/wide/cam1\"]\n");
  check("cameras = [\"eye/cam eye/cam\"]\nframes_apart = [8]\n");
  // Of frames apart that are named twice the log is told once.
  testing::internal::CaptureStderr();
  check("frames_apart = [0, 5, 5]\n");
  const std::string told = testing::internal::GetCapturedStderr();
  EXPECT_NE(told.find("frames_apart = 5: sequence uav1 has 3 frames"), std::string::npos) << told;
  EXPECT_EQ(std::count(told.begin(), told.end(), '\n'), 1) << told;
  refused("cameras = [\"stereo/left wide/cam0\"]\n",
          {"no sequence has both stereo/left and wide/cam0", "SEQUENCE/stereo/left"});
  refused("cameras = [\"stereo/left wide/cam7\"]\n", {"unknown camera \"wide/cam7\"", "wide/cam0"});
  refused("cameras = [\"uav1/wide/cam0 uav2/wide/cam0\"]\n", {"wide/cam0", "stereo/left"});
  // The longest sequence has no such cameras.
  refused("cameras = [\"stereo/left stereo/right\"]\nframes_apart = [5]\n",
          {"no sequence is so long", "uav1, has 3 frames"});
}

}  // namespace
}  // namespace terracast::test
