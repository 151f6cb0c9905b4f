#include "scene/ground/ground_imagery.h"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "core/srgb.h"
#include "scene/ground/blend.h"
#include "scene/ground/noise.h"

namespace terracast::scene {
namespace {

using world::kImageryTile_px;

constexpr int kTileShift = 9;
static_assert(1 << kTileShift == kImageryTile_px);

/// Streams of noise.
constexpr std::uint32_t kImageryDetail = 307;
/// Root mean square of the detail below a picture's pixels, as a share of its albedo.
constexpr float kDetail = 0.16f;
/// Detail keeps within this share of the albedo, so that nothing shines or is black; noise of root mean
/// square 1 is within 3 of 0, and symmetric, so that the mean stays 1.
constexpr float kMostDetail = 0.5f;
/// Relief that the pictures do not show themselves, as shading: none below pixels of a metre.
constexpr double kRelief = 0.35;
constexpr double kReliefFromPixel_m = 1.0;
constexpr double kReliefWholePixel_m = 8.0;

std::uint64_t key_of(int level, std::int64_t x, std::int64_t y) {
  constexpr std::int64_t kOffset = std::int64_t{1} << 25;
  return static_cast<std::uint64_t>(level + 64) << 52 |
         static_cast<std::uint64_t>(x + kOffset) << 26 | static_cast<std::uint64_t>(y + kOffset);
}

Eigen::Array4f linear_of(const core::Image8& image, int x, int y) {
  const std::uint8_t* codes = &image(x, y);
  if (image.channels() == 3)
    return {core::linear_from_srgb8(codes[0]), core::linear_from_srgb8(codes[1]),
            core::linear_from_srgb8(codes[2]), 1.0f};
  if (codes[3] == 0) return Eigen::Array4f::Zero();
  const float alpha = static_cast<float>(codes[3]) / 255.0f;
  return {alpha * core::linear_from_srgb8(codes[0]), alpha * core::linear_from_srgb8(codes[1]),
          alpha * core::linear_from_srgb8(codes[2]), alpha};
}

}  // namespace

struct GroundImagery::Tile {
  core::Image8 image;
  std::atomic<std::size_t>& bytes_alive;
  Tile(core::Image8 decoded, std::atomic<std::size_t>& alive)
      : image(std::move(decoded)), bytes_alive(alive) {
    bytes_alive += image.data().size();
  }
  ~Tile() { bytes_alive -= image.data().size(); }
  Tile(const Tile&) = delete;
  Tile& operator=(const Tile&) = delete;
};

struct GroundImagery::Slot {
  std::mutex loading;
  // The rest: under the cache's mutex.
  std::shared_ptr<const Tile> tile;
  std::weak_ptr<const Tile> alive;
  std::uint64_t last_used = 0;
};

struct GroundImagery::Cache {
  std::atomic<std::size_t> bytes_alive = 0;  // first: tiles count themselves out of it
  explicit Cache(std::size_t num_slots) : slots(num_slots) {}
  std::mutex mutex;
  std::vector<Slot> slots;
  std::vector<std::size_t> held;  ///< slots whose tile the cache keeps
  std::uint64_t now = 0;
  Stats stats;
};

GroundImagery::GroundImagery(const world::TileStore& store, double budget_bytes)
    : store_(store), budget_bytes_(budget_bytes) {
  std::size_t num_slots = 0;
  for (const world::ImageryInfo& imagery : store.manifest().imagery) {
    first_slot_.push_back(num_slots);
    num_slots += imagery.tiles.size();
    Row row{imagery.finest_level, imagery.coarsest_level, {}};
    row.tiles.reserve(imagery.tiles.size());
    for (std::size_t i = 0; i < imagery.tiles.size(); ++i) {
      const world::ImageryTileId& id = imagery.tiles[i].id;
      row.tiles.emplace(key_of(id.level, id.x, id.y), i);
    }
    rows_.push_back(std::move(row));
  }
  cache_ = std::make_unique<Cache>(num_slots);
}

GroundImagery::~GroundImagery() = default;

GroundImagery::Stats GroundImagery::stats() const {
  const std::lock_guard lock(cache_->mutex);
  return cache_->stats;
}

std::shared_ptr<const GroundImagery::Tile> GroundImagery::load(std::size_t row,
                                                               std::size_t tile) const {
  Slot& slot = cache_->slots[first_slot_[row] + tile];
  const std::lock_guard loading(slot.loading);
  {
    const std::lock_guard lock(cache_->mutex);
    slot.last_used = ++cache_->now;
    if (std::shared_ptr<const Tile> found = slot.alive.lock()) return found;
  }
  // Room is made before memory is taken.
  constexpr double kTileBytes = 4.0 * kImageryTile_px * kImageryTile_px;
  {
    const std::lock_guard lock(cache_->mutex);
    std::vector<std::size_t>& held = cache_->held;
    while (!held.empty() &&
           static_cast<double>(cache_->bytes_alive.load()) + kTileBytes > budget_bytes_) {
      const auto oldest = std::min_element(held.begin(), held.end(), [&](auto a, auto b) {
        return cache_->slots[a].last_used < cache_->slots[b].last_used;
      });
      cache_->slots[*oldest].tile.reset();
      held.erase(oldest);
    }
  }
  auto loaded = std::make_shared<const Tile>(store_.load_imagery(row, tile), cache_->bytes_alive);
  const std::lock_guard lock(cache_->mutex);
  slot.alive = loaded;
  slot.tile = loaded;
  cache_->held.push_back(first_slot_[row] + tile);
  ++cache_->stats.num_loaded;
  cache_->stats.peak_bytes = std::max(cache_->stats.peak_bytes, cache_->bytes_alive.load());
  return loaded;
}

/// Null where the world has no such tile.
const core::Image8* GroundImagery::find(std::size_t row, int level, std::int64_t x, std::int64_t y,
                                        Reader& reader) const {
  const auto found = rows_[row].tiles.find(key_of(level, x, y));
  if (found == rows_[row].tiles.end()) return nullptr;
  const std::size_t key = first_slot_[row] + found->second + 1;
  // Neighbours of a level, and a level and the next, come to different pins.
  const auto place = static_cast<std::size_t>((x & 1) | (y & 1) << 1 | (level & 1) << 2);
  Reader::Pin& pin = reader.pins_[place];
  if (pin.key != key || !pin.tile) {
    pin.tile.reset();
    pin.tile = load(row, found->second);
    pin.key = key;
  }
  return &pin.tile->image;
}

Eigen::Array4f GroundImagery::texel(std::size_t row, int level, std::int64_t column,
                                    std::int64_t line, Reader& reader) const {
  const core::Image8* image = find(row, level, column >> kTileShift, line >> kTileShift, reader);
  if (image == nullptr) return Eigen::Array4f::Zero();
  constexpr std::int64_t kWithin = kImageryTile_px - 1;
  return linear_of(*image, static_cast<int>(column & kWithin),
                   static_cast<int>(kWithin - (line & kWithin)));
}

Eigen::Array4f GroundImagery::bilinear(std::size_t row, int level,
                                       const Eigen::Vector2d& place_world, Reader& reader) const {
  const double pixel_m = world::ImageryTileId{level, 0, 0}.pixel_m();
  const double x = place_world.x() / pixel_m - 0.5;
  const double y = place_world.y() / pixel_m - 0.5;
  const double x0 = std::floor(x);
  const double y0 = std::floor(y);
  const auto tx = static_cast<float>(x - x0);
  const auto ty = static_cast<float>(y - y0);
  const auto column = static_cast<std::int64_t>(x0);
  const auto line = static_cast<std::int64_t>(y0);
  constexpr std::int64_t kWithin = kImageryTile_px - 1;
  const std::int64_t cx = column & kWithin;
  const std::int64_t cy = line & kWithin;
  std::array<Eigen::Array4f, 4> corners;
  if (cx < kWithin && cy < kWithin) {
    const core::Image8* image = find(row, level, column >> kTileShift, line >> kTileShift, reader);
    if (image == nullptr) return Eigen::Array4f::Zero();
    const int px = static_cast<int>(cx);
    const int py = static_cast<int>(kWithin - cy);
    corners = {linear_of(*image, px, py), linear_of(*image, px + 1, py),
               linear_of(*image, px, py - 1), linear_of(*image, px + 1, py - 1)};
  } else {
    corners = {texel(row, level, column, line, reader), texel(row, level, column + 1, line, reader),
               texel(row, level, column, line + 1, reader),
               texel(row, level, column + 1, line + 1, reader)};
  }
  const Eigen::Array4f south = corners[0] + tx * (corners[1] - corners[0]);
  const Eigen::Array4f north = corners[2] + tx * (corners[3] - corners[2]);
  return south + ty * (north - south);
}

ImagerySample GroundImagery::sample(const Eigen::Vector2d& place_world, double footprint_m,
                                    Reader& reader) const {
  ImagerySample seen;
  for (std::size_t row = 0; row < rows_.size() && seen.alpha < 0.999f; ++row) {
    const Row& pictures = rows_[row];
    const double finest_m = world::ImageryTileId{pictures.finest_level, 0, 0}.pixel_m();
    const double wanted = footprint_m > finest_m ? std::log2(footprint_m / finest_m) : 0.0;
    const double level =
        std::min(wanted, static_cast<double>(pictures.coarsest_level - pictures.finest_level));
    const int finer = static_cast<int>(level);
    const auto share = static_cast<float>(level - finer);
    Eigen::Array4f here = bilinear(row, pictures.finest_level + finer, place_world, reader);
    if (share > 0.0f)
      here = here * (1.0f - share) +
             bilinear(row, pictures.finest_level + finer + 1, place_world, reader) * share;
    if (here[3] <= 0.0f) continue;
    if (seen.row < 0) {
      seen.row = static_cast<int>(row);
      seen.pixel_m = finest_m;
    }
    seen.albedo += (1.0f - seen.alpha) * here.head<3>();
    seen.alpha += (1.0f - seen.alpha) * here[3];
  }
  return seen;
}

void GroundImagery::drape(const GroundPlaces& places, const GroundPacket& packet,
                          std::uint32_t seed, Reader& reader, GroundLook& look) const {
  if (is_empty()) return;
  std::array<ImagerySample, kLanes> samples;
  bool any = false;
  bool wants_detail = false;
  double finest_pixel_m = 1e9;
  double coarsest_pixel_m = 0.0;
  for (int i = 0; i < kLanes; ++i) {
    const auto cover = static_cast<world::Cover>(packet.cover[i]);
    if (packet.is_painted[i] != 0 || look.is_water[i] > 0.0f || cover == world::Cover::Outside ||
        cover == world::Cover::Seabed)
      continue;
    ImagerySample& one = samples[static_cast<std::size_t>(i)];
    one =
        sample({places.point_world[0][i], places.point_world[1][i]}, places.footprint_m[i], reader);
    if (one.alpha <= 0.0f) continue;
    any = true;
    finest_pixel_m = std::min(finest_pixel_m, one.pixel_m);
    coarsest_pixel_m = std::max(coarsest_pixel_m, one.pixel_m);
    wants_detail = wants_detail || places.footprint_m[i] < one.pixel_m;
  }
  if (!any) return;
  // One sum for each pixel size that lanes have; nearly always there is one.
  for (double pixel_m = finest_pixel_m; pixel_m <= coarsest_pixel_m; pixel_m *= 2.0) {
    NoiseSum detail{};
    if (wants_detail) {
      // Lattices of a pixel and finer: over some pixels they come to nothing.
      const int level = std::clamp(static_cast<int>(std::lround(std::log2(pixel_m))),
                                   kFinestNoiseLevel, kCoarsestNoiseLevel);
      detail = sum_noise(packet.places, level, kFinestNoiseLevel, seed + kImageryDetail);
    }
    const auto relief =
        static_cast<float>(kRelief * std::clamp((pixel_m - kReliefFromPixel_m) /
                                                    (kReliefWholePixel_m - kReliefFromPixel_m),
                                                0.0, 1.0));
    for (int i = 0; i < kLanes; ++i) {
      const ImagerySample& one = samples[static_cast<std::size_t>(i)];
      if (one.alpha <= 0.0f || one.pixel_m != pixel_m) continue;
      const float factor =
          wants_detail ? 1.0f + clamped(kDetail * detail.value[i], -kMostDetail, kMostDetail)
                       : 1.0f;
      for (std::size_t k = 0; k < 3; ++k) {
        const float shown = one.albedo[static_cast<int>(k)] * factor;
        look.albedo[k][i] = shown + (1.0f - one.alpha) * look.albedo[k][i];
        const float kept = 1.0f - one.alpha * (1.0f - relief);
        look.normal[k][i] = packet.normal[k][i] + kept * (look.normal[k][i] - packet.normal[k][i]);
      }
      const float squared = look.normal[0][i] * look.normal[0][i] +
                            look.normal[1][i] * look.normal[1][i] +
                            look.normal[2][i] * look.normal[2][i];
      const float shrink = 1.0f / std::sqrt(std::max(squared, 1e-12f));
      for (std::size_t k = 0; k < 3; ++k) look.normal[k][i] *= shrink;
      // Hollows are in the picture.
      look.openness[i] += one.alpha * (1.0f - relief) * (1.0f - look.openness[i]);
    }
  }
}

}  // namespace terracast::scene
