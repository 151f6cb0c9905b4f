#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "scene/ground/sample_width.h"
#include "scene/light/hit_shader.h"
#include "scene/light/sampler.h"
#include "scene/light/sky.h"
#include "scene/scene.h"
#include "scene/water/water_above.h"
#include "scene/water/water_light.h"
#include "world/ray_query.h"

namespace terracast::scene {

/// Rays whose radiance is sought, and buffers that are used again. The vectors of the first group are the caller's to
/// fill, all as long as `rays`.
struct LightRays {
  std::vector<world::WorldRay> rays;  ///< unit directions
  std::vector<double> offsets_s;      ///< their times, counted from that of the scene
  /// The sun's light is sought in these directions; their origins are set here.
  std::vector<world::WorldRay> sun_rays;
  std::vector<std::uint64_t> bits;  ///< random, of the pixel that a ray belongs to
  std::vector<int> samples;         ///< number of the ray in its pixel
  std::vector<float> spread;        ///< LitHits::spread

  std::vector<Color> radiance;  ///< the result, in kcd/m^2

  std::vector<double> times_s;
  std::vector<world::SurfaceHit> hits;
  std::vector<world::SurfaceSample> surfaces;
  std::vector<std::uint32_t> sun_ray_of;  ///< the ray that a sun ray belongs to
  std::vector<double> light_times_s;      ///< of the sun rays, or of the sky rays
  std::vector<world::WorldRay> sky_rays;
  std::vector<std::uint32_t> sky_ray_of;
  std::vector<std::uint8_t> is_occluded;
  std::vector<float> sun_share;
  std::vector<float> sky_share;
  std::vector<Color> below;  ///< of the rays that hit water
  std::vector<Color> mirrored;
  std::vector<float> reflectance;
  HitShader::Scratch shader;
  WaterLight::Scratch water;

  void clear();
};

/// The light that rays bring to a viewer of a scene: of surfaces in sun and sky, of water, through its media.
/// threads   safe
class Radiance {
 public:
  /// How finely light is sought.
  struct Sampling {
    const PixelSampler& sampler;
    int num_sky_rays;  ///< a ray, toward what hides the sky near its hit; 0: crowns are darkened by estimate
  };

  /// `at` and the sampler must outlive it.
  /// eye_world     the viewer: decides what water it is in
  /// starts_at_eye whether all rays start there, but for a lens and the time a shutter is open
  /// trail         takes the tiles that the rays visit; null: not recorded
  Radiance(const SceneAt& at, const Sampling& sampling, const Eigen::Vector3d& eye_world,
           bool starts_at_eye, world::RayTrail* trail);

  /// A direction toward the sun's disc.
  /// on_disc   in the unit disc
  Eigen::Vector3d toward_sun(const Eigen::Vector2d& on_disc) const {
    return sun_ + on_disc.x() * sun_right_ + on_disc.y() * sun_up_;
  }

  /// Sets `radiance` of the rays.
  /// width   of each ray's share of an image
  void find(const SampleWidth& width, LightRays& s) const;

 private:
  double lift_m(const world::SurfaceHit& hit, const world::SurfaceSample& surface) const;
  void cast_light(std::span<const world::WorldRay> rays, std::span<const std::uint32_t> ray_of,
                  LightRays& s) const;
  void cast_sun_rays(LightRays& s) const;
  void cast_sky_rays(LightRays& s) const;
  void dim_sun(LightRays& s) const;
  void lay_media(const SampleWidth& width, LightRays& s) const;

  const SceneAt& at_;
  Sampling sampling_;
  world::RayTrail* trail_;
  HitShader shader_;
  std::optional<WaterLight> water_;  ///< nothing: it is opaque
  WaterAbove eye_;                   ///< the water over the viewer; its depth is 0 above it
  std::optional<float> eye_height_m_;
  Eigen::Vector3d sun_;
  Eigen::Vector3d sun_right_;  ///< spans the sun's disc with sun_up_, of its radius
  Eigen::Vector3d sun_up_;
};

}  // namespace terracast::scene
