#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "world/object_scene.h"
#include "world/packed_tile.h"
#include "world/paint_index.h"
#include "world/terrain_walk.h"
#include "world/tile.h"

struct RTCDeviceTy;
struct RTCSceneTy;
struct RTCGeometryTy;

namespace terracast::world {

/// An Embree device. Threads: safe.
class EmbreeDevice {
 public:
  /// profile   "widest" or as rtcNewDevice takes it
  /// throws    Config: a profile that this machine or Embree does not have
  explicit EmbreeDevice(const std::string& profile);
  /// As it was given.
  const std::string& profile_asked() const { return profile_asked_; }
  ~EmbreeDevice();
  EmbreeDevice(const EmbreeDevice&) = delete;
  EmbreeDevice& operator=(const EmbreeDevice&) = delete;

  RTCDeviceTy* handle() const { return device_; }
  /// Rays that Embree takes at once at full width: 16 or 8.
  int packet_width() const { return packet_width_; }
  /// Version and configuration in words.
  const std::string& profile() const { return profile_; }

 private:
  RTCDeviceTy* device_;
  int packet_width_;
  std::string profile_;
  std::string profile_asked_;
};

/// One tile, loaded: its stitched terrain as an Embree scene in floats about the tile's centre, the
/// same heights for the walk, its other layers, and what stands on it and is painted on it.
/// Immutable; threads: safe.
///
/// The heights in Embree's buffer are the true ones, exact in float; "raised by epsilon" is done by
/// lowering each ray by epsilon_m. Around the tile lies a ring of narrow cells that carries the
/// border heights outward, so that a ray whose float twin runs just outside still meets the
/// surface.
class TileScene {
 public:
  /// Set aside for a bare tile while it is read, decoded and built; each loaded tile is checked to
  /// take no more. What it takes meanwhile is held by MemoryBudget's bound on the process alone.
  static constexpr std::size_t kMostBytesWhileLoading =
      std::size_t{64} * kTileSamples * kTileSamples;
  /// The same of a tile with objects, from their bytes in its file (TileInfo::objects_bytes): those
  /// bytes, what they are decoded to, and the trees over them with all that building them takes
  /// (embree_scene.cpp has the sum).
  static std::size_t most_bytes_while_loading(std::size_t objects_bytes);
  /// The same of a tile that has been loaded before, and kept so much: most of what stands in its file may
  /// be levels of detail that it does not show.
  static std::size_t most_bytes_while_loading(std::size_t objects_bytes, std::size_t scene_bytes);

  /// What is set aside beside the scene's own bytes while it is made again from a PackedTile.
  static constexpr std::size_t kMostBytesWhileUnpacking = kMostBytesWhileLoading / 2;

  /// frame_shift_m   moves the origin of the floats, modulo a cell, off the tile's centre
  /// rules           needed where something stands on the tile
  /// throws          Io: out of memory; Input: as ObjectScene
  TileScene(const EmbreeDevice& device, Tile tile, std::uint8_t coarser_sides,
            const Eigen::Vector3d& frame_shift_m, const ObjectRules* rules = nullptr);
  /// The same scene again.
  TileScene(const EmbreeDevice& device, const PackedTile& packed,
            const Eigen::Vector3d& frame_shift_m);
  ~TileScene();
  TileScene(const TileScene&) = delete;
  TileScene& operator=(const TileScene&) = delete;

  RTCSceneTy* handle() const { return scene_; }
  const TerrainGrid& grid() const { return grid_; }
  /// Origin of the floats: the tile's centre, for z always.
  const Eigen::Vector3d& center_world() const { return center_world_; }

  /// More than the vertical error of Embree's float arithmetic in this tile (embree_scene.cpp has
  /// the derivation).
  double epsilon_m() const { return epsilon_m_; }
  /// A point this high above the surface is above it for Embree too.
  double clear_m() const { return 2.0 * epsilon_m_; }
  /// A ray that comes into the tile above this, or starts in it above this, is above the surface
  /// there for Embree too: for each side (west, east, south, north) and each block of cells along
  /// it, from the border's heights there; in row kInside from the tile's highest point.
  /// shape (5, kEntryBlocks)
  const double* entry_tops_z_world() const { return entry_tops_.data(); }
  static constexpr int kEntryBlockCells = 16;
  static constexpr int kEntryBlocks = kTileCells / kEntryBlockCells;
  static constexpr int kInside = 4;
  /// A hit's u, v lie in the ring, or too near it to tell, when they are less than this from 0 or
  /// 1.
  static constexpr float kRingEnd = 1.001F / (kTileCells + 2);
  static bool is_in_ring(float u, float v) {
    return std::min(u, v) <= kRingEnd || std::max(u, v) >= 1.0F - kRingEnd;
  }
  /// The cell of the tile that a hit's u, v name, or the nearest one to it.
  struct NamedCell {
    int x;
    int y;
  };
  static NamedCell cell_of(float u, float v);

  const std::vector<Cover>& cover() const { return cover_; }
  const std::vector<std::uint8_t>& moisture() const { return moisture_; }
  const std::vector<std::uint8_t>& source() const { return source_; }

  /// Null where the tile shows none within its square.
  const ObjectScene* objects() const { return objects_.get(); }
  /// Null where nothing is painted.
  const PaintIndex* paint() const { return paint_.get(); }

  /// Everything that this tile keeps in memory, Embree's part included.
  std::size_t num_bytes() const { return num_bytes_; }

  /// What the scene is made from again.
  PackedTile packed() const;

 private:
  void take_objects(Tile& tile, const ObjectRules* rules);
  void build(const EmbreeDevice& device, const std::vector<std::int32_t>& half_steps,
             const Eigen::Vector3d& frame_shift_m);
  void find_entry_tops();

  TileId id_;
  RTCSceneTy* scene_ = nullptr;
  std::unique_ptr<const ObjectScene> objects_;
  std::shared_ptr<const PaintIndex> paint_;
  TerrainGrid grid_;
  Eigen::Vector3d center_world_;
  double epsilon_m_ = 0.0;
  double highest_z_world_ = 0.0;
  std::vector<double> entry_tops_;
  std::vector<Cover> cover_;
  std::vector<std::uint8_t> moisture_;
  std::vector<std::uint8_t> source_;
  std::size_t num_bytes_ = 0;
};

}  // namespace terracast::world
