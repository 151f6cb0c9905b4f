#pragma once

#include <cstdint>
#include <vector>

#include "capture/frame.h"
#include "job/run_config.h"

namespace terracast::batch {

/// What a part of a job is expected to take.
struct Cost {
  double cpu_s = 0.0;  ///< of one core
  double bytes = 0.0;  ///< on disk

  Cost& operator+=(const Cost& other) {
    cpu_s += other.cpu_s;
    bytes += other.bytes;
    return *this;
  }
  friend Cost operator+(Cost a, const Cost& b) { return a += b; }
  friend Cost operator*(double factor, const Cost& cost) {
    return {.cpu_s = factor * cost.cpu_s, .bytes = factor * cost.bytes};
  }
};

/// Expected cost of a sequence's parts, from its rays, tiles and bytes. The factors were measured
/// (docs/performance.md, "What a batch is expected to cost"); machines differ by a factor, which
/// `batch status` learns from the shards that are done.
class SequenceCost {
 public:
  /// config    of its run
  /// cameras   its own
  SequenceCost(const job::RunConfig& config,
               const std::vector<capture::CameraCalibration>& cameras);

  /// Of a process that begins to work on a sequence: its sources are opened, its tracks chosen.
  Cost sequence_start() const;
  Cost frame() const;
  /// The tiles that it adds to a world with so many frames.
  Cost tiles(std::int64_t num_frames) const;
  /// format   index into the config's exports; one that leaves the sequence out costs nothing
  Cost export_frame(std::size_t format) const;
  Cost validate_frame(std::size_t format) const;
  /// Of one process.
  double memory_bytes(int num_threads, std::int64_t num_frames) const;

 private:
  double num_pixels_ = 0.0;  ///< of a frame, all cameras
  double largest_image_px_ = 0.0;
  double num_color_samples_ = 0.0;
  double tracing_bytes_ = 0.0;
  double num_tracks_ = 0.0;
  std::vector<double> export_pixels_;  ///< of a frame in each format
  std::vector<double> export_bytes_;
};

/// Of the base levels of a world, whatever flies over it.
Cost world_cost(const tiler::WorldOptions& world);

}  // namespace terracast::batch
