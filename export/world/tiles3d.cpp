#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <regex>
#include <set>
#include <unordered_map>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/json.h"
#include "core/parallel.h"
#include "core/progress.h"
#include "export/world/model_file.h"
#include "export/world/world_format.h"
#include "geo/units.h"

// 3D Tiles 1.1 (OGC 22-025r4): tileset.json and a glTF file for each tile of the world. A tile's content lies in
// east-north-up about its centre; readers turn glTF's y up into z up and apply the tile's transform to ECEF.

namespace terracast::world_export {
namespace {

using core::ErrorKind;
using core::fail;
using core::Json;
using world::TileId;

/// A coarser tile's borders may lie off a finer one's by less than this many of its spacings.
constexpr double kSkirtSpacings = 2.0;
/// Written last: an export is whole when it is there. Until then the other one names all tiles of the folder.
constexpr const char* kTileset = "tileset.json";
constexpr const char* kPartial = "tileset.partial.json";
/// In asset.extras of both: whose they are.
constexpr const char* kMark = "terracast_export";
constexpr const char* kMarkText = "3dtiles";
/// Tilesets of ours are no deeper, and name no longer names.
constexpr int kDeepest = 64;
constexpr std::size_t kLongestName = 64;
/// Of the picture of each tile's ground.
constexpr int kUsualSide_px = 512;

/// A bounding volume of the kind "region", with room for floats' last places.
class Bounds {
 public:
  void add(const geo::Geodetic& place) {
    constexpr double kRoom_rad = 1e-10;  // less than a millimetre
    constexpr double kRoom_m = 1e-3;
    const double lat = geo::radians_from_degrees(place.lat_deg);
    const double lon = geo::radians_from_degrees(place.lon_deg);
    add(Bounds({lon - kRoom_rad, lat - kRoom_rad, place.height_m - kRoom_m},
               {lon + kRoom_rad, lat + kRoom_rad, place.height_m + kRoom_m}));
  }
  void add(const Bounds& other) {
    lowest_ = lowest_.cwiseMin(other.lowest_);
    highest_ = highest_.cwiseMax(other.highest_);
  }
  Bounds() = default;
  /// West, south, east, north in radians, lowest and highest ellipsoidal height.
  std::vector<double> values() const {
    return {lowest_.x(), lowest_.y(), highest_.x(), highest_.y(), lowest_.z(), highest_.z()};
  }

 private:
  Bounds(const Eigen::Vector3d& lowest, const Eigen::Vector3d& highest)
      : lowest_(lowest), highest_(highest) {}

  /// Longitude, latitude, height.
  Eigen::Vector3d lowest_ = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity());
  Eigen::Vector3d highest_ = -lowest_;
};

class TilesetWriter {
 public:
  explicit TilesetWriter(const WorldExportInputs& inputs)
      : inputs_(inputs),
        frame_(inputs.store.manifest().origin),
        cut_(cut_of_region(inputs.store, inputs.region, inputs.finest_spacing_m)),
        texture_side_px_(texture_side_px(inputs, cut_, kUsualSide_px, cut_.size())),
        maker_(inputs.store, texture_side_px_ > 0) {}

  void write() {
    const std::vector<TileId> tops = top_tiles();
    for (const TileId& top : tops) collect(top);
    const std::set<std::string> stale = claim_folder();
    core::Progress progress(inputs_.context, "tiles", static_cast<std::int64_t>(tiles_.size()));
    std::vector<Bounds> bounds(tiles_.size());
    core::parallel_for(static_cast<std::int64_t>(tiles_.size()), [&](std::int64_t k) {
      const auto i = static_cast<std::size_t>(k);
      bounds[i] = write_content(tiles_[i]);
      progress.advance();
    });
    // From the leaves up: a tile's volume holds its children's.
    for (std::size_t i = tiles_.size(); i-- > 0;) {
      Bounds& all = bounds_.emplace(tiles_[i], bounds[i]).first->second;
      if (is_leaf(tiles_[i])) continue;
      for (const TileId& child : children_of(tiles_[i])) all.add(bounds_.at(child));
    }

    Json children = Json::array();
    double error_m = 0.0;
    for (const TileId& top : tops) {
      children.push(json_of(top));
      error_m = std::max(error_m, 4.0 * top.spacing_m());
    }
    Json root = Json::object();
    root.set("boundingVolume", volume_of(tops))
        .set("geometricError", error_m)
        .set("refine", "REPLACE")
        .set("children", std::move(children));
    Json tileset = Json::object();
    tileset.set("asset", asset()).set("geometricError", 2.0 * error_m).set("root", std::move(root));
    for (const std::string& name : stale) remove(inputs_.destination / name);
    tileset.write(inputs_.destination / kTileset, 1);
    remove(inputs_.destination / kPartial);
  }

