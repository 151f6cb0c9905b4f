#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "geo/box3.h"
#include "geo/geodesy.h"
#include "world/tile.h"

namespace terracast::world {

/// Where heights come from; Tile::source counts these.
struct SourceInfo {
  std::string
      name;  ///< file name without folder, or "procedural", "sea", "extended", "filled void"
  std::string kind;            ///< raster, procedural, analytic, sea, extend, void
  std::string horizontal_crs;  ///< as GDAL names it; empty for those that are not rasters
  std::string vertical_datum;  ///< ellipsoid, egm96, egm2008, or the file of a grid of offsets
  std::string
      pipeline;  ///< the PROJ pipeline from its CRS to latitude and longitude; empty for identity
  double spacing_m = 0.0;             ///< between its samples on the ground
  std::string content_hash;           ///< of the file or of the parameters
  std::string licence;                ///< as the config states it
  std::string accuracy;               ///< of its heights, as the config states it
  std::int64_t num_voids = 0;         ///< samples of the source without a value
  std::int64_t num_voids_filled = 0;  ///< of these, filled from their surroundings
};

/// A layer of what stands on the ground or is painted on it; Provenance::layer counts these.
struct LayerInfo {
  std::string name;          ///< as the config calls it
  std::string kind;          ///< buildings, vegetation, …
  std::string source;        ///< file name without folder, or "procedural"
  std::string content_hash;  ///< of the file or of the parameters
  std::string licence;       ///< as the config states it
  std::string accuracy;      ///< of its places, as the config states it
  /// What was read, used, repaired and left out, by name, in the order in which it was told.
  std::vector<std::pair<std::string, std::int64_t>> counts;
};

/// A prototype of a store.
struct PrototypeInfo {
  std::string name;
  std::string content_hash;  ///< of its file
};

/// One tile of a store.
struct TileInfo {
  TileId id;
  double lowest_z_world = 0.0;
  double highest_z_world = 0.0;
  std::uint64_t num_bytes = 0;
  std::uint64_t objects_bytes = 0;  ///< of these, what stands on the tile, inflated
  std::string content_hash = {};
  geo::Box3d box_world() const;
};

/// What a store is. manifest.json holds neither threads, hosts, times nor absolute paths.
struct WorldManifest {
  std::string name;
  std::string input_hash;  ///< of everything that determines the tiles
  geo::Geodetic origin;    ///< of the world frame
  double size_m = 0.0;     ///< side of the square of the world, centred on the origin
  int finest_level = 0;    ///< anywhere
  int base_level = 0;      ///< the coarsest level that covers the square fully by measured samples
  int coarsest_level = 0;  ///< covers the apron too; every place of it is in a tile of this level
  int measured_level = 0;  ///< levels from here up hold no synthetic detail
  double apron_radius_m = 0.0;  ///< tiles reach at least this far from the origin
  std::string
      outside;  ///< error, sea, extend, procedural: what the config asked for where coverage is missing
  std::uint64_t seed = 0;
  std::vector<SourceInfo> sources;
  std::vector<LayerInfo> layers;
  std::vector<PrototypeInfo> prototypes;
  std::vector<TileInfo> tiles;  ///< sorted by id
};

/// A finished world folder:
///
///     manifest.json                  written last: the store is complete when it exists
///     tiles/<level>/<x>_<y>.tile
///     prototypes/<row>.prototype
///
/// Threads: safe.
class TileStore {
 public:
  /// throws Io: no such folder; Input: no or damaged manifest (says that tiling has not finished)
  static TileStore open(const std::filesystem::path& folder);

  const WorldManifest& manifest() const { return manifest_; }
  const std::filesystem::path& folder() const { return folder_; }
  const TileInfo* find(const TileId& id) const;

  /// Reads a tile and checks it.
  /// throws Input: damaged (a flipped bit is found) or not the manifest's; Io
  Tile load(const TileId& id) const;

  /// Reads a prototype and checks it.
  /// row      of WorldManifest::prototypes
  /// throws   as load()
  Prototype load_prototype(std::size_t row) const;

  /// The sea's depth in a tile (Tile::sea_depth_steps); empty where it has none.
  /// throws as load()
  std::vector<std::int32_t> load_sea_depth(const TileId& id) const;

 private:
  const TileInfo& listed(const TileId& id) const;

  std::filesystem::path folder_;
  WorldManifest manifest_;
  std::unordered_map<TileId, std::size_t> index_;
};

/// Path of a tile's file inside a store.
std::filesystem::path tile_path(const std::filesystem::path& store, const TileId& id);

/// Writes a tile atomically and says what the manifest shall hold of it.
TileInfo write_tile(const std::filesystem::path& store, const Tile& tile);

/// Writes a prototype atomically and says what the manifest shall hold of it.
PrototypeInfo write_prototype(const std::filesystem::path& store, std::size_t row,
                              const Prototype& prototype);

/// What a manifest would hold of a tile file that is there already and whole; nothing when it is
/// missing or damaged.
std::optional<TileInfo> inspect_tile(const std::filesystem::path& store, const TileId& id);

/// Writes manifest.json (tiles sorted).
void write_manifest(const std::filesystem::path& store, WorldManifest manifest);

}  // namespace terracast::world
