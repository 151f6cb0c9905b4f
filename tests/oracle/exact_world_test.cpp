#include "validate/oracle/exact_world.h"

#include <gmock/gmock.h>
#include <gmpxx.h>
#include <gtest/gtest.h>
#include <xmmintrin.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/parallel.h"
#include "core/random.h"
#include "tests/oracle/nothing_stands.h"
#include "tests/support/brute_terrain.h"
#include "tests/support/test_data.h"
#include "tests/support/tiny_world.h"
#include "validate/oracle/geometry_rules.h"
#include "world/lod.h"

namespace terracast::oracle {
namespace {

namespace fs = std::filesystem;
using test::nothing_stands;
using test::ScratchFolder;
using testing::HasSubstr;

constexpr std::uint64_t kSeed = 20260114;

mpq_class dot(const Eigen::Vector3d& n, const std::array<mpq_class, 3>& v) {
  return mpq_class(n.x()) * v[0] + mpq_class(n.y()) * v[1] + mpq_class(n.z()) * v[2];
}
std::array<mpq_class, 3> minus(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  std::array<mpq_class, 3> difference;
  for (int k = 0; k < 3; ++k)
    difference[static_cast<std::size_t>(k)] = mpq_class(a[k]) - mpq_class(b[k]);
  return difference;
}

/// Where a ray crosses the plane n x = c, exactly.
mpq_class crossing(const ExactRay& ray, const Eigen::Vector3d& normal, double c) {
  const Eigen::Vector3d zero = Eigen::Vector3d::Zero();
  return (mpq_class(c) - dot(normal, minus(ray.origin_world, zero))) /
         dot(normal, minus(ray.through_world, ray.origin_world));
}

double random(std::uint64_t index, double lowest, double highest, std::uint64_t stream = 1) {
  return core::random_between(lowest, highest, kSeed, stream, index);
}

std::vector<TileKey> keys_of(const std::vector<world::CutTile>& cut) {
  std::vector<TileKey> keys;
  for (const auto& tile : cut) keys.push_back({tile.id.level, tile.id.x, tile.id.y});
  return keys;
}

/// Levels 0, 1 and 2 side by side: 512 m of the finest around the origin.
test::TinyWorldOptions stepped_levels() {
  test::TinyWorldOptions options;
  options.refine = [](const world::TileId& id) {
    return (id.level == 2 && id.x == -1 && id.y == -1) ||
           (id.level == 1 && id.x == -1 && id.y == -1);
  };
  return options;
}

double rough_m(double x, double y) {
  return 90.0 + 30.0 * std::sin(x * 0.021) * std::cos(y * 0.017) +
         6.0 * std::sin(x * 0.31 + y * 0.17) + 2.5 * std::cos(x * 0.9 - y * 1.1);
}

/// A world of a height function with a cut of three levels.
struct Stepped {
  explicit Stepped(const fs::path& folder, const test::HeightFunction& height_m = rough_m)
      : store(test::make_tiny_world(folder, height_m, stepped_levels())),
        cut(world::finest_cut(store)),
        world(folder),
        keys(keys_of(cut)) {}
  world::TileStore store;
  std::vector<world::CutTile> cut;
  WorldFolder world;
  std::vector<TileKey> keys;
};

TEST(ExactWorld, APlaneIsWhereItsEquationPutsItToTheLastBit) {
  const ScratchFolder scratch;
  // Slopes and offset that lie on the lattice of heights at every sample.
  const Stepped scene(scratch.path(),
                      [](double x, double y) { return 100.0 + 0.25 * x - 0.5 * y; });
  const ExactWorld terrain(scene.world, scene.keys, nothing_stands);
  const Eigen::Vector3d normal(-0.25, 0.5, 1.0);
  for (std::uint64_t i = 0; i < 500; ++i) {
    const Eigen::Vector2d from(random(7 * i, -700, 700), random(7 * i + 1, -700, 700));
    const Eigen::Vector2d to(random(7 * i + 2, -900, 900), random(7 * i + 3, -900, 900));
    const ExactRay ray{
        {from.x(), from.y(),
         100.0 + 0.25 * from.x() - 0.5 * from.y() + random(7 * i + 4, 0.01, 300)},
        {to.x(), to.y(), 100.0 + 0.25 * to.x() - 0.5 * to.y() - random(7 * i + 5, 0.01, 50)}};
    const auto hit = terrain.first_hit(ray);
    ASSERT_TRUE(hit) << i;
    EXPECT_EQ(hit->t, crossing(ray, normal, 100.0).get_d()) << i;
    EXPECT_NEAR((hit->normal_world - normal.normalized()).norm(), 0.0, 1e-15);
    const std::array<double, 3> weights =
        hit->weights_at(hit->point_world.x(), hit->point_world.y());
    for (const double weight : weights) EXPECT_GE(weight, -1e-9);
  }
  EXPECT_FALSE(terrain.first_hit({{0, 0, 500}, {100, 50, 501}}));
  // Away from the ground, and short of it.
  EXPECT_FALSE(terrain.first_hit({{0, 0, 200}, {0, 0, 201}}));
  EXPECT_FALSE(terrain.first_hit({{0, 0, 200}, {0, 0, 101}}, 1.0));
  EXPECT_TRUE(terrain.first_hit({{0, 0, 200}, {0, 0, 100}}, 1.0));
}

TEST(ExactWorld, AWedgeHidesWhatLiesBehindItsRidge) {
  const ScratchFolder scratch;
  const Stepped scene(scratch.path(), [](double x, double) { return 64.0 - 0.5 * std::abs(x); });
  const ExactWorld terrain(scene.world, scene.keys, nothing_stands);
  const Eigen::Vector3d east(0.5, 0.0, 1.0), west(-0.5, 0.0, 1.0);
  int num_hidden = 0;
  for (std::uint64_t i = 0; i < 500; ++i) {
    // From the west towards a point of the eastern face: over the ridge, or into the western face.
    const double x = random(5 * i, 1, 500, 2);
    const Eigen::Vector3d point(x, random(5 * i + 1, -700, 700, 2), 64.0 - 0.5 * x);
    const double eye_x = random(5 * i + 2, -700, -1, 2);
    const Eigen::Vector3d eye(eye_x, random(5 * i + 3, -700, 700, 2),
                              64.0 + 0.5 * eye_x + random(5 * i + 4, 0.1, 800, 2));
    const ExactRay ray{eye, point};
    const auto hit = terrain.first_hit(ray);
    // Which face is met first is a matter of the height at which the ray passes the ridge.
    const mpq_class at_ridge = crossing(ray, {1.0, 0.0, 0.0}, 0.0);
    const mpq_class height =
        mpq_class(eye.z()) + at_ridge * (mpq_class(point.z()) - mpq_class(eye.z()));
    const bool is_hidden = height < 64;
    num_hidden += is_hidden ? 1 : 0;
    if (!is_hidden && !hit)
      continue;  // the point is rounded, and the ray all but parallel to its face
    ASSERT_TRUE(hit) << i;
    EXPECT_EQ(hit->t, crossing(ray, is_hidden ? west : east, 64.0).get_d()) << i;
  }
  EXPECT_GT(num_hidden, 100);
  EXPECT_LT(num_hidden, 400);
}

/// Every triangle whose box the ray's shadow may touch, in rational arithmetic, with the stitching of
/// tests/support/brute_terrain.h.
class EveryTriangle {
 public:
  explicit EveryTriangle(const Stepped& scene)
      : terrain_(scene.store, scene.cut), cut_(scene.cut) {}

