#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "scene/ground/blend.h"
#include "world/ray_query.h"

namespace terracast::scene {

/// Where a sample meets an object, and what is known of the surface there.
struct ObjectPlace {
  world::Finish finish;
  Rgb color;             ///< of the finish, linear
  std::uint64_t seed;    ///< of the object, in its world
  std::uint32_t part;    ///< triangle of the shape
  std::uint8_t variety;  ///< Instance::variety
  /// Whether u_m and v_m are the shape's own. Without such they are distances from the object's place
  /// along u and v.
  bool has_uv;
  double u_m;
  double v_m;
  Eigen::Vector3f u;  ///< unit, world: the direction in which u_m grows; level but on level places
  Eigen::Vector3f v;  ///< up the surface
  Eigen::Vector3f normal;        ///< unit, world, of the true triangle, towards the camera
  Eigen::Vector3f from_place_m;  ///< SurfaceSample's, as reach_m and height_m
  float reach_m;
  float height_m;
  float footprint_m;  ///< width of an image sample on the surface
  /// Noise of the place in the world, each of root mean square 1; 0 where needs_noise() says no.
  float coarse;  ///< 8 m to 1 m
  float fine;    ///< 0.5 m to 6 cm
};

/// What light meets there. Of light that comes in, no more goes out: for each channel
/// gloss.share * F + (1 - gloss.share * F) * (albedo + transmitted) is at most 1.
struct ObjectLook {
  Rgb albedo = {0.0f, 0.0f, 0.0f};                    ///< share of light sent back, every way
  Rgb transmitted = {0.0f, 0.0f, 0.0f};               ///< share sent through, every way: leaves
  Eigen::Vector3f normal = Eigen::Vector3f::UnitZ();  ///< with the relief that the shape lacks
  float openness = 1.0f;        ///< share of the light of the surroundings that hollows leave
  float crown_openness = 1.0f;  ///< the same by what stands around: leaves inside a crown

  /// A smooth or a rough layer that mirrors, over a share of the surface.
  struct Gloss {
    float share = 0.0f;
    Rgb facing = {0.04f, 0.04f, 0.04f};  ///< reflected where one looks straight at it
    float roughness = 0.2f;              ///< of slopes: alpha of Trowbridge and Reitz (1975)
    Eigen::Vector3f normal = Eigen::Vector3f::UnitZ();
  } gloss;
  Rgb emitted_by_night = {0.0f, 0.0f, 0.0f};  ///< radiance, kcd/m2
};

/// Whether light goes through a material: such a surface is lit from behind too.
constexpr bool is_translucent(world::Material material) {
  return material == world::Material::Leaves || material == world::Material::Needles ||
         material == world::Material::Blades;
}

/// Whether a material is drawn with noise.
bool needs_noise(world::Material material);

/// A place without its noise.
/// hit       of an object
/// up        unit, world
ObjectPlace object_place(const world::SurfaceHit& hit, const world::SurfaceSample& surface,
                         const Eigen::Vector3f& up, float footprint_m, std::uint32_t world_seed);

/// Procedural surfaces of objects, family by family (render/looks). All of it is a function of the
/// object and the place on it: it is the same from every view and in every frame; only how much detail is
/// left out follows the footprint, and what is left out fades into its average. Threads: safe.
ObjectLook look_at_object(const ObjectPlace& place);

}  // namespace terracast::scene
