#include "world/scene_cache.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <memory>
#include <stdexcept>
#include <thread>
#include <vector>

#include "core/parallel.h"
#include "core/random.h"
#include "tests/support/tiny_world.h"

namespace terracast::world {
namespace {

using testing::ElementsAre;

/// Flat tiles in a row; what is loaded is written down.
class SceneCacheTest : public testing::Test {
 protected:
  static constexpr std::size_t kNumTiles = 8;

  std::unique_ptr<const TileScene> load(std::size_t tile_index) {
    if (is_broken_) throw std::runtime_error("broken");
    {
      const std::lock_guard lock(mutex_);
      loaded_.push_back(tile_index);
    }
    const TileId id{0, static_cast<std::int32_t>(tile_index), 0};
    return std::make_unique<const TileScene>(
        device_, test::make_tile(id, [](double, double) { return 7.0; }), std::uint8_t{0},
        Eigen::Vector3d::Zero());
  }

  std::size_t bytes_of_tile() { return load(0)->num_bytes(); }

  /// A cache in which so many tiles stay loaded while others come and go.
  std::unique_ptr<SceneCache> cache_of(double num_tiles) {
    const auto bytes = static_cast<double>(bytes_of_tile());
    loaded_.clear();
    return std::make_unique<SceneCache>(
        std::vector<std::size_t>(kNumTiles, 0),
        (num_tiles - 0.5) * bytes + static_cast<double>(TileScene::kMostBytesWhileLoading),
        [this](std::size_t tile_index, const PackedTile*) { return load(tile_index); });
  }

  std::vector<std::size_t> loaded() {
    const std::lock_guard lock(mutex_);
    return loaded_;
  }
  /// Once so many loads have ended, however slow the machine is, and some time for one too many.
  std::vector<std::size_t> loaded_after(std::size_t count, const SceneCache& cache) {
    for (int k = 0; k < 12000 && cache.stats().num_loaded < count; ++k)
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    return loaded();
  }

  static void use(SceneCache& cache, std::initializer_list<std::size_t> tiles) {
    SceneCache::Pin pin(cache);
    for (const std::size_t tile : tiles) cache.load(pin, tile);
  }
  static std::vector<std::size_t> found(SceneCache& cache) {
    std::vector<std::size_t> tiles;
    const SceneCache::Pin pin(cache);
    for (std::size_t tile = 0; tile < kNumTiles; ++tile)
      if (cache.find(pin, tile) != nullptr) tiles.push_back(tile);
    return tiles;
  }