  std::optional<mpq_class> first_crossing(const ExactRay& ray) const {
    std::optional<mpq_class> best;
    const Eigen::Vector3d d = ray.through_world - ray.origin_world;
    for (std::size_t tile = 0; tile < cut_.size(); ++tile) {
      const double s = cut_[tile].id.spacing_m();
      const Eigen::Vector2d corner = cut_[tile].id.corner_world();
      for (int j = 0; j < world::kTileCells; ++j)
        for (int i = 0; i < world::kTileCells; ++i) {
          // A cell farther from the ray's shadow than its half diagonal is not met.
          const Eigen::Vector2d centre = corner + s * Eigen::Vector2d(i + 0.5, j + 0.5);
          const double length = d.head<2>().norm();
          const double off = d.x() * (centre.y() - ray.origin_world.y()) -
                             d.y() * (centre.x() - ray.origin_world.x());
          const double near =
              length > 0.0 ? std::abs(off) / length : (centre - ray.origin_world.head<2>()).norm();
          if (near > 0.7072 * s + 0.01) continue;
          for (const bool is_upper : {false, true})
            cross(terrain_.triangle(tile, i, j, is_upper), ray, best);
        }
    }
    return best;
  }

 private:
  static mpq_class volume(const std::array<mpq_class, 3>& a, const std::array<mpq_class, 3>& b,
                          const std::array<mpq_class, 3>& c) {
    return a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) +
           a[2] * (b[0] * c[1] - b[1] * c[0]);
  }

