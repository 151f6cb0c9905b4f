#include "tiler/preview.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <map>
#include <optional>
#include <unordered_map>

#include "core/bytes_text.h"
#include "core/error.h"
#include "core/parallel.h"
#include "core/semantic_class.h"
#include "tiler/map_drawing.h"
#include "world/tile.h"

namespace terracast::tiler {
namespace {

using world::kTileCells;
using world::Tile;
using world::TileId;
using world::TileStore;

constexpr Colour kPaper = {246, 244, 238};
constexpr Colour kInk = {40, 40, 40};
constexpr Colour kSea = {118, 164, 206};
constexpr Colour kWhite = {255, 255, 255};
constexpr Colour kPathColours[] = {{214, 39, 40},  {31, 119, 180}, {148, 20, 160},
                                   {255, 127, 14}, {23, 150, 150}, {120, 70, 20}};

constexpr Colour kHatch = {150, 70, 60};
constexpr int kHatchPeriod_px = 10;

/// Whether a pixel lies on a line of the hatch, at 45 degrees.
bool is_hatched(int x_px, int y_px) { return (x_px + y_px) % kHatchPeriod_px == 0; }

/// Part of the square that is shown beyond it, on each side.
constexpr double kMargin = 0.03;

/// Land tints from the lowest to the highest ground.
struct Tint {
  double share;
  Colour colour;
};
constexpr Tint kTints[] = {{0.0, {122, 160, 104}}, {0.2, {170, 190, 124}}, {0.4, {224, 212, 150}},
                           {0.6, {204, 166, 112}}, {0.8, {170, 132, 104}}, {0.93, {216, 208, 202}},
                           {1.0, {250, 250, 250}}};

Eigen::Vector3d tint_of(double share) {
  const auto colour = [](const Tint& tint) {
    return Eigen::Vector3d(tint.colour[0], tint.colour[1], tint.colour[2]);
  };
  for (std::size_t i = 1; i < std::size(kTints); ++i)
    if (share <= kTints[i].share) {
      const double t =
          std::max(share - kTints[i - 1].share, 0.0) / (kTints[i].share - kTints[i - 1].share);
      return colour(kTints[i - 1]) + t * (colour(kTints[i]) - colour(kTints[i - 1]));
    }
  return colour(kTints[std::size(kTints) - 1]);
}

/// Of covers that a layer tells: that of the semantic class that they give the ground.
std::optional<Eigen::Vector3d> color_of(world::Cover cover) {
  using core::SemanticClass;
  const auto color = [](SemanticClass semantic_class) -> std::optional<Eigen::Vector3d> {
    const auto& srgb =
        core::semantic_classes()[static_cast<std::size_t>(semantic_class)].color_srgb;
    return Eigen::Vector3d(srgb[0], srgb[1], srgb[2]);
  };
  switch (cover) {
    case world::Cover::Forest:
      return color(SemanticClass::Tree);  // from above, the crowns
    case world::Cover::Shrubs:
      return color(SemanticClass::Shrubland);
    case world::Cover::Grass:
      return color(SemanticClass::Grass);
    case world::Cover::Crops:
      return color(SemanticClass::Cropland);
    case world::Cover::BuiltUp:
      return color(SemanticClass::Building);
    case world::Cover::Bare:
      return color(SemanticClass::Rock);
    case world::Cover::Snow:
      return color(SemanticClass::Snow);
    case world::Cover::Wetland:
      return color(SemanticClass::Wetland);
    case world::Cover::Lake:
      return color(SemanticClass::Lake);
    case world::Cover::River:
      return color(SemanticClass::River);
    case world::Cover::Land:
    case world::Cover::Sea:
    case world::Cover::Outside:
    case world::Cover::Seabed:
      return std::nullopt;
  }
  return std::nullopt;
}

bool is_in_world(world::Cover cover) {
  return cover != world::Cover::Sea && cover != world::Cover::Outside;
}

/// Heights and covers over the map: of the level that fits its pixels, or the finest that is there.
class LevelSampler {
 public:
  LevelSampler(const TileStore& store, const Eigen::AlignedBox2d& area_world, double metres_per_px)
      : level_(std::clamp(static_cast<int>(std::floor(std::log2(metres_per_px))),
                          store.manifest().finest_level, store.manifest().coarsest_level)) {
    std::vector<TileId> ids;
    const TileId low = world::tile_at(level_, area_world.min().x(), area_world.min().y());
    const TileId high = world::tile_at(level_, area_world.max().x(), area_world.max().y());
    for (int y = low.y; y <= high.y; ++y)
      for (int x = low.x; x <= high.x; ++x)
        for (TileId id{level_, x, y}; id.level <= store.manifest().coarsest_level; id = id.parent())
          if (store.find(id) != nullptr) {
            ids.push_back(id);
            break;
          }
    std::sort(ids.begin(), ids.end());
    ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
    std::vector<Tile> tiles(ids.size());
    core::parallel_for(static_cast<std::int64_t>(ids.size()), [&](std::int64_t i) {
      tiles[static_cast<std::size_t>(i)] = store.load(ids[static_cast<std::size_t>(i)]);
    });
    for (std::size_t i = 0; i < ids.size(); ++i) tiles_.emplace(ids[i], std::move(tiles[i]));
    coarsest_level_ = store.manifest().coarsest_level;
  }

