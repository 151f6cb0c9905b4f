#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "geo/camera_model.h"
#include "scene/light/radiance.h"
#include "scene/light/sampler.h"
#include "scene/scene.h"
#include "sensors/camera/views.h"
#include "sensors/events/adaptive_steps.h"
#include "sensors/events/pixel.h"
#include "sensors/sensor.h"
#include "world/ray_trail.h"

namespace terracast::sensors::events {

/// What pixels see of a scene over a short span of time: the mean light of samples all over a pixel, whose places in the pixel
/// and on the sun's disc are the pixel's own for all time, each look from the body's own pose at its time.
///
/// determinism   a look depends on the scene, the motion, pixel, time and the span; not on the other looks
/// threads       const use is safe, with buffers of one's own
class SceneLooks {
 public:
  /// Of one thread; empty to begin with, and again for each block of pixels.
  struct Scratch {
    scene::LightRays light;
    std::map<double, std::array<View, 3>> views;  ///< by time: then, and just before and after
  };

  /// site and model must outlive it.
  /// trail   takes the tiles that the rays visit; null: not recorded
  SceneLooks(const SensorSite& site, const geo::CameraModel& model, const PixelOptions& options,
             const scene::PixelSampler& sampler, int num_samples, const TimeSpan& span,
             world::RayTrail* trail);

  void look(std::span<const LookPlace> places, std::span<Look> looks, Scratch& scratch) const;

 private:
  /// All in one cell of the image.
  void look_at_some(std::span<const LookPlace> places, std::span<Look> looks,
                    Scratch& scratch) const;
  const std::array<View, 3>& views_at(double time_s, Scratch& scratch) const;
  View view_at(double time_s) const;
  Eigen::Vector2d centre_of(std::uint32_t pixel) const;
  Eigen::Vector2d middle_of_cell(std::uint32_t pixel) const;
  double flow_pxps(const LookPlace& place, double nearest_m, Scratch& scratch) const;

  const SensorSite& site_;
  const geo::CameraModel& model_;
  const PixelOptions& options_;
  const scene::PixelSampler& sampler_;
  int num_samples_;
  double middle_s_;
  scene::SceneAt at_;
  scene::Radiance radiance_;
};

}  // namespace terracast::sensors::events
