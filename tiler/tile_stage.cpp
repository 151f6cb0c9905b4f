#include "tiler/tile_stage.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <set>
#include <unordered_map>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/json.h"
#include "core/parallel.h"
#include "core/progress.h"
#include "tiler/imagery/imagery_pyramid.h"
#include "tiler/known_rasters.h"
#include "tiler/layer_stack.h"
#include "tiler/tile_builder.h"

namespace terracast::tiler {
namespace {

using core::ErrorKind;
using core::fail;
using world::TileId;
using world::TileInfo;

constexpr const char* kInputsFile = "inputs.json";

/// Tiles of 66 km: few are needed, however far the horizon, and the Earth's curve drops less than
/// the 16 km that a tile's heights may span, out to kLargestApronRadius_m.
constexpr int kLowestCoarsestLevel = 8;

/// There the ground falls off by 0.11 m a metre along the axes, 0.16 along a tile's diagonal: 10 km
/// in one tile, to which the relief adds.
constexpr double kLargestApronRadius_m = 700000.0;

/// Without viewpoints the apron serves one this far above the highest ground.
constexpr double kAssumedAbove_m = 1000.0;

/// The horizon is that of the ellipsoid; the apron's ground may lie below it, and refraction is
/// left out.
constexpr double kApronMargin = 1.05;
constexpr double kApronMargin_m = 10000.0;

bool intersects_square(const TileId& id, double half_size_m) {
  const Eigen::Vector2d corner = id.corner_world();
  return corner.x() < half_size_m && corner.x() + id.side_m() > -half_size_m &&
         corner.y() < half_size_m && corner.y() + id.side_m() > -half_size_m;
}

/// The tiles of a world: grown from the top, each built (or found whole) when it is first asked
/// for.
class Growth {
 public:
  Growth(const WorldSurface& surface, const TilePlan& plan, const std::filesystem::path& folder,
         const core::Context& context)
      : surface_(surface), plan_(plan), folder_(folder), context_(context) {
    half_size_m_ = surface.options().size_m / 2.0;
    base_level_ = surface.base_level();
    coarsest_level_ = std::max(kLowestCoarsestLevel, base_level_ + 1);
  }

  world::TileStore run();

 private:
  void claim_folder();
  void read_previous();
  double apron_radius_m() const;
  std::vector<TileId> roots(double radius_m) const;
  bool must_split(const TileInfo& tile) const;
  void build(const std::vector<TileId>& ids);
  void split(const std::vector<TileId>& parents);
  void balance();
  void add_imagery(world::WorldManifest& manifest);
  world::WorldRasters rasters_of_world() const;
  void finish(double radius_m);
  void warn_of_what_is_unknown(const world::WorldManifest& manifest) const;

