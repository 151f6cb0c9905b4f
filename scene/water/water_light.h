#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "scene/ground/ground.h"
#include "scene/light/hit_shader.h"
#include "scene/light/sky.h"
#include "scene/water/water_above.h"
#include "world/timed_query.h"

namespace terracast::scene {

/// Refractive index of water for visible light.
inline constexpr double kWaterIndex = 1.333;

/// What water does to light, a channel each of linear sRGB.
struct WaterOptics {
  Color absorption_per_m;
  Color backscatter_per_m;
  Color scatter_per_m;

  /// Radiance of water without a bottom, looked into from above, per irradiance that goes down in it, and
  /// how fast light fades on the ways down and up (Lee et al. 1998).
  Color deep_reflectance() const;  ///< 1/sr
  Color fading_per_m() const { return absorption_per_m + backscatter_per_m; }
  Color beam_per_m() const { return absorption_per_m + scatter_per_m; }
};

/// Pure water (absorption: Pope and Fry 1997; backscattering: Morel 1974) with particles and yellow
/// substance (Bricaud, Morel and Prieur 1981), as much of them as gives this visibility under water: the
/// distance at which contrast falls to 2 % at 550 nm.
/// cover   lakes hold more yellow substance than the sea, rivers more particles than lakes
WaterOptics optics_of(world::Cover cover, double visibility_m);

/// The direction in which a ray goes on below (or above) a surface, and none beyond the critical angle.
/// direction, normal   unit; the normal on the side from which the ray comes
/// eta                 index where it comes from over that where it goes
/// returns             whether there is one
bool refract(const Eigen::Vector3d& direction, const Eigen::Vector3d& normal, double eta,
             Eigen::Vector3d& refracted);

/// Share of unpolarised light that a smooth surface of water reflects (Fresnel), from either side.
/// eta   as refract()
float fresnel_reflectance(float cos_incidence, float eta);

/// What is seen of water by rays that met it; of others, all is below 0. Each as many as rays.
struct SeenWater {
  /// Radiance that comes up to the surface from below, as it is above it but for the share that is
  /// reflected.
  std::span<Color> below;
  std::span<Color> mirrored;     ///< radiance that comes to the facet from where it mirrors
  std::span<float> reflectance;  ///< of the facet, at the angle at which the ray meets it
};

/// What is seen in water and mirrored by it. Where waves are smaller than a sample, each ray meets one facet of
/// those that are seen (scene/water/rough_water.h), spread evenly over the samples of a pixel. Threads: safe.
class WaterLight {
 public:
  /// Buffers, used again.
  struct Scratch {
    std::vector<std::size_t> water;  ///< rays that met water
    std::vector<Eigen::Vector3d> normals;
    std::vector<double>
        blur;  ///< of `water`: by how much of their way waves spread what lies below
    std::vector<world::WorldRay> rays;
    std::vector<double> offsets_s;
    std::vector<world::SurfaceHit> hits;
    std::vector<world::SurfaceSample> surfaces;
    std::vector<std::size_t> of_water;  ///< of `water` that a ray belongs to
    std::vector<float> sun_share;
    std::vector<float> sky_share;
    std::vector<Color> radiance;
    std::vector<Color> bottom;  ///< of `water`: albedo
    std::vector<double> way_m;  ///< of `water`: along the ray to the bottom; below 0: none
    std::vector<double> depth_m;
    std::vector<double> sea_depth_m;  ///< of `water`: of the sea above the bottom; 0 elsewhere
    std::vector<float> foam;
    std::vector<Eigen::Vector3d> bed_places;  ///< of what viewers in water see
    std::vector<WaterAbove> above;            ///< those
    GroundPlaces places;
    GroundPacket packet;
    GroundLook look;
    HitShader::Scratch shader;
  };

  /// All must outlive it. bed   the world without water
  WaterLight(const world::TimedQuery& whole, const world::TimedQuery& bed, const Ground& ground,
             const Sky& sky, const HitShader& shader, double visibility_m);

  /// Sets what `seen` holds, for LitHits.
  void look(const LitHits& hits, Scratch& scratch, const SeenWater& seen,
            world::RayTrail* trail) const;

  /// What rays of a camera in water bring to it: from the bed and from solids, through the surface within
  /// Snell's window, off the surface beyond it, and from the water on the way.
  /// hits       of the world without water, for viewers in water
  /// eye        the water at the camera, of a depth above 0
  void look_in_water(const LitHits& hits, const WaterAbove& eye, Scratch& scratch,
                     std::span<Color> radiance, world::RayTrail* trail) const;

 private:
  const WaterOptics& optics(world::Cover cover) const;
  Color irradiance_below(float sun_share) const;
  Color glow(const WaterOptics& water, float rise) const;
  void look_down(const LitHits& hits, Scratch& scratch, std::span<Color> below,
                 world::RayTrail* trail) const;
  void shade_bottom(const LitHits& hits, Scratch& scratch, double start_depth_m,
                    world::RayTrail* trail) const;
  void find_sea(const LitHits& hits, Scratch& scratch, bool is_viewer_in_water,
                world::RayTrail* trail) const;
  void find_foam(const LitHits& hits, Scratch& scratch, std::span<const std::size_t> lanes) const;
  float surf_at(const Eigen::Vector2d& place_world) const;
  void draw_facets(const LitHits& hits, Scratch& scratch, std::span<float> reflectance) const;
  void look_up(const LitHits& hits, Scratch& scratch, const SeenWater& seen,
               world::RayTrail* trail) const;

  const world::TimedQuery& whole_;
  const world::TimedQuery& bed_;
  const Ground& ground_;
  const Sky& sky_;
  const HitShader& shader_;
  WaterOptics sea_;
  WaterOptics lake_;
  WaterOptics river_;
};

}  // namespace terracast::scene
