#include "scene/water/sea_exposure.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "core/hash.h"
#include "world/tile_cover.h"

namespace terracast::scene {

using Eigen::Vector2d;

namespace {

/// Where a range of samples lies, in samples of a tile's level from the world's origin.
struct Extent {
  std::int64_t first_x = std::numeric_limits<std::int64_t>::max();
  std::int64_t first_y = std::numeric_limits<std::int64_t>::max();
  std::int64_t last_x = std::numeric_limits<std::int64_t>::min();
  std::int64_t last_y = std::numeric_limits<std::int64_t>::min();

  void add(const world::TileId& id) {
    const std::int64_t x = std::int64_t{id.x} * world::kTileCells;
    const std::int64_t y = std::int64_t{id.y} * world::kTileCells;
    first_x = std::min(first_x, x);
    first_y = std::min(first_y, y);
    last_x = std::max(last_x, x + world::kTileCells);
    last_y = std::max(last_y, y + world::kTileCells);
  }
  /// Of every 2^step_log2-th; the first may lie before the range.
  std::int64_t width(int step_log2) const {
    return (last_x >> step_log2) - (first_x >> step_log2) + 1;
  }
  std::int64_t height(int step_log2) const {
    return (last_y >> step_log2) - (first_y >> step_log2) + 1;
  }
};

}  // namespace

std::shared_ptr<const SeaExposure> SeaExposure::of(const world::TileStore& store,
                                                   std::int64_t max_nodes) {
  const world::WorldManifest& manifest = store.manifest();
  const int level = std::min(manifest.coarsest_level, kLevel);
  auto exposure = std::make_shared<SeaExposure>();
  // Sea farther off than this does not count for what lies in the world's square.
  const double outer_m = 0.5 * manifest.size_m + kReach_m + 2.0 * std::exp2(level);
  std::vector<world::TileId> tiles;
  Extent extent;
  for (const world::TileInfo& info : manifest.tiles) {
    const Vector2d corner = info.id.corner_world();
    if (info.id.level != level || corner.maxCoeff() > outer_m ||
        corner.minCoeff() + info.id.side_m() < -outer_m)
      continue;
    tiles.push_back(info.id);
    extent.add(info.id);
  }
  int step_log2 = 0;
  if (!tiles.empty()) {
    // Sides are divided: their product may be more than 64 bits hold.
    while (extent.width(step_log2) > max_nodes / extent.height(step_log2)) ++step_log2;
    exposure->first_x_ = extent.first_x >> step_log2;
    exposure->first_y_ = extent.first_y >> step_log2;
    exposure->width_ = extent.width(step_log2);
    exposure->height_ = extent.height(step_log2);
    exposure->sums_.resize(
        static_cast<std::size_t>((exposure->width_ + 1) * (exposure->height_ + 1)));
  }
  exposure->spacing_m_ = std::exp2(level + step_log2);
  for (const world::TileId& id : tiles) {
    world::Tile tile;
    tile.cover = world::load_cover(store, id);  // nothing else of it counts
    exposure->add(id, tile, step_log2);
  }
  exposure->add_up();
  return exposure;
}

/// Puts a tile's samples in their places. Neighbours share their borders'.
void SeaExposure::add(const world::TileId& id, const world::Tile& tile, int step_log2) {
  const std::int64_t step = std::int64_t{1} << step_log2;
  const std::int64_t x = std::int64_t{id.x} * world::kTileCells;
  const std::int64_t y = std::int64_t{id.y} * world::kTileCells;
  const auto first_of = [&](std::int64_t at) { return ((at + step - 1) >> step_log2) * step - at; };
  for (std::int64_t j = first_of(y); j < world::kTileSamples; j += step)
    for (std::int64_t i = first_of(x); i < world::kTileSamples; i += step) {
      const std::int64_t column = ((x + i) >> step_log2) - first_x_ + 1;
      const std::int64_t row = ((y + j) >> step_log2) - first_y_ + 1;
      const std::size_t sample = world::Tile::sample(static_cast<int>(i), static_cast<int>(j));
      sums_[static_cast<std::size_t>(row * (width_ + 1) + column)] = {
          1, tile.cover[sample] == world::Cover::Sea ? 1 : 0};
    }
}

/// Makes sums of what was put in places, row upon row.
void SeaExposure::add_up() {
  const std::int64_t row = width_ + 1;
  for (std::int64_t j = 1; j <= height_; ++j) {
    Sums so_far;
    for (std::int64_t i = 1; i < row; ++i) {
      Sums& here = sums_[static_cast<std::size_t>(j * row + i)];
      so_far.known += here.known;
      so_far.sea += here.sea;
      const Sums& below = sums_[static_cast<std::size_t>((j - 1) * row + i)];
      here = {below.known + so_far.known, below.sea + so_far.sea};
    }
  }
  content_hash_ = core::content_hash(
      fmt::format("{} {} {} {} {:.17g} {}", first_x_, first_y_, width_, height_, spacing_m_,
                  core::content_hash(std::as_bytes(std::span(sums_)))));
}

double SeaExposure::share_at(std::int64_t i, std::int64_t j) const {
  const auto reach = static_cast<std::int64_t>(std::floor(kReach_m / spacing_m_));
  const std::int64_t west = std::clamp<std::int64_t>(i - reach, 0, width_);
  const std::int64_t east = std::clamp<std::int64_t>(i + reach + 1, 0, width_);
  const std::int64_t south = std::clamp<std::int64_t>(j - reach, 0, height_);
  const std::int64_t north = std::clamp<std::int64_t>(j + reach + 1, 0, height_);
  const auto at = [&](std::int64_t x, std::int64_t y) -> const Sums& {
    return sums_[static_cast<std::size_t>(y * (width_ + 1) + x)];
  };
  const Sums &ne = at(east, north), &nw = at(west, north), &se = at(east, south),
             &sw = at(west, south);
  const std::int32_t known = ne.known - nw.known - se.known + sw.known;
  const std::int32_t sea = ne.sea - nw.sea - se.sea + sw.sea;
  return known > 0 ? sea / static_cast<double>(known) : 1.0;
}

double SeaExposure::sea_share(const Vector2d& place_world) const {
  if (sums_.empty()) return 1.0;
  const double x = place_world.x() / spacing_m_ - static_cast<double>(first_x_);
  const double y = place_world.y() / spacing_m_ - static_cast<double>(first_y_);
  const double i = std::floor(x);
  const double j = std::floor(y);
  const auto share = [&](int east, int north) {
    return share_at(static_cast<std::int64_t>(i) + east, static_cast<std::int64_t>(j) + north);
  };
  const double south = share(0, 0) + (x - i) * (share(1, 0) - share(0, 0));
  const double north = share(0, 1) + (x - i) * (share(1, 1) - share(0, 1));
  return south + (y - j) * (north - south);
}

double SeaExposure::surf(const Vector2d& place_world) const {
  const double t =
      std::clamp((sea_share(place_world) - kSheltered) / (kOpen - kSheltered), 0.0, 1.0);
  return t * t * (3.0 - 2.0 * t);
}

}  // namespace terracast::scene
