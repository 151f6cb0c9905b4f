#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <set>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/random.h"
#include "tests/support/brute_terrain.h"
#include "tests/support/test_data.h"
#include "tests/world/mountains.h"
#include "tests/world/rays.h"
#include "world/ray_query.h"

// Rays that come into the tiles from outside, and cuts whose coarsest tiles do not fill a
// rectangle.
namespace terracast::world {
namespace {

using test::cast_all;
using test::is_blocked;
using test::kInfinity;

constexpr int kRootLevel = 1;
constexpr double kRootSide_m = 512.0;
constexpr double kHalfSize_m = 2.0 * kRootSide_m;

TileId root_of(TileId id) {
  while (id.level < kRootLevel) id = id.parent();
  return id;
}

/// 4 x 4 coarsest tiles, two of them split: one beside the ring's hole, one beside the L's notch.
test::TinyWorldOptions four_by_four() {
  test::TinyWorldOptions options;
  options.finest_level = 0;
  options.coarsest_level = kRootLevel;
  options.num_roots = 4;
  options.refine = [](const TileId& id) {
    return id == TileId{kRootLevel, -2, 0} || id == TileId{kRootLevel, 0, -1};
  };
  return options;
}

/// Which of the 4 x 4 coarsest tiles a cut leaves out.
struct CutShape {
  std::string name;
  std::function<bool(const TileId& root)> is_missing;
};

const CutShape kSquare = {"square", [](const TileId&) { return false; }};
const CutShape kL = {"L", [](const TileId& root) { return root.x >= 0 && root.y >= 0; }};
const CutShape kRing = {"ring", [](const TileId& root) {
                          return root.x >= -1 && root.x < 1 && root.y >= -1 && root.y < 1;
                        }};
/// Two squares that touch in the origin.
const CutShape kTwoIslands = {"two islands",
                              [](const TileId& root) { return (root.x >= 0) == (root.y >= 0); }};

/// A side that has no neighbour left is nobody's finer side: the masks are made anew.
std::vector<CutTile> cut_of(const TileStore& store, const CutShape& shape) {
  std::vector<TileId> leaves;
  for (const CutTile& tile : finest_cut(store))
    if (!shape.is_missing(root_of(tile.id))) leaves.push_back(tile.id);
  return with_coarser_sides(leaves);
}

/// What a ray meets in a cut of any shape, without TileMap and Embree: triangles by the full
/// traversal; and the outer sides, which are solid: a ray that comes over one below the ground
/// crosses there, as one that starts under the ground crosses at its start.
class ShapeTruth {
 public:
  ShapeTruth(const TileStore& store, const std::vector<CutTile>& cut) : brute_(store, cut) {
    for (const CutTile& tile : cut) roots_.insert(root_of(tile.id));
  }

  struct Crossing {
    double t = kInfinity;
    std::size_t num_gaps = 0;  ///< that the ray has passed before
    bool is_at_side = false;   ///< or at its start
    bool is_decided = true;    ///< false: it comes in at the very edge of ground and side
  };

  Crossing first_crossing(const WorldRay& ray) const {
    constexpr double kUndecided_m = 1e-6;  // heights err by less than 1e-9 m at coordinates of 4 km
    Crossing crossing{
        .t = brute_.first_crossing(ray.origin_world, ray.direction_world, ray.t_min, ray.t_max)};
    const std::vector<Stretch> parts = stretches(ray);
    for (std::size_t k = 0; k < parts.size() && parts[k].begin < crossing.t; ++k) {
      crossing.num_gaps = k;
      const Eigen::Vector3d point = ray.origin_world + parts[k].begin * ray.direction_world;
      // On the root's side, which it may miss by a rounding.
      const Eigen::Vector2d low = parts[k].root.corner_world();
      const double x = std::clamp(point.x(), low.x(), low.x() + kRootSide_m);
      const double y = std::clamp(point.y(), low.y(), low.y() + kRootSide_m);
      const double above_m = point.z() - brute_.ground_z(x, y);
      if (std::abs(above_m) < kUndecided_m) crossing.is_decided = false;
      if (above_m > 0.0 && crossing.is_decided) continue;
      crossing.t = parts[k].begin;
      crossing.is_at_side = true;
      break;
    }
    return crossing;
  }

