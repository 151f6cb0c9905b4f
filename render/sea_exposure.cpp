#include "render/sea_exposure.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace terracast::render {

using Eigen::Vector2d;

std::shared_ptr<const SeaExposure> SeaExposure::of(const world::TileStore& store) {
  const world::WorldManifest& manifest = store.manifest();
  const int level = std::min(manifest.coarsest_level, kLevel);
  auto exposure = std::make_shared<SeaExposure>();
  exposure->spacing_m_ = std::exp2(level);
  // Sea farther off than this does not count for what lies in the world's square.
  const double outer_m = 0.5 * manifest.size_m + kReach_m + 2.0 * exposure->spacing_m_;
  std::vector<world::TileId> tiles;
  std::int64_t last_x = std::numeric_limits<std::int64_t>::min();
  std::int64_t last_y = last_x;
  exposure->first_x_ = exposure->first_y_ = std::numeric_limits<std::int64_t>::max();
  for (const world::TileInfo& info : manifest.tiles) {
    const Vector2d corner = info.id.corner_world();
    if (info.id.level != level || corner.maxCoeff() > outer_m ||
        corner.minCoeff() + info.id.side_m() < -outer_m)
      continue;
    tiles.push_back(info.id);
    const auto x = static_cast<std::int64_t>(info.id.x) * world::kTileCells;
    const auto y = static_cast<std::int64_t>(info.id.y) * world::kTileCells;
    exposure->first_x_ = std::min(exposure->first_x_, x);
    exposure->first_y_ = std::min(exposure->first_y_, y);
    last_x = std::max(last_x, x + world::kTileCells);
    last_y = std::max(last_y, y + world::kTileCells);
  }
  if (tiles.empty()) return exposure;
  exposure->width_ = last_x - exposure->first_x_ + 1;
  exposure->height_ = last_y - exposure->first_y_ + 1;
  const std::int64_t row = exposure->width_ + 1;
  std::vector<Sums>& sums = exposure->sums_;
  sums.resize(static_cast<std::size_t>(row * (exposure->height_ + 1)));
  for (const world::TileId& id : tiles) {
    const world::Tile tile = store.load(id);
    const std::int64_t x = static_cast<std::int64_t>(id.x) * world::kTileCells - exposure->first_x_;
    const std::int64_t y = static_cast<std::int64_t>(id.y) * world::kTileCells - exposure->first_y_;
    // Neighbours share their borders' samples.
    for (int j = 0; j < world::kTileSamples; ++j)
      for (int i = 0; i < world::kTileSamples; ++i)
        sums[static_cast<std::size_t>((y + j + 1) * row + x + i + 1)] = {
            1, tile.cover[world::Tile::sample(i, j)] == world::Cover::Sea ? 1 : 0};
  }
  for (std::int64_t j = 1; j <= exposure->height_; ++j) {
    Sums so_far;
    for (std::int64_t i = 1; i < row; ++i) {
      Sums& here = sums[static_cast<std::size_t>(j * row + i)];
      so_far.known += here.known;
      so_far.sea += here.sea;
      const Sums& below = sums[static_cast<std::size_t>((j - 1) * row + i)];
      here = {below.known + so_far.known, below.sea + so_far.sea};
    }
  }
  return exposure;
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

}  // namespace terracast::render