  /// The tiles that `at` looks into, in the order of their ids.
  std::vector<const Tile*> tiles() const {
    std::vector<const Tile*> all;
    for (const auto& [id, tile] : tiles_) all.push_back(&tile);
    std::sort(all.begin(), all.end(), [](const Tile* a, const Tile* b) { return a->id < b->id; });
    return all;
  }

  struct Value {
    double z_world = 0.0;
    double spacing_m = 0.0;  ///< of the samples
    world::Cover cover = world::Cover::Land;
    std::uint8_t source = 0;  ///< row of the manifest's sources
    bool is_known = false;
  };

  Value at(double x_world, double y_world) const {
    for (int level = level_; level <= coarsest_level_; ++level) {
      const auto found = tiles_.find(world::tile_at(level, x_world, y_world));
      if (found == tiles_.end()) continue;
      const Tile& tile = found->second;
      const Eigen::Vector2d at =
          (Eigen::Vector2d(x_world, y_world) - tile.id.corner_world()) / tile.id.spacing_m();
      const int i = std::clamp(static_cast<int>(at.x()), 0, kTileCells - 1);
      const int j = std::clamp(static_cast<int>(at.y()), 0, kTileCells - 1);
      const double tx = at.x() - i;
      const double ty = at.y() - j;
      const double south = tile.z_world(i, j) + tx * (tile.z_world(i + 1, j) - tile.z_world(i, j));
      const double north =
          tile.z_world(i, j + 1) + tx * (tile.z_world(i + 1, j + 1) - tile.z_world(i, j + 1));
      const std::size_t nearest = Tile::sample(tx < 0.5 ? i : i + 1, ty < 0.5 ? j : j + 1);
      return {south + ty * (north - south), tile.id.spacing_m(), tile.cover[nearest],
              tile.source[nearest], true};
    }
    return {};
  }

