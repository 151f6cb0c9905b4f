#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "core/ledger.h"
#include "geo/box3.h"
#include "geo/geodesy.h"
#include "world/imagery_info.h"
#include "world/texture.h"
#include "world/tile.h"
#include "world/volume.h"
#include "world/volume_info.h"
#include "world/way_network.h"

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
  double spacing_m = 0.0;             ///< between its samples on the ground; 0: it has none
  std::string content_hash;           ///< of the file or of the parameters
  std::string licence;                ///< as the config states it
  std::string accuracy;               ///< of its heights, as the config states it
  std::int64_t num_voids = 0;         ///< samples of the source without a value
  std::int64_t num_voids_filled = 0;  ///< of these, filled from their surroundings
  core::Ledger ledger = {};           ///< what its files say
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
  core::Ledger ledger = {};  ///< what its files say
};

/// A prototype of a store.
struct PrototypeInfo {
  std::string name;
  std::string content_hash;  ///< of its file
  bool is_model = false;     ///< as Prototype's
};

/// A texture of a store.
struct TextureInfo {
  std::string name;
  int width_px = 0;
  int height_px = 0;
  int channels = 3;
  std::string content_hash;  ///< of its file
};

/// The ways of a store.
struct WaysInfo {
  std::int64_t num_parts = 0;  ///< 0: there are none, and no file
  std::string content_hash;    ///< of their file
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
  core::Ledger aridity_ledger = {};  ///< what the raster of aridity indices says; empty without one
  std::vector<PrototypeInfo> prototypes;
  std::vector<TextureInfo> textures;
  std::vector<ImageryInfo> imagery;  ///< the first that knows a place is believed
  std::vector<VolumeInfo> volumes;
  std::vector<VolumePlace> volume_places;
  WaysInfo ways;
  std::vector<TileInfo> tiles;  ///< sorted by id
};

/// A finished world folder:
///
///     manifest.json                  written last: the store is complete when it exists
///     tiles/<level>/<x>_<y>.tile
///     prototypes/<row>.prototype
///     textures/<row>.png
///     imagery/<row>/<level>/<x>_<y>.png
///     volumes/<row>.volume
///     ways.bin                       where it has any
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
  Tile load(const TileId& id, WaterDepth depth = WaterDepth::LeftOut) const;

  /// Reads a prototype and checks it.
  /// row      of WorldManifest::prototypes
  /// throws   as load()
  Prototype load_prototype(std::size_t row) const;

  /// Reads a texture and checks it.
  /// row      of WorldManifest::textures
  /// throws   as load()
  Texture load_texture(std::size_t row) const;

  /// Reads a tile of imagery (three channels, or four with alpha) and checks it.
  /// row    of WorldManifest::imagery
  /// tile   of its tiles
  /// throws as load()
  core::Image8 load_imagery(std::size_t row, std::size_t tile) const;

  /// Reads a volume and checks it.
  /// row    of WorldManifest::volumes
  /// throws as load()
  Volume load_volume(std::size_t row) const;

  /// Reads the world's ways and checks them; without any, none.
  /// throws as load()
  WayNetwork load_ways() const;

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

/// Writes a texture atomically and says what the manifest shall hold of it.
/// throws   Input: as check_texture()
TextureInfo write_texture(const std::filesystem::path& store, std::size_t row,
                          const Texture& texture);

/// What the textures of a world take in memory, with all their coarser levels.
std::size_t num_bytes_of(const std::vector<TextureInfo>& textures);

/// Writes a tile of imagery atomically; its sources are left to the caller.
/// image   kImageryTile_px a side, RGBA; alpha is left out where all of it is 255
ImageryTileInfo write_imagery_tile(const std::filesystem::path& store, std::size_t row,
                                   const ImageryTileId& id, const core::Image8& image);

/// Whether a tile of imagery is there and is the one that was listed.
bool is_imagery_tile_whole(const std::filesystem::path& store, std::size_t row,
                           const ImageryTileInfo& tile);

/// Writes a volume atomically and says what the manifest shall hold of it.
/// throws   Input: as check_volume()
VolumeInfo write_volume(const std::filesystem::path& store, std::size_t row, const Volume& volume);

/// Writes the world's ways atomically and says what the manifest shall hold of them; of none nothing is written.
WaysInfo write_ways(const std::filesystem::path& store, const WayNetwork& network);

/// What a manifest would hold of a tile file that is there already and whole; nothing when it is
/// missing or damaged.
std::optional<TileInfo> inspect_tile(const std::filesystem::path& store, const TileId& id);

/// Writes manifest.json (tiles sorted).
void write_manifest(const std::filesystem::path& store, WorldManifest manifest);

}  // namespace terracast::world
