#include "render/reuse.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>
#include <thread>

#include "capture/frame_record_json.h"
#include "capture/sequence_files.h"
#include "core/atomic_file.h"
#include "geo/sun.h"
#include "tests/support/brute_terrain.h"
#include "tests/support/folder_compare.h"
#include "tests/support/hills_flight.h"
#include "tests/support/test_data.h"

// A sequence is rendered, something is edited, and it is rendered again with the frames that can be
// taken from the first capture. What must come out is known without the program's own keys and
// trails: every byte from a render without anything to take from; which frames are rendered from the
// frames' rays, followed here by the full traversal, and the columns of the tiles that they enter.
namespace terracast::render {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;
using test::BruteTerrain;
using testing::ElementsAre;
using testing::IsEmpty;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr int kWidth = 12;
constexpr int kHeight = 8;
constexpr int kNumTiles = 4;  ///< along a side of the world, of 256 m
constexpr double kSide_m = 256.0;

/// Valleys of 0 m and hills of 90 m, larger than tiles, with smaller ones on them.
double valleys_m(double x, double y) {
  return 45.0 + 40.0 * std::sin(0.011 * x + 0.4) * std::cos(0.009 * y) +
         4.0 * std::sin(0.07 * x) * std::sin(0.06 * y + 1.0);
}
double flat_m(double, double) { return 20.0; }

world::TileStore make_world(const fs::path& folder, const test::HeightFunction& height_m) {
  test::TinyWorldOptions options;
  options.finest_level = 0;
  options.coarsest_level = 0;
  options.num_roots = kNumTiles;
  return test::make_tiny_world(folder, height_m, options);
}

/// A copy of a world in which the heights within a tile are others, but for its borders.
/// raised_m   of a sample, by how near it is to the tile's middle: 0 at the border, 1 there
world::TileStore edited(const world::TileStore& store, const fs::path& folder,
                        const world::TileId& id, const std::function<double(double)>& raised_m) {
  fs::copy(store.folder(), folder, fs::copy_options::recursive);
  world::Tile tile = store.load(id);
  for (int j = 0; j < world::kTileSamples; ++j) {
    for (int i = 0; i < world::kTileSamples; ++i) {
      const double nearness = 1.0 - std::max(std::abs(i - 128.0), std::abs(j - 128.0)) / 128.0;
      const double steps = raised_m(nearness) / world::kHeightStep_m;
      tile.height_steps[world::Tile::sample(i, j)] += static_cast<int>(std::lround(steps));
    }
  }
  const double middle = 0.5 * (tile.lowest_z_world() + tile.highest_z_world());
  const double moved_m = std::round(middle) - tile.center_z_m;
  tile.center_z_m += moved_m;
  for (std::int32_t& steps : tile.height_steps)
    steps -= static_cast<int>(moved_m / world::kHeightStep_m);
  world::WorldManifest manifest = store.manifest();
  manifest.input_hash = "edited";
  for (world::TileInfo& info : manifest.tiles)
    if (info.id == id) info = world::write_tile(folder, tile);
  world::write_manifest(folder, manifest);
  return world::TileStore::open(folder);
}

geo::BodyState looking(double x, double y, double z, double yaw_deg, double pitch_deg) {
  constexpr double kRadPerDeg = std::numbers::pi / 180.0;
  geo::BodyState state;
  state.world_from_body.translation = {x, y, z};
  state.world_from_body.rotation = Eigen::AngleAxisd(yaw_deg * kRadPerDeg, Vector3d::UnitZ()) *
                                   Eigen::AngleAxisd(pitch_deg * kRadPerDeg, Vector3d::UnitY());
  return state;
}

/// Frames that look at many places: down, across valleys, into the sky.
SequencePlan looks() {
  SequencePlan plan = test::small_plan(1, kWidth, kHeight);
  rigs::RigOptions rig;
  rig.name = "pair";
  rig.cameras = {test::camera_options("left", kWidth, kHeight, 1.2 * kWidth),
                 test::camera_options("right", kWidth, kHeight, 1.2 * kWidth)};
  rig.cameras[1].offset_mm = {0.0, -500.0, 0.0};
  plan.cameras = rigs::build_cameras({rig});
  plan.states = {
      looking(-420.0, -380.0, 190.0, 30.0, 50.0), looking(-380.0, -330.0, 190.0, 30.0, 50.0),
      looking(-300.0, 380.0, 120.0, -70.0, 14.0), looking(330.0, 200.0, 230.0, 160.0, 75.0),
      looking(300.0, 210.0, 230.0, 165.0, 70.0),  looking(100.0, -400.0, 110.0, 95.0, 8.0),
      looking(400.0, -400.0, 300.0, 135.0, 40.0), looking(0.0, 0.0, 300.0, 0.0, -60.0)};
  for (std::size_t i = 0; i < plan.states.size(); ++i)
    plan.states[i].time_s = 0.1 * static_cast<double>(i);
  plan.tracks.num_points = 64;
  plan.conditions.sun_azimuth_deg = 200.0;
  plan.conditions.sun_elevation_deg = 35.0;
  plan.detail = {.cell_px = 1.0, .finest_spacing_m = 1.0};
  return plan;
}

/// Rays as the test follows them: those of which one is surely cast as it stands, or some of which
/// surely are.
struct Bundle {
  struct Ray {
    Vector3d origin;
    Vector3d direction;
    double t_end;
  };
  std::vector<Ray> rays;
};

enum class Verdict { Seen, Unseen, Unknown };

/// The rays of each frame, by this test's own pinholes, followed to the ground by the full traversal.
class Truth {
 public:
  Truth(const world::TileStore& store, const SequencePlan& plan)
      : plan_(plan),
        brute_(store, world::finest_cut(store)),
        sun_(test::TracedPlan(store, plan).renderer.sky().daylight().sun_direction_world) {
    for (std::size_t frame = 0; frame < plan.states.size(); ++frame) bundles_.push_back(of(frame));
  }