  /// Of a ray whose direction has length 1.
  bool is_met(const Crossing& crossing, const WorldRay& ray, const SurfaceHit& hit) const {
    if (!crossing.is_at_side) return test::is_crossing_at(crossing.t, brute_, ray, hit);
    // Where a ray comes over a side, or starts within a rounding of it: eight roundings of 2^-53,
    // of its place and of t, over how fast it goes across.
    const double extent_m = std::max(ray.origin_world.cwiseAbs().maxCoeff(), crossing.t);
    double rate = 1.0;
    for (const int axis : {0, 1})
      if (ray.direction_world[axis] != 0.0)
        rate = std::min(rate, std::abs(ray.direction_world[axis]));
    return std::abs(hit.t - crossing.t) <= 8.0 * 0x1.0p-53 * extent_m / rate &&
           test::is_of_its_triangle(brute_, ray, hit);
  }

  const test::BruteTerrain& brute() const { return brute_; }
  const std::set<TileId>& roots() const { return roots_; }

 private:
  /// A part of a ray over roots that touch, in order.
  struct Stretch {
    double begin, end;
    TileId root;  ///< the first
  };

  std::vector<Stretch> stretches(const WorldRay& ray) const {
    std::vector<Stretch> parts;
    for (const TileId& root : roots_) {
      Stretch part{.begin = ray.t_min, .end = ray.t_max, .root = root};
      for (const int axis : {0, 1}) {
        const double low = root.corner_world()[axis];
        const double high = low + kRootSide_m;
        const double o = ray.origin_world[axis];
        const double d = ray.direction_world[axis];
        if (d == 0.0) {
          if (o < low || o > high) part.end = -kInfinity;
          continue;
        }
        part.begin = std::max(part.begin, std::min((low - o) / d, (high - o) / d));
        part.end = std::min(part.end, std::max((low - o) / d, (high - o) / d));
      }
      if (part.begin <= part.end) parts.push_back(part);
    }
    std::sort(parts.begin(), parts.end(),
              [](const Stretch& a, const Stretch& b) { return a.begin < b.begin; });
    // The side between two roots has the same t for both.
    std::vector<Stretch> joined;
    for (const Stretch& part : parts) {
      if (joined.empty() || part.begin > joined.back().end)
        joined.push_back(part);
      else
        joined.back().end = std::max(joined.back().end, part.end);
    }
    return joined;
  }

  test::BruteTerrain brute_;
  std::set<TileId> roots_;
};

/// Numbers for one ray.
class Draws {
 public:
  explicit Draws(std::uint64_t index) : index_(index) {}
  double between(double low, double high) {
    return core::random_between(low, high, 31, index_, num_draws_++);
  }
  double log_between(double low, double high) {
    return std::exp(between(std::log(low), std::log(high)));
  }
  std::size_t below(std::size_t count) {
    return static_cast<std::size_t>(between(0.0, static_cast<double>(count)));
  }
  Eigen::Vector2d place_in(const TileId& root) {
    return root.corner_world() + kRootSide_m * Eigen::Vector2d(between(0, 1), between(0, 1));
  }

 private:
  std::uint64_t index_;
  std::uint64_t num_draws_ = 0;
};

Eigen::Vector3d at_height(const Eigen::Vector2d& place, double above_m) {
  return {place.x(), place.y(), test::mountain_height_m(place.x(), place.y()) + above_m};
}

class RayCuts : public testing::Test {
 protected:
  RayCuts()
      : store_(test::make_tiny_world(folder_ / "world", test::mountain_height_m, four_by_four())) {
    for (const CutTile& tile : finest_cut(store_)) {
      lowest_z_ = std::min(lowest_z_, store_.find(tile.id)->lowest_z_world);
      highest_z_ = std::max(highest_z_, store_.find(tile.id)->highest_z_world);
    }
  }

