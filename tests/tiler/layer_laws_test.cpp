#include <algorithm>
#include <chrono>
#include <map>
#include <mutex>
#include <set>

#include "core/atomic_file.h"
#include "core/parallel.h"
#include "core/random.h"
#include "core/toml_reader.h"
#include "tests/tiler/raster_files.h"
#include "tests/tiler/settled_files.h"
#include "tests/tiler/tile_borders.h"
#include "tiler/layer_stack.h"
#include "tiler/tile_builder.h"
#include "tiler/tile_stage.h"
#include "validate/world_check/world_check.h"
#include "world/tile_file.h"

/// What every kind of layer keeps, by itself and with all others: a new one is under these laws with its line in
/// the table of kinds.
namespace terracast::test {
namespace {

namespace fs = std::filesystem;
using Files = std::map<std::string, std::string>;

// A country of each size is there in seconds: the smaller one has roads and houses, the larger one a town.
constexpr double kSmall_m = 2048.0;
constexpr double kTown_m = 4096.0;

std::optional<tiler::LayerOptions> layer_by(const std::string& kind, const std::string& keys) {
  tiler::LayerOptions layer;
  try {
    core::TomlDocument::parse("kind = \"" + kind + "\"\n" + keys, "layer.toml").read(layer);
  } catch (const core::Error&) {
    return std::nullopt;  // keys that it does not have, or that do not suffice
  }
  return layer;
}

/// Made in the first of some ways that its kind takes.
/// unused   loses that way
tiler::LayerOptions layer_of(const std::string& kind, const std::vector<std::string>& ways,
                             std::set<std::string>* unused = nullptr) {
  for (const std::string& keys : ways)
    if (auto layer = layer_by(kind, keys)) {
      if (unused != nullptr) unused->erase(keys);
      return *layer;
    }
  ADD_FAILURE() << "layers of kind " << kind
                << " can be made in none of the ways of this test: add one";
  return {};
}

/// From seeds wherever that can be, else from the files.
std::vector<std::string> from_seeds(std::vector<std::string> of_files) {
  of_files.insert(of_files.begin(), {"source = \"country\"", "source = \"derived\"", ""});
  return of_files;
}

/// All kinds in the order in which they may ask each other; new ones come last.
std::vector<std::string> all_kinds() {
  std::vector<std::string> kinds = {"water",   "roads",      "buildings", "land_cover",
                                    "objects", "vegetation", "imagery",   "clouds"};
  for (const tiler::LayerKindInfo& kind : tiler::layer_kinds())
    if (std::find(kinds.begin(), kinds.end(), kind.name) == kinds.end())
      kinds.emplace_back(kind.name);
  return kinds;
}

tiler::WorldOptions world_with(const std::vector<std::string>& kinds,
                               const std::vector<std::string>& ways, double size_m) {
  tiler::WorldOptions options = world_of("procedural", size_m);
  options.seed = 3;
  options.outside = "extend";
  options.elevation[0].landform = "coast";
  options.elevation[0].relief_m = 300.0;
  for (const std::string& kind : kinds) options.layers.push_back(layer_of(kind, ways));
  return options;
}

/// Fine tiles about the middle, coarse ones beyond.
tiler::TilePlan plan_over(const tiler::WorldSurface& surface) {
  tiler::TilePlan plan;
  plan.detail.finest_spacing_m = 2.0;
  plan.sequences.push_back({{.position_world = {0.0, 0.0, surface.sample(0.0, 0.0).z_world + 250.0},
                             .pixels_per_radian = 150.0}});
  return plan;
}

struct Tiled {
  std::shared_ptr<const tiler::WorldSurface> surface;
  std::optional<world::TileStore> store;
  Files files;
};

Tiled tile(const tiler::WorldOptions& options, const fs::path& folder, int num_threads) {
  const core::ThreadLimit limit(num_threads);
  const core::Log log("tile", core::LogLevel::Off);
  Tiled tiled;
  tiled.surface = prepare(options, num_threads);
  tiled.store = tiler::run_tile_stage(*tiled.surface, plan_over(*tiled.surface), folder,
                                      {.log = log, .num_threads = num_threads, .events_file = {}});
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file())
      tiled.files[fs::relative(entry.path(), folder).string()] = core::read_text_file(entry.path());
  return tiled;
}

/// The files of all tiles, each built by itself, in an order of chance, some beside each other.
Files tiles_in_any_order(const Tiled& tiled, std::uint64_t seed) {
  std::vector<world::TileId> ids;
  for (const world::TileInfo& info : tiled.store->manifest().tiles) ids.push_back(info.id);
  for (std::size_t i = ids.size(); i > 1; --i)
    std::swap(ids[i - 1], ids[core::random_bits(seed, 1, i) % i]);
  Files files;
  std::mutex mutex;
  const core::ThreadLimit limit(2);
  core::parallel_for(static_cast<std::int64_t>(ids.size()), [&](std::int64_t i) {
    const world::TileId& id = ids[static_cast<std::size_t>(i)];
    const std::vector<std::byte> bytes = world::encode_tile(build_tile(*tiled.surface, id));
    const std::lock_guard lock(mutex);
    files[fmt::format("tiles/{}/{}_{}.tile", id.level, id.x, id.y)].assign(
        reinterpret_cast<const char*>(bytes.data()), bytes.size());
  });
  return files;
}

/// Each run its own; GTEST_RANDOM_SEED or --gtest_random_seed takes one again.
std::uint64_t seed_of_order() {
  const auto given = static_cast<std::uint64_t>(GTEST_FLAG_GET(random_seed));
  return given != 0 ? given
                    : static_cast<std::uint64_t>(
                          std::chrono::system_clock::now().time_since_epoch().count() % 99999 + 1);
}

/// What reaches over borders in the world that was checked.
Crossings expect_laws(const tiler::WorldOptions& options, const fs::path& folder) {
  const Tiled one = tile(options, folder / "one", 1);
  const Tiled two = tile(options, folder / "two", 2);
  for (const auto& [name, bytes] : one.files)
    EXPECT_TRUE(two.files.contains(name) && two.files.at(name) == bytes)
        << name << " differs between one thread and two";
  EXPECT_EQ(one.files.size(), two.files.size());
  const std::uint64_t seed = seed_of_order();
  SCOPED_TRACE(fmt::format("order of --gtest_random_seed={}", seed));
  for (const auto& [name, bytes] : tiles_in_any_order(two, seed))
    EXPECT_TRUE(one.files.at(name) == bytes) << name << " is another when it is built by itself";

  const core::Log log("test", core::LogLevel::Off);
  const auto faults = world_check::check_world(*one.store, {.log = log});
  EXPECT_TRUE(faults.is_right()) << world_check::table_of(faults, one.store->manifest());
  return expect_whole_over_borders(*one.store);
}

class LayerLaws : public testing::TestWithParam<std::string> {};

TEST_P(LayerLaws, TheSameBytesFromAnyThreadsAndAnyOrderOfTilesAndNothingIsWrong) {
  const ScratchFolder folder;
  const auto ways = from_seeds(write_settled_files(folder.path()));
  expect_laws(world_with({GetParam()}, ways, kSmall_m), folder.path());
}

INSTANTIATE_TEST_SUITE_P(Kinds, LayerLaws, testing::ValuesIn(all_kinds()),
                         [](const auto& kind) { return kind.param; });

void expect_crossings(const Crossings& crossings, const std::vector<std::string>& names) {
  for (const std::string& name : names)
    EXPECT_TRUE(crossings.contains(name)) << "no " << name << " reach over borders";
}

/// Things on each other's ground, round each other, over borders: whole worlds of all kinds.
TEST(SettledWorld, OfSeedsIsTheSameInAnyOrderAndWholeOverBordersAndNothingInItIsWrong) {
  const ScratchFolder folder;
  const auto ways = from_seeds(write_settled_files(folder.path()));
  expect_crossings(
      expect_laws(world_with(all_kinds(), ways, kTown_m), folder.path()),
      {"buildings solids", "objects instances", "roads strips", "vegetation instances"});
}

TEST(SettledWorld, OfFilesIsTheSameInAnyOrderAndWholeOverBordersAndNothingInItIsWrong) {
  const ScratchFolder folder;
  const auto ways = write_settled_files(folder.path());
  std::set<std::string> unused(ways.begin(), ways.end());
  for (const std::string& kind : all_kinds()) layer_of(kind, ways, &unused);
  EXPECT_TRUE(unused.empty()) << "no kind takes " << *unused.begin();
  tiler::WorldOptions options = world_with(all_kinds(), ways, kSmall_m);
  options.elevation[0].landform = "plains";
  expect_crossings(expect_laws(options, folder.path()),
                   {"buildings solids", "objects instances", "objects solids", "roads areas",
                    "roads solids", "roads strips", "vegetation instances"});
}

}  // namespace
}  // namespace terracast::test
