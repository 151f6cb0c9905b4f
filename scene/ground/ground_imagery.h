#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <unordered_map>
#include <vector>

#include "core/image.h"
#include "scene/ground/ground.h"
#include "scene/light/sky.h"
#include "world/tile_store.h"

namespace terracast::scene {

/// What pictures know of a place.
struct ImagerySample {
  Color albedo = Color::Zero();  ///< linear, times alpha
  float alpha = 0.0f;            ///< how much of it is known
  double pixel_m = 0.0;          ///< of the finest picture that knows it
  int row = -1;                  ///< that picture's, of WorldManifest::imagery; -1: none
};

/// The pictures of a world's ground (WorldManifest::imagery), decoded tile by tile as they are asked for.
/// A sample is bilinear in the two levels whose pixels are next to its footprint, in linear light, and
/// linear between them: a function of place and footprint alone, whatever the cache holds.
///
/// memory    decoded tiles within budget_bytes, what threads are reading counted, or what they are
///           reading where that is more: at most kPins tiles of 1 MiB a thread
/// threads   safe, each with a Reader of its own
class GroundImagery {
 private:
  struct Tile;

 public:
  static constexpr std::size_t kPins = 8;
  /// Tiles that one thread is reading.
  class Reader {
   public:
    void let_go() { pins_ = {}; }

   private:
    friend class GroundImagery;
    struct Pin {
      std::size_t key = 0;
      std::shared_ptr<const Tile> tile;
    };
    std::array<Pin, kPins> pins_;
  };

  /// The store must outlive it.
  GroundImagery(const world::TileStore& store, double budget_bytes);
  ~GroundImagery();

  bool is_empty() const { return rows_.empty(); }

  /// footprint_m   width of an image sample on the ground; 0: the finest level
  /// throws        Input: a damaged tile; Io
  ImagerySample sample(const Eigen::Vector2d& place_world, double footprint_m,
                       Reader& reader) const;

  /// Lays the pictures over what the ground looks like, but where it is painted or water. Below the
  /// pictures' pixels noise of mean 1 goes on with the detail: over some pixels the mean albedo stays
  /// the pictures'.
  void drape(const GroundPlaces& places, const GroundPacket& packet, std::uint32_t seed,
             Reader& reader, GroundLook& look) const;

  struct Stats {
    std::uint64_t num_loaded = 0;
    std::size_t peak_bytes = 0;  ///< of decoded tiles that were alive at once
  };
  Stats stats() const;

 private:
  struct Row {
    int finest_level;
    int coarsest_level;
    std::unordered_map<std::uint64_t, std::size_t> tiles;  ///< by level and address
  };
  struct Slot;
  std::shared_ptr<const Tile> load(std::size_t row, std::size_t tile) const;
  const core::Image8* find(std::size_t row, int level, std::int64_t x, std::int64_t y,
                           Reader& reader) const;
  Eigen::Array4f texel(std::size_t row, int level, std::int64_t column, std::int64_t line,
                       Reader& reader) const;
  Eigen::Array4f bilinear(std::size_t row, int level, const Eigen::Vector2d& place_world,
                          Reader& reader) const;

  const world::TileStore& store_;
  double budget_bytes_;
  std::vector<Row> rows_;
  std::vector<std::size_t> first_slot_;  ///< of each row
  struct Cache;
  std::unique_ptr<Cache> cache_;
};

}  // namespace terracast::scene