  /// Whether a ray of a frame comes into the column of a tile that reaches up to top_z.
  Verdict verdict(std::size_t frame, const world::TileId& id, double top_z) const {
    constexpr double kMargin_m = 0.5;
    const auto enters = [&](const Bundle::Ray& ray, double margin_m) {
      double first = 0.0;
      double last = ray.t_end;
      const auto clip = [&](double low, double high, int axis) {
        const double o = ray.origin[axis];
        const double d = ray.direction[axis];
        if (d == 0.0) {
          if (o < low || o > high) last = -kInfinity;
          return;
        }
        first = std::max(first, std::min((low - o) / d, (high - o) / d));
        last = std::min(last, std::max((low - o) / d, (high - o) / d));
      };
      clip(id.x * kSide_m - margin_m, (id.x + 1) * kSide_m + margin_m, 0);
      clip(id.y * kSide_m - margin_m, (id.y + 1) * kSide_m + margin_m, 1);
      clip(-1e6, top_z + margin_m, 2);
      return first <= last;
    };
    bool may_enter = false;
    for (const Bundle& bundle : bundles_[frame]) {
      const auto all_enter = [&](double margin_m) {
        return std::all_of(bundle.rays.begin(), bundle.rays.end(),
                           [&](const Bundle::Ray& ray) { return enters(ray, margin_m); });
      };
      if (!bundle.rays.empty() && all_enter(-kMargin_m)) return Verdict::Seen;
      for (const Bundle::Ray& ray : bundle.rays) may_enter = may_enter || enters(ray, kMargin_m);
    }
    return may_enter ? Verdict::Unknown : Verdict::Unseen;
  }

  /// The frames that see a tile up to a height; the test fails where that is not clear.
  std::vector<int> frames_that_see(const world::TileId& id, double top_z) const {
    std::vector<int> frames;
    for (std::size_t frame = 0; frame < bundles_.size(); ++frame) {
      const Verdict found = verdict(frame, id, top_z);
      EXPECT_NE(found, Verdict::Unknown) << "frame " << frame << ", tile " << id.name();
      if (found == Verdict::Seen) frames.push_back(static_cast<int>(frame));
    }
    return frames;
  }

