#include "sensors/camera/ground_truth.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <set>

#include "capture/channel.h"
#include "capture/labels.h"
#include "core/lanes.h"
#include "core/parallel.h"
#include "core/random.h"
#include "sensors/camera/sight.h"
#include "tests/support/hills_flight.h"
#include "tests/support/test_data.h"

namespace terracast::sensors {
namespace {

using test::TracedPlan;

bool is_sky(const TruthFrame& truth, std::size_t pixel) { return std::isinf(truth.range_m[pixel]); }

/// z = 40 m, as far as 2048 m to each side.
world::TileStore make_plane(const std::filesystem::path& folder) {
  return test::make_tiny_world(folder, [](double, double) { return 40.0; },
                               {.finest_level = 3, .coarsest_level = 3});
}

// A level plane in closed form: range = height / sine of the depression, to 1e-12 of it.
TEST(GroundTruth, APlaneIsWhereItsEquationPutsIt) {
  const test::ScratchFolder folder;
  const world::TileStore store = make_plane(folder / "world");
  render::SequencePlan plan = test::small_plan(1, 40, 32);
  const TracedPlan scene(store, plan);
  const TruthFrame truth = scene.renderer.truth(0, 0);
  const View& view = scene.renderer.views().at(0, 0);
  int num_ground = 0;
  for (int y = 0; y < 32; ++y) {
    for (int x = 0; x < 40; ++x) {
      const auto pixel = static_cast<std::size_t>(y * 40 + x);
      const Eigen::Vector3d direction = view.ray_world({x + 0.5, y + 0.5}).normalized();
      const double range_m = (40.0 - view.center_world.z()) / direction.z();
      const Eigen::Vector3d point = view.center_world + range_m * direction;
      const bool on_tiles =
          range_m > 0.0 && std::abs(point.x()) < 2048.0 && std::abs(point.y()) < 2048.0;
      ASSERT_EQ(is_sky(truth, pixel), !on_tiles) << x << " " << y;
      if (!on_tiles) continue;
      ++num_ground;
      EXPECT_NEAR(truth.range_m[pixel], range_m, 1e-12 * range_m);
      EXPECT_EQ(truth.facts.range_m.data()[pixel], static_cast<float>(truth.range_m[pixel]));
      EXPECT_EQ(truth.facts.normal_world(x, y, 2), 1.0f);
      EXPECT_LT((truth.point_world[pixel] - point).norm(), 1e-9);
    }
  }
  EXPECT_GT(num_ground, 400);
}

TEST(View, SeveralPixelsHaveTheRaysThatEachOneHas) {
  const render::SequencePlan plan = test::small_plan(2, 40, 32);
  const ViewTable views(plan.states, plan.cameras);
  const View& view = views.at(1, 2);
  for (std::uint64_t i = 0; i < 1000; ++i) {
    geo::PixelBlock pixels;
    for (int k = 0; k < geo::PixelBlock::kPixels; ++k) {
      const std::uint64_t index = i * geo::PixelBlock::kPixels + static_cast<std::uint64_t>(k);
      pixels.x[k] = core::random_between(0, 40, 6, 0, index);
      pixels.y[k] = core::random_between(0, 32, 6, 1, index);
    }
    geo::VectorBlock rays;
    view.find_rays(pixels, rays);
    for (int k = 0; k < geo::PixelBlock::kPixels; ++k)
      ASSERT_EQ(Eigen::Vector3d(rays.x[k], rays.y[k], rays.z[k]),
                view.ray_world({pixels.x[k], pixels.y[k]}));
  }
}

// Points all around, and points whose pixels are a few roundings on either side of the border.
TEST(View, SeveralPointsAreInTheImageAsEachOneIs) {
  const render::SequencePlan plan = test::small_plan(2, 40, 32);
  const ViewTable views(plan.states, plan.cameras);
  const View& view = views.at(1, 0);
  int num_in = 0;
  for (std::uint64_t i = 0; i < 5000; ++i) {
    geo::VectorBlock points;
    std::uint32_t expected = 0;
    for (int k = 0; k < geo::VectorBlock::kVectors; ++k) {
      const std::uint64_t index = i * geo::VectorBlock::kVectors + static_cast<std::uint64_t>(k);
      const Eigen::Vector2d pixel(k % 2 == 0 ? 0.0 : core::random_between(-20, 60, 5, 1, index),
                                  k % 2 == 1 ? 32.0 : core::random_between(-20, 50, 5, 2, index));
      const double depth_m = core::random_between(-100, 1000, 5, 3, index);
      const Eigen::Vector3d point = view.center_world + depth_m * view.ray_world(pixel);
      points.x[k] = point.x();
      points.y[k] = point.y();
      points.z[k] = point.z();
      if (view.has_in_image(point)) expected |= std::uint32_t{1} << k;
    }
    ASSERT_EQ(view.find_in_image(points), expected) << i;
    num_in += __builtin_popcount(expected);
  }
  EXPECT_GT(num_in, 2000);
  EXPECT_LT(num_in, 35000);
}

struct PairCount {
  std::int64_t num_covisible = 0;
  std::int64_t num_tested = 0;
};

/// Every pixel of (frame, camera) that claims to be seen by (other_frame, other_camera) is looked
/// at from there anew.
void check_pair(const TracedPlan& scene, const TruthFrame& truth, int frame, int camera,
                int other_frame, int other_camera, std::uint32_t flag, PairCount& count) {
  const View& from = scene.renderer.views().at(frame, camera);
  const View& to = scene.renderer.views().at(other_frame, other_camera);
  const int width = from.model->width_px();
  for (std::size_t pixel = 0; pixel < truth.range_m.size(); ++pixel) {
    if (is_sky(truth, pixel)) {
      EXPECT_EQ(truth.facts.flags.data()[pixel] & flag, 0u) << "sky is never seen elsewhere";
      continue;
    }
    const Eigen::Vector3d& point = truth.point_world[pixel];
    const std::optional<Eigen::Vector2d> predicted = to.project(point);
    if (!predicted || !to.model->contains(*predicted)) {
      EXPECT_EQ(truth.facts.flags.data()[pixel] & flag, 0u) << "outside the image";
      continue;
    }
    const double depth_m = (to.world_from_camera.transpose() * (point - to.center_world)).z();
    // A new ray through the exact sub-pixel.
    const world::WorldRay ray{.origin_world = to.center_world,
                              .direction_world = to.ray_world(*predicted)};
    world::SurfaceHit hit;
    scene.query.intersect({&ray, 1}, {&hit, 1}, world::Coherence::Incoherent);
    const bool meets = std::abs(hit.t - depth_m) <= 1e-9 * depth_m;
    const bool claims = (truth.facts.flags.data()[pixel] & flag) != 0;
    if (meets) ++count.num_covisible;
    if (!claims) continue;
    ++count.num_tested;
    EXPECT_TRUE(meets) << "pixel " << pixel << ": " << hit.t << " m against " << depth_m;
    // Flow from the stored pose and model, before anything is rounded to float.
    const Eigen::Vector2d start(static_cast<double>(pixel % static_cast<std::size_t>(width)) + 0.5,
                                static_cast<double>(pixel / static_cast<std::size_t>(width)) + 0.5);
    const auto pose = [&](int f, int c) {
      return scene.plan.states[static_cast<std::size_t>(f)].world_from_body *
             scene.plan.cameras[static_cast<std::size_t>(c)].body_from_camera();
    };
    const capture::CameraView from_view{*from.model, pose(frame, camera)};
    const capture::CameraView to_view{*to.model, pose(other_frame, other_camera)};
    const auto flow = capture::flow(from_view, to_view, start, truth.range_m[pixel]);
    ASSERT_TRUE(flow.has_value());
    const Eigen::Vector3d met = ray.origin_world + hit.t * ray.direction_world;
    const auto there = to.project(met);
    ASSERT_TRUE(there.has_value());
    EXPECT_LT((start + *flow - *there).norm(), 1e-4);
  }
}

// What a visibility bit promises: a new ray of the other frame through the exact sub-pixel meets
// the predicted point.
TEST(GroundTruth, VisiblePointsAreMetByNewRaysOfTheOtherFrame) {
  const test::ScratchFolder folder;
  const world::TileStore store = test::make_hills(folder / "world");
  const TracedPlan scene(store, test::small_plan(6, 64, 48));
  PairCount next;
  PairCount stereo;
  for (int frame = 0; frame < 6; ++frame) {
    const TruthFrame truth = scene.renderer.truth(frame, 0);
    if (frame < 5) {
      check_pair(scene, truth, frame, 0, frame + 1, 0, capture::kVisibleNext, next);
    }
    if (frame > 0)
      check_pair(scene, truth, frame, 0, frame - 1, 0, capture::kVisiblePrevious, next);
    for (const int other : {1, 2})
      check_pair(scene, truth, frame, 0, frame, other, capture::visible_in_camera(other), stereo);
  }
  // Ten pairs of frames; what the test leaves out are rays that graze within 1e-9.
  EXPECT_GT(next.num_covisible, 15000);
  EXPECT_GE(static_cast<double>(next.num_tested), 0.9 * static_cast<double>(next.num_covisible));
  EXPECT_GT(stereo.num_covisible, 5000);
  EXPECT_GE(static_cast<double>(stereo.num_tested),
            0.9 * static_cast<double>(stereo.num_covisible));
}

TEST(GroundTruth, HiddenPointsAreNotVisible) {
  const test::ScratchFolder folder;
  const world::TileStore store = test::make_hills(folder / "world");
  const TracedPlan scene(store, test::small_plan(1, 64, 48));
  const TruthFrame truth = scene.renderer.truth(0, 0);
  // Straight under each point lies no ground that the camera could see: the points moved 5 m down
  // are hidden.
  std::vector<Eigen::Vector3d> sunk;
  std::vector<Eigen::Vector3d> seen;
  for (std::size_t pixel = 0; pixel < truth.range_m.size(); ++pixel) {
    if (is_sky(truth, pixel)) continue;
    seen.push_back(truth.point_world[pixel]);
    sunk.push_back(truth.point_world[pixel] - Eigen::Vector3d(0.0, 0.0, 5.0));
  }
  const OpenView view = scene.renderer.views().open(0, 0);
  int num_seen = 0;
  for (const std::uint8_t v : visible_in_view(scene.query, view, seen)) num_seen += v;
  for (const std::uint8_t v : visible_in_view(scene.query, view, sunk)) EXPECT_EQ(v, 0);
  EXPECT_GE(num_seen, static_cast<int>(0.999 * static_cast<double>(seen.size())));
}

TEST(GroundTruth, EdgesAreWhereAThousandthOfAPixelChangesGroundToSky) {
  const test::ScratchFolder folder;
  const world::TileStore store = test::make_hills(folder / "world");
  render::SequencePlan plan = test::small_plan(1, 200, 120);
  plan.cameras = test::small_rig(200, 120, 0.0);
  const TracedPlan scene(store, plan);
  const TruthFrame truth = scene.renderer.truth(0, 0);
  const View& view = scene.renderer.views().at(0, 0);
  int num_sky = 0;
  for (int y = 0; y < 120; ++y) {
    for (int x = 0; x < 200; ++x) {
      const auto pixel = static_cast<std::size_t>(y * 200 + x);
      num_sky += is_sky(truth, pixel) ? 1 : 0;
      bool differs = false;
      for (const auto& [dx, dy] : {std::pair{-1e-3, 0.0}, std::pair{1e-3, 0.0},
                                   std::pair{0.0, -1e-3}, std::pair{0.0, 1e-3}}) {
        const world::WorldRay ray{.origin_world = view.center_world,
                                  .direction_world = view.ray_world({x + 0.5 + dx, y + 0.5 + dy})};
        world::SurfaceHit hit;
        scene.query.intersect({&ray, 1}, {&hit, 1}, world::Coherence::Incoherent);
        differs = differs || hit.is_sky() != is_sky(truth, pixel);
      }
      EXPECT_EQ((truth.facts.flags(x, y) & capture::kEdge) != 0, differs) << x << " " << y;
    }
  }
  EXPECT_GT(num_sky, 2000);
  EXPECT_LT(num_sky, 22000);
}

/// A level plane that ends at x = 2048 m, seen eastward by a level camera that stands still: the skyline lies in a row of
/// the image, so far below the centres of its pixels.
render::SequencePlan plan_of_skyline(int num_frames, int width_px, int height_px, int row,
                                     double shift_px) {
  render::SequencePlan plan = test::small_plan(num_frames, width_px, height_px);
  plan.cameras = test::small_rig(width_px, height_px, 0.0);
  std::vector<double>& parameters = plan.cameras[0].intrinsics.parameters;
  parameters[3] = 20.0;
  const double above_m = (row + 0.5 + shift_px - parameters[3]) * 2048.0 / parameters[1];
  Eigen::Matrix3d world_from_camera;  // right: south, down, forward: east
  world_from_camera << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  for (geo::BodyState& state : plan.states)
    state.world_from_body =
        geo::Rigid3d{Eigen::Quaterniond(world_from_camera), {0.0, 0.0, 40.0 + above_m}} *
        plan.cameras[0].body_from_camera().inverse();
  return plan;
}

// Of a row that lies at a border of the units of 32 pixels.
TEST(GroundTruth, ASkylineAtTheCentresOfARowMakesEdgesOfAllOfIt) {
  constexpr int kWidth = 96;
  constexpr int kHeight = 70;
  const test::ScratchFolder folder;
  const world::TileStore store = make_plane(folder / "world");
  for (const int row : {31, 32}) {
    for (const double shift_px : {-3e-4, 3e-4}) {
      const render::SequencePlan plan = plan_of_skyline(1, kWidth, kHeight, row, shift_px);
      const TracedPlan scene(store, plan);
      const TruthFrame truth = scene.renderer.truth(0, 0);
      for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x < kWidth; ++x) {
          const bool is_above = y < row || (y == row && shift_px > 0.0);
          ASSERT_EQ(is_sky(truth, static_cast<std::size_t>(y * kWidth + x)), is_above)
              << x << " " << y;
          ASSERT_EQ((truth.facts.flags(x, y) & capture::kEdge) != 0, y == row) << x << " " << y;
        }
      }
    }
  }
}