  static void cross(const std::array<Eigen::Vector3d, 3>& corners, const ExactRay& ray,
                    std::optional<mpq_class>& best) {
    const auto d = minus(ray.through_world, ray.origin_world);
    const auto a = minus(corners[0], ray.origin_world);
    const auto b = minus(corners[1], ray.origin_world);
    const auto c = minus(corners[2], ray.origin_world);
    const mpq_class u = volume(d, b, c), v = volume(d, c, a), w = volume(d, a, b);
    const mpq_class sum = u + v + w;
    if (sum == 0) return;  // in the plane of the triangle, or beside it
    if (sgn(u) * sgn(sum) < 0 || sgn(v) * sgn(sum) < 0 || sgn(w) * sgn(sum) < 0) return;
    const mpq_class t = volume(a, b, c) / sum;
    if (t >= 0 && (!best || t < *best)) best = t;
  }

  test::BruteTerrain terrain_;
  std::vector<world::CutTile> cut_;
};

/// A ray that ends at or below the ground, from 5 to 60 m above it.
ExactRay low_ray(std::uint64_t i) {
  const Eigen::Vector2d from(random(6 * i, -900, 400, 3), random(6 * i + 1, -900, 400, 3));
  const double angle = random(6 * i + 2, 0.0, 6.2832, 3);
  const double reach = random(6 * i + 3, 20.0, 600.0, 3);
  const Eigen::Vector2d to = from + reach * Eigen::Vector2d(std::cos(angle), std::sin(angle));
  return {{from.x(), from.y(), rough_m(from.x(), from.y()) + random(6 * i + 4, 5.0, 60.0, 3)},
          {to.x(), to.y(), rough_m(to.x(), to.y()) + random(6 * i + 5, -20.0, 10.0, 3)}};
}

TEST(ExactWorld, FindsWhatEveryTriangleInRationalNumbersFinds) {
  const ScratchFolder scratch;
  const Stepped scene(scratch.path());
  const ExactWorld terrain(scene.world, scene.keys, nothing_stands);
  const EveryTriangle every(scene);
  constexpr std::uint64_t kRays = 80;
  std::vector<int> outcomes(kRays);
  core::parallel_for(kRays, [&](std::int64_t i) {
    const ExactRay ray = low_ray(static_cast<std::uint64_t>(i));
    const auto hit = terrain.first_hit(ray);
    const auto truth = every.first_crossing(ray);
    ASSERT_EQ(hit.has_value(), truth.has_value()) << i;
    if (hit) {
      EXPECT_EQ(hit->t, truth->get_d()) << i;
    }
    outcomes[static_cast<std::size_t>(i)] = hit ? 1 : 0;
  });
  EXPECT_GT(std::count(outcomes.begin(), outcomes.end(), 1), 40);
}

/// Samples on the borders of the cut's tiles, those included that a coarser neighbour has not.
std::vector<Eigen::Vector3d> border_samples(const Stepped& scene, const ExactWorld& terrain) {
  std::vector<Eigen::Vector3d> samples;
  for (const TileKey& key : scene.keys) {
    const auto surface = terrain.surface(key);
    for (const int k : {0, 1, 2, 77, 128, 255, 256})
      for (const auto& [i, j] :
           {std::pair(0, k), std::pair(256, k), std::pair(k, 0), std::pair(k, 256)})
        samples.push_back(surface->vertex_world(i, j));
  }
  return samples;
}

TEST(ExactWorld, RaysAtBordersCornersAndJunctionsAlwaysHit) {
  const ScratchFolder scratch;
  const Stepped scene(scratch.path());
  const ExactWorld terrain(scene.world, scene.keys, nothing_stands);
  const auto num_changes = std::count_if(scene.cut.begin(), scene.cut.end(),
                                         [](const auto& tile) { return tile.coarser_sides != 0; });
  ASSERT_GE(num_changes, 4) << "levels must change side by side";
  const std::vector<Eigen::Vector3d> samples = border_samples(scene, terrain);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const Eigen::Vector3d& sample = samples[i];
    // Straight down, within the planes of the borders, and from aside: at the very sample.
    for (const Eigen::Vector3d& up :
         {Eigen::Vector3d(0, 0, 64), Eigen::Vector3d(16, 0, 128), Eigen::Vector3d(0, -16, 128),
          Eigen::Vector3d(random(2 * i, -9, 9, 4), random(2 * i + 1, -9, 9, 4), 100.0)}) {
      const ExactRay ray{sample + up, sample};
      const auto hit = terrain.first_hit(ray, 1.0);
      ASSERT_TRUE(hit) << "sample " << i << ", from " << up.transpose();
    }
  }
  // Between samples of a border: through points of its edges that are exact in binary.
  for (const TileKey& key : scene.keys) {
    const auto surface = terrain.surface(key);
    for (int k = 0; k < 256; k += 17) {
      const Eigen::Vector3d a = surface->vertex_world(0, k), b = surface->vertex_world(0, k + 1);
      const Eigen::Vector3d middle = 0.5 * (a + b);
      EXPECT_TRUE(terrain.first_hit({middle + Eigen::Vector3d(0, 0, 32), middle}, 1.0));
      EXPECT_TRUE(terrain.first_hit({middle + Eigen::Vector3d(0, 1, 32), middle}, 1.0));
    }
  }
}