 private:
  struct Camera {
    Vector3d center;
    Eigen::Matrix3d world_from_camera;
    std::vector<double> p;  ///< fx, fy, cx, cy

    Vector3d ray(double u, double v) const {
      return world_from_camera * Vector3d((u - p[2]) / p[0], (v - p[3]) / p[1], 1.0);
    }
    bool has(const Vector3d& point) const {
      const Vector3d at = world_from_camera.transpose() * (point - center);
      const double u = p[0] * at.x() / at.z() + p[2];
      const double v = p[1] * at.y() / at.z() + p[3];
      return at.z() > 0.0 && u >= 0.0 && v >= 0.0 && u < kWidth && v < kHeight;
    }
  };

  Camera camera(std::size_t frame, std::size_t index) const {
    const capture::CameraCalibration& calibration = plan_.cameras[index];
    const geo::Rigid3d& body = plan_.states[frame].world_from_body;
    const geo::Rigid3d& mount = calibration.body_from_rig;
    const geo::Rigid3d& lens = calibration.rig_from_camera;
    const Vector3d center_rig = mount.rotation * lens.translation + mount.translation;
    return {body.rotation * center_rig + body.translation,
            (body.rotation * mount.rotation * lens.rotation).toRotationMatrix(),
            calibration.intrinsics.parameters};
  }

  Bundle::Ray followed(const Vector3d& origin, const Vector3d& direction, double t_end) const {
    return {origin, direction,
            std::min(t_end, brute_.first_crossing(origin, direction, 0.0, t_end))};
  }

  std::vector<Bundle> of(std::size_t frame) const {
    std::vector<Bundle> bundles;
    for (std::size_t k = 0; k < plan_.cameras.size(); ++k) {
      const Camera here = camera(frame, k);
      std::vector<Camera> others;
      if (frame + 1 < plan_.states.size()) others.push_back(camera(frame + 1, k));
      if (frame > 0) others.push_back(camera(frame - 1, k));
      for (std::size_t other = 0; other < plan_.cameras.size(); ++other)
        if (other != k) others.push_back(camera(frame, other));
      for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x) add_pixel(here, others, x, y, bundles);
    }
    return bundles;
  }

  void add_pixel(const Camera& here, const std::vector<Camera>& others, int x, int y,
                 std::vector<Bundle>& bundles) const {
    // The ray of the facts, and those of visibility: each is cast as it stands.
    const Bundle::Ray middle = followed(here.center, here.ray(x + 0.5, y + 0.5), kInfinity);
    bundles.push_back({{middle}});
    if (!std::isinf(middle.t_end)) {
      const Vector3d point = middle.origin + middle.t_end * middle.direction;
      for (const Camera& other : others)
        if (other.has(point))
          bundles.push_back({{followed(other.center, point - other.center, 1.0)}});
    }
    // Rays of colour are somewhere in the pixel, so are their ends; rays to the sun are from there.
    Bundle color;
    Bundle to_sun;
    add_grid(here, x, y, bundles);
    const double radius = std::tan(geo::kSunAngularRadius_rad);
    const Vector3d right = sun_.cross(Vector3d::UnitX()).normalized() * radius;
    const Vector3d up = sun_.cross(right);
    for (const double u : {0.0, 0.5, 1.0}) {
      for (const double v : {0.0, 0.5, 1.0}) {
        const Bundle::Ray ray = followed(here.center, here.ray(x + u, y + v), kInfinity);
        color.rays.push_back(ray);
        if (sun_.z() < 0.0) continue;
        if (std::isinf(ray.t_end)) {
          to_sun.rays.push_back({ray.origin, ray.direction, -kInfinity});  // that one comes nowhere
          continue;
        }
        const Vector3d start = ray.origin + ray.t_end * ray.direction + Vector3d(0.0, 0.0, 0.01);
        for (const Vector3d& place : {sun_, Vector3d(sun_ + right), Vector3d(sun_ - right),
                                      Vector3d(sun_ + up), Vector3d(sun_ - up)})
          to_sun.rays.push_back(followed(start, place, kInfinity));
      }
    }
    bundles.push_back(std::move(color));
    bundles.push_back(std::move(to_sun));
  }

