#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "core/image.h"
#include "scene/light/sampler.h"
#include "scene/light/shading.h"
#include "scene/light/sky.h"
#include "scene/scene.h"
#include "sensors/camera/camera_plan.h"
#include "sensors/camera/ground_truth.h"
#include "sensors/camera/imaging/imager.h"
#include "sensors/camera/pixel_blocks.h"
#include "sensors/camera/views.h"

namespace terracast::sensors {

/// The options with which a plan's scene is opened: its light, and its first camera as the viewer.
scene::SceneOptions scene_options(const CameraPlan& plan, const ViewTable& views,
                                  const world::RayQueryOptions& tracing);

/// The images of one sequence's cameras. Parallel inside an image. Threads: safe.
class FrameRenderer {
 public:
  /// Views and scene must outlive the renderer.
  /// views    of the plan
  /// scene    opened with scene_options() of the plan
  /// throws   Config: exposures that make no sense; Input, Io from tiles
  FrameRenderer(const CameraPlan& plan, const ViewTable& views, const scene::Scene& scene);

  const scene::Scene& scene() const { return scene_; }
  const ViewTable& views() const { return views_; }
  const scene::Ground& ground() const { return scene_.ground(); }
  const scene::Sky& sky() const { return scene_.sky(); }
  const scene::MovingBodies& moving() const { return scene_.moving(); }

  /// Facts of a camera at a frame.
  TruthFrame truth(int frame, int camera) const {
    TruthFrame truth;
    this->truth(frame, camera, truth);
    return truth;
  }
  /// The same, into a frame that has been used before.
  /// trail   takes the tiles that the rays visit; null: not recorded
  void truth(int frame, int camera, TruthFrame& truth, world::RayTrail* trail = nullptr) const {
    trace_truth(scene_.viewed(), scene_.moving(), scene_.ground(), views_, frame, camera, truth,
                trail, wants_bottom_ ? scene_.bed() : nullptr, flags_);
  }

  /// Anti-aliased colour of a camera at a frame; no ground truth mixes in.
  Photo photo(int frame, int camera, world::RayTrail* trail = nullptr) const;
  core::Image8 color(int frame, int camera, world::RayTrail* trail = nullptr) const {
    return photo(frame, camera, trail).color;
  }

 private:
  /// How finely light is looked for.
  struct Sampling {
    scene::PixelSampler sampler;
    int num_samples;
    int num_sky_rays;
  };
  /// Takes the radiance of a unit's pixels, row by row.
  using TakeLight = std::function<void(const PixelUnit&, std::span<const scene::Color>)>;

  void gather_light(int frame, int camera, const std::vector<PixelUnit>& units,
                    const Sampling& sampling, world::RayTrail* trail, const TakeLight& take) const;
  /// What a camera's light meter sees: some places of its image, at the fixed exposure.
  std::vector<scene::Color> meter(int frame, int camera) const;

  const ViewTable& views_;
  const scene::Scene& scene_;
  bool wants_bottom_;
  std::uint32_t flags_;          ///< that are looked for
  std::vector<double> times_s_;  ///< of the frames
  scene::Exposure exposure_;
  Sampling sampling_;
  std::uint64_t seed_;
  Imagers imagers_;
};

}  // namespace terracast::sensors
