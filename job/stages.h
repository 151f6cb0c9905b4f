#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "core/context.h"
#include "job/job.h"
#include "labels/label.h"
#include "render/render_stage.h"
#include "validate/check.h"
#include "validate/ground_map.h"
#include "world/tile_store.h"

namespace terracast::job {

/// Where a job's stages put their results below --out.
struct OutputFolders {
  explicit OutputFolders(const std::filesystem::path& out);
  std::filesystem::path world, captures, exports, reports;
};

/// surface   of lay_out_world(), where it was laid out before
world::TileStore tile(const Job& job, const std::filesystem::path& store,
                      const core::Context& context,
                      std::shared_ptr<const tiler::WorldSurface> surface = nullptr);
/// selection   of the frames of each sequence
void render(const Job& job, const world::TileStore& store, const capture::FrameSelection& selection,
            const std::filesystem::path& captures, const core::Context& context);
/// One of the job's sequences.
/// earlier_folders   of it under other inputs: frames are taken over from there whose images are what
///                   would be rendered
render::RenderedFrames render_sequence(
    const Job& job, const render::SequencePlan& sequence, const world::TileStore& store,
    const capture::FrameSelection& selection, const std::filesystem::path& folder,
    const core::Context& context, const std::vector<std::filesystem::path>& earlier_folders = {});
/// The kinds that the config asks for, and those with their defaults that its formats need.
std::vector<labels::LabelOptions> wanted_labels(const RunConfig& config);
/// What labels are held against, of a sequence that is planned or captured.
labels::SequenceOutline outline_of(const RunConfig& config, const std::string& name,
                                   const std::vector<capture::CameraCalibration>& cameras,
                                   std::size_t num_frames, double rate_hz);
/// Makes the labels of all sequences that the config wants; of a config that wants none, nothing.
/// are_checked   by prepare_job(), which has warned of those that make nothing
/// throws        Config: a sequence that was captured with another config; as labels::check_labels and
///               labels::run_label_stage
void label(const RunConfig& config, const world::TileStore& store,
           const std::filesystem::path& captures, const core::Context& context,
           bool are_checked = false);
/// Needs the config, the capture and its labels alone.
/// throws   Config: no format, or a sequence that was captured with another config
void export_formats(const RunConfig& config, const OutputFolders& out,
                    const core::Context& context);
/// The maps below a report's tracks, from a world's tiles. Of an area whose middle is not in the
/// world's square there is none, nor where tiles cannot be read.
validate::GroundMapMaker ground_map_of(const world::TileStore& store);
/// validate::Undulation of geo's EGM96.
std::optional<double> egm96_undulation_m(double lat_deg, double lon_deg);

/// Checks what was exported in one format.
validate::ValidateOptions validate_options(const RunConfig& config, const std::string& format,
                                           const world::TileStore& store);
/// returns   whether every check of every format holds
bool validate_formats(const Job& job, const OutputFolders& out, const core::Context& context);

/// All stages, in order.
/// returns   whether every check holds; nothing when the config names no format to export and check
std::optional<bool> run(const Job& job, const std::filesystem::path& out,
                        const core::Context& context);

}  // namespace terracast::job
