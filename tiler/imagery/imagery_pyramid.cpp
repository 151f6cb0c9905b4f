#include "tiler/imagery/imagery_pyramid.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>

#include "core/parallel.h"
#include "core/progress.h"
#include "tiler/surface.h"
#include "world/texture.h"
#include "world/tile_store.h"

namespace terracast::tiler {
namespace {

using world::ImageryTileId;
using world::kImageryTile_px;

/// Levels go up to pixels of 64 m, which horizons ask for, or to four tiles for the square.
constexpr int kLeastCoarsestLevel = 6;
/// Parts of the square that are built at once: as many as keep many threads busy, and no more than
/// their results fit.
constexpr std::size_t kMaxParts = 256;

/// South-western, south-eastern, north-western, north-eastern.
ImageryTileId child_of(const ImageryTileId& id, int quadrant) {
  return {id.level - 1, 2 * id.x + (quadrant & 1), 2 * id.y + (quadrant >> 1)};
}

}  // namespace

/// What one part of the square has written.
struct ImageryPyramid::Part {
  std::filesystem::path store;
  std::size_t row;
  std::vector<world::ImageryTileInfo> tiles;
};

/// A tile, half as large, for the next coarser level.
struct ImageryPyramid::Built {
  core::Image8 half;  ///< empty: nothing is known
  std::vector<int> sources;
};

ImageryPyramid::ImageryPyramid(int finest_level, double size_m, const WorldSurface& surface,
                               std::vector<std::shared_ptr<const ColorRaster>> rasters)
    : finest_level_(finest_level),
      coarsest_level_(std::max(finest_level, kLeastCoarsestLevel)),
      half_size_m_(0.5 * size_m),
      surface_(surface),
      rasters_(std::move(rasters)) {
  while (ImageryTileId{coarsest_level_, 0, 0}.side_m() < half_size_m_) ++coarsest_level_;
}

bool ImageryPyramid::touches_square(const ImageryTileId& id) const {
  const Eigen::Vector2d corner = id.corner_world();
  return (corner.array() < half_size_m_).all() &&
         (corner.array() + id.side_m() > -half_size_m_).all();
}

std::vector<ImageryTileId> ImageryPyramid::tiles_of_square(int level) const {
  const double side_m = ImageryTileId{level, 0, 0}.side_m();
  const int reach = static_cast<int>(std::ceil(half_size_m_ / side_m));
  std::vector<ImageryTileId> ids;
  for (int x = -reach; x < reach; ++x)
    for (int y = -reach; y < reach; ++y) ids.push_back({level, x, y});
  return ids;
}

core::Image8 ImageryPyramid::finest_tile(const ImageryTileId& id, std::vector<int>& sources) const {
  constexpr int kNodes = ColorRaster::kNodes;
  std::vector<double> z_world;
  z_world.reserve((kNodes + 1) * (kNodes + 1));
  const Eigen::Vector2d corner = id.corner_world();
  for (int j = 0; j <= kNodes; ++j)
    for (int i = 0; i <= kNodes; ++i) {
      const Eigen::Vector2d at = (corner + id.side_m() / kNodes * Eigen::Vector2d(i, j))
                                     .cwiseMax(-half_size_m_)
                                     .cwiseMin(half_size_m_);
      z_world.push_back(surface_.sample(at.x(), at.y()).z_world);
    }
  core::Image8 image(kImageryTile_px, kImageryTile_px, 4);
  for (std::size_t i = 0; i < rasters_.size(); ++i)
    if (rasters_[i]->fill(id, z_world, image)) sources.push_back(static_cast<int>(i));
  return sources.empty() ? core::Image8() : image;
}

ImageryPyramid::Built ImageryPyramid::build(const ImageryTileId& id, Part& part) const {
  if (!touches_square(id)) return {};
  if (id.level > finest_level_) {
    std::array<Built, 4> children;
    for (int quadrant = 0; quadrant < 4; ++quadrant)
      children[static_cast<std::size_t>(quadrant)] = build(child_of(id, quadrant), part);
    return join(id, children, part);
  }
  Built built;
  const core::Image8 image = finest_tile(id, built.sources);
  if (image.empty()) return {};
  world::ImageryTileInfo info = world::write_imagery_tile(part.store, part.row, id, image);
  info.sources = built.sources;
  part.tiles.push_back(std::move(info));
  built.half = world::halved(image);
  return built;
}

ImageryPyramid::Built ImageryPyramid::join(const ImageryTileId& id,
                                           const std::array<Built, 4>& children, Part& part) const {
  core::Image8 image(kImageryTile_px, kImageryTile_px, 4);
  std::set<int> sources;
  for (std::size_t quadrant = 0; quadrant < 4; ++quadrant) {
    const core::Image8& half = children[quadrant].half;
    if (half.empty()) continue;
    sources.insert(children[quadrant].sources.begin(), children[quadrant].sources.end());
    const int x0 = (quadrant & 1) != 0 ? half.width() : 0;
    const int y0 = (quadrant & 2) != 0 ? 0 : half.height();  // rows run southward
    for (int y = 0; y < half.height(); ++y)
      std::copy(half.row(y).begin(), half.row(y).end(), &image(x0, y0 + y));
  }
  if (sources.empty()) return {};
  Built built{.half = world::halved(image), .sources = {sources.begin(), sources.end()}};
  world::ImageryTileInfo info = world::write_imagery_tile(part.store, part.row, id, image);
  info.sources = built.sources;
  part.tiles.push_back(std::move(info));
  return built;
}

world::ImageryInfo ImageryPyramid::write(const std::filesystem::path& store, std::size_t row,
                                         const core::Context& context) const {
  int part_level = finest_level_;
  while (part_level < coarsest_level_ && tiles_of_square(part_level).size() > kMaxParts)
    ++part_level;
  std::vector<ImageryTileId> ids = tiles_of_square(part_level);
  std::vector<Part> parts(ids.size(), Part{store, row, {}});
  std::vector<Built> built(ids.size());
  {
    core::Progress progress(context, "parts of imagery", static_cast<std::int64_t>(ids.size()));
    core::parallel_for(static_cast<std::int64_t>(ids.size()), [&](std::int64_t i) {
      const auto at = static_cast<std::size_t>(i);
      built[at] = build(ids[at], parts[at]);
      progress.advance();
    });
  }
  Part rest{store, row, {}};
  std::map<ImageryTileId, Built> finer;
  for (std::size_t i = 0; i < ids.size(); ++i) finer[ids[i]] = std::move(built[i]);
  for (int level = part_level + 1; level <= coarsest_level_; ++level) {
    std::map<ImageryTileId, Built> coarser;
    for (const ImageryTileId& id : tiles_of_square(level)) {
      std::array<Built, 4> children;
      for (int quadrant = 0; quadrant < 4; ++quadrant)
        if (const auto found = finer.find(child_of(id, quadrant)); found != finer.end())
          children[static_cast<std::size_t>(quadrant)] = std::move(found->second);
      coarser[id] = join(id, children, rest);
    }
    finer = std::move(coarser);
  }
  world::ImageryInfo info;
  info.finest_level = finest_level_;
  info.coarsest_level = coarsest_level_;
  for (const auto& raster : rasters_) info.sources.push_back(raster->name());
  parts.push_back(std::move(rest));
  for (Part& part : parts)
    info.tiles.insert(info.tiles.end(), std::make_move_iterator(part.tiles.begin()),
                      std::make_move_iterator(part.tiles.end()));
  std::sort(info.tiles.begin(), info.tiles.end(),
            [](const auto& a, const auto& b) { return a.id < b.id; });
  return info;
}

}  // namespace terracast::tiler
