#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "world/object_scene.h"
#include "world/paint_index.h"
#include "world/tile.h"

namespace terracast::world {

/// Bytes of a tile's samples; one byte where all are equal.
template <class Byte>
class PackedBytes {
  static_assert(sizeof(Byte) == 1);

 public:
  PackedBytes() = default;
  explicit PackedBytes(const std::vector<Byte>& bytes) : size_(bytes.size()) {
    bool is_constant = true;
    for (const Byte byte : bytes) is_constant = is_constant && byte == bytes.front();
    if (is_constant && !bytes.empty())
      bytes_ = {bytes.front()};
    else
      bytes_ = bytes;
  }

  std::vector<Byte> unpacked() const {
    return bytes_.size() == size_ ? bytes_ : std::vector<Byte>(size_, bytes_.front());
  }
  std::size_t num_bytes() const { return bytes_.size(); }

 private:
  std::size_t size_ = 0;
  std::vector<Byte> bytes_;
};

/// The heights of a tile's samples in half steps of kHeightStep_m, exactly. Each is kept in two bytes as its
/// difference to the plane through its western, southern and south-western neighbours, or all in four
/// where a difference needs more.
class PackedHeights {
 public:
  PackedHeights() = default;
  /// half_steps   kTileSamples^2
  explicit PackedHeights(std::vector<std::int32_t> half_steps);

  std::vector<std::int32_t> unpacked() const;
  std::size_t num_bytes() const {
    return differences_.size() * sizeof(std::int16_t) + half_steps_.size() * sizeof(std::int32_t);
  }

 private:
  std::int32_t first_half_steps_ = 0;
  std::vector<std::int16_t> differences_;
  std::vector<std::int32_t> half_steps_;
};

/// What a loaded tile is made from again without its file: about a fifth of the memory of a bare tile, at
/// the cost of Embree's build.
struct PackedTile {
  TileId id;
  double center_z_m = 0.0;
  PackedHeights heights;  ///< stitched
  PackedBytes<Cover> cover;
  PackedBytes<std::uint8_t> moisture;
  PackedBytes<std::uint8_t> source;
  std::optional<ObjectScene::Packed> objects;
  std::shared_ptr<const PaintIndex> paint;  ///< null: none; shared with the scene

  std::size_t num_bytes() const;
};

}  // namespace terracast::world