TEST(ExactWorld, StitchesByTheWrittenRule) {
  const ScratchFolder scratch;
  const Stepped scene(scratch.path());
  const ExactWorld terrain(scene.world, scene.keys, nothing_stands);
  for (const world::CutTile& tile : scene.cut) {
    const auto levels = terrain.neighbour_levels({tile.id.level, tile.id.x, tile.id.y});
    for (std::size_t side = 0; side < 4; ++side)
      EXPECT_EQ(levels[side] > 0, ((tile.coarser_sides >> side) & 1) != 0) << tile.id.name();
    // Both tiles at a border have one line there: every sample of the finer one lies on an edge of
    // the coarser one.
    if (levels[1] <= 0) continue;
    const auto fine = terrain.surface({tile.id.level, tile.id.x, tile.id.y});
    const world::TileId beside = tile.id.neighbour(1, 0).parent();
    const auto coarse = terrain.surface({beside.level, beside.x, beside.y});
    const int first = tile.id.y % 2 != 0 ? 128 : 0;
    for (int k = 0; k < 256; ++k) {
      const double z = fine->vertex_world(256, k).z();
      const double low = coarse->vertex_world(0, first + k / 2).z();
      const double high = coarse->vertex_world(0, first + (k + 1) / 2).z();
      EXPECT_EQ(z, 0.5 * (low + high)) << tile.id.name() << " " << k;
    }
  }
}

TEST(ExactWorld, ResultsDoNotDependOnThreadsMemoryOrTheFloatingMode) {
  const ScratchFolder scratch;
  const Stepped scene(scratch.path());
  const ExactWorld roomy(scene.world, scene.keys, nothing_stands);
  const ExactWorld narrow(scene.world, scene.keys, nothing_stands, Viewers::AboveWater, 1);
  std::vector<TileKey> backwards(scene.keys.rbegin(), scene.keys.rend());
  const ExactWorld turned(scene.world, backwards, nothing_stands);
  constexpr std::int64_t kRays = 200;
  std::vector<std::optional<ExactHit>> hits(kRays);
  for (std::int64_t i = 0; i < kRays; ++i)
    hits[static_cast<std::size_t>(i)] = roomy.first_hit(low_ray(static_cast<std::uint64_t>(i)));
  core::parallel_for(kRays, [&](std::int64_t i) {
    const unsigned mode = _mm_getcsr();
    constexpr unsigned kDenormalsAreZero = 0x8040;
    _mm_setcsr(mode | kDenormalsAreZero);
    const ExactRay ray = low_ray(static_cast<std::uint64_t>(i));
    const auto& hit = hits[static_cast<std::size_t>(i)];
    for (const ExactWorld* terrain : {&narrow, &turned}) {
      const auto other = terrain->first_hit(ray);
      ASSERT_EQ(hit.has_value(), other.has_value());
      if (!hit) continue;
      EXPECT_EQ(hit->t, other->t);
      EXPECT_EQ(hit->point_world, other->point_world);
    }
    EXPECT_EQ(_mm_getcsr() & ~0x3fU, (mode | kDenormalsAreZero) & ~0x3fU);
    _mm_setcsr(mode);
  });
  // A tile of heights, and no more than one of trees beside.
  EXPECT_LT(narrow.stats().peak_bytes, std::size_t{1} << 26);
  EXPECT_GT(narrow.stats().num_tiles_read, roomy.stats().num_tiles_read);
}