 private:
  int level_;
  int coarsest_level_ = 0;
  std::unordered_map<TileId, Tile> tiles_;
};

/// Rise per metre to the east and north. Where samples are coarser than pixels it is taken over their
/// spacing, between which heights are bilinear: cells would show as facets.
Eigen::Vector2d slope_at(const LevelSampler& sampler, const Eigen::Vector2d& at_world,
                         double metres_per_px) {
  const double reach_m =
      0.5 * std::max(sampler.at(at_world.x(), at_world.y()).spacing_m, metres_per_px);
  const auto rise = [&](const Eigen::Vector2d& along) {
    const Eigen::Vector2d ahead = at_world + reach_m * along, behind = at_world - reach_m * along;
    const LevelSampler::Value high = sampler.at(ahead.x(), ahead.y());
    const LevelSampler::Value low = sampler.at(behind.x(), behind.y());
    return high.is_known && low.is_known ? (high.z_world - low.z_world) / (2.0 * reach_m) : 0.0;
  };
  return {rise(Eigen::Vector2d::UnitX()), rise(Eigen::Vector2d::UnitY())};
}

struct MapFrame {
  int width_px = 0;
  int height_px = 0;
  Eigen::Affine2d world_from_pixel = Eigen::Affine2d::Identity();
  double metres_per_px() const { return world_from_pixel.linear().col(0).norm(); }
  Eigen::Vector2d pixel(double x_world, double y_world) const {
    return world_from_pixel.inverse() * Eigen::Vector2d(x_world, y_world);
  }
  Eigen::Vector2d world(double x_px, double y_px) const {
    return world_from_pixel * Eigen::Vector2d(x_px, y_px);
  }
  Eigen::AlignedBox2d area_world() const {
    Eigen::AlignedBox2d area;
    for (const double x : {0.0, 1.0 * width_px})
      for (const double y : {0.0, 1.0 * height_px}) area.extend(world(x, y));
    return area;
  }
};

struct HeightRange {
  double lowest_m = 0.0;
  double highest_m = 0.0;
};

HeightRange draw_relief(const TileStore& store, const LevelSampler& sampler, const MapFrame& map,
                        core::Image8& image) {
  const int width = map.width_px;
  const int height = map.height_px;
  const double step_m = map.metres_per_px();
  std::vector<LevelSampler::Value> values(static_cast<std::size_t>(width) *
                                          static_cast<std::size_t>(height));
  const auto value = [&](int i, int j) -> LevelSampler::Value& {
    return values[static_cast<std::size_t>(j) * static_cast<std::size_t>(width) +
                  static_cast<std::size_t>(i)];
  };
  core::parallel_for(height, [&](std::int64_t row) {
    const int j = static_cast<int>(row);
    for (int i = 0; i < width; ++i) {
      const Eigen::Vector2d at = map.world(i + 0.5, j + 0.5);
      LevelSampler::Value& here = value(i, j);
      here = sampler.at(at.x(), at.y());
      // Tints follow the height above the curved Earth; a sphere is near enough for colours.
      here.z_world += at.squaredNorm() / (2.0 * geo::kWgs84SemiMajorAxis_m);
    }
  });
  HeightRange range{1e9, -1e9};
  for (const LevelSampler::Value& v : values)
    if (v.is_known && is_in_world(v.cover)) {
      range.lowest_m = std::min(range.lowest_m, v.z_world);
      range.highest_m = std::max(range.highest_m, v.z_world);
    }
  if (range.lowest_m > range.highest_m) range = {0.0, 1.0};
  const double span_m = std::max(range.highest_m - range.lowest_m, 1.0);
  // Gentle land is shown steeper, so that it can be read.
  const double exaggeration = std::clamp(
      0.06 * std::max(map.width_px, map.height_px) * map.metres_per_px() / span_m, 1.0, 8.0);
  const Eigen::Vector3d light = Eigen::Vector3d(-1.0, 1.0, 1.2).normalized();
  core::parallel_for(height, [&](std::int64_t row) {
    const int j = static_cast<int>(row);
    for (int i = 0; i < width; ++i) {
      const LevelSampler::Value& here = value(i, j);
      Eigen::Vector3d colour(kPaper[0], kPaper[1], kPaper[2]);
      if (here.is_known && here.cover == world::Cover::Sea) {
        colour = {kSea[0], kSea[1], kSea[2]};
      } else if (here.is_known) {
        const Eigen::Vector2d slope =
            exaggeration * slope_at(sampler, map.world(i + 0.5, j + 0.5), step_m);
        const double shade =
            std::max(Eigen::Vector3d(-slope.x(), -slope.y(), 1.0).normalized().dot(light), 0.0);
        colour = color_of(here.cover).value_or(tint_of((here.z_world - range.lowest_m) / span_m)) *
                 (0.35 + 0.88 * shade);
      }
      const Eigen::Vector2d at = map.world(i + 0.5, j + 0.5);
      if (at.cwiseAbs().maxCoeff() > 0.5 * store.manifest().size_m)
        colour = 0.45 * colour + 0.55 * Eigen::Vector3d(kPaper[0], kPaper[1], kPaper[2]);
      for (int channel = 0; channel < 3; ++channel)
        image(i, j, channel) = static_cast<std::uint8_t>(std::clamp(colour[channel], 0.0, 255.0));
    }
  });
  return range;
}

/// Rows of the sources that fill what nobody measured.
std::vector<std::uint8_t> rows_of_filled(const world::WorldManifest& manifest) {
  std::vector<std::uint8_t> rows;
  for (std::size_t row = 0; row < manifest.sources.size(); ++row)
    if (manifest.sources[row].kind == "void" || manifest.sources[row].kind == "extend")
      rows.push_back(static_cast<std::uint8_t>(row));
  return rows;
}

/// Hatches what was filled inside the square.
/// returns   whether there is any
bool hatch_filled(const TileStore& store, const LevelSampler& sampler, const MapFrame& map,
                  Canvas& canvas) {
  const std::vector<std::uint8_t> filled = rows_of_filled(store.manifest());
  const double half_m = 0.5 * store.manifest().size_m;
  std::atomic<bool> has_filled = false;
  core::parallel_for(map.height_px, [&](std::int64_t row) {
    const int j = static_cast<int>(row);
    for (int i = 0; i < map.width_px; ++i) {
      const Eigen::Vector2d at = map.world(i + 0.5, j + 0.5);
      if (at.cwiseAbs().maxCoeff() > half_m) continue;
      const LevelSampler::Value here = sampler.at(at.x(), at.y());
      // The nearest sample of a place by the border may lie beyond it.
      if (!here.is_known || here.cover == world::Cover::Outside ||
          std::find(filled.begin(), filled.end(), here.source) == filled.end())
        continue;
      has_filled = true;
      if (is_hatched(i, j)) canvas.fill(i, j, 1, 1, kHatch);
    }
  });
  return has_filled;
}

/// Ways as lines, the widest last, and a dot for each building or other shape of its own, in the
/// colours of their classes. Crops, trees and small things are left to the covers.
void draw_settlements(const LevelSampler& sampler, const MapFrame& map, Canvas& canvas) {
  const double metres_per_px = map.metres_per_px();
  const auto color_of_class = [](core::SemanticClass semantic_class) {
    return core::semantic_classes()[static_cast<std::size_t>(semantic_class)].color_srgb;
  };
  std::vector<const world::Strip*> strips;
  for (const Tile* tile : sampler.tiles())
    for (const world::Strip& strip : tile->objects.strips) strips.push_back(&strip);
  std::stable_sort(strips.begin(), strips.end(), [](const auto* a, const auto* b) {
    return a->half_width_steps < b->half_width_steps;
  });
  for (const world::Strip* strip : strips) {
    const double width_px = 2.0 * strip->half_width_steps * world::kHeightStep_m / metres_per_px;
    // A way of less than a seventh of a pixel would be noise on such a map.
    if (width_px < 0.14) continue;
    std::vector<Eigen::Vector2d> places;
    for (const Eigen::Vector2i& point : strip->points_steps)
      places.push_back(
          map.pixel(point.x() * world::kHeightStep_m, point.y() * world::kHeightStep_m));
    canvas.polyline(places, std::max(width_px, 0.7), color_of_class(strip->coating.semantic_class));
  }
  const Colour building = color_of_class(core::SemanticClass::Building);
  for (const Tile* tile : sampler.tiles())
    for (const world::Solid& solid : tile->objects.solids)
      canvas.disc(map.pixel(solid.place_m.x(), solid.place_m.y()),
                  std::max(4.0 / metres_per_px, 0.6), building);
}

void draw_paths(const std::vector<PreviewPath>& paths, const MapFrame& map, Canvas& canvas,
                double width_px) {
  for (std::size_t k = 0; k < paths.size(); ++k) {
    if (paths[k].positions_world.empty()) continue;
    std::vector<Eigen::Vector2d> places;
    for (const Eigen::Vector3d& at : paths[k].positions_world)
      places.push_back(map.pixel(at.x(), at.y()));
    const Colour& colour = kPathColours[k % std::size(kPathColours)];
    canvas.polyline(places, width_px + 2.0, kWhite);
    canvas.polyline(places, width_px, colour);
    canvas.disc(places.front(), 2.2 * width_px, kWhite);
    canvas.disc(places.front(), 1.6 * width_px, colour);
  }
}

void draw_legend(const TileStore& store, const std::vector<PreviewPath>& paths, const MapFrame& map,
                 const HeightRange& range, bool has_filled, core::Image8& image) {
  Canvas canvas(image);
  const int side_px = map.width_px;
  const int strip_px = image.height() - side_px;
  const int scale = std::max(strip_px / 48, 1);
  const int line_px = 11 * scale;
  const int left = 8 * scale;
  const int top = side_px + 6 * scale;
  canvas.text(left, top, store.manifest().name, scale, kInk);

  const int bar_px = draw_scale_bar(canvas, left, top + line_px, scale, map.metres_per_px(),
                                    0.2 * map.width_px, kInk);

  const int ramp_left = left + std::max(bar_px + 20 * scale, side_px / 4);
  const int ramp_px = side_px / 5;
  for (int i = 0; i < ramp_px; ++i) {
    const Eigen::Vector3d colour = tint_of(static_cast<double>(i) / ramp_px);
    canvas.fill(ramp_left + i, top + line_px, 1, 6 * scale,
                {static_cast<std::uint8_t>(colour.x()), static_cast<std::uint8_t>(colour.y()),
                 static_cast<std::uint8_t>(colour.z())});
  }
  canvas.text(ramp_left, top, "height above ellipsoid", scale, kInk);
  canvas.text(ramp_left, top + 2 * line_px, fmt::format("{:.0f}", range.lowest_m), scale, kInk);
  const std::string highest = fmt::format("{:.0f} m", range.highest_m);
  canvas.text(ramp_left + ramp_px - Canvas::text_width_px(highest, scale) + scale,
              top + 2 * line_px, highest, scale, kInk);

  const int names_left = ramp_left +
                         std::max(ramp_px, Canvas::text_width_px("height above ellipsoid", scale)) +
                         24 * scale;
  int x = names_left;
  int y = top;
  if (has_filled) {
    for (int j = 0; j < 7 * scale; ++j)
      for (int i = 0; i < 10 * scale; ++i)
        if (is_hatched(x + i, y + j)) canvas.fill(x + i, y + j, 1, 1, kHatch);
    canvas.text(x + 14 * scale, y, "filled, not measured", scale, kInk);
    y += line_px;
  }
  for (std::size_t k = 0; k < paths.size(); ++k) {
    const int width = Canvas::text_width_px(paths[k].name, scale) + 24 * scale;
    if (x + width > image.width() && x > names_left) {
      x = names_left;
      y += line_px;
    }
    if (y + line_px > image.height()) break;
    canvas.fill(x, y + 2 * scale, 10 * scale, 3 * scale, kPathColours[k % std::size(kPathColours)]);
    canvas.text(x + 14 * scale, y, paths[k].name, scale, kInk);
    x += width;
  }
}

void draw_north_arrow(const MapFrame& map, Canvas& canvas) {
  const int side_px = map.width_px;
  const double size = side_px / 22.0;
  const Eigen::Vector2d tip(side_px - 1.1 * size, 0.5 * size);
  const Eigen::Vector2d foot = tip + Eigen::Vector2d(0.0, 1.2 * size);
  for (const auto& [colour, extra] : {std::pair{kWhite, 2.0}, {kInk, 0.0}}) {
    const double width = size / 12.0 + extra;
    canvas.line(tip, foot, width, colour);
    canvas.line(tip, tip + Eigen::Vector2d(-0.3 * size, 0.45 * size), width, colour);
    canvas.line(tip, tip + Eigen::Vector2d(0.3 * size, 0.45 * size), width, colour);
  }
  const int scale = std::max(side_px / 450, 1);
  canvas.text(static_cast<int>(foot.x()) - 2 * scale, static_cast<int>(foot.y()) + 3 * scale, "N",
              scale, kInk);
}

void check_size(int size_px) {
  if (size_px < 64 || size_px > 16384)
    core::fail(core::ErrorKind::Config, "a map of {} pixels; 64 to 16384 can be drawn", size_px);
}

/// What a source says of itself; a source that says nothing is told from one that was not asked.
std::string_view stated(std::string_view words) { return words.empty() ? "not stated" : words; }

}  // namespace

core::Image8 render_preview(const TileStore& store, const std::vector<PreviewPath>& paths,
                            int size_px) {
  check_size(size_px);
  const int strip_px = std::max(size_px / 20, 40);
  MapFrame map;
  map.width_px = map.height_px = size_px - strip_px;
  const double half_side_m = store.manifest().size_m * (0.5 + kMargin);
  const double metres_per_px = 2.0 * half_side_m / map.width_px;
  map.world_from_pixel = Eigen::Translation2d(-half_side_m, half_side_m) *
                         Eigen::Scaling(metres_per_px, -metres_per_px);
  core::Image8 image(map.width_px, size_px, 3, kPaper[0]);
  Canvas canvas(image);
  canvas.fill(0, map.height_px, map.width_px, strip_px, kPaper);
  const LevelSampler sampler(store, map.area_world(), map.metres_per_px());
  const HeightRange range = draw_relief(store, sampler, map, image);
  const bool has_filled = hatch_filled(store, sampler, map, canvas);
  draw_settlements(sampler, map, canvas);
  const double half_m = store.manifest().size_m / 2.0;
  const Eigen::Vector2d low = map.pixel(-half_m, -half_m);
  const Eigen::Vector2d high = map.pixel(half_m, half_m);
  canvas.polyline({low, {high.x(), low.y()}, high, {low.x(), high.y()}, low}, 1.2, kInk);
  draw_paths(paths, map, canvas, std::max(map.width_px / 450.0, 1.5));
  draw_north_arrow(map, canvas);
  draw_legend(store, paths, map, range, has_filled, image);
  return image;
}

core::Image8 render_relief(const TileStore& store, const Eigen::Affine2d& world_from_pixel,
                           int width_px, int height_px) {
  constexpr int kMostPixels = 16384;
  if (std::min(width_px, height_px) < 1 || std::max(width_px, height_px) > kMostPixels)
    core::fail(core::ErrorKind::Config, "a map of {} x {} pixels; 1 to {} can be drawn", width_px,
               height_px, kMostPixels);
  const MapFrame map{width_px, height_px, world_from_pixel};
  if (!(map.metres_per_px() > 0.0) || !std::isfinite(map.metres_per_px()))
    core::fail(core::ErrorKind::Config, "a map with pixels of {} m", map.metres_per_px());
  core::Image8 image(width_px, height_px, 3);
  draw_relief(store, LevelSampler(store, map.area_world(), map.metres_per_px()), map, image);
  return image;
}

std::string describe_world(const TileStore& store) {
  const world::WorldManifest& manifest = store.manifest();
  std::string text;
  const auto line = [&](const char* name, const std::string& value) {
    text += fmt::format("{:16}{}\n", name, value);
  };
  const auto spacing = [](int level) { return fmt::format("{:g} m", std::exp2(level)); };
  line("world", manifest.name);
  line("origin", fmt::format("latitude {:.7f}, longitude {:.7f} (WGS84)", manifest.origin.lat_deg,
                             manifest.origin.lon_deg));
  const geo::WorldFrame frame(manifest.origin);
  const double half_m = manifest.size_m / 2.0;
  double lowest_lat = 90.0;
  double highest_lat = -90.0;
  double lowest_lon = 1e9;
  double highest_lon = -1e9;
  for (const double x : {-half_m, 0.0, half_m})
    for (const double y : {-half_m, 0.0, half_m}) {
      const geo::Geodetic place = frame.geodetic_from_world({x, y, 0.0});
      // Counted on from the origin, so that the date line does not tear the square.
      const double lon =
          manifest.origin.lon_deg + std::remainder(place.lon_deg - manifest.origin.lon_deg, 360.0);
      lowest_lat = std::min(lowest_lat, place.lat_deg);
      highest_lat = std::max(highest_lat, place.lat_deg);
      lowest_lon = std::min(lowest_lon, lon);
      highest_lon = std::max(highest_lon, lon);
    }
  line("square",
       fmt::format("{:g} km a side; latitude {:.4f} to {:.4f}, longitude {:.4f} to {:.4f}",
                   manifest.size_m / 1000.0, lowest_lat, highest_lat, lowest_lon, highest_lon));
  line("apron", fmt::format("to {:.0f} km from the origin; outside = \"{}\"",
                            manifest.apron_radius_m / 1000.0, manifest.outside));
  double finest_m = std::exp2(manifest.measured_level);
  for (const world::SourceInfo& source : manifest.sources)
    if (source.kind == "raster") finest_m = std::min(finest_m, source.spacing_m);
  const bool has_insets = finest_m < std::exp2(manifest.measured_level);
  line("measured", fmt::format("from level {} ({}) up{}; the square is covered by level {} ({})",
                               manifest.measured_level, spacing(manifest.measured_level),
                               has_insets ? fmt::format(", in parts every {:.3g} m", finest_m) : "",
                               manifest.base_level, spacing(manifest.base_level)));
  line("seed", fmt::format("{}", manifest.seed));
  line("inputs", manifest.input_hash);

  struct LevelCount {
    std::int64_t num_tiles = 0;
    std::uint64_t num_bytes = 0;
  };
  std::map<int, LevelCount> levels;
  LevelCount all;
  double lowest_m = 1e9;
  double highest_m = -1e9;
  for (const world::TileInfo& tile : manifest.tiles) {
    for (LevelCount* count : {&levels[tile.id.level], &all}) {
      ++count->num_tiles;
      count->num_bytes += tile.num_bytes;
    }
    if (tile.id.level != manifest.base_level) continue;
    lowest_m = std::min(lowest_m, tile.lowest_z_world);
    highest_m = std::max(highest_m, tile.highest_z_world);
  }
  if (highest_m >= lowest_m)
    line("heights", fmt::format("{:.1f} to {:.1f} m, world z of tiles of the base level", lowest_m,
                                highest_m));
  text += fmt::format("\n{:>6} {:>10} {:>8} {:>10}\n", "level", "spacing", "tiles", "size");
  for (auto level = levels.rbegin(); level != levels.rend(); ++level)
    text += fmt::format("{:>6} {:>10} {:>8} {:>10}\n", level->first, spacing(level->first),
                        level->second.num_tiles,
                        core::bytes_text(static_cast<double>(level->second.num_bytes)));
  text += fmt::format("{:>6} {:>10} {:>8} {:>10}\n", "all", "", all.num_tiles,
                      core::bytes_text(static_cast<double>(all.num_bytes)));

  text += "\nsources\n";
  for (const world::SourceInfo& source : manifest.sources) {
    text += fmt::format("  {} ({}), heights above {}", source.name, source.kind,
                        source.vertical_datum.empty() ? "ellipsoid" : source.vertical_datum);
    if (source.spacing_m > 0.0) text += fmt::format(", every {:.3g} m", source.spacing_m);
    text += "\n";
    if (!source.horizontal_crs.empty())
      text += fmt::format("    CRS       {}\n", source.horizontal_crs);
    if (!source.pipeline.empty()) text += fmt::format("    pipeline  {}\n", source.pipeline);
    if (source.kind == "raster")
      text += fmt::format("    voids     {}, of these {} filled from their surroundings\n",
                          source.num_voids, source.num_voids_filled);
    text += fmt::format("    licence   {}\n    accuracy  {}\n", stated(source.licence),
                        stated(source.accuracy));
    if (!source.content_hash.empty())
      text += fmt::format("    hash      {}\n", source.content_hash);
  }
  if (!manifest.layers.empty()) text += "\nlayers\n";
  for (const world::LayerInfo& layer : manifest.layers) {
    text += fmt::format("  {} ({}), from {}\n", layer.name, layer.kind, layer.source);
    for (const auto& [name, count] : layer.counts)
      text += fmt::format("    {:9} {}\n", count, name);
    text += fmt::format("    licence   {}\n    accuracy  {}\n", stated(layer.licence),
                        stated(layer.accuracy));
    if (!layer.content_hash.empty()) text += fmt::format("    hash      {}\n", layer.content_hash);
  }
  return text;
}

std::string ledger_text(const TileStore& store) {
  std::string text;
  const auto add = [&](const std::string& name, const core::Ledger& ledger) {
    if (!ledger.is_empty()) text += fmt::format("{}\n{}\n", name, ledger.table());
  };
  for (const world::SourceInfo& source : store.manifest().sources) add(source.name, source.ledger);
  for (const world::LayerInfo& layer : store.manifest().layers)
    add(fmt::format("{} ({})", layer.name, layer.source), layer.ledger);
  add("aridity_raster", store.manifest().aridity_ledger);
  return text.empty() ? "The sources of this world are no files that say anything.\n" : text;
}

}  // namespace terracast::tiler
