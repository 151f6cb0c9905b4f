#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <span>
#include <vector>

#include "core/random.h"
#include "geo/geodesy.h"
#include "tests/support/test_data.h"
#include "tests/support/tiny_world.h"
#include "tests/world/rays.h"
#include "world/instance_frame.h"
#include "world/prototype_library.h"
#include "world/ray_query.h"
#include "world/terrain_walk.h"
#include "world/triangle_crossing.h"

// What rays meet of objects is what cross_block() says of each ray and all their triangles, one after the
// other, without boxes, floats or packets; to the last bit.
namespace terracast::world {
namespace {

using test::cast_all;
using test::kInfinity;
using test::same_bits;

constexpr double kHalfSize_m = 1024.0;
constexpr int kNumInstances = 60;

double ground_m(double x, double y) {
  return 300.0 + 20.0 * std::sin(0.01 * x) * std::cos(0.008 * y);
}

class Draw {
 public:
  explicit Draw(std::uint64_t stream) : stream_(stream) {}
  double between(double low, double high) {
    return core::random_between(low, high, 4711, stream_, num_drawn_++);
  }
  Eigen::Vector3d in_box(double half) {
    const double x = between(-half, half), y = between(-half, half);
    return {x, y, between(-half, half)};
  }

 private:
  std::uint64_t stream_;
  std::uint64_t num_drawn_ = 0;
};

/// Triangles every which way, from far smaller to as large as the shape, some with shared edges, slivers
/// and upright ones among them, within reach_m of the middle of an upright cylinder's axis.
Shape thicket(std::uint64_t stream, int num_triangles, double reach_m) {
  Draw draw(stream);
  Shape shape;
  shape.finishes = {Finish{}};
  const auto vertex = [&](const Eigen::Vector3d& place_m) {
    shape.vertices_steps.push_back((place_m / kHeightStep_m).array().round().matrix().cast<int>());
    return static_cast<std::uint32_t>(shape.vertices_steps.size() - 1);
  };
  const Eigen::Vector3d middle(0.0, 0.0, reach_m);
  while (static_cast<int>(shape.triangles.size()) < num_triangles) {
    const double size_m = reach_m * std::exp(draw.between(-5.0, 0.0));
    const Eigen::Vector3d at = middle + draw.in_box(0.5 * reach_m);
    const std::uint32_t a = vertex(at);
    const std::uint32_t b = vertex(at + draw.in_box(0.5 * size_m));
    const bool is_sliver = draw.between(0.0, 1.0) < 0.2;
    const std::uint32_t c = vertex(at + draw.in_box(is_sliver ? 0.01 : 0.5 * size_m));
    const std::uint32_t d = vertex(at + draw.in_box(0.5 * size_m));
    shape.triangles.push_back({{a, b, c}, 0});
    shape.triangles.push_back({{b, a, d}, 0});
  }
  return shape;
}

struct Shown {
  std::uint32_t object;
  Shape shape;
  Eigen::Vector3i origin_steps = Eigen::Vector3i::Zero();
  std::optional<Instance> instance;
  InstanceFrame frame;

  Eigen::Vector3d world(const Eigen::Vector3d& point_m) const {
    return instance ? frame * point_m
                    : Eigen::Vector3d(point_m + origin_steps.cast<double>() * kHeightStep_m);
  }
};

/// A world of four coarse tiles and finer ones about its middle, with solids and instances, all of which
/// every tile holds.
class ObjectRays : public testing::Test {
 protected:
  ObjectRays()
      : bare_(test::make_tiny_world(folder_ / "bare", ground_m, options())),
        store_(settle()),
        ground_(bare_, finest_cut(bare_), {}) {}

  static test::TinyWorldOptions options() {
    test::TinyWorldOptions options;
    options.refine = [](const TileId& id) { return id.center_world().norm() < 1.1 * id.side_m(); };
    return options;
  }