TEST(ExactWorld, GroundsAreThoseOfTheTrianglesCorners) {
  const ScratchFolder scratch;
  test::TinyWorldOptions options;
  options.cover = [](double x, double) { return x < 0.0 ? world::Cover::Sea : world::Cover::Land; };
  const world::TileStore store = test::make_tiny_world(
      scratch.path(), [](double, double) { return 3.0; }, options);
  const ExactWorld terrain(WorldFolder(scratch.path()), keys_of(world::finest_cut(store)),
                           nothing_stands);
  const auto grounds = [&](double x) {
    return terrain.first_hit({{x, 1.0, 50.0}, {x, 1.0, 3.0}})->grounds;
  };
  EXPECT_THAT(grounds(-9.0), testing::Each(Ground::Sea));
  EXPECT_THAT(grounds(9.0), testing::Each(Ground::Land));
  EXPECT_THAT(grounds(-1.0), testing::Contains(Ground::Sea));
  EXPECT_THAT(grounds(-1.0), testing::Contains(Ground::Land));
}

template <class Work>
std::string input_error(const Work& work) {
  try {
    work();
  } catch (const core::Error& error) {
    EXPECT_EQ(error.kind(), core::ErrorKind::Input) << error.what();
    return error.what();
  }
  ADD_FAILURE() << "no error";
  return "";
}

TEST(ExactWorld, ADamagedTileIsAnError) {
  const ScratchFolder scratch;
  const Stepped scene(scratch.path());
  const TileKey key = scene.keys.front();
  const fs::path file = world::tile_path(scratch.path(), {key.level, key.x, key.y});
  std::vector<std::byte> bytes = core::read_file(file);
  bytes[bytes.size() / 2] ^= std::byte{1};
  core::write_file(file, bytes);
  const ExactWorld terrain(scene.world, scene.keys, nothing_stands);
  EXPECT_THAT(input_error([&] { terrain.surface(key); }), HasSubstr(file.string()));
  EXPECT_THAT(input_error([&] {
                ExactWorld(scene.world, std::vector<TileKey>{{0, 77, 77}}, nothing_stands);
              }),
              HasSubstr("0/77/77"));
}

class GeometryRules : public testing::Test {
 protected:
  GeometryRules() : scene_(scratch_.path()) {
    geometry_ = {.cell_px = 1.0, .finest_spacing_m = 1.0, .tiles = {}};
    for (const TileKey& key : scene_.keys) geometry_.tiles.push_back(shown(key));
  }
  ShownTile shown(const TileKey& key) const {
    return {key, scene_.store.find({key.level, key.x, key.y})->content_hash};
  }
  void remove(const TileKey& key) {
    ASSERT_EQ(std::erase_if(geometry_.tiles, [&](const auto& tile) { return tile.key == key; }), 1U)
        << key.name();
  }
  RuleFaults faults(std::span<const Eye> eyes = {}) const {
    return find_rule_faults(geometry_, scene_.world, eyes);
  }

  ScratchFolder scratch_;
  Stepped scene_;
  ShownGeometry geometry_;
};

TEST_F(GeometryRules, TheCutOfARendererHasNoFault) {
  EXPECT_EQ(faults().count, 0) << faults().first;
  EXPECT_TRUE(faults().can_be_measured);
}

TEST_F(GeometryRules, EachKindOfFaultIsFoundAndNamed) {
  const ShownGeometry right = geometry_;
  const TileKey fine{0, -2, -2}, above = fine.parent();
  const auto expect_fault = [&](const char* words, bool can_be_measured) {
    const RuleFaults found = faults();
    EXPECT_GE(found.count, 1) << words;
    EXPECT_THAT(found.first, HasSubstr(words));
    EXPECT_EQ(found.can_be_measured, can_be_measured) << words;
    geometry_ = right;
  };
  remove(fine);
  expect_fault("no tile covers 0/-2/-2", true);
  geometry_.tiles.push_back(shown(fine));
  expect_fault("named twice", true);
  geometry_.tiles.push_back(shown(above));
  expect_fault("lies within tile", true);
  geometry_.tiles.front().content_hash = std::string(32, '0');
  expect_fault("the world's holds", false);
  geometry_.tiles.push_back({{0, 70, 0}, std::string(32, '0')});
  expect_fault("is not in the world", false);
  remove({1, -2, -1});
  expect_fault("no tile covers 1/-2/-1", true);
}

