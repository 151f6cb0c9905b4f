#pragma once

#include <span>
#include <string>
#include <vector>

#include "render/sequence_plan.h"
#include "sensors/camera/frame_renderer.h"
#include "world/lod.h"
#include "world/tile_store.h"

namespace terracast::render {

/// Of everything that determines a sequence's capture.
std::string input_hash_of(const SequencePlan& plan, const world::TileStore& store,
                          const std::vector<world::CutTile>& cut);

/// Hashes of everything that determines the image files of single frames, so that files can be taken
/// from another capture whose frame has the same key. What stands in the records beside them (times,
/// velocities, tracks) does not count.
///
/// Of the world only the tiles that the frame's rays touch count, with their places in the cut, which
/// primitive ids hold, and what all of it gives the ground: its origin, its seed, the level of its
/// sea, where that is open (the cover of its tiles of SeaExposure, touched or not), and whether
/// trees stand in it, and what tiles name by rows: prototypes and textures. Where a camera is
/// exposed or balanced by what other frames show, all tiles and poses count. Which tiles are
/// touched depends on others too (render/visited_tiles.h).
class FrameKeys {
 public:
  /// All must outlive the keys.
  FrameKeys(const SequencePlan& plan, const world::TileStore& store,
            const std::vector<world::CutTile>& cut, const sensors::FrameRenderer& renderer);

  /// touched_tiles   indices into the cut
  std::string key(int frame, std::span<const int> touched_tiles) const;

 private:
  const SequencePlan& plan_;
  const world::TileStore& store_;
  const std::vector<world::CutTile>& cut_;
  const scene::MovingBodies& moving_;
  std::string common_;  ///< what all frames share, hashed
};

}  // namespace terracast::render