TEST(GroundTruth, FlagsAreThoseAskedForAndNoOtherFactDependsOnThem) {
  constexpr int kWidth = 96;
  constexpr int kHeight = 70;
  const test::ScratchFolder folder;
  const world::TileStore store = make_plane(folder / "world");
  render::SequencePlan plan = plan_of_skyline(3, kWidth, kHeight, 31, 3e-4);
  const TracedPlan whole(store, plan);
  const TruthFrame all = whole.renderer.truth(1, 0);
  std::uint32_t seen = 0;
  for (const std::uint32_t flags : all.facts.flags.data()) seen |= flags;
  const std::uint64_t rays_before = whole.query.stats().num_rays;
  std::vector<std::vector<std::string>> choices = {{}, {"previous", "edge"}};
  for (const capture::FlagGroup& group : capture::flag_groups()) {
    EXPECT_NE(seen & group.bits, 0U) << group.name << ": no pixel has it, nothing is compared";
    choices.push_back({std::string(group.name)});
  }
  for (const std::vector<std::string>& names : choices) {
    std::uint32_t asked = 0;
    for (const std::string& name : names)
      for (const capture::FlagGroup& group : capture::flag_groups())
        if (group.name == name) asked |= group.bits;
    plan.facts.flags = names;
    const TracedPlan scene(store, plan);
    const TruthFrame truth = scene.renderer.truth(1, 0);
    EXPECT_EQ(truth.range_m, all.range_m);
    EXPECT_EQ(truth.facts.normal_world, all.facts.normal_world);
    EXPECT_EQ(truth.facts.semantic_id, all.facts.semantic_id);
    EXPECT_EQ(truth.facts.primitive_id, all.facts.primitive_id);
    for (std::size_t i = 0; i < all.facts.flags.data().size(); ++i)
      ASSERT_EQ(truth.facts.flags.data()[i], all.facts.flags.data()[i] & asked) << i;
    EXPECT_LT(scene.query.stats().num_rays, rays_before);
    if (names.empty()) {
      EXPECT_EQ(scene.query.stats().num_rays, std::uint64_t{kWidth * kHeight});
    }
  }
}

