#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "core/image.h"
#include "render/clouds.h"
#include "render/ground_imagery.h"
#include "render/ground_truth.h"
#include "render/imaging/imager.h"
#include "render/material.h"
#include "render/pixel_blocks.h"
#include "render/render_stage.h"
#include "render/sampler.h"
#include "render/shading.h"
#include "render/sky.h"
#include "render/texture_library.h"
#include "render/views.h"
#include "render/water_above.h"
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
  /// bed            the world without water, for what is seen in it; null: water is opaque
  /// is_in_water    all cameras are: what they meet is what `bed` says (RayQuery::WithoutWater with
  ///                viewers_in_water)
  FrameRenderer(const SequencePlan& plan, const world::TileStore& store,
                const world::RayQuery& query, const world::RayQuery* bed = nullptr,
                bool is_in_water = false);

  const ViewTable& views() const { return views_; }
  const Ground& ground() const { return ground_; }
  const Sky& sky() const { return sky_; }
  const MovingBodies& moving() const { return moving_; }

  /// Facts of a camera at a frame.
  TruthFrame truth(int frame, int camera) const {
    TruthFrame truth;
    this->truth(frame, camera, truth);
    return truth;
  }
  /// The same, into a frame that has been used before.
  /// trail   takes the tiles to which the rays come; null: nobody wants to know
  void truth(int frame, int camera, TruthFrame& truth, world::RayTrail* trail = nullptr) const {
    trace_truth(is_in_water_ ? *bed_ : query_, moving_, ground_, views_, frame, camera, truth,
                trail, wants_bottom_ ? bed_ : nullptr, flags_);
  }

  /// Anti-aliased colour of a camera at a frame; no ground truth mixes in.
  Photo photo(int frame, int camera, world::RayTrail* trail = nullptr) const;
  core::Image8 color(int frame, int camera, world::RayTrail* trail = nullptr) const {
    return photo(frame, camera, trail).color;
  }

 private:
  /// How finely light is looked for.
  struct Sampling {
    PixelSampler sampler;
    int num_samples;
    int num_sky_rays;
  };
  /// Takes the radiance of a unit's pixels, row by row.
  using TakeLight = std::function<void(const PixelUnit&, std::span<const Color>)>;

  void gather_light(int frame, int camera, const std::vector<PixelUnit>& units,
                    const Sampling& sampling, world::RayTrail* trail, const TakeLight& take) const;
  /// What a camera's light meter sees: some places of its image, at the fixed exposure.
  std::vector<Color> meter(int frame, int camera) const;
  WaterAbove water_at(const Eigen::Vector3d& center_world, world::RayTrail* trail) const;

  ViewTable views_;
  const world::RayQuery& query_;
  const world::RayQuery* bed_;
  double water_visibility_m_;
  bool wants_bottom_;
  std::uint32_t flags_;  ///< that are looked for
  bool is_in_water_;
  MovingBodies moving_;
  Ground ground_;
  GroundImagery imagery_;
  TextureLibrary textures_;
  Sky sky_;
  Clouds clouds_;
  Exposure exposure_;
  Sampling sampling_;
  std::uint64_t seed_;
  Imagers imagers_;
};

}  // namespace terracast::render
