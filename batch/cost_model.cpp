#include "batch/cost_model.h"

#include <algorithm>

#include "rigs/rig.h"

namespace terracast::batch {
namespace {

// Factors of configs/climb.toml on a Xeon of 2 cores: CPU time of its stages over what they handled.
// Of each pixel: its ray, its rays to other frames and cameras, its labels and their bounds, PNG and
// EXR.
constexpr double kTruth_s_per_px = 1.1e-6;
/// A ray for colour, one to the sun, and the ground's look.
constexpr double kColor_s_per_sample = 1.05e-6;
constexpr double kCapture_bytes_per_px = 27.4;
constexpr double kSequenceStart_s = 4.0;
constexpr double kTrack_s = 1e-4;  ///< some 20 rays and their places
constexpr double kFrameRecord_bytes = 40e3;
constexpr double kExport_s_per_px = 0.18e-6;
constexpr double kValidate_s_per_px = 0.4e-6;
constexpr double kReport_bytes_per_px = 0.85;
constexpr double kTile_s = 0.027;
constexpr double kTile_bytes = 98e3;
constexpr double kTilesPerWorld = 330.0;  ///< the base level of 50 km at 30 m, and what is coarser
constexpr double kTilesPerSequence = 200.0;
constexpr double kTilesPerFrame = 4.0;
/// Beside the tiles: images at work, which hold every fact in memory.
constexpr double kImage_bytes_per_px = 120.0;
constexpr double kImagesInWork = 5.0;
constexpr double kProgram_bytes = 150e6;
/// A tile that is loaded, and its ray-tracing scene.
constexpr double kScene_bytes = 1e6;

}  // namespace

SequenceCost::SequenceCost(const job::RunConfig& config,
                           const std::vector<capture::CameraCalibration>& cameras) {
  for (const capture::CameraCalibration& camera : cameras) {
    const double num_px = static_cast<double>(camera.intrinsics.width_px) *
                          static_cast<double>(camera.intrinsics.height_px);
    num_pixels_ += num_px;
    largest_image_px_ = std::max(largest_image_px_, num_px);
  }
  num_color_samples_ = static_cast<double>(config.conditions.color_samples);
  tracing_bytes_ = config.tracing.memory_bytes;
  num_tracks_ = static_cast<double>(config.tracks.num_points);
  for (const auto& chosen : config.exports) {
    const exporters::Exporter& exporter = chosen.exporter();
    const exporters::FrameSize size =
        exporter.takes_any_of(cameras) ? exporter.frame_size(cameras) : exporters::FrameSize{};
    export_pixels_.push_back(size.num_pixels);
    export_bytes_.push_back(size.num_bytes);
  }
}

Cost SequenceCost::sequence_start() const {
  return {.cpu_s = kSequenceStart_s + num_tracks_ * kTrack_s, .bytes = 0.0};
}

Cost SequenceCost::frame() const {
  return {.cpu_s = num_pixels_ * (kTruth_s_per_px + num_color_samples_ * kColor_s_per_sample),
          .bytes = num_pixels_ * kCapture_bytes_per_px + kFrameRecord_bytes};
}

Cost SequenceCost::tiles(std::int64_t num_frames) const {
  const double num_tiles = kTilesPerSequence + kTilesPerFrame * static_cast<double>(num_frames);
  return num_tiles * Cost{.cpu_s = kTile_s, .bytes = kTile_bytes};
}

Cost SequenceCost::export_frame(std::size_t format) const {
  return {.cpu_s = export_pixels_.at(format) * kExport_s_per_px, .bytes = export_bytes_.at(format)};
}

Cost SequenceCost::validate_frame(std::size_t format) const {
  return {.cpu_s = export_pixels_.at(format) * kValidate_s_per_px,
          .bytes = export_pixels_.at(format) * kReport_bytes_per_px};
}

double SequenceCost::memory_bytes(int num_threads, std::int64_t num_frames) const {
  const double images =
      largest_image_px_ * kImage_bytes_per_px * std::min(kImagesInWork, num_threads + 2.0);
  const double num_tiles =
      kTilesPerWorld + kTilesPerSequence + kTilesPerFrame * static_cast<double>(num_frames);
  return kProgram_bytes + images + std::min(tracing_bytes_, num_tiles * kScene_bytes);
}

Cost world_cost(const tiler::WorldOptions& world) {
  const double share = std::max(world.size_m / 51200.0, 0.1);
  return kTilesPerWorld * share * share * Cost{.cpu_s = kTile_s, .bytes = kTile_bytes};
}

}  // namespace terracast::batch
