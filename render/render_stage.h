#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "capture/frame.h"
#include "core/context.h"
#include "core/schema.h"
#include "geo/trajectory.h"
#include "sensors/camera/camera_plan.h"
#include "sensors/camera/tracks.h"
#include "world/lod.h"
#include "world/ray_query.h"
#include "world/tile_store.h"

namespace terracast::render {

/// Everything that determines a sequence's frames.
struct SequencePlan : sensors::CameraPlan {
  double rate_hz = 10.0;
  /// Nominal, and the cameras' clocks, as in capture::SequenceInfo.
  std::vector<capture::CameraCalibration> believed_cameras = {};
  std::vector<capture::CameraClock> clocks = {};
  /// Of all sequences that show one geometry, its own among them; null: it shows a geometry of its own.
  std::shared_ptr<const std::vector<world::Viewpoint>> shared_viewpoints = nullptr;
  sensors::TrackOptions tracks;
  world::DetailOptions detail;
  std::string config_toml;
};

/// Every camera at every frame stands inside the square of `size_m` round the world's origin.
/// throws Input: one does not, named with its place
void check_inside(const SequencePlan& plan, const geo::WorldFrame& frame_of_world, double size_m);

/// The places from which a sequence's cameras see the world: what the tiler and the frozen cut are
/// given.
std::vector<world::Viewpoint> viewpoints_of(const std::vector<geo::BodyState>& states,
                                            const std::vector<capture::CameraCalibration>& cameras);

/// Those for which the geometry that a sequence shows is chosen.
std::vector<world::Viewpoint> viewpoints_of(const SequencePlan& plan);

/// What a sequence's capture will say of itself (all that determines the bytes goes into
/// input_hash).
capture::SequenceInfo describe_sequence(const SequencePlan& plan, const world::TileStore& store);

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