 private:
  /// Until the export has ended, kPartial names all tiles of the folder.
  /// returns   those of an earlier export that this one does not write
  std::set<std::string> claim_folder() const {
    std::set<std::string> stale = earlier_tiles();
    std::set<std::string> named = stale;
    for (const TileId& id : tiles_) {
      named.insert(name_of(id));
      stale.erase(name_of(id));
    }
    Json partial = Json::object();
    partial.set("asset", asset())
        .set("tiles", Json::array_of(std::vector<std::string>(named.begin(), named.end())));
    core::make_folder(inputs_.destination / "tiles");
    partial.write(inputs_.destination / kPartial, 1);
    remove(inputs_.destination / kTileset);
    return stale;
  }
  /// The tiles of an earlier export into the folder.
  /// throws   Input: what is there is of somebody else
  std::set<std::string> earlier_tiles() const {
    std::set<std::string> names;
    const auto add = [&](const std::filesystem::path& file, const std::string& name) {
      static const std::regex own("tiles/-?[0-9]+_-?[0-9]+_-?[0-9]+\\.glb");
      if (name.size() > kLongestName || !std::regex_match(name, own))
        fail(ErrorKind::Input,
             "{}: names {}, which is no tile of an export of terracast; give another folder",
             file.string(), name.substr(0, 2 * kLongestName));
      names.insert(name);
    };
    if (std::filesystem::is_symlink(inputs_.destination / "tiles"))
      fail(ErrorKind::Input,
           "{}: is a link, and tiles are written and removed there; give another folder",
           (inputs_.destination / "tiles").string());
    if (const auto file = inputs_.destination / kPartial; std::filesystem::exists(file))
      for (const std::string& name : read_own(file).at("tiles").strings()) add(file, name);
    const auto file = inputs_.destination / kTileset;
    if (!std::filesystem::exists(file)) return names;
    const std::function<void(const Json&, int)> visit = [&](const Json& tile, int depth) {
      if (depth > kDeepest)
        fail(ErrorKind::Input, "{}: its tiles lie deeper than {}; give another folder",
             file.string(), kDeepest);
      if (tile.has("content")) add(file, tile.at("content").at("uri").string());
      if (!tile.has("children")) return;
      for (std::size_t i = 0; i < tile.at("children").size(); ++i)
        visit(tile.at("children").at(i), depth + 1);
    };
    visit(read_own(file).at("root"), 0);
    return names;
  }
  static Json asset() {
    Json extras = Json::object();
    extras.set(kMark, kMarkText);
    Json asset = Json::object();
    asset.set("version", "1.1").set("extras", std::move(extras));
    return asset;
  }
  /// throws   Input: it is not one of ours
  static Json read_own(const std::filesystem::path& file) {
    Json json = Json::read(file);
    const auto is_own = [&] {
      if (!json.has("asset") || !json.at("asset").has("extras")) return false;
      const Json extras = json.at("asset").at("extras");
      return extras.has(kMark) && extras.at(kMark).string() == kMarkText;
    };
    if (!is_own())
      fail(ErrorKind::Input,
           "{}: is none that this version of terracast has written (asset.extras.{}); give another "
           "folder",
           file.string(), kMark);
    return json;
  }
  /// throws   Io
  static void remove(const std::filesystem::path& file) {
    std::error_code error;
    std::filesystem::remove(file, error);
    if (error) fail(ErrorKind::Io, "{}: cannot be removed: {}", file.string(), error.message());
  }

  bool is_leaf(const TileId& id) const {
    const auto found =
        std::lower_bound(cut_.begin(), cut_.end(), id,
                         [](const world::CutTile& tile, const TileId& at) { return tile.id < at; });
    return found != cut_.end() && found->id == id;
  }

  /// The finest tiles above the cut of which a few cover the region.
  std::vector<TileId> top_tiles() const {
    constexpr std::size_t kMostTops = 4;
    std::vector<TileId> tops;
    for (const world::CutTile& tile : cut_) tops.push_back(tile.id);
    for (int level = tops.front().level;
         tops.size() > kMostTops && level < inputs_.store.manifest().coarsest_level; ++level) {
      for (TileId& id : tops)
        if (id.level <= level) id = id.parent();
      std::sort(tops.begin(), tops.end());
      tops.erase(std::unique(tops.begin(), tops.end()), tops.end());
    }
    // None within another one.
    std::erase_if(tops, [&](const TileId& id) {
      return std::any_of(tops.begin(), tops.end(), [&](const TileId& other) {
        return other.level > id.level && other.contains(id);
      });
    });
    return tops;
  }

  void collect(const TileId& id) {
    tiles_.push_back(id);
    if (is_leaf(id)) return;
    for (const TileId& child : children_of(id)) collect(child);
  }

