#include <algorithm>
#include <map>
#include <mutex>

#include "core/atomic_file.h"
#include "core/log.h"
#include "core/parallel.h"
#include "core/random.h"
#include "core/toml_reader.h"
#include "plugins/laws/laws.h"
#include "tiler/surface.h"
#include "tiler/tile_builder.h"
#include "tiler/tile_stage.h"
#include "validate/world_check/world_check.h"
#include "world/tile_file.h"

namespace terracast::plugins {
namespace {

namespace fs = std::filesystem;
using Files = std::map<std::string, std::string>;

/// Two kilometres of a coast, fine about the middle.
constexpr const char* kWorld = R"(name = "laws"
origin_lat_deg = 46.0
origin_lon_deg = 7.0
size_m = 2048.0
seed = 3
outside = "extend"

[[elevation]]
kind = "procedural"
landform = "coast"
vertical_datum = "ellipsoid"
relief_m = 300.0
)";

struct Tiled {
  std::shared_ptr<const tiler::WorldSurface> surface;
  std::optional<world::TileStore> store;
  Files files;
};

Files files_of(const fs::path& folder) {
  Files files;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file())
      files[fs::relative(entry.path(), folder).string()] = core::read_text_file(entry.path());
  return files;
}

class LayerLaws {
 public:
  LayerLaws(const tiler::LayerOptions& layer, const fs::path& folder, LawReport& report)
      : folder_(folder), report_(report) {
    core::TomlDocument::parse(kWorld, "world").read(options_);
    options_.layers = {layer};
  }

  void try_all() {
    report_.begin("its sources are read, and tiles are made");
    const Tiled one = tile("one", 1);
    report_.begin("the same bytes from one thread and from two");
    const Files two = tile("two", 2).files;
    expect_same(one.files, two, "of two threads");
    expect_same(two, one.files, "of one thread");
    report_.begin("a tile is the same by itself, in any order");
    expect_same(one.files, tiles_in_any_order(one), "by itself");
    report_.begin("nothing in its world is wrong, and all goes on over the borders of tiles");
    const auto faults = world_check::check_world(*one.store, {.log = kQuiet});
    report_.expect(faults.is_right(), world_check::table_of(faults, one.store->manifest()));
  }

 private:
  Tiled tile(const std::string& name, int num_threads) {
    const core::ThreadLimit limit(num_threads);
    const core::Context context{.log = kQuiet, .num_threads = num_threads};
    Tiled tiled;
    tiled.surface = tiler::WorldSurface::prepare(options_, context);
    const double z_world = tiled.surface->sample(0.0, 0.0).z_world;
    tiler::TilePlan plan;
    plan.detail.finest_spacing_m = 2.0;
    plan.sequences.push_back(
        {{.position_world = {0.0, 0.0, z_world + 250.0}, .pixels_per_radian = 150.0}});
    tiled.store = tiler::run_tile_stage(*tiled.surface, plan, folder_ / name, context);
    tiled.files = files_of(folder_ / name);
    return tiled;
  }

  static Files tiles_in_any_order(const Tiled& tiled) {
    std::vector<world::TileId> ids;
    for (const world::TileInfo& info : tiled.store->manifest().tiles) ids.push_back(info.id);
    constexpr std::uint64_t kOrder = 11;
    for (std::size_t i = ids.size(); i > 1; --i)
      std::swap(ids[i - 1], ids[core::random_bits(kOrder, 1, i) % i]);
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

  /// Each of `others` is one of `files`.
  void expect_same(const Files& files, const Files& others, const std::string& which) {
    for (const auto& [name, bytes] : others) {
      const auto own = files.find(name);
      report_.expect(own != files.end() && own->second == bytes,
                     fmt::format("{} {} is another", name, which));
    }
  }

  fs::path folder_;
  LawReport& report_;
  core::Log kQuiet{"laws", core::LogLevel::Off};
  tiler::WorldOptions options_;
};

}  // namespace

void try_layer(const tiler::LayerOptions& layer, const fs::path& folder, LawReport& report) {
  LayerLaws(layer, folder, report).try_all();
}

}  // namespace terracast::plugins
