#pragma once

#include <filesystem>
#include <vector>

#include "core/context.h"
#include "render/sequence_plan.h"
#include "world/ray_query.h"
#include "world/tile_store.h"

namespace terracast::render {

/// What a run made, ascending.
struct RenderedFrames {
  std::vector<int> rendered;
  std::vector<int> taken_over;
};

/// Renders the unfinished ones of some frames of a sequence into `folder`. Finished ones are never
/// rendered again, but those of a finished sequence that lost a file or are damaged. Writes the
/// sequence's manifest when all frames are there.
///
/// Several processes may render a sequence into one folder, each its own frames or the same ones: the
/// last to end has written the manifest.
///
/// A frame whose images were rendered earlier, under inputs that differ in nothing that they show, is
/// taken over: its files become further links to those (copies where the file system has no links),
/// and its record says what it says now. The folder comes out byte for byte as if all were rendered.
/// Of a changed world a frame is rendered again when one of its rays was cast at a changed tile, or may
/// come as low as one that was raised (render/visited_tiles.h); of changed inputs, when its key changes
/// (render/input_hash.h).
/// earlier_folders   of the same sequence, as it was or is rendered under other inputs; whatever in
///                   them is damaged or of another version is not taken
/// throws   Input: a camera under the ground or outside the world (frame, place, how far); Config:
///          `folder` holds another sequence; Usage: a selection that is none; Io
RenderedFrames run_render_stage(const world::TileStore& store, const SequencePlan& plan,
                                const world::RayQueryOptions& tracing,
                                const capture::FrameSelection& selection,
                                const std::filesystem::path& folder, const core::Context& context,
                                const std::vector<std::filesystem::path>& earlier_folders = {});

}  // namespace terracast::render
