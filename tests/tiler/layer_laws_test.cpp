#include <algorithm>
#include <map>
#include <mutex>

#include "core/atomic_file.h"
#include "core/parallel.h"
#include "core/random.h"
#include "core/toml_reader.h"
#include "tests/support/record.h"
#include "tests/tiler/raster_files.h"
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

/// A picture of the ground about the origin.
void draw_picture(const fs::path& file) {
  RasterSpec spec = utm_spec(2048.0, 16.0);
  spec.type = GDT_Byte;
  spec.num_bands = 1;
  spec.value = [](double u, double v) {
    return 40.0 + std::fmod(std::abs(u) / 7.0 + std::abs(v) / 3.0, 150.0);
  };
  write_raster(file, spec);
}

/// Ways to make a layer without data of its own; the first that a kind takes is what the laws are asked of.
std::vector<std::string> ways_to_make(const fs::path& picture) {
  return {"source = \"country\"", "source = \"derived\"", "",
          "files = [\"" + picture.string() + "\"]"};
}

std::optional<tiler::LayerOptions> layer_by(const std::string& kind, const std::string& keys) {
  tiler::LayerOptions layer;
  try {
    core::TomlDocument::parse("kind = \"" + kind + "\"\n" + keys, "layer.toml").read(layer);
  } catch (const core::Error&) {
    return std::nullopt;  // keys that it does not have, or that do not suffice
  }
  return layer;
}

tiler::LayerOptions layer_of(const std::string& kind, const fs::path& picture) {
  for (const std::string& keys : ways_to_make(picture))
    if (auto layer = layer_by(kind, keys)) return *layer;
  ADD_FAILURE() << "layers of kind " << kind
                << " can be made in none of the ways of this test: add one";
  return {};
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

tiler::WorldOptions world_with(const std::vector<std::string>& kinds, double size_m,
                               const fs::path& picture) {
  tiler::WorldOptions options = world_of("procedural", size_m);
  options.seed = 3;
  options.outside = "extend";
  options.elevation[0].landform = "coast";
  options.elevation[0].relief_m = 300.0;
  for (const std::string& kind : kinds) options.layers.push_back(layer_of(kind, picture));
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
Files tiles_in_any_order(const Tiled& tiled) {
  std::vector<world::TileId> ids;
  for (const world::TileInfo& info : tiled.store->manifest().tiles) ids.push_back(info.id);
  for (std::size_t i = ids.size(); i > 1; --i)
    std::swap(ids[i - 1], ids[core::random_bits(17, 1, i) % i]);
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

void expect_laws(const std::vector<std::string>& kinds, double size_m) {
  const ScratchFolder folder;
  draw_picture(folder / "picture.tif");
  const tiler::WorldOptions options = world_with(kinds, size_m, folder / "picture.tif");
  const Tiled one = tile(options, folder / "one", 1);
  const Tiled two = tile(options, folder / "two", 2);
  for (const auto& [name, bytes] : one.files)
    EXPECT_TRUE(two.files.contains(name) && two.files.at(name) == bytes)
        << name << " differs between one thread and two";
  EXPECT_EQ(one.files.size(), two.files.size());
  for (const auto& [name, bytes] : tiles_in_any_order(two))
    EXPECT_TRUE(one.files.at(name) == bytes) << name << " is another when it is built by itself";

  const core::Log log("test", core::LogLevel::Off);
  const auto faults = world_check::check_world(*one.store, {.log = log});
  EXPECT_TRUE(faults.is_right()) << world_check::table_of(faults, one.store->manifest());
}

class LayerLaws : public testing::TestWithParam<std::string> {};

TEST_P(LayerLaws, TheSameBytesFromAnyThreadsAndAnyOrderOfTilesAndNothingIsWrong) {
  expect_laws({GetParam()}, kSmall_m);
}

INSTANTIATE_TEST_SUITE_P(Kinds, LayerLaws, testing::ValuesIn(all_kinds()),
                         [](const auto& kind) { return kind.param; });

/// Things on each other's ground, round each other, over borders: a whole world of all kinds.
TEST(SettledWorld, OfAllLayersIsTheSameInAnyOrderAndNothingInItIsWrong) {
  expect_laws(all_kinds(), kTown_m);
}

}  // namespace
}  // namespace terracast::test