  EmbreeDevice device_{"widest"};
  std::mutex mutex_;
  std::vector<std::size_t> loaded_;
  bool is_broken_ = false;
};

TEST_F(SceneCacheTest, WithoutExpectationsTheTileUsedLongestAgoGoes) {
  const auto cache = cache_of(3);
  use(*cache, {0, 1, 2, 0, 3});
  EXPECT_THAT(found(*cache), ElementsAre(0, 2, 3));
  EXPECT_THAT(loaded(), ElementsAre(0, 1, 2, 3));
  EXPECT_EQ(cache->stats().num_waited, 4U);
}

TEST_F(SceneCacheTest, LoadsWhatIsExpectedInThatOrderUntilItIsFull) {
  const auto cache = cache_of(3);
  cache->expect({{4, 0}, {2, 1}, {5, 2}, {1, 3}});
  EXPECT_THAT(loaded_after(3, *cache), ElementsAre(4, 2, 5));
  use(*cache, {2, 4, 5});
  EXPECT_EQ(cache->stats().num_waited, 0U);
  EXPECT_EQ(cache->stats().num_evicted, 0U);
}

TEST_F(SceneCacheTest, WhatIsNeededLatestGoes) {
  const auto cache = cache_of(3);
  cache->expect({{4, 0}, {2, 2}, {5, 1}});
  loaded_after(3, *cache);
  use(*cache, {7});
  EXPECT_THAT(found(*cache), ElementsAre(4, 5, 7));
}

TEST_F(SceneCacheTest, WhatIsExpectedReplacesWhatIsNot) {
  const auto cache = cache_of(3);
  use(*cache, {0, 1, 2});
  cache->expect({});  // from here on what was used before counts as used in the last frame
  cache->expect({{3, 1}, {4, 2}});
  EXPECT_THAT(loaded_after(5, *cache), ElementsAre(0, 1, 2, 3, 4));
  EXPECT_THAT(found(*cache), ElementsAre(2, 3, 4));
}

TEST_F(SceneCacheTest, WhatWasUsedInTheLastFrameStays) {
  const auto cache = cache_of(3);
  cache->expect({});
  use(*cache, {0, 1, 2});
  cache->expect({{3, 1}, {4, 2}});
  EXPECT_THAT(loaded_after(3, *cache), ElementsAre(0, 1, 2));
}

TEST_F(SceneCacheTest, APinnedSceneLivesAndItsRoomIsWaitedFor) {
  const auto cache = cache_of(1);
  auto pin = std::make_unique<SceneCache::Pin>(*cache);
  const TileScene& held = cache->load(*pin, 0);
  std::atomic<bool> is_done = false;
  std::jthread other([&] {
    use(*cache, {1, 2});
    is_done = true;
  });
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  EXPECT_FALSE(is_done);
  EXPECT_EQ(held.center_world().x(), 128.0);
  pin.reset();
  other.join();
  EXPECT_EQ(loaded().size(), 3U);
  EXPECT_LT(cache->stats().peak_bytes_resident, 2 * bytes_of_tile());
}

TEST_F(SceneCacheTest, AnEvictedSceneThatIsStillHeldIsTakenBack) {
  const auto cache = cache_of(1);
  auto pin = std::make_unique<SceneCache::Pin>(*cache);
  cache->load(*pin, 0);
  std::jthread other([&] { use(*cache, {1}); });
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  EXPECT_THAT(found(*cache), testing::IsEmpty());
  use(*cache, {0});
  EXPECT_THAT(loaded(), ElementsAre(0));
  pin.reset();
  other.join();
}

TEST_F(SceneCacheTest, ALoadThatFailsIsTriedAgain) {
  const auto cache = cache_of(1);
  is_broken_ = true;
  for (int k = 0; k < 3; ++k) EXPECT_THROW(use(*cache, {0}), std::runtime_error);
  is_broken_ = false;
  use(*cache, {0});
  EXPECT_THAT(loaded(), ElementsAre(0));
}

TEST_F(SceneCacheTest, UnitsLoadTheTileForWhichMostRaysWait) {
  constexpr std::int64_t kNumUnits = 4;
  const core::ThreadLimit limit(1);
  const auto cache = cache_of(1);
  use(*cache, {6, 7});  // one goes: from here on units take turns
  loaded_.clear();
  cache->run_units(kNumUnits, [&](std::int64_t unit) {
    SceneCache::Pin pin(*cache);
    // All wait for four tiles, most rays for tile 2, and start with a tile of their own.
    std::vector<TileDemand> demands;
    for (std::int64_t k = 0; k < kNumUnits; ++k) {
      const auto tile = static_cast<std::size_t>((unit + k) % kNumUnits);
      demands.push_back({.tile_index = tile, .num_rays = tile == 2 ? 9U : 1U});
    }
    while (!demands.empty()) {
      const SceneCache::Loaded got = cache->load_one_of(pin, demands);
      EXPECT_EQ(got.scene->center_world().x(), 128.0 + 256.0 * static_cast<double>(got.tile_index));
      std::erase_if(demands,
                    [&](const TileDemand& one) { return one.tile_index == got.tile_index; });
    }
  });
  EXPECT_EQ(loaded().front(), 2U);
  // Each unit on its own would load four.
  EXPECT_LT(loaded().size(), static_cast<std::size_t>(2 * kNumUnits));
}

TEST_F(SceneCacheTest, AFailureOfOneUnitLeavesTheLoop) {
  const auto cache = cache_of(1);
  use(*cache, {6, 7});
  is_broken_ = true;
  EXPECT_THROW(cache->run_units(40,
                                [&](std::int64_t) {
                                  SceneCache::Pin pin(*cache);
                                  cache->load_one_of(pin, std::vector<TileDemand>{{3, 1}});
                                }),
               std::runtime_error);
  is_broken_ = false;
  cache->run_units(40, [&](std::int64_t) {
    SceneCache::Pin pin(*cache);
    cache->load_one_of(pin, std::vector<TileDemand>{{3, 1}});
  });
}

TEST_F(SceneCacheTest, ManyThreadsKeepTheBudget) {
  constexpr double kFitting = 3.0;
  const auto cache = cache_of(kFitting);
  const auto budget = (kFitting - 0.5) * static_cast<double>(bytes_of_tile()) +
                      static_cast<double>(TileScene::kMostBytesWhileLoading);
  std::atomic<int> num_wrong = 0;
  {
    std::vector<std::jthread> threads;
    for (std::uint64_t thread = 0; thread < 4; ++thread)
      threads.emplace_back([&, thread] {
        SceneCache::Pin pin(*cache);
        for (std::uint64_t k = 0; k < 60; ++k) {
          const std::size_t tile = core::random_bits(5, thread, k) % kNumTiles;
          const TileScene& scene = cache->load(pin, tile);
          if (scene.center_world().x() != 128.0 + 256.0 * static_cast<double>(tile)) ++num_wrong;
          if (k % 7 == 0)
            cache->expect({{static_cast<std::uint32_t>(core::random_bits(6, thread, k) % kNumTiles),
                            static_cast<std::uint32_t>(k % 3)}});
        }
      });
  }
  EXPECT_EQ(num_wrong, 0);
  EXPECT_LE(static_cast<double>(cache->stats().peak_bytes_resident), budget);
}

}  // namespace
}  // namespace terracast::world