  TileStore settle() {
    const TileStore store = test::make_tiny_world(folder_ / "world", ground_m, options());
    const std::array<Shape, 2> shapes = {thicket(1, 150, 9.0), thicket(2, 14, 3.0)};
    WorldManifest manifest = store.manifest();
    manifest.layers.push_back({.name = "things",
                               .kind = "objects",
                               .source = "",
                               .content_hash = "",
                               .licence = "CC0",
                               .accuracy = "",
                               .counts = {}});
    for (std::size_t row = 0; row < shapes.size(); ++row)
      manifest.prototypes.push_back(
          write_prototype(folder_ / "world", row, {"thicket", {{127, shapes[row]}}}));
    Draw draw(3);
    TileObjects objects;
    for (int i = 0; i < 3; ++i) {
      // The first stands on the border of tiles.
      const Eigen::Vector2d place(i == 0 ? 5.0 : draw.between(-300.0, 300.0),
                                  i == 0 ? 0.0 : draw.between(-300.0, 300.0));
      Solid solid;
      solid.provenance = {.instance_id = static_cast<std::uint32_t>(i + 1)};
      solid.place_m = place.cast<int>();
      solid.origin_steps = steps_at(place);
      solid.levels = {{127, thicket(10 + static_cast<std::uint64_t>(i), 120, 25.0)}};
      shown_.push_back({.object = static_cast<std::uint32_t>(i),
                        .shape = solid.levels[0].shape,
                        .origin_steps = solid.origin_steps,
                        .instance = std::nullopt,
                        .frame = {}});
      objects.solids.push_back(solid);
    }
    const geo::WorldFrame frame(manifest.origin);
    for (std::uint32_t i = 0; i < kNumInstances; ++i) {
      const double reach_m = i < 40 ? 60.0 : 0.8 * kHalfSize_m;  // a wood, and others
      Instance instance;
      instance.provenance = {.instance_id = 100 + i};
      instance.prototype = static_cast<std::uint16_t>(i % 2);
      instance.place_steps =
          steps_at({draw.between(-reach_m, reach_m), draw.between(-reach_m, reach_m)});
      instance.heading = static_cast<std::uint16_t>(draw.between(0.0, 65535.0));
      instance.scale = static_cast<std::uint16_t>(draw.between(800.0, 9000.0));
      shown_.push_back({.object = 3 + i,
                        .shape = shapes[i % 2],
                        .instance = instance,
                        .frame = instance_frame(instance, frame)});
      objects.instances.push_back(instance);
    }
    for (TileInfo& info : manifest.tiles) {
      Tile tile = store.load(info.id);
      tile.objects = objects;
      tile.objects_top_steps = static_cast<std::int32_t>(200.0 / kHeightStep_m);
      info = write_tile(folder_ / "world", tile);
    }
    write_manifest(folder_ / "world", manifest);
    return TileStore::open(folder_ / "world");
  }

  static Eigen::Vector3i steps_at(const Eigen::Vector2d& place) {
    return Eigen::Vector3d(place.x() / kHeightStep_m, place.y() / kHeightStep_m,
                           ground_m(place.x(), place.y()) / kHeightStep_m)
        .array()
        .round()
        .matrix()
        .cast<int>();
  }

  void add(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double t_min = 0.0,
           double t_max = kInfinity) {
    rays_.push_back(
        {.origin_world = origin, .direction_world = direction, .t_min = t_min, .t_max = t_max});
  }

  /// 16 x 16 pixels toward a place.
  void add_image(const Eigen::Vector3d& eye, const Eigen::Vector3d& toward, double pixel_rad) {
    const Eigen::Vector3d forward = (toward - eye).normalized();
    const Eigen::Vector3d right = forward.unitOrthogonal();
    const Eigen::Vector3d down = forward.cross(right);
    for (int j = -8; j < 8; ++j)
      for (int i = -8; i < 8; ++i) add(eye, forward + pixel_rad * (i * right + j * down));
  }

