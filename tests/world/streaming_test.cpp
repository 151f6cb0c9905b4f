#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <span>
#include <vector>

#include "core/error.h"
#include "core/parallel.h"
#include "tests/support/test_data.h"
#include "tests/support/tiny_world.h"
#include "tests/world/rays.h"
#include "world/embree_scene.h"
#include "world/packed_tile.h"
#include "world/ray_query.h"

// A view of a world whose tiles do not all fit in memory.
namespace terracast::world {
namespace {

using test::same_bits;

double hills_m(double x, double y) {
  return 40.0 * std::sin(x * 0.011) * std::cos(y * 0.013) + 3.0 * std::sin(0.09 * x + 0.07 * y);
}

/// What a view comes to: hits of its pixels' rays, and whether the sun shines there.
struct Seen {
  std::vector<SurfaceHit> hits;
  std::vector<std::uint8_t> is_dark;
};

class Streaming : public testing::Test {
 protected:
  static constexpr int kNumRoots = 8;  // 64 tiles of 256 m
  static constexpr int kColumns = 96;
  static constexpr int kRows = 48;
  static constexpr int kUnit = 8;

  static test::TinyWorldOptions options() {
    test::TinyWorldOptions options;
    options.coarsest_level = 0;
    options.num_roots = kNumRoots;
    return options;
  }

  /// All round from the middle of the world, in units of squares of pixels, row by row.
  static Seen look(const RayQuery& query) {
    const Eigen::Vector3d eye(10.0, 20.0, 160.0);
    Seen seen{.hits = std::vector<SurfaceHit>(std::size_t{kColumns} * kRows),
              .is_dark = std::vector<std::uint8_t>(std::size_t{kColumns} * kRows)};
    query.run_units((kColumns / kUnit) * (kRows / kUnit), [&](std::int64_t unit) {
      const int column = static_cast<int>(unit) % (kColumns / kUnit) * kUnit;
      const int row = static_cast<int>(unit) / (kColumns / kUnit) * kUnit;
      std::vector<WorldRay> rays;
      std::vector<std::size_t> pixels;
      for (int y = row; y < row + kUnit; ++y)
        for (int x = column; x < column + kUnit; ++x) {
          const double azimuth = 2.0 * M_PI * x / kColumns;
          const double dip = 0.02 + 0.8 * y / kRows;
          rays.push_back({.origin_world = eye,
                          .direction_world = {std::cos(azimuth), std::sin(azimuth), -dip}});
          pixels.push_back(static_cast<std::size_t>(y) * kColumns + static_cast<std::size_t>(x));
        }
      std::vector<SurfaceHit> hits(rays.size());
      query.intersect(rays, hits, Coherence::Coherent);
      for (std::size_t i = 0; i < rays.size(); ++i) {
        const double t = hits[i].is_sky() ? 0.0 : hits[i].t;
        rays[i] = {.origin_world = rays[i].origin_world + t * rays[i].direction_world +
                                   Eigen::Vector3d(0.0, 0.0, 0.05),
                   .direction_world = Eigen::Vector3d(0.9, 0.3, 0.1)};
      }
      std::vector<std::uint8_t> is_dark(rays.size());
      query.occluded(rays, is_dark);
      for (std::size_t i = 0; i < rays.size(); ++i) {
        seen.hits[pixels[i]] = hits[i];
        seen.is_dark[pixels[i]] = is_dark[i];
      }
    });
    return seen;
  }