TEST(GroundTruth, FactsDoNotDependOnThreadsOrTheLocalOrigin) {
  const test::ScratchFolder folder;
  const world::TileStore store = test::make_hills(folder / "world");
  const render::SequencePlan plan = test::small_plan(2, 70, 50);
  const TracedPlan scene(store, plan);
  const TruthFrame first = scene.renderer.truth(0, 0);
  const core::Image8 first_color = scene.renderer.color(0, 0);
  world::RayQueryOptions moved;
  moved.local_origin_world = {1000.3, -777.7, 123.1};
  const TracedPlan other(store, plan, moved);
  const core::ThreadLimit one(1);
  const TruthFrame second = other.renderer.truth(0, 0);
  EXPECT_EQ(first.range_m, second.range_m);
  EXPECT_EQ(first.facts.flags, second.facts.flags);
  EXPECT_EQ(first.facts.semantic_id, second.facts.semantic_id);
  EXPECT_EQ(first.facts.primitive_id, second.facts.primitive_id);
  EXPECT_EQ(first.facts.normal_world, second.facts.normal_world);
  EXPECT_EQ(first_color, other.renderer.color(0, 0));
}

TEST(GroundTruth, AFrameThatIsUsedAgainKeepsNothing) {
  const test::ScratchFolder folder;
  const world::TileStore store = test::make_hills(folder / "world");
  render::SequencePlan level = test::small_plan(2, 90, 70);
  level.cameras = test::small_rig(90, 70, 0.0);  // half of it sky
  const TracedPlan looks_level(store, level);
  const TracedPlan looks_down(store, test::small_plan(2, 64, 48));
  const TruthFrame expected = looks_level.renderer.truth(0, 0);
  TruthFrame truth = looks_down.renderer.truth(1, 1);
  looks_level.renderer.truth(1, 2, truth);
  looks_level.renderer.truth(0, 0, truth);
  EXPECT_EQ(truth.range_m, expected.range_m);
  EXPECT_EQ(truth.point_world, expected.point_world);
  EXPECT_EQ(truth.facts.range_m, expected.facts.range_m);
  EXPECT_EQ(truth.facts.normal_world, expected.facts.normal_world);
  EXPECT_EQ(truth.facts.semantic_id, expected.facts.semantic_id);
  EXPECT_EQ(truth.facts.instance_id, expected.facts.instance_id);
  EXPECT_EQ(truth.facts.primitive_id, expected.facts.primitive_id);
  EXPECT_EQ(truth.facts.flags, expected.facts.flags);
}

