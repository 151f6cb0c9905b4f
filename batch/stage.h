#pragma once

#include <array>
#include <string>
#include <string_view>

namespace terracast::batch {

/// The stages of a batch, in order. A shard is worked on when what it needs of earlier stages is
/// done.
enum class Stage {
  Tile,      ///< the tiles of a run's world; runs of one world share them
  Render,    ///< frames of a run
  Export,    ///< a run in a format
  Validate,  ///< the report on that
  Merge,     ///< one dataset of all
};

inline constexpr std::array kStages = {Stage::Tile, Stage::Render, Stage::Export, Stage::Validate,
                                       Stage::Merge};

std::string_view stage_name(Stage stage);
/// throws Usage: no such stage
Stage stage_from_name(const std::string& name);

/// A shard of the plan: "render/12" in messages and on the command line.
struct ShardId {
  Stage stage = Stage::Tile;
  int index = 0;
  std::string text() const;
  /// throws Usage: not STAGE/INDEX
  static ShardId parse(const std::string& text);
  bool operator==(const ShardId&) const = default;
};

}  // namespace terracast::batch