  test::ScratchFolder folder_;
  TileStore store_ = test::make_tiny_world(folder_ / "world", hills_m, options());
  RayQuery all_{store_, finest_cut(store_), {}};
};

TEST_F(Streaming, ViewsAreTheSameAtEveryBudgetAndLoadEachTileAFewTimes) {
  const Seen expected = look(all_);
  const RayQueryStats of_all = all_.stats();
  ASSERT_GT(of_all.num_tiles_loaded, 50U);
  ASSERT_EQ(of_all.num_tiles_evicted, 0U);
  for (const int num_threads : {1, 2}) {
    const core::ThreadLimit limit(num_threads);
    // Loads a tile, at most. At a tenth one tile fits beside one that is loaded.
    for (const auto& [share, most_loads] :
         std::vector<std::pair<double, double>>{{1.0, 1.0}, {0.5, 4.0}, {0.25, 8.0}, {0.1, 40.0}}) {
      const double memory_bytes =
          share * (static_cast<double>(of_all.bytes_resident) +
                   2.0 * static_cast<double>(TileScene::kMostBytesWhileLoading));
      const RayQuery query(store_, all_.cut(), {.memory_bytes = memory_bytes});
      const Seen seen = look(query);
      const RayQueryStats stats = query.stats();
      SCOPED_TRACE(fmt::format("{} of the need, {} threads: {} loads, {} of them unpacked", share,
                               num_threads, stats.num_tiles_loaded, stats.num_tiles_unpacked));
      RecordProperty(fmt::format("loads_{}_{}", static_cast<int>(100.0 * share), num_threads),
                     std::to_string(stats.num_tiles_loaded));
      EXPECT_TRUE(same_bits(seen.hits, expected.hits));
      EXPECT_EQ(seen.is_dark, expected.is_dark);
      EXPECT_LE(static_cast<double>(stats.peak_bytes_resident), memory_bytes);
      EXPECT_LE(static_cast<double>(stats.num_tiles_loaded),
                most_loads * static_cast<double>(of_all.num_tiles_loaded));
      EXPECT_EQ(stats.num_tiles_evicted > 0, share < 1.0);
      if (share == 0.5) {
        EXPECT_GE(static_cast<double>(stats.bytes_at_first_eviction), 0.9 * memory_bytes);
      }
    }
  }
}

TEST_F(Streaming, ABudgetBelowTheLeastIsRefusedWithWhatWouldDo) {
  const double least_bytes = all_.least_memory_bytes();
  EXPECT_NO_THROW(RayQuery(store_, all_.cut(), {.memory_bytes = least_bytes}));
  try {
    const RayQuery query(store_, all_.cut(), {.memory_bytes = 0.99 * least_bytes});
    FAIL() << "no error";
  } catch (const core::Error& error) {
    EXPECT_EQ(error.kind(), core::ErrorKind::Config);
    EXPECT_THAT(error.what(), testing::HasSubstr("tracing.memory_bytes = "));
    EXPECT_THAT(error.what(), testing::HasSubstr(fmt::format("{:.4g} would be enough",
                                                             std::ceil(least_bytes * 1e-6) * 1e6)));
  }
}

TEST(PackedTiles, GiveTheSameSceneAgain) {
  const EmbreeDevice device("widest");
  // Smooth, and with steps that take more than two bytes.
  for (const double cliff_m : {0.0, 900.0}) {
    const Tile tile = test::make_tile({0, 1, -2}, [&](double x, double y) {
      return hills_m(x, y) + (std::sin(0.3 * x) > 0.0 ? cliff_m : 0.0);
    });
    const Eigen::Vector3d shift(0.3, 0.2, 0.0);
    const TileScene scene(device, tile, std::uint8_t{0}, shift);
    const PackedTile packed = scene.packed();
    EXPECT_LT(packed.num_bytes(), scene.num_bytes() / (cliff_m == 0.0 ? 6 : 4));
    const TileScene again(device, packed, shift);
    EXPECT_EQ(again.center_world(), scene.center_world());
    EXPECT_EQ(again.epsilon_m(), scene.epsilon_m());
    EXPECT_EQ(again.cover(), scene.cover());
    EXPECT_EQ(again.moisture(), scene.moisture());
    EXPECT_EQ(again.source(), scene.source());
    EXPECT_EQ(again.num_bytes(), scene.num_bytes());
    for (int j = 0; j < kTileSamples; ++j)
      for (int i = 0; i < kTileSamples; ++i)
        ASSERT_EQ(again.grid().z(i, j), scene.grid().z(i, j)) << i << ", " << j;
    for (int k = 0; k < 5 * TileScene::kEntryBlocks; ++k)
      EXPECT_EQ(again.entry_tops_z_world()[k], scene.entry_tops_z_world()[k]);
  }
}

}  // namespace
}  // namespace terracast::world
