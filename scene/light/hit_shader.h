#pragma once

#include <span>
#include <vector>

#include "scene/ground/ground.h"
#include "scene/ground/ground_imagery.h"
#include "scene/ground/sample_width.h"
#include "scene/light/shading.h"
#include "scene/light/sky.h"
#include "scene/objects/object_look.h"
#include "scene/objects/texture_library.h"
#include "world/ray_query.h"

namespace terracast::scene {

/// Rays of one camera's image, what they met, and the light there. All spans are as long as rays.
struct LitHits {
  std::span<const world::WorldRay> rays;  ///< unit directions, from the camera
  /// Their times, counted from the frame's; empty: all at that.
  std::span<const double> offsets_s = {};
  std::span<const world::SurfaceHit> hits;
  std::span<const world::SurfaceSample> surfaces;
  std::span<const float> sun_share;  ///< of the sun's disc that is seen from the hit, 0 … 1
  /// Of the light of the surroundings what comes past objects near the hit, 0 … 1; below 0: nobody has
  /// looked.
  std::span<const float> sky_share;
  SampleWidth sample_width;
  /// Of the bed of the sea (Cover::Seabed) its depth (scene/water/water_above.h); 0 elsewhere. Empty: 0.
  std::span<const double> sea_depth_m = {};
  /// Numbers of [0, 1], spread evenly over the samples of a pixel; empty: drawn by place.
  std::span<const float> spread = {};
  /// Of rays that met water (SeenWater): below 0, or empty: nobody has looked.
  std::span<const Color> below = {};
  std::span<const Color> mirrored = {};
  std::span<const float> reflectance = {};
};

/// Width of a sample on the surface that a ray met: between that across the view and that along it, but on
/// water the latter, since waves that a sample holds must not be drawn.
double footprint_m(const LitHits& hits, std::size_t ray);

/// What surfaces are like where rays met them, whatever the light. Threads: safe.
class SurfaceLooks {
 public:
  /// Buffers, used again.
  struct Scratch {
    std::vector<std::size_t> ground;
    std::vector<std::size_t> objects;
    std::vector<std::size_t> noisy;  ///< objects that are drawn with noise
    std::vector<ObjectPlace> places;
    GroundPlaces ground_places;
    GroundPacket packet;
    GroundLook look;
    GroundImagery::Reader imagery;
  };

  /// All must outlive it.
  SurfaceLooks(const Ground& ground, const GroundImagery& imagery, const TextureLibrary& textures)
      : ground_(ground), imagery_(imagery), textures_(textures) {}
  const Ground& ground() const { return ground_; }

  /// Sets scratch.ground and scratch.objects: the rays that met either.
  static void part(const LitHits& hits, Scratch& scratch);
  /// Sets ground_places, packet and look of up to kLanes of scratch.ground.
  void look_at_ground(const LitHits& hits, std::span<const std::size_t> lanes,
                      Scratch& scratch) const;
  /// Sets places, one for each of scratch.objects; look_at_object tells the rest.
  /// up   unit
  void look_at_objects(const LitHits& hits, const Eigen::Vector3f& up, Scratch& scratch) const;

  /// The share of light that each surface sends back, every way; NaN of the sky. Of water what comes from below its
  /// surface; mirrors of any kind are left out. Only rays, hits, surfaces, sample_width and
  /// sea_depth_m count.
  void find_albedo(const LitHits& hits, const Eigen::Vector3f& up, Scratch& scratch,
                   std::span<Color> albedo) const;

 private:
  const Ground& ground_;
  const GroundImagery& imagery_;
  const TextureLibrary& textures_;
};

/// Radiance that rays bring to the camera: from the sky, from the ground in packets, from objects one by
/// one, all through the air. What a ray brings depends on no other. Threads: safe.
class HitShader {
 public:
  /// Buffers, used again.
  struct Scratch : SurfaceLooks::Scratch {
    ViewPacket view;
    Lanes3f shaded;
  };

  /// All must outlive the shader.
  HitShader(const Ground& ground, const GroundImagery& imagery, const TextureLibrary& textures,
            const Sky& sky)
      : looks_(ground, imagery, textures), sky_(sky) {}

  /// radiance   as many as rays
  void shade(const LitHits& hits, Scratch& scratch, std::span<Color> radiance) const;

 private:
  float height_over_sea_m(const Eigen::Vector3d& point_world) const;
  void shade_ground_lanes(const LitHits& hits, std::span<const std::size_t> lanes, Scratch& scratch,
                          std::span<Color> radiance) const;
  void shade_objects(const LitHits& hits, Scratch& scratch, std::span<Color> radiance) const;

  const SurfaceLooks looks_;
  const Sky& sky_;
};

}  // namespace terracast::scene