  /// Rays of colour closer together, and one to the sun from each: more that may be cast.
  void add_grid(const Camera& here, int x, int y, std::vector<Bundle>& bundles) const {
    constexpr int kPlaces = 8;
    Bundle grid;
    grid.rays.push_back({here.center, Vector3d::UnitZ(), -kInfinity});  // none of it is sure
    for (int j = 0; j < kPlaces; ++j) {
      for (int i = 0; i < kPlaces; ++i) {
        const Bundle::Ray ray = followed(
            here.center, here.ray(x + (i + 0.5) / kPlaces, y + (j + 0.5) / kPlaces), kInfinity);
        grid.rays.push_back(ray);
        if (std::isinf(ray.t_end) || sun_.z() < 0.0) continue;
        const Vector3d start = ray.origin + ray.t_end * ray.direction + Vector3d(0.0, 0.0, 0.01);
        grid.rays.push_back(followed(start, sun_, kInfinity));
      }
    }
    bundles.push_back(std::move(grid));
  }

  const SequencePlan& plan_;
  BruteTerrain brute_;
  Vector3d sun_;
  std::vector<std::vector<Bundle>> bundles_;  ///< by frame
};

class TakenOver : public testing::Test {
 protected:
  RenderedFrames render(const world::TileStore& store, const SequencePlan& plan,
                        const fs::path& folder, const std::vector<fs::path>& earlier = {},
                        const capture::FrameSelection& selection = {}) {
    const core::Log log("test", core::LogLevel::Off);
    const core::Context context{.log = log, .num_threads = 2, .events_file = {}};
    return run_render_stage(store, plan, {}, selection, folder, context, earlier);
  }

  /// Renders with what can be taken from `earlier`, and without; both must come to the same bytes.
  /// returns   the frames that were rendered
  std::vector<int> render_again(const world::TileStore& store, const SequencePlan& plan,
                                const std::vector<fs::path>& earlier) {
    const fs::path name = std::to_string(num_renders_++);
    const RenderedFrames done = render(store, plan, scratch_ / "again" / name, earlier);
    EXPECT_EQ(done.rendered.size() + done.taken_over.size(), plan.states.size());
    render(store, plan, scratch_ / "anew" / name);
    EXPECT_EQ(test::first_difference(scratch_ / "again" / name, scratch_ / "anew" / name), "");
    for (const int frame : done.taken_over)
      EXPECT_TRUE(
          fs::equivalent(earlier.front() / capture::facts_path(plan.cameras[1], frame),
                         scratch_ / "again" / name / capture::facts_path(plan.cameras[1], frame)));
    return done.rendered;
  }

  std::vector<int> all() const {
    return capture::FrameSelection{}.frames_of(static_cast<int>(plan_.states.size()));
  }

  test::ScratchFolder scratch_;
  SequencePlan plan_ = looks();
  int num_renders_ = 0;
};

TEST_F(TakenOver, AfterAnEditOfATileExactlyTheFramesThatSawItAreRendered) {
  const world::TileStore store = make_world(scratch_ / "world", valleys_m);
  render(store, plan_, scratch_ / "first");
  const Truth truth(store, plan_);
  std::set<std::vector<int>> sets;
  for (const world::TileId& id : {world::TileId{0, -2, -2}, world::TileId{0, -1, -2},
                                  world::TileId{0, 1, -2}, world::TileId{0, 0, -1}}) {
    const world::TileStore changed =
        edited(store, scratch_ / "changed", id, [](double nearness) { return -nearness; });
    const std::vector<int> saw = truth.frames_that_see(id, store.find(id)->highest_z_world);
    EXPECT_EQ(render_again(changed, plan_, {scratch_ / "first"}), saw) << id.name();
    EXPECT_THAT(saw, testing::Not(IsEmpty()));
    sets.insert(saw);
    fs::remove_all(changed.folder());
  }
  EXPECT_EQ(sets.size(), 4u);  // each of other frames
}

