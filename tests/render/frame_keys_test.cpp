#include <gtest/gtest.h>

#include <algorithm>
#include <functional>

#include "core/atomic_file.h"
#include "core/schema_writer.h"
#include "core/toml_reader.h"
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
  const test::TracedPlan flight(store, plan, cut, {});
  const auto touched = std::find_if(cut.begin(), cut.end(),
                                    [](const world::CutTile& tile) { return tile.id == kTouched; });
  const int index = static_cast<int>(touched - cut.begin());
  return FrameKeys(plan, store, cut, flight.renderer).key(0, std::span(&index, 1));
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

/// A value that a key does not have, in its range.
std::string other_value(const core::KeyInfo& key) {
  if (key.default_value == "false") return "true";
  if (key.default_value == "true") return "false";
  if (key.name == "visibility_km") return "31.5";
  if (key.name == "sun_azimuth_deg") return "71.5";
  if (key.name == "sun_elevation_deg") return "33.25";
  if (key.name == "water_visibility_m" || key.name == "exposure") return "7.5";
  if (key.name == "color_samples" || key.name == "ambient_rays") return "3";
  ADD_FAILURE() << "no other value is known for the new key " << key.name;
  return key.default_value;
}

// Whatever condition is added to the description counts, without a second list of conditions.
TEST(FrameKeys, HoldEveryConditionThatIsDescribed) {
  const test::ScratchFolder folder;
  const world::TileStore store = make_coast(folder / "world");
  const auto key_with = [&](const std::string& conditions) {
    SequencePlan plan = test::small_plan(1, 16, 12);
    core::write_file(folder / "conditions.toml", conditions);
    plan.conditions = core::read_toml<scene::ConditionOptions>(folder / "conditions.toml");
    const std::vector<world::CutTile> cut = world::finest_cut(store);
    const test::TracedPlan traced(store, plan, cut, {});
    const int touched = 0;
    return FrameKeys(plan, store, cut, traced.renderer).key(0, std::span(&touched, 1));
  };
  const std::string key = key_with("");
  EXPECT_EQ(key_with(""), key);
  for (const core::KeyInfo& info : core::list_keys<scene::ConditionOptions>()) {
    if (info.name.starts_with("media")) continue;
    EXPECT_NE(key_with(info.name + " = " + other_value(info) + "\n"), key) << info.name;
  }
  const std::string haze = "[[media]]\nkind = \"exponential_haze\"\n";
  EXPECT_NE(key_with(haze), key);
  EXPECT_NE(key_with(haze + "base_m = 1.0\n"), key_with(haze));
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
