#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "capture/frame_reader.h"
#include "render/input_hash.h"
#include "render/visited_tiles.h"
#include "world/lod.h"
#include "world/tile_store.h"

namespace terracast::render {

/// What frames are rendered with now. All must outlive who is given it.
struct RenderInputs {
  const SequencePlan& plan;
  const world::TileStore& store;
  const std::vector<world::CutTile>& cut;
  const std::vector<capture::TileScale>& tiles;  ///< of the cut
  const FrameKeys& keys;
  const FrameSight& sight;
};

/// Frames of a capture under other inputs, of which the images need not be rendered again. Threads:
/// safe.
class EarlierFrames {
 public:
  /// folder    of the sequence, finished or not
  /// returns   nothing where there is none whose frames can be taken: no sequence, a damaged one, one
  ///           of another version or with other cameras
  /// throws    Io
  static std::optional<EarlierFrames> open(const std::filesystem::path& folder,
                                           const RenderInputs& inputs);

  const std::filesystem::path& folder() const { return earlier_.folder(); }

  /// The record of a frame whose images are byte for byte what would be rendered now: it is whole, so
  /// are its files, its key is that of the inputs now, and no tile has changed, or come into the cut,
  /// that one of its rays might meet now.
  /// returns   with its tiles as indices into the cut now; nothing: it must be rendered
  /// throws    Io
  std::optional<capture::FrameRecord> find(int frame) const;

 private:
  /// A tile of the cut whose highest point may stand higher than what stood there earlier.
  struct Raised {
    int tile;                   ///< of the cut now
    std::vector<int> earlier;   ///< tiles that stood there, of the earlier cut
    double highest_z_world_m;   ///< of the lowest of these
    bool is_same_tile = false;  ///< the one that stood there, with another content
  };

  EarlierFrames(capture::WholeFrames earlier, const RenderInputs& inputs)
      : earlier_(std::move(earlier)), inputs_(inputs) {}
  /// Compares the cuts; false where a tile stands now in whose place there was none.
  bool find_raised();
  /// Whether no ray of the record's frame meets anything in what has been raised. Turns passed tiles
  /// into those of the cut now.
  bool still_sees_the_same(capture::FrameRecord& record) const;

  capture::WholeFrames earlier_;
  RenderInputs inputs_;
  std::vector<int> now_of_earlier_;  ///< index into the cut now; -1: it is not in it
  std::vector<Raised> raised_;
};

}  // namespace terracast::render