TEST_F(TakenOver, AHillThatGrowsIntoTheWayOfRaysIsSeenByTheirFrames) {
  const world::TileStore store = make_world(scratch_ / "world", valleys_m);
  render(store, plan_, scratch_ / "first");
  const Truth truth(store, plan_);
  const auto expect_right = [&](const world::TileId& id, double grown_m) {
    const world::TileStore changed = edited(store, scratch_ / "changed", id,
                                            [&](double nearness) { return grown_m * nearness; });
    const std::vector<int> see = truth.frames_that_see(id, changed.find(id)->highest_z_world);
    EXPECT_EQ(render_again(changed, plan_, {scratch_ / "first"}), see) << id.name();
    fs::remove_all(changed.folder());
    return see;
  };
  // Rays of frame 5 pass over it, 25 m above its highest point or more.
  EXPECT_THAT(expect_right({0, 1, -2}, 20.0), ElementsAre(2, 6));
  EXPECT_THAT(expect_right({0, 1, -2}, 60.0), ElementsAre(2, 5, 6));
  // The highest tile of all: that other rays are followed up to another height does not show.
  expect_right({0, 0, 0}, 60.0);
}

TEST_F(TakenOver, OverFlatGroundFramesTellHowTheirRaysCameDown) {
  const world::TileStore store = make_world(scratch_ / "world", flat_m);
  render(store, plan_, scratch_ / "first");
  const Truth truth(store, plan_);
  for (const world::TileId& id : {world::TileId{0, 0, 0}, world::TileId{0, -1, 1}}) {
    const world::TileStore changed =
        edited(store, scratch_ / "changed", id, [](double nearness) { return 50.0 * nearness; });
    EXPECT_EQ(render_again(changed, plan_, {scratch_ / "first"}), truth.frames_that_see(id, 70.0));
    fs::remove_all(changed.folder());
  }
}

TEST_F(TakenOver, WhatGrowsHigherThanFramesTellIsRenderedByAllThatSeeIt) {
  const world::TileStore store = make_world(scratch_ / "world", flat_m);
  render(store, plan_, scratch_ / "first");
  const Truth truth(store, plan_);
  const world::TileId id{0, 1, -2};
  const world::TileStore changed =
      edited(store, scratch_ / "changed", id, [](double nearness) { return 150.0 * nearness; });
  const std::vector<int> see = truth.frames_that_see(id, 170.0);
  const std::vector<int> rendered = render_again(changed, plan_, {scratch_ / "first"});
  EXPECT_THAT(see, testing::Not(IsEmpty()));
  EXPECT_TRUE(std::includes(rendered.begin(), rendered.end(), see.begin(), see.end()));
  // Neither those that look elsewhere nor the sky's.
  for (const int frame : {0, 3, 7}) EXPECT_THAT(rendered, testing::Not(testing::Contains(frame)));
}

TEST_F(TakenOver, AnEditThatNobodySawRendersNothing) {
  const world::TileStore store = make_world(scratch_ / "world", valleys_m);
  plan_.states.resize(2);
  render(store, plan_, scratch_ / "first");
  for (const double grown_m : {-5.0, 30.0, 300.0}) {
    const world::TileStore changed = edited(store, scratch_ / "changed", {0, 1, 1},
                                            [&](double nearness) { return grown_m * nearness; });
    EXPECT_THAT(render_again(changed, plan_, {scratch_ / "first"}), IsEmpty()) << grown_m;
    fs::remove_all(changed.folder());
  }
}

