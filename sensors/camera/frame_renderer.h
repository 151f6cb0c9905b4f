#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "core/image.h"
#include "scene/ground/ground.h"
#include "scene/ground/ground_imagery.h"
#include "scene/light/shading.h"
#include "scene/light/sky.h"
#include "scene/media/clouds.h"
#include "scene/objects/texture_library.h"
#include "scene/water/water_above.h"
#include "sensors/camera/camera_plan.h"
#include "sensors/camera/ground_truth.h"
#include "sensors/camera/imaging/imager.h"
#include "sensors/camera/pixel_blocks.h"
#include "sensors/camera/sampler.h"
#include "sensors/camera/views.h"
#include "world/ray_query.h"

namespace terracast::sensors {

/// Everything that one sequence's images are made from. Parallel inside an image. Threads: safe.
class FrameRenderer {
 public:
  /// The query, and with it the store, must outlive the renderer.
  /// throws   Config: cameras or UTC that make no sense; Input, Io from tiles
  /// bed            the world without water, for what is seen in it; null: water is opaque
  /// is_in_water    all cameras are: what they meet is what `bed` says (RayQuery::WithoutWater with
  ///                viewers_in_water)
  FrameRenderer(const CameraPlan& plan, const world::TileStore& store, const world::RayQuery& query,
                const world::RayQuery* bed = nullptr, bool is_in_water = false);

  const ViewTable& views() const { return views_; }
  const scene::Ground& ground() const { return ground_; }
  const scene::Sky& sky() const { return sky_; }
  const scene::MovingBodies& moving() const { return moving_; }

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
  using TakeLight = std::function<void(const PixelUnit&, std::span<const scene::Color>)>;

  void gather_light(int frame, int camera, const std::vector<PixelUnit>& units,
                    const Sampling& sampling, world::RayTrail* trail, const TakeLight& take) const;
  /// What a camera's light meter sees: some places of its image, at the fixed exposure.
  std::vector<scene::Color> meter(int frame, int camera) const;
  scene::WaterAbove water_at(const Eigen::Vector3d& center_world, world::RayTrail* trail) const;

  ViewTable views_;
  const world::RayQuery& query_;
  const world::RayQuery* bed_;
  double water_visibility_m_;
  bool wants_bottom_;
  std::uint32_t flags_;  ///< that are looked for
  bool is_in_water_;
  scene::MovingBodies moving_;
  scene::Ground ground_;
  scene::GroundImagery imagery_;
  scene::TextureLibrary textures_;
  scene::Sky sky_;
  scene::Clouds clouds_;
  scene::Exposure exposure_;
  Sampling sampling_;
  std::uint64_t seed_;
  Imagers imagers_;
};

}  // namespace terracast::sensors