  const WorldSurface& surface_;
  const TilePlan& plan_;
  const std::filesystem::path& folder_;
  const core::Context& context_;
  double half_size_m_ = 0.0;
  int base_level_ = 0;
  int coarsest_level_ = 0;
  double previous_radius_m_ = 0.0;
  std::set<TileId> previous_;  ///< tiles of an earlier run with other sequences
  std::vector<world::ImageryInfo> previous_imagery_;
  std::unordered_map<TileId, TileInfo> tiles_;
  std::unordered_map<TileId, std::uint8_t> is_split_;
  std::int64_t num_built_ = 0;
};

void Growth::claim_folder() {
  const std::filesystem::path file = folder_ / kInputsFile;
  std::error_code ignored;
  std::string found;
  if (std::filesystem::exists(file, ignored))
    found = core::Json::read(file).at("input_hash").string();
  else if (std::filesystem::exists(folder_ / "manifest.json", ignored))
    found = world::TileStore::open(folder_).manifest().input_hash;
  const std::string expected = surface_.input_hash();
  if (!found.empty() && found != expected)
    fail(ErrorKind::Config,
         "{}: holds a world of other inputs (hash {}; this config's is {}); give another "
         "--out folder, or remove this one",
         folder_.string(), found, expected);
  core::make_folder(folder_);
  core::remove_temporaries(folder_);
  if (found.empty() || !std::filesystem::exists(file, ignored)) {
    core::Json inputs = core::Json::object();
    inputs.set("input_hash", expected).set("name", surface_.options().name);
    inputs.write(file);
  }
}

void Growth::read_previous() {
  std::error_code ignored;
  if (!std::filesystem::exists(folder_ / "manifest.json", ignored)) return;
  const world::TileStore store = world::TileStore::open(folder_);
  if (store.manifest().input_hash != surface_.input_hash())
    fail(ErrorKind::Config, "{}: its manifest is of other inputs (hash {}) than its {}; remove it",
         folder_.string(), store.manifest().input_hash, kInputsFile);
  previous_radius_m_ = store.manifest().apron_radius_m;
  previous_imagery_ = store.manifest().imagery;
  for (const TileInfo& tile : store.manifest().tiles) previous_.insert(tile.id);
}

/// From where a viewpoint sees: its position, or the corners of the box around where its rays start.
std::vector<Eigen::Vector3d> places_of(const world::Viewpoint& viewpoint) {
  if (!viewpoint.sheaf) return {viewpoint.position_world};
  std::vector<Eigen::Vector3d> places;
  const geo::Box3d& box = viewpoint.sheaf->starts_box_world();
  for (int corner = 0; corner < 8; ++corner)
    places.emplace_back(((corner & 1) != 0 ? box.max() : box.min()).x(),
                        ((corner & 2) != 0 ? box.max() : box.min()).y(),
                        ((corner & 4) != 0 ? box.max() : box.min()).z());
  return places;
}

double Growth::apron_radius_m() const {
  // Heights of viewpoints above the ellipsoid, and the place whose horizon reaches farthest from
  // the origin.
  double highest_m = surface_.highest_m() + kAssumedAbove_m;
  double off_centre_m = half_size_m_ * std::sqrt(2.0);
  bool has_viewpoint = false;
  for (const auto& sequence : plan_.sequences)
    for (const world::Viewpoint& viewpoint : sequence)
      for (const Eigen::Vector3d& place : places_of(viewpoint)) {
        const double height_m = surface_.frame().geodetic_from_world(place).height_m;
        highest_m = has_viewpoint ? std::max(highest_m, height_m) : height_m;
        off_centre_m = std::max(off_centre_m, place.head<2>().norm());
        has_viewpoint = true;
      }
  const double above_apron_m = std::max(highest_m - std::min(surface_.lowest_m(), 0.0), 100.0);
  const double horizon_m = geo::horizon_distance_m(above_apron_m);
  const double radius_m = horizon_m * kApronMargin + off_centre_m + kApronMargin_m;
  if (radius_m > kLargestApronRadius_m)
    fail(ErrorKind::Input,
         "a camera {:.0f} m above the ellipsoid sees a horizon {:.0f} km away, for which the "
         "ground must reach {:.0f} km from the world's origin; worlds reach {:.0f} km, which "
         "serves cameras up to about 30 km",
         highest_m, horizon_m / 1000.0, radius_m / 1000.0, kLargestApronRadius_m / 1000.0);
  return std::max(std::ceil(radius_m), previous_radius_m_);
}

std::vector<TileId> Growth::roots(double radius_m) const {
  const double side_m = TileId{coarsest_level_, 0, 0}.side_m();
  const int reach = static_cast<int>(std::ceil(radius_m / side_m));
  std::vector<TileId> ids;
  for (int x = -reach; x < reach; ++x)
    for (int y = -reach; y < reach; ++y) {
      const TileId id{coarsest_level_, x, y};
      const Eigen::Vector2d corner = id.corner_world();
      const Eigen::Vector2d nearest = Eigen::Vector2d::Zero().cwiseMax(corner).cwiseMin(
          corner + Eigen::Vector2d::Constant(side_m));
      if (nearest.norm() < radius_m) ids.push_back(id);
    }
  return ids;
}

bool Growth::must_split(const TileInfo& tile) const {
  if (tile.id.level > base_level_ && intersects_square(tile.id, half_size_m_)) return true;
  if (previous_.count(tile.id.child(0)) != 0) return true;
  return std::any_of(plan_.sequences.begin(), plan_.sequences.end(), [&](const auto& sequence) {
    return world::wants_refinement(tile, sequence, plan_.detail);
  });
}

/// So many indices, in an order that differs from process to process.
std::vector<std::size_t> own_order(std::size_t count) {
  std::vector<std::size_t> order(count);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::shuffle(order.begin(), order.end(), std::minstd_rand(std::random_device()()));
  return order;
}

void Growth::build(const std::vector<TileId>& ids) {
  std::vector<TileInfo> infos(ids.size());
  std::vector<std::uint8_t> was_built(ids.size(), 0);
  core::Progress progress(context_, fmt::format("tiles of level {}", ids.front().level),
                          static_cast<std::int64_t>(ids.size()));
  // Processes that tile one world at the same time find most of each other's tiles made. What a tile is
  // does not depend on when it is built.
  const std::vector<std::size_t> order = own_order(ids.size());
  core::parallel_for(static_cast<std::int64_t>(ids.size()), [&](std::int64_t k) {
    const std::size_t i = order[static_cast<std::size_t>(k)];
    core::with_context(
        [&] {
          if (auto whole = world::inspect_tile(folder_, ids[i])) {
            infos[i] = *std::move(whole);
            progress.skip();
            return;
          }
          infos[i] = world::write_tile(folder_, build_tile(surface_, ids[i]));
          was_built[i] = 1;
          progress.advance();
        },
        fmt::format("building tile {}", ids[i].name()));
  });
  for (std::size_t i = 0; i < ids.size(); ++i) {
    tiles_.emplace(ids[i], infos[i]);
    num_built_ += was_built[i];
  }
}

void Growth::split(const std::vector<TileId>& parents) {
  std::vector<TileId> children;
  for (const TileId& parent : parents) {
    is_split_[parent] = 1;
    for (int quadrant = 0; quadrant < 4; ++quadrant)
      if (tiles_.count(parent.child(quadrant)) == 0) children.push_back(parent.child(quadrant));
  }
  if (!children.empty()) build(children);
}

void Growth::balance() {
  std::vector<TileId> leaves;
  for (const auto& [id, info] : tiles_)
    if (is_split_.count(id) == 0) leaves.push_back(id);
  std::sort(leaves.begin(), leaves.end());
  const std::vector<TileId> balanced = world::balance(leaves);
  // A leaf that is not one any more has been split; so have those between it and its new leaves.
  for (TileId id : balanced)
    while (id.level < coarsest_level_ && is_split_.emplace(id.parent(), 1).second) id = id.parent();
  std::unordered_map<int, std::vector<TileId>> missing;
  for (const auto& [id, split] : is_split_)
    for (int quadrant = 0; quadrant < 4; ++quadrant)
      if (tiles_.count(id.child(quadrant)) == 0)
        missing[id.level - 1].push_back(id.child(quadrant));
  for (int level = coarsest_level_; level > -64; --level) {
    auto found = missing.find(level);
    if (found == missing.end()) continue;
    std::sort(found->second.begin(), found->second.end());
    build(found->second);
  }
}

void Growth::add_imagery(world::WorldManifest& manifest) {
  const auto& pyramids = surface_.layers().imagery();
  for (std::size_t row = 0; row < pyramids.size(); ++row) {
    // Pictures do not depend on what the sequences want: an earlier run has made them.
    const bool is_there =
        row < previous_imagery_.size() &&
        std::all_of(previous_imagery_[row].tiles.begin(), previous_imagery_[row].tiles.end(),
                    [&](const world::ImageryTileInfo& tile) {
                      return world::is_imagery_tile_whole(folder_, row, tile);
                    });
    manifest.imagery.push_back(is_there ? previous_imagery_[row]
                                        : pyramids[row].second->write(folder_, row, context_));
    manifest.imagery.back().layer = pyramids[row].first;
  }
}

world::WorldRasters Growth::rasters_of_world() const {
  world::WorldRasters rasters{.sources = rasters_of(surface_),
                              .land_cover = surface_.layers().cover_rasters(),
                              .imagery = {}};
  for (const auto& [layer, pyramid] : surface_.layers().imagery()) {
    rasters.imagery.emplace_back();
    for (const auto& raster : pyramid->rasters())
      rasters.imagery.back().push_back(raster->grid().info(raster->name()));
  }
  return rasters;
}

/// Of the first hundred kinds of all that the sources' files say.
void Growth::warn_of_what_is_unknown(const world::WorldManifest& manifest) const {
  std::vector<std::pair<std::string, const core::Ledger*>> ledgers;
  for (const world::SourceInfo& source : manifest.sources)
    ledgers.emplace_back(source.name, &source.ledger);
  for (const world::LayerInfo& layer : manifest.layers)
    ledgers.emplace_back(fmt::format("{} ({})", layer.name, layer.source), &layer.ledger);
  ledgers.emplace_back("aridity_raster", &manifest.aridity_ledger);
  constexpr std::size_t kMostKinds = 100;
  std::size_t num_told = 0, num_untold = 0;
  for (const auto& [name, ledger] : ledgers)
    for (const std::string& line : ledger->warnings()) {
      if (num_told == kMostKinds) {
        ++num_untold;
        continue;
      }
      context_.log.warn("{}: {}", name, line);
      ++num_told;
    }
  if (num_untold > 0)
    context_.log.warn("and {} more kinds; terracast world info {} --ledger shows them all",
                      num_untold, folder_.string());
}

void Growth::finish(double radius_m) {
  world::WorldManifest manifest;
  const WorldOptions& options = surface_.options();
  manifest.name = options.name;
  manifest.input_hash = surface_.input_hash();
  manifest.origin = surface_.frame().origin();
  manifest.size_m = options.size_m;
  manifest.base_level = base_level_;
  manifest.coarsest_level = coarsest_level_;
  manifest.measured_level = surface_.measured_level();
  manifest.apron_radius_m = radius_m;
  manifest.outside = options.outside;
  manifest.seed = static_cast<std::uint64_t>(options.seed);
  manifest.sources = surface_.sources();
  manifest.layers = surface_.layers().infos();
  if (surface_.layers().dryness() != nullptr)
    manifest.aridity_ledger = surface_.layers().dryness()->ledger();
  const std::vector<world::Prototype>& prototypes = surface_.layers().prototypes();
  for (std::size_t row = 0; row < prototypes.size(); ++row)
    manifest.prototypes.push_back(world::write_prototype(folder_, row, prototypes[row]));
  const std::vector<world::Texture>& textures = surface_.layers().textures();
  for (std::size_t row = 0; row < textures.size(); ++row)
    manifest.textures.push_back(world::write_texture(folder_, row, textures[row]));
  if (world::num_bytes_of(manifest.textures) > world::kMaxTexturesBytes)
    fail(ErrorKind::Input,
         "the textures of all layers take {} bytes of memory, {} would do; make them smaller",
         world::num_bytes_of(manifest.textures), world::kMaxTexturesBytes);
  add_imagery(manifest);
  const std::vector<world::Volume>& volumes = surface_.layers().volumes();
  for (std::size_t row = 0; row < volumes.size(); ++row)
    manifest.volumes.push_back(world::write_volume(folder_, row, volumes[row]));
  manifest.volume_places = surface_.layers().volume_places();
  manifest.ways = world::write_ways(folder_, surface_.layers().ways());
  world::write_rasters(folder_, manifest.input_hash, rasters_of_world(),
                       surface_.layers().cover_rows());
  surface_.keep_ground(folder_);
  manifest.finest_level = coarsest_level_;
  for (const auto& [id, info] : tiles_) {
    manifest.finest_level = std::min(manifest.finest_level, id.level);
    manifest.tiles.push_back(info);
  }
  warn_of_what_is_unknown(manifest);
  world::write_manifest(folder_, std::move(manifest));
}

world::TileStore Growth::run() {
  claim_folder();
  read_previous();
  const double radius_m = apron_radius_m();
  std::vector<TileId> level_tiles = roots(radius_m);
  for (const TileId& id : previous_)
    if (id.level == coarsest_level_ &&
        std::find(level_tiles.begin(), level_tiles.end(), id) == level_tiles.end())
      level_tiles.push_back(id);
  build(level_tiles);
  while (true) {
    std::vector<TileId> parents;
    for (const TileId& id : level_tiles)
      if (must_split(tiles_.at(id))) parents.push_back(id);
    if (parents.empty()) break;
    split(parents);
    level_tiles.clear();
    for (const TileId& parent : parents)
      for (int quadrant = 0; quadrant < 4; ++quadrant)
        level_tiles.push_back(parent.child(quadrant));
  }
  balance();
  finish(radius_m);
  context_.log.info("{}: {} tiles, {} of them new; apron to {:.0f} km", folder_.string(),
                    tiles_.size(), num_built_, radius_m / 1000.0);
  return world::TileStore::open(folder_);
}

}  // namespace

world::TileStore run_tile_stage(const WorldSurface& surface, const TilePlan& plan,
                                const std::filesystem::path& folder, const core::Context& context) {
  const core::ThreadLimit limit(context.num_threads);
  return Growth(surface, plan, folder, context).run();
}

}  // namespace terracast::tiler