TEST_F(TakenOver, OfChangedInputsExactlyTheFramesThatShowThemAreRendered) {
  const world::TileStore store = make_world(scratch_ / "world", valleys_m);
  render(store, plan_, scratch_ / "first");
  const auto rendered_after = [&](const std::function<void(SequencePlan&)>& edit) {
    SequencePlan plan = plan_;
    edit(plan);
    plan.config_toml += "# edited\n";
    return render_again(store, plan, {scratch_ / "first"});
  };
  // Nothing that images show.
  EXPECT_THAT(rendered_after([](SequencePlan&) {}), IsEmpty());
  EXPECT_THAT(rendered_after([](SequencePlan& plan) { plan.tracks.num_points = 40; }), IsEmpty());
  EXPECT_THAT(rendered_after([](SequencePlan& plan) {
                plan.rate_hz = 5.0;
                for (geo::BodyState& state : plan.states) {
                  state.time_s *= 2.0;
                  state.velocity_world_mps.x() = 3.0;
                }
              }),
              IsEmpty());
  // The sun's place is given, so that the time says nothing of it.
  EXPECT_THAT(rendered_after([](SequencePlan& plan) { plan.utc_start = "2025-06-21T10:00:05Z"; }),
              IsEmpty());
  // A pose: its frame and those beside it, which look for its points.
  EXPECT_THAT(rendered_after([](SequencePlan& plan) {
                plan.states[5].world_from_body.translation.x() += 0.001;
              }),
              ElementsAre(4, 5, 6));
  // More and fewer frames.
  EXPECT_THAT(rendered_after([](SequencePlan& plan) {
                plan.states.push_back(plan.states.back());
                plan.states.back().time_s += 0.1;
              }),
              ElementsAre(7, 8));
  EXPECT_THAT(rendered_after([](SequencePlan& plan) { plan.states.pop_back(); }), ElementsAre(6));
}

TEST_F(TakenOver, InputsThatAllFramesShowRenderAll) {
  const world::TileStore store = make_world(scratch_ / "world", flat_m);
  plan_.states.resize(3);
  render(store, plan_, scratch_ / "first");
  const auto rendered_after = [&](const std::function<void(SequencePlan&)>& edit) {
    SequencePlan plan = plan_;
    edit(plan);
    return render_again(store, plan, {scratch_ / "first"});
  };
  EXPECT_EQ(rendered_after([](SequencePlan& plan) { plan.conditions.exposure = 1.5; }), all());
  EXPECT_EQ(rendered_after([](SequencePlan& plan) { plan.conditions.visibility_km = 50.0; }),
            all());
  EXPECT_EQ(rendered_after([](SequencePlan& plan) { plan.conditions.color_samples = 3; }), all());
  EXPECT_EQ(rendered_after([](SequencePlan& plan) { plan.conditions.sun_azimuth_deg = 201.0; }),
            all());
  EXPECT_EQ(rendered_after([](SequencePlan& plan) { plan.seed = 2; }), all());
  EXPECT_EQ(rendered_after([](SequencePlan& plan) {
              plan.cameras[1].rig_from_camera.translation.y() -= 0.001;
            }),
            all());
  EXPECT_EQ(
      rendered_after([](SequencePlan& plan) { plan.cameras[0].intrinsics.parameters[0] += 0.1; }),
      all());
  EXPECT_EQ(rendered_after([](SequencePlan& plan) { plan.cameras[0].name = "port"; }), all());
}

