#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "core/image.h"
#include "render/ground_truth.h"
#include "render/material.h"
#include "render/render_stage.h"
#include "render/sampler.h"
#include "render/shading.h"
#include "render/sky.h"
#include "render/views.h"
#include "world/ray_query.h"

namespace terracast::render {

/// The light of a sequence: the sun of its first frame (it moves 0.004 degrees a second) and the
/// air.
Daylight daylight_of(const SequencePlan& plan, const geo::WorldFrame& frame);

/// Everything that one sequence's images are made from. Parallel inside an image. Threads: safe.
class FrameRenderer {
 public:
  /// The query, and with it the store, must outlive the renderer.
  /// throws   Config: cameras or UTC that make no sense; Input, Io from tiles
  FrameRenderer(const SequencePlan& plan, const world::TileStore& store,
                const world::RayQuery& query);

  const ViewTable& views() const { return views_; }
  const Ground& ground() const { return ground_; }
  const Sky& sky() const { return sky_; }

  /// Facts of a camera at a frame.
  TruthFrame truth(int frame, int camera) const {
    TruthFrame truth;
    trace_truth(query_, ground_, views_, frame, camera, truth);
    return truth;
  }
  /// The same, into a frame that has been used before.
  /// trail   takes the tiles to which the rays come; null: nobody wants to know
  void truth(int frame, int camera, TruthFrame& truth, world::RayTrail* trail = nullptr) const {
    trace_truth(query_, ground_, views_, frame, camera, truth, trail);
  }

  /// Anti-aliased colour of a camera at a frame; no ground truth mixes in.
  core::Image8 color(int frame, int camera, world::RayTrail* trail = nullptr) const;

 private:
  ViewTable views_;
  const world::RayQuery& query_;
  Ground ground_;
  Sky sky_;
  Exposure exposure_;
  int num_samples_;
  PixelSampler sampler_;
  std::uint64_t seed_;
};

}  // namespace terracast::render