  std::vector<TileId> children_of(const TileId& id) const {
    std::vector<TileId> children;
    for (int quadrant = 0; quadrant < 4; ++quadrant)
      if (inputs_.store.find(id.child(quadrant)) != nullptr &&
          overlaps(inputs_.store, inputs_.region, id.child(quadrant)))
        children.push_back(id.child(quadrant));
    return children;
  }

  geo::Geodetic center_of(const TileId& id) const {
    const world::TileInfo& info = *inputs_.store.find(id);
    const Eigen::Vector2d center = id.center_world();
    return frame_.geodetic_from_world(
        {center.x(), center.y(), 0.5 * (info.lowest_z_world + info.highest_z_world)});
  }

  std::string name_of(const TileId& id) const {
    return fmt::format("tiles/{}_{}_{}.glb", id.level, id.x, id.y);
  }

  Bounds write_content(const TileId& id) const {
    const geo::Rigid3d enu_from_tile_world = enu_from_world(frame_, center_of(id));
    const std::filesystem::path file = inputs_.destination / name_of(id);
    const WorldModel model = core::with_context(
        [&] {
          return maker_.make({{.id = id, .coarser_sides = 0}}, enu_from_tile_world,
                             {.region = std::nullopt,
                              .skirt_m = kSkirtSpacings * id.spacing_m(),
                              .texture_side_px = texture_side_px_});
        },
        fmt::format("making {}", file.string()));
    write_model(model, center_of(id), file, "glb2");
    const geo::Rigid3d world_from_enu = enu_from_tile_world.inverse();
    Bounds bounds;
    const auto add = [&](const Eigen::Vector3d& place_enu) {
      bounds.add(frame_.geodetic_from_world(world_from_enu * place_enu));
    };
    for (const Part& part : model.parts)
      for (const Eigen::Vector3d& vertex : part.vertices) add(vertex);
    for (const Placed& placed : model.placed)
      for (const Part& part : model.prototypes[placed.model])
        for (const Eigen::Vector3d& vertex : part.vertices)
          add((placed.frame_from_model * vertex.homogeneous()).head<3>());
    return bounds;
  }

  Json json_of(const TileId& id) const {
    Json content = Json::object();
    content.set("uri", name_of(id));
    Json json = Json::object();
    json.set("boundingVolume", volume_of({id}))
        .set("geometricError", is_leaf(id) ? 0.0 : id.spacing_m())
        .set("transform", transform_of(id))
        .set("content", std::move(content));
    if (is_leaf(id)) return json;
    Json children = Json::array();
    // Transforms chain from parent to child.
    for (const TileId& child : children_of(id)) {
      Json one = json_of(child);
      one.set("transform", transform_between(id, child));
      children.push(std::move(one));
    }
    json.set("children", std::move(children));
    return json;
  }

  geo::Rigid3d ecef_from_tile(const TileId& id) const {
    return frame_.ecef_from_world() * enu_from_world(frame_, center_of(id)).inverse();
  }
  Json transform_of(const TileId& id) const { return columns_of(ecef_from_tile(id)); }
  Json transform_between(const TileId& parent, const TileId& child) const {
    return columns_of(ecef_from_tile(parent).inverse() * ecef_from_tile(child));
  }
  static Json columns_of(const geo::Rigid3d& transform) {
    const Eigen::Matrix3d rotation = transform.rotation.toRotationMatrix();
    std::vector<double> columns;
    for (int column = 0; column < 3; ++column) {
      for (int row = 0; row < 3; ++row) columns.push_back(rotation(row, column));
      columns.push_back(0.0);
    }
    for (int row = 0; row < 3; ++row) columns.push_back(transform.translation[row]);
    columns.push_back(1.0);
    return Json::array_of(columns);
  }

  Json volume_of(const std::vector<TileId>& ids) const {
    Bounds all;
    for (const TileId& id : ids) all.add(bounds_.at(id));
    Json volume = Json::object();
    volume.set("region", Json::array_of(all.values()));
    return volume;
  }

  const WorldExportInputs& inputs_;
  const geo::WorldFrame frame_;
  const std::vector<world::CutTile> cut_;
  const int texture_side_px_;  ///< as many on every level
  const ModelMaker maker_;
  std::vector<TileId> tiles_;  ///< each before its children
  std::unordered_map<TileId, Bounds> bounds_;
};

}  // namespace

WorldFormatInfo tiles3d_world_format() {
  return {"3dtiles",
          "3D Tiles 1.1: a folder with tileset.json, georeferenced, all levels of detail.", "",
          [](const WorldExportInputs& inputs) { TilesetWriter(inputs).write(); }};
}

}  // namespace terracast::world_export