TEST_F(TakenOver, TilesInThePlaceOfOthersAreSeenByAllThatSawThose) {
  // The same ground in tiles of 256 m, and in such of 512 m in the east.
  test::TinyWorldOptions options;
  options.finest_level = 0;
  options.coarsest_level = 1;
  options.num_roots = 2;
  options.refine = [](const world::TileId&) { return true; };
  const world::TileStore fine = test::make_tiny_world(scratch_ / "fine", valleys_m, options);
  options.refine = [](const world::TileId& id) { return id.x < 0; };
  const world::TileStore mixed = test::make_tiny_world(scratch_ / "mixed", valleys_m, options);
  plan_.detail.cell_px = 0.01;  // as fine as the world has it
  plan_.detail.cell_px = 0.01;  // as fine as the world has it
  // The west, which no ray leaves; the sky; across to the east; the sky.
  plan_.states = {looking(-410.0, -380.0, 190.0, 0.0, 80.0), looking(0.0, 0.0, 300.0, 0.0, -60.0),
                  looking(-420.0, -380.0, 190.0, 30.0, 40.0), looking(0.0, 0.0, 300.0, 0.0, -60.0)};
  for (std::size_t i = 0; i < plan_.states.size(); ++i)
    plan_.states[i].time_s = 0.1 * static_cast<double>(i);
  render(fine, plan_, scratch_ / "first");
  EXPECT_THAT(render_again(mixed, plan_, {scratch_ / "first"}), ElementsAre(2));
  render(mixed, plan_, scratch_ / "second");
  EXPECT_THAT(render_again(fine, plan_, {scratch_ / "second"}), ElementsAre(2));
}

TEST_F(TakenOver, WhatIsDamagedIsRendered) {
  const world::TileStore store = make_world(scratch_ / "world", flat_m);
  const fs::path first = scratch_ / "first";
  render(store, plan_, first);
  const auto damage = [&](const fs::path& file) {
    std::vector<std::byte> bytes = core::read_file(file);
    bytes[bytes.size() / 2] ^= std::byte{1};
    core::write_file(file, bytes);
  };
  damage(first / capture::color_path(plan_.cameras[0], 0));
  damage(first / capture::record_path(1));
  fs::remove(first / capture::facts_path(plan_.cameras[0], 2));
  fs::remove(first / capture::record_path(3));
  // A record that fits its own hash, but says that the frame touched nothing.
  const std::string file = (first / capture::record_path(4)).string();
  const capture::SequenceInfo info = capture::WholeFrames::open(first)->info();
  capture::FrameRecord record = capture::record_from_json(core::Json::read(file), info, file);
  record.touched_tiles.clear();
  capture::json_from_record(record, info.input_hash).write(file);
  plan_.config_toml += "# edited\n";
  EXPECT_THAT(render_again(store, plan_, {first}), ElementsAre(0, 1, 2, 3, 4));

  // Another version is no reason to fail, nor is a folder that is none.
  std::string text = core::read_text_file(first / capture::kSequenceFile);
  const std::string version = fmt::format("\"version\": {}", capture::kCaptureVersion);
  text.replace(text.find(version), version.size(), "\"version\": 3");
  core::write_file(first / capture::kSequenceFile, text);
  EXPECT_EQ(render_again(store, plan_, {first, scratch_ / "missing"}), all());
}

TEST_F(TakenOver, FromSeveralUnfinishedCapturesAndByRunsAtTheSameTime) {
  const world::TileStore store = make_world(scratch_ / "world", flat_m);
  render(store, plan_, scratch_ / "early", {}, {.first = 0, .end = 3});
  SequencePlan later = plan_;
  later.config_toml += "# edited\n";
  // What is taken can be taken on, and frames that are there stay.
  EXPECT_THAT(render(store, later, scratch_ / "late", {scratch_ / "early"}, {.first = 2, .end = 5})
                  .rendered,
              ElementsAre(3, 4));
  SequencePlan last = plan_;
  last.config_toml += "# edited again\n";
  const std::vector<fs::path> earlier = {scratch_ / "early", scratch_ / "late",
                                         scratch_ / "together"};
  {
    std::vector<std::jthread> runs;
    for (int i = 0; i < 3; ++i)
      runs.emplace_back([&] { render(store, last, scratch_ / "together", earlier); });
  }
  render(store, last, scratch_ / "anew");
  EXPECT_EQ(test::first_difference(scratch_ / "together", scratch_ / "anew"), "");
  EXPECT_THAT(
      render(store, last, scratch_ / "alone", {scratch_ / "early", scratch_ / "late"}).rendered,
      ElementsAre(5, 6, 7));
}

}  // namespace
}  // namespace terracast::render