TEST_F(GeometryRules, TilesThatDifferByTwoLevelsAreFound) {
  // The tile north-east of the origin is split twice at its corner, its neighbours are not.
  test::TinyWorldOptions options;
  options.refine = [](const world::TileId& id) { return id.x == 0 && id.y == 0; };
  const fs::path folder = scratch_ / "other";
  const world::TileStore store = test::make_tiny_world(folder, rough_m, options);
  const auto add = [&](const TileKey& key) {
    geometry_.tiles.push_back({key, store.find({key.level, key.x, key.y})->content_hash});
  };
  geometry_.tiles.clear();
  for (const TileKey& root : {TileKey{2, -1, -1}, TileKey{2, 0, -1}, TileKey{2, -1, 0}}) add(root);
  for (const int quadrant : {1, 2, 3}) add(TileKey{2, 0, 0}.child(quadrant));
  for (int quadrant = 0; quadrant < 4; ++quadrant) add(TileKey{1, 0, 0}.child(quadrant));
  const RuleFaults found = find_rule_faults(geometry_, WorldFolder(folder), {});
  EXPECT_EQ(found.count, 4) << "two tiles at each of the sides west and south: " << found.first;
  EXPECT_THAT(found.first, HasSubstr("differ by 2 levels"));
}

TEST_F(GeometryRules, ATileTooCoarseForAnEyeIsFound) {
  const world::TileInfo& coarse = *scene_.store.find({2, 0, 0});
  // Cells of 4 m, one pixel each: at 4 m for each pixel of a radian the rule is just kept.
  const Eigen::Vector3d above(512.0, 512.0, coarse.highest_z_world + 400.0);
  const auto at = [&](double pixels_per_radian) {
    return std::vector<Eye>{{above, pixels_per_radian, "the eye"}};
  };
  EXPECT_EQ(faults(at(100.0)).count, 0) << faults(at(100.0)).first;
  EXPECT_GE(faults(at(100.01)).count, 1);
  EXPECT_THAT(faults(at(100.01)).first, HasSubstr("2/0/0"));
  geometry_.finest_spacing_m = 4.0;  // nothing may be split
  EXPECT_EQ(faults(at(1e4)).count, 0);
}

TEST(ShownGeometryFile, DamageIsRefused) {
  const ScratchFolder scratch;
  const std::string right =
      R"({"format": "terracast-geometry", "version": 1, "cell_px": 2.0, "finest_spacing_m": 1.0,)"
      R"( "tiles": ["2/-1/0 00112233445566778899aabbccddeeff"]})";
  const auto read = [&](const std::string& from, const std::string& to) {
    std::string text = right;
    const auto at = text.find(from);
    EXPECT_NE(at, std::string::npos);
    core::write_file(scratch / "g.json", text.replace(at, from.size(), to));
    return read_shown_geometry(scratch / "g.json", "g.json");
  };
  const ShownGeometry geometry = read("2.0", "2.5");
  EXPECT_EQ(geometry.cell_px, 2.5);
  ASSERT_EQ(geometry.tiles.size(), 1U);
  EXPECT_EQ(geometry.tiles[0].key, (TileKey{2, -1, 0}));
  for (const auto& [from, to] : std::vector<std::pair<std::string, std::string>>{
           {"terracast-geometry", "geometry"},
           {"\"version\": 1", "\"version\": 2"},
           {"2.0", "0.0"},
           {"2/-1/0", "2/-1"},
           {"2/-1/0", "99/0/0"},
           {"2/-1/0", "2/-1/99999999999"},
           {"2/-1/0 ", "2/-1/0"},
           {"eeff", "eef"},
           {"eeff", "eefF"},
           {"}", ""},
           {"\"2/-1/0 00112233445566778899aabbccddeeff\"", ""},
           {"[\"", "[7, \""}})
    EXPECT_THAT(input_error([&] { read(from, to); }), HasSubstr("g.json")) << from << " -> " << to;
}

}  // namespace
}  // namespace terracast::oracle