  /// A ray of one of six kinds, some of which need gaps.
  WorldRay random_ray(const ShapeTruth& truth, std::uint64_t index) const {
    Draws draws(index);
    std::vector<TileId> present(truth.roots().begin(), truth.roots().end());
    std::vector<TileId> missing;
    for (int y = -2; y < 2; ++y)
      for (int x = -2; x < 2; ++x)
        if (truth.roots().count({kRootLevel, x, y}) == 0) missing.push_back({kRootLevel, x, y});
    const auto place_on = [&](const std::vector<TileId>& roots) {
      return draws.place_in(roots[draws.below(roots.size())]);
    };
    const auto place_outside = [&] {
      const double angle = draws.between(0.0, 2.0 * M_PI);
      return Eigen::Vector2d(draws.between(1500.0, 4000.0) *
                             Eigen::Vector2d(std::cos(angle), std::sin(angle)));
    };
    const auto anywhere = [&] {
      return Eigen::Vector2d(draws.between(-1.0, 1.0) * kHalfSize_m,
                             draws.between(-1.0, 1.0) * kHalfSize_m);
    };
    WorldRay ray;
    const auto aim = [&](const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
      ray.origin_world = from;
      ray.direction_world = (to - from).normalized();
    };
    switch (index % 6) {
      case 0: {  // from outside, above or below the ground
        const Eigen::Vector2d start = place_outside();
        aim({start.x(), start.y(), draws.between(lowest_z_ - 300.0, highest_z_ + 1500.0)},
            at_height(anywhere(), draws.between(-100.0, 300.0)));
        break;
      }
      case 1: {  // over a gap, which lies half way
        Eigen::Vector2d start = place_on(present);
        Eigen::Vector2d to = place_on(present);
        const auto is_gap_half_way = [&] {
          const Eigen::Vector2d middle = (start + to) / 2.0;
          return truth.roots().count(tile_at(kRootLevel, middle.x(), middle.y())) == 0;
        };
        for (int tries = 0; tries < 100 && !is_gap_half_way(); ++tries) {
          start = place_on(present);
          to = place_on(present);
        }
        aim(at_height(start, draws.log_between(5.0, 1000.0)),
            at_height(to, draws.between(-200.0, 100.0)));
        break;
      }
      case 2: {  // out of a gap
        const Eigen::Vector2d start = place_on(missing);
        aim(at_height(start, draws.between(-600.0, 600.0)),
            at_height(place_on(present), draws.between(-100.0, 100.0)));
        break;
      }
      case 3: {  // from below the ground outside
        const Eigen::Vector2d start = place_outside();
        const Eigen::Vector2d to = anywhere();
        aim({start.x(), start.y(), draws.between(lowest_z_ - 500.0, lowest_z_ + 200.0)},
            {to.x(), to.y(), draws.between(lowest_z_ - 500.0, highest_z_)});
        break;
      }
      case 4: {  // exactly along the sides of roots, from inside, outside or a gap
        const int axis = static_cast<int>(draws.below(2));
        Eigen::Vector2d place = Eigen::Vector2d::Zero();
        place[axis] = kRootSide_m * (static_cast<double>(draws.below(5)) - 2.0);
        place[1 - axis] = draws.between(-1.6, 1.6) * kHalfSize_m;
        Eigen::Vector3d direction(0.0, 0.0, draws.between(-0.5, 0.1));
        direction[1 - axis] = draws.between(0.0, 1.0) < 0.5 ? 1.0 : -1.0;
        ray.origin_world = at_height(place, draws.log_between(0.5, 700.0));
        ray.direction_world = direction.normalized();
        break;
      }
      default: {  // past the corners of roots, by a micrometre to a centimetre: decided in double
        const auto corner = [&] {
          return kRootSide_m * (static_cast<double>(draws.below(5)) - 2.0) +
                 draws.log_between(1e-6, 1e-2) * (draws.between(0.0, 1.0) < 0.5 ? 1.0 : -1.0);
        };
        const Eigen::Vector2d place(corner(), corner());
        aim(at_height(anywhere(), draws.log_between(1.0, 1500.0)),
            at_height(place, draws.between(-20.0, 50.0)));
        break;
      }
    }
    return ray;
  }