  void add_rays() {
    Draw draw(7);
    add_image({-180.0, -40.0, 345.0}, {0.0, 0.0, 308.0}, 1.0 / 60.0);
    add_image({3.0, 4.0, 420.0}, {0.0, 0.0, 300.0}, 1.0 / 40.0);  // down: all directions
    add_image({0.0, 10.0, 312.0}, {50.0, 20.0, 315.0}, 1.0 / 10.0);
    add_image({-900.0, 800.0, 700.0}, {0.0, 0.0, 310.0}, 1.0 / 400.0);
    add_image({60e3, -30e3, 9e3}, {0.0, 0.0, 310.0}, 2e-5);
    for (const Shown& one : shown_) {
      for (int k = 0; k < 30; ++k) {
        const auto triangle = static_cast<std::size_t>(
            draw.between(0.0, 1.0) * static_cast<double>(one.shape.triangles.size()));
        const TriangleCorners steps = corners_of(one.shape, triangle);
        std::array<Eigen::Vector3d, 3> corners;
        for (std::size_t c = 0; c < 3; ++c)
          corners[c] = one.world(steps[c].cast<double>() * kHeightStep_m);
        // At a corner, at the middle of an edge, at one within a last place beside it, or within.
        const double along = draw.between(0.0, 1.0);
        Eigen::Vector3d target = corners[0];
        if (k % 5 == 1) target = 0.5 * (corners[0] + corners[1]);
        if (k % 5 == 2) target = corners[1] + along * (corners[2] - corners[1]);
        if (k % 5 == 3) target = target + draw.in_box(1e-6);
        if (k % 5 == 4) target = (corners[0] + corners[1] + corners[2]) / 3.0;
        const double far_m = std::exp(draw.between(0.0, 9.0));
        const Eigen::Vector3d eye = target + far_m * draw.in_box(1.0);
        add(eye, target - eye);
        if (k % 3 == 0) add(eye, target - eye, 0.0, 1.0);
        if (k % 3 == 1) add(eye, (target - eye).normalized(), -10.0, 1e4);
        // Along an axis, and in the triangle's own plane.
        const int axis = k % 3;
        add(target - 40.0 * Eigen::Vector3d::Unit(axis), Eigen::Vector3d::Unit(axis));
        const Eigen::Vector3d across = corners[1] - corners[2];
        if (across.norm() > 0.0) add(target - 30.0 * across.normalized(), across.normalized());
      }
    }
  }

  /// The same as a ray is moved into an instance's frame.
  static WorldRay moved(const Shown& one, const WorldRay& ray) {
    if (!one.instance) return ray;
    const double inverse_scale = 4096.0 / one.instance->scale;
    const Eigen::Quaterniond turn = one.frame.world_from_prototype.conjugate();
    WorldRay own = ray;
    own.origin_world = inverse_scale * (turn * (ray.origin_world - one.frame.place_world));
    own.direction_world = inverse_scale * (turn * ray.direction_world);
    return own;
  }

  /// Whether the triangle's plane holds the ray's start.
  /// length_m   of the ray's direction in the world
  static bool starts_on(const TriangleCorners& corners, const WorldRay& own, double length_m,
                        double t) {
    const Eigen::Vector3d first = corners[0].cast<double>();
    const Eigen::Vector3d normal =
        (corners[1].cast<double>() - first).cross(corners[2].cast<double>() - first);
    const Eigen::Vector3d& direction = own.direction_world;
    return (t - own.t_min) * length_m * std::abs(normal.dot(direction)) <=
           kOnSurface_m * normal.norm() * direction.norm();
  }

  /// Of all triangles, before the ground.
  void meet_all(const WorldRay& ray, SurfaceHit& first) const {
    for (const Shown& one : shown_) {
      const WorldRay own = moved(one, ray);
      const ShearedRay sheared(own.origin_world, own.direction_world);
      for (std::uint32_t i = 0; i < one.shape.triangles.size(); ++i) {
        const TriangleCorners corners = corners_of(one.shape, i, one.origin_steps);
        TriangleBlock block{};
        for (int lane = 0; lane < TriangleBlock::kTriangles; ++lane) block.set(lane, corners, i);
        block.count = 1;
        BlockCrossings crossings;
        cross_block(sheared, block, crossings);
        const double t = crossings.t[0];
        if (crossings.crossed == 0 || t < ray.t_min || t > ray.t_max || t >= first.t ||
            starts_on(corners, own, ray.direction_world.norm(), t))
          continue;
        first.t = t;
        first.object = one.object;
        first.triangle = i;
      }
    }
  }

