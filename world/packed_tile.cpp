#include "world/packed_tile.h"

#include <limits>
#include <utility>

namespace terracast::world {
namespace {

/// Predicts a sample but the first from those before it, in rows from the south.
std::int32_t predicted(const std::vector<std::int32_t>& half_steps, int i, int j) {
  const auto at = [&](int x, int y) { return half_steps[Tile::sample(x, y)]; };
  if (j == 0) return at(i - 1, 0);
  if (i == 0) return at(0, j - 1);
  return at(i - 1, j) + at(i, j - 1) - at(i - 1, j - 1);
}

}  // namespace

PackedHeights::PackedHeights(std::vector<std::int32_t> half_steps) {
  using Limits = std::numeric_limits<std::int16_t>;
  first_half_steps_ = half_steps.front();
  differences_.reserve(half_steps.size());
  for (int j = 0; j < kTileSamples; ++j) {
    for (int i = 0; i < kTileSamples; ++i) {
      const bool is_first = i == 0 && j == 0;
      const std::int32_t difference =
          is_first ? 0 : half_steps[Tile::sample(i, j)] - predicted(half_steps, i, j);
      if (difference < Limits::min() || difference > Limits::max()) {
        differences_ = std::vector<std::int16_t>();
        half_steps_ = std::move(half_steps);
        return;
      }
      differences_.push_back(static_cast<std::int16_t>(difference));
    }
  }
}

std::vector<std::int32_t> PackedHeights::unpacked() const {
  if (differences_.empty()) return half_steps_;
  std::vector<std::int32_t> half_steps(differences_.size());
  half_steps.front() = first_half_steps_;
  for (int j = 0; j < kTileSamples; ++j) {
    for (int i = j == 0 ? 1 : 0; i < kTileSamples; ++i) {
      const std::size_t sample = Tile::sample(i, j);
      half_steps[sample] = differences_[sample] + predicted(half_steps, i, j);
    }
  }
  return half_steps;
}

std::size_t PackedTile::num_bytes() const {
  return sizeof *this + heights.num_bytes() + cover.num_bytes() + moisture.num_bytes() +
         source.num_bytes() + (objects ? objects->num_bytes() : 0) +
         (paint != nullptr ? paint->num_bytes() : 0);
}

}  // namespace terracast::world
