#include <gtest/gtest.h>

#include <algorithm>
#include <functional>

#include "render/input_hash.h"
#include "tests/support/hills_flight.h"
#include "tests/support/test_data.h"

// What frames show of the world although their rays do not touch it: a frame must not be taken from
// another capture when that changed.
namespace terracast::render {
namespace {

namespace fs = std::filesystem;
using world::Cover;
using world::Tile;
using world::TileId;

const TileId kTouched{6, 0, 0};
const TileId kBeside{6, -1, 0};

/// The sea in the west of a world of tiles of level 6 below such of level 7.
world::TileStore make_coast(const fs::path& folder) {
  test::TinyWorldOptions options;
  options.finest_level = 6;
  options.coarsest_level = 7;
  options.refine = [](const TileId&) { return true; };
  options.cover = [](double x, double) { return x < -1000.0 ? Cover::Sea : Cover::Land; };
  return test::make_tiny_world(
      folder, [](double x, double) { return x < -1000.0 ? 0.0 : 5.0; }, options);
}

/// A copy of a world with another tile beside the touched one.
world::TileStore edited(const world::TileStore& store, const fs::path& folder,
                        const std::function<void(Tile&)>& edit) {
  fs::copy(store.folder(), folder, fs::copy_options::recursive);
  Tile tile = store.load(kBeside);
  edit(tile);
  world::WorldManifest manifest = store.manifest();
  for (world::TileInfo& info : manifest.tiles)
    if (info.id == kBeside) info = world::write_tile(folder, tile);
  world::write_manifest(folder, manifest);
  return world::TileStore::open(folder);
}

std::string key_of(const world::TileStore& store) {
  const SequencePlan plan = test::small_plan(1, 16, 12);
  const std::vector<world::CutTile> cut = world::finest_cut(store);
  const world::RayQuery query(store, cut, {});
  const sensors::FrameRenderer renderer(plan, store, query);
  const auto touched = std::find_if(cut.begin(), cut.end(),
                                    [](const world::CutTile& tile) { return tile.id == kTouched; });
  const int index = static_cast<int>(touched - cut.begin());
  return FrameKeys(plan, store, cut, renderer).key(0, std::span(&index, 1));
}

TEST(FrameKeys, HoldWhereTheSeaIsOpenAlsoByTilesThatNoRayTouches) {
  const test::ScratchFolder folder;
  const world::TileStore store = make_coast(folder / "first");
  const std::string key = key_of(store);
  // A sample 320 m west of the touched tile, which the coarser level does not have: the sea's level
  // stays.
  constexpr int kColumn = 251, kRow = 7;
  const world::TileStore other_sea = edited(store, folder / "sea", [](Tile& tile) {
    tile.cover[Tile::sample(kColumn, kRow)] = Cover::Sea;
  });
  EXPECT_NE(key_of(other_sea), key);
  // What else is there does not count.
  const world::TileStore other_land = edited(store, folder / "land", [](Tile& tile) {
    tile.cover[Tile::sample(kColumn, kRow)] = Cover::Forest;
    tile.height_steps[Tile::sample(kColumn, kRow)] += 100;
  });
  EXPECT_EQ(key_of(other_land), key);
}

TEST(FrameKeys, HoldWhetherTreesStandInTheWorld) {
  const test::ScratchFolder folder;
  const world::TileStore store = make_coast(folder / "world");
  const std::string key = key_of(store);
  world::WorldManifest manifest = store.manifest();
  world::LayerInfo layer;
  layer.name = layer.kind = "vegetation";
  manifest.layers.push_back(layer);
  world::write_manifest(store.folder(), manifest);
  EXPECT_NE(key_of(world::TileStore::open(store.folder())), key);
}

}  // namespace
}  // namespace terracast::render