  test::ScratchFolder folder_;
  TileStore bare_;
  std::vector<Shown> shown_;
  TileStore store_;
  RayQuery ground_;
  std::vector<WorldRay> rays_;
};

bool is_same(const SurfaceHit& a, const SurfaceHit& b) {
  return a.t == b.t && a.object == b.object && (a.is_ground() || a.triangle == b.triangle);
}

TEST_F(ObjectRays, MeetWhatEachTriangleAloneSaysWhateverTravelsWithThem) {
  add_rays();
  std::vector<SurfaceHit> expected = cast_all(ground_, rays_);
  std::size_t num_on_objects = 0;
  for (std::size_t i = 0; i < rays_.size(); ++i) {
    meet_all(rays_[i], expected[i]);
    num_on_objects += expected[i].is_ground() ? 0 : 1;
  }
  EXPECT_GT(num_on_objects, rays_.size() / 3);
  EXPECT_LT(num_on_objects, rays_.size() - rays_.size() / 20);

  std::vector<SurfaceHit> first_hits;
  for (const char* profile : {"widest", "isa=sse4.2,frequency_level=simd128"}) {
    for (const int packet_width : {8, 16}) {
      const RayQuery query(store_, finest_cut(store_),
                           {.embree_profile = profile, .packet_width = packet_width});
      SCOPED_TRACE(fmt::format("{}, packets of {}", profile, packet_width));
      for (const Coherence coherence : {Coherence::Coherent, Coherence::Incoherent}) {
        const std::vector<SurfaceHit> hits = cast_all(query, rays_, coherence);
        for (std::size_t i = 0; i < rays_.size(); ++i)
          ASSERT_TRUE(is_same(hits[i], expected[i]))
              << test::text(rays_[i]) << ": t " << hits[i].t << " of " << hits[i].object << ", "
              << hits[i].triangle << " and not " << expected[i].t << " of " << expected[i].object
              << ", " << expected[i].triangle;
        if (first_hits.empty()) first_hits = hits;
        ASSERT_TRUE(same_bits(hits, first_hits));
      }
      for (std::size_t i = 0; i < rays_.size(); i += 17)
        ASSERT_TRUE(is_same(test::cast(query, rays_[i]), expected[i])) << test::text(rays_[i]);
      std::vector<std::uint8_t> is_occluded(rays_.size());
      query.occluded(rays_, is_occluded);
      for (std::size_t i = 0; i < rays_.size(); ++i)
        ASSERT_EQ(is_occluded[i] != 0, !expected[i].is_sky()) << test::text(rays_[i]);
    }
  }
}

TEST_F(ObjectRays, MeetTheSameInTilesThatWerePacked) {
  add_rays();
  const RayQuery all(store_, finest_cut(store_), {});
  std::vector<SurfaceSample> expected_surfaces(rays_.size());
  std::vector<SurfaceHit> expected(rays_.size());
  all.intersect(rays_, expected, Coherence::Coherent, expected_surfaces, nullptr,
                SurfaceNeed::Facts);
  const RayQuery small(store_, all.cut(), {.memory_bytes = 2.0 * all.least_memory_bytes()});
  std::vector<SurfaceSample> surfaces(rays_.size());
  std::vector<SurfaceHit> hits(rays_.size());
  for (int round = 0; round < 2; ++round) {
    small.intersect(rays_, hits, Coherence::Coherent, surfaces, nullptr, SurfaceNeed::Facts);
    ASSERT_TRUE(same_bits(hits, expected));
    for (std::size_t i = 0; i < rays_.size(); ++i) {
      if (hits[i].is_sky() || hits[i].is_ground()) continue;
      ASSERT_EQ(surfaces[i].provenance, expected_surfaces[i].provenance);
      ASSERT_EQ(surfaces[i].finish, expected_surfaces[i].finish);
      ASSERT_EQ(surfaces[i].crossing_error, expected_surfaces[i].crossing_error);
    }
  }
  EXPECT_GT(small.stats().num_tiles_unpacked, 0U);
}

}  // namespace
}  // namespace terracast::world