  test::ScratchFolder folder_;
  TileStore store_;
  double lowest_z_ = kInfinity;
  double highest_z_ = -kInfinity;
};

TEST_F(RayCuts, SidesWithoutANeighbourHaveNoCoarserOne) {
  const auto mask = [&](const CutShape& shape, const TileId& id) {
    for (const CutTile& tile : cut_of(store_, shape))
      if (tile.id == id) return static_cast<int>(tile.coarser_sides);
    return -1;
  };
  // Of the finer tiles beside the hole, and beside the notch.
  EXPECT_EQ(mask(kSquare, {0, -3, 1}), kEast | kNorth);
  EXPECT_EQ(mask(kRing, {0, -3, 1}), kNorth);
  EXPECT_EQ(mask(kRing, {0, -3, 0}), kSouth);
  EXPECT_EQ(mask(kSquare, {0, 1, -1}), kEast | kNorth);
  EXPECT_EQ(mask(kL, {0, 1, -1}), kEast);
  EXPECT_EQ(mask(kTwoIslands, {0, 0, -1}), 0);
}

TEST_F(RayCuts, AnyShapeOfCoarsestTilesEqualsAFullTraversal) {
  constexpr std::size_t kNumRays = 18'000;
  for (const CutShape& shape : {kL, kRing, kTwoIslands}) {
    const RayQuery query(store_, cut_of(store_, shape), {});
    const ShapeTruth truth(store_, query.cut());
    std::vector<WorldRay> rays;
    for (std::size_t i = 0; i < kNumRays; ++i) rays.push_back(random_ray(truth, i));
    const std::vector<SurfaceHit> hits = cast_all(query, rays);
    std::size_t num_undecided = 0;
    std::size_t num_at_sides = 0;
    std::size_t num_after_gaps = 0;
    std::size_t num_different = 0;
    std::string first_difference;
    for (std::size_t i = 0; i < kNumRays; ++i) {
      const ShapeTruth::Crossing crossing = truth.first_crossing(rays[i]);
      if (!crossing.is_decided) {
        ++num_undecided;
        continue;
      }
      num_at_sides += crossing.is_at_side ? 1 : 0;
      num_after_gaps += crossing.t < kInfinity && crossing.num_gaps > 0 ? 1 : 0;
      if (truth.is_met(crossing, rays[i], hits[i])) continue;
      if (num_different++ == 0)
        first_difference =
            fmt::format("ray {}: t {} where the truth is {}{}; {}", i, hits[i].t, crossing.t,
                        crossing.is_at_side ? ", at a side" : "", test::text(rays[i]));
    }
    fmt::print("{}: {} rays, {} cross at a side, {} beyond a gap, {} undecided, {} differ\n",
               shape.name, kNumRays, num_at_sides, num_after_gaps, num_undecided, num_different);
    EXPECT_EQ(num_different, 0U) << shape.name << ", " << first_difference;
    EXPECT_GT(num_at_sides, kNumRays / 20) << shape.name;
    EXPECT_GT(num_after_gaps, kNumRays / 100) << shape.name;
    EXPECT_LT(num_undecided, kNumRays / 1000) << shape.name;
  }
}

// The place where a ray starts, rounded, can lie outside although the ray is past the side by then,
// or inside although it is not: neither may lose it.
TEST_F(RayCuts, RaysThatStartWithinARoundingOfAnOpenSideMeetTheGround) {
  struct OpenSide {
    TileId root;
    int axis;
    bool is_high;  ///< the root's eastern or northern side
  };
  for (const CutShape& shape : {kSquare, kRing}) {
    const RayQuery query(store_, cut_of(store_, shape), {});
    const ShapeTruth truth(store_, query.cut());
    std::vector<OpenSide> sides;
    for (const TileId& root : truth.roots())
      for (const int axis : {0, 1})
        for (const bool is_high : {false, true}) {
          const int step = is_high ? 1 : -1;
          const TileId beside = root.neighbour(axis == 0 ? step : 0, axis == 1 ? step : 0);
          if (truth.roots().count(beside) == 0) sides.push_back({root, axis, is_high});
        }
    double highest_z = -kInfinity;
    for (const CutTile& tile : query.cut())
      highest_z = std::max(highest_z, store_.find(tile.id)->highest_z_world);
    std::size_t num_hits = 0;
    std::size_t num_outside = 0;
    constexpr std::size_t kNumRays = 8000;
    for (std::size_t i = 0; i < kNumRays; ++i) {
      Draws draws(i);
      const OpenSide& side = sides[i % sides.size()];
      const double inward = side.is_high ? -1.0 : 1.0;
      Eigen::Vector2d place = draws.place_in(side.root);
      const double border = side.root.corner_world()[side.axis] + (side.is_high ? kRootSide_m : 0);
      place[side.axis] = border;
      Eigen::Vector3d start(place.x(), place.y(), 0.0);
      const double ground_z = truth.brute().ground_z(place.x(), place.y());
      // One in eight starts under the ground.
      const double sign = draws.below(8) < 7 ? 1.0 : -1.0;
      start.z() = ground_z + sign * draws.log_between(0.5, 300.0);
      Eigen::Vector3d direction(0.0, 0.0, draws.between(-0.8, -0.05));
      direction[side.axis] = inward * draws.between(0.1, 1.0);
      direction[1 - side.axis] = draws.between(-1.0, 1.0);
      direction.normalize();
      WorldRay ray{.origin_world = start, .direction_world = direction};
      const double length_m = draws.log_between(1.0, 5000.0);
      const std::size_t kind = draws.below(4);
      if (kind == 0) {  // one step of a double before the side
        ray.origin_world[side.axis] = std::nextafter(border, border - inward * kHalfSize_m);
      } else if (kind == 1) {  // exactly on it
        ASSERT_EQ(ray.origin_world[side.axis], border);
      } else if (kind == 2) {  // there at t_min
        ray.origin_world = start - length_m * direction;
        ray.t_min = length_m;
      } else {
        // There where falling rays are put into their first tile: 1 m above the highest point of
        // all, or at other heights.
        start.z() = highest_z + 0.25 * static_cast<double>(draws.below(8));
        ray.origin_world = start - length_m * direction;
      }
      const Eigen::Vector3d first = ray.origin_world + ray.t_min * direction;
      num_outside += inward * (first[side.axis] - border) < 0.0 ? 1 : 0;

      const ShapeTruth::Crossing crossing = truth.first_crossing(ray);
      if (!crossing.is_decided) continue;
      const SurfaceHit hit = test::cast(query, ray);
      EXPECT_TRUE(truth.is_met(crossing, ray, hit))
          << shape.name << ", kind " << kind << ": t " << hit.t << " where the truth is "
          << crossing.t << "; " << test::text(ray);
      EXPECT_EQ(is_blocked(query, ray), !std::isinf(crossing.t)) << test::text(ray);
      num_hits += hit.is_sky() ? 0 : 1;
    }
    EXPECT_GT(num_hits, kNumRays / 4) << shape.name;
    EXPECT_GT(num_outside, kNumRays / 8) << shape.name;
  }
}

TEST_F(RayCuts, AHoleWithinACoarsestTileIsAnError) {
  std::vector<TileId> leaves;
  for (const CutTile& tile : finest_cut(store_))
    if (tile.id != TileId{0, -3, 0}) leaves.push_back(tile.id);
  try {
    const RayQuery query(store_, with_coarser_sides(leaves), {});
    ADD_FAILURE() << "no error";
  } catch (const core::Error& error) {
    EXPECT_EQ(error.kind(), core::ErrorKind::Input);
  }
}

TEST(RaySides, OfTheWorldAreSolid) {
  constexpr double kGround_m = 100.0;
  const test::ScratchFolder folder;
  const TileStore store =
      test::make_tiny_world(folder / "world", [](double, double) { return kGround_m; });
  const RayQuery query(store, finest_cut(store), {});
  for (const int axis : {0, 1})
    for (const double outward : {-1.0, 1.0})
      for (const double along_m : {-700.3, 0.0, 12.0, 1000.0})  // 0: between two coarsest tiles
        for (const double rise : {-2.0, -0.5, 0.0, 0.5, 2.0})
          for (const double aside : {0.0, 0.3})
            for (const double distance_m : {1e-3, 10.0, 3000.0})
              for (const double height_m : {-8000.0, -50.0, 99.999, 100.001}) {
                Eigen::Vector3d side(0.0, 0.0, height_m);
                side[axis] = 1024.0 * outward;
                side[1 - axis] = along_m;
                Eigen::Vector3d direction(0.0, 0.0, rise);
                direction[axis] = -outward;
                direction[1 - axis] = aside;
                const WorldRay ray{.origin_world = side - distance_m * direction,
                                   .direction_world = direction};
                const SurfaceHit hit = test::cast(query, ray);
                const bool is_over = height_m > kGround_m;
                EXPECT_EQ(is_blocked(query, ray), !hit.is_sky()) << test::text(ray);
                if (is_over && rise >= 0.0) {
                  EXPECT_TRUE(hit.is_sky()) << test::text(ray);
                  continue;
                }
                // Starts are rounded, by 5e-13 m at 6 km; over the ground t errs by that over the
                // rise, 0.5 at least, and by a few roundings of 6 km more.
                const double beyond_m = is_over ? (height_m - kGround_m) / -rise : 0.0;
                EXPECT_NEAR(hit.t, distance_m + beyond_m, is_over ? 4e-12 : 1e-12)
                    << test::text(ray);
              }
}

}  // namespace
}  // namespace terracast::world