TEST(GroundTruth, NormalsAndClassesArePropertiesOfThePoint) {
  const test::ScratchFolder folder;
  const world::TileStore store = test::make_hills(folder / "world");
  const TracedPlan scene(store, test::small_plan(2, 64, 48));
  // The same points, met from two frames, are of the same class.
  const TruthFrame truth = scene.renderer.truth(0, 0);
  const View& to = scene.renderer.views().at(1, 0);
  scene::GroundPacket packet;
  int num_compared = 0;
  for (std::size_t pixel = 0; pixel < truth.range_m.size(); ++pixel) {
    if ((truth.facts.flags.data()[pixel] & capture::kVisibleNext) == 0) continue;
    const world::WorldRay ray{.origin_world = to.center_world,
                              .direction_world = truth.point_world[pixel] - to.center_world};
    world::SurfaceHit hit;
    world::SurfaceSample surface;
    scene.query.intersect({&ray, 1}, {&hit, 1}, world::Coherence::Incoherent, {&surface, 1});
    if (primitive_id(hit) != truth.facts.primitive_id.data()[pixel]) continue;  // on a shared edge
    const Eigen::Vector3f normal = hit.normal_world().cast<float>();
    for (int k = 0; k < 3; ++k)
      EXPECT_EQ(truth.facts.normal_world.data()[3 * pixel + static_cast<std::size_t>(k)],
                normal[k]);
    scene::GroundPlaces places;
    for (int lane = 0; lane < core::kLanes; ++lane)
      places.set(lane, truth.point_world[pixel], hit.normal_world(), surface, 7.0);
    scene.renderer.ground().set(places, packet);
    core::Lanes<std::uint8_t> classes;
    scene.renderer.ground().classify(packet, classes);
    EXPECT_EQ(classes[3], truth.facts.semantic_id.data()[pixel]);
    ++num_compared;
  }
  EXPECT_GT(num_compared, 1000);
}

}  // namespace
}  // namespace terracast::sensors
