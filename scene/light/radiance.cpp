#include "scene/light/radiance.h"

#include <algorithm>
#include <cmath>

#include "core/random.h"
#include "geo/sun.h"

namespace terracast::scene {
namespace {

// The raised surface that shadow rays hit lies within this share of the tile's side above the true one.
constexpr double kShadowLiftPerSide = 2e-6;
constexpr double kShadowLift_m = 2e-3;
// Of objects the surface itself is hit, exactly; what lies on it (signs, marks) is this thick.
constexpr double kObjectShadowLift_m = 2e-3;
// Objects farther than this take hardly any of the light of the sky from most points, and about as much from all
// points of a town.
constexpr double kSkyReach_m = 30.0;

/// The water over a viewer who is in it.
WaterAbove water_over(const Scene& scene, const Eigen::Vector3d& eye_world,
                      world::RayTrail* trail) {
  WaterAbove above;
  find_water_above(scene.whole(), std::span(&eye_world, 1), std::span(&above, 1), trail);
  // Near a shore the surface's cover may be the land's.
  if (!world::is_water(above.cover)) {
    const std::optional<double> surface_z =
        scene.whole().surface_z_world(eye_world.x(), eye_world.y());
    above = {.depth_m = surface_z.value_or(0.0) - eye_world.z(), .cover = world::Cover::Sea};
  }
  above.depth_m = std::max(above.depth_m, 1e-3);
  return above;
}

}  // namespace

void LightRays::clear() {
  rays.clear();
  offsets_s.clear();
  sun_rays.clear();
  bits.clear();
  samples.clear();
  spread.clear();
}

Radiance::Radiance(const SceneAt& at, const Sampling& sampling, const Eigen::Vector3d& eye_world,
                   bool starts_at_eye, world::RayTrail* trail)
    : at_(at),
      sampling_(sampling),
      trail_(trail),
      shader_(at.scene().ground(), at.scene().imagery(), at.scene().textures(), at.scene().sky()),
      sun_(at.scene().daylight().sun_direction_world) {
  const Scene& scene = at.scene();
  if (scene.bed() != nullptr)
    water_.emplace(at.whole(), at.bed(), scene.ground(), scene.sky(), shader_,
                   scene.conditions().water_visibility_m);
  if (scene.is_in_water()) eye_ = water_over(scene, eye_world, trail);
  if (starts_at_eye)
    eye_height_m_ = static_cast<float>(approximate_height_m(eye_world)) -
                    static_cast<float>(scene.ground().climate().sea_level_m);
  const Eigen::Vector3d beside =
      std::abs(sun_.z()) < 0.9 ? Eigen::Vector3d::UnitZ() : Eigen::Vector3d::UnitX();
  const double radius = std::tan(geo::kSunAngularRadius_rad);
  const Eigen::Vector3d right = sun_.cross(beside).normalized();
  sun_right_ = right * radius;
  sun_up_ = sun_.cross(right) * radius;
}

void Radiance::find(const SampleWidth& width, LightRays& s) const {
  s.times_s = s.offsets_s;
  if (at_.shift_s() != 0.0)
    for (double& time_s : s.times_s) time_s += at_.shift_s();
  s.hits.resize(s.rays.size());
  s.surfaces.resize(s.rays.size());
  at_.viewed().intersect(s.rays, s.times_s, s.hits, world::Coherence::Coherent, s.surfaces, trail_);
  s.radiance.resize(s.rays.size());
  const bool is_in_water = eye_.depth_m > 0.0;
  if (is_in_water) {
    s.sun_share.assign(s.rays.size(), 1.0f);
    s.sky_share.assign(s.rays.size(), -1.0f);
  } else {
    cast_sun_rays(s);
    dim_sun(s);
    cast_sky_rays(s);
  }
  LitHits lit{.rays = s.rays,
              .offsets_s = s.times_s,
              .hits = s.hits,
              .surfaces = s.surfaces,
              .sun_share = s.sun_share,
              .sky_share = s.sky_share,
              .sample_width = width,
              .spread = s.spread};
  if (is_in_water) {
    water_->look_in_water(lit, eye_, s.water, s.radiance, trail_);
    return;
  }
  if (water_) {
    s.below.resize(s.rays.size());
    s.mirrored.resize(s.rays.size());
    s.reflectance.resize(s.rays.size());
    water_->look(lit, s.water, {s.below, s.mirrored, s.reflectance}, trail_);
    lit.below = s.below;
    lit.mirrored = s.mirrored;
    lit.reflectance = s.reflectance;
  }
  shader_.shade(lit, s.shader, s.radiance);
  lay_media(width, s);
}

double Radiance::lift_m(const world::SurfaceHit& hit, const world::SurfaceSample& surface) const {
  return hit.is_ground()
             ? kShadowLift_m + kShadowLiftPerSide * world::kTileCells * surface.spacing_m
             : kObjectShadowLift_m;
}

/// Sets is_occluded of rays to light.
/// ray_of   the viewer's ray whose time each has
void Radiance::cast_light(std::span<const world::WorldRay> rays,
                          std::span<const std::uint32_t> ray_of, LightRays& s) const {
  s.light_times_s.clear();
  for (const std::uint32_t ray : ray_of) s.light_times_s.push_back(s.times_s[ray]);
  s.is_occluded.resize(rays.size());
  at_.whole().occluded(rays, s.light_times_s, s.is_occluded, trail_);
}

/// A ray from each hit to a point of the sun's disc; what faces away is dark without one.
void Radiance::cast_sun_rays(LightRays& s) const {
  s.sun_share.assign(s.rays.size(), 0.0f);
  s.sun_ray_of.clear();
  for (std::size_t i = 0; i < s.rays.size(); ++i) {
    const world::SurfaceHit& hit = s.hits[i];
    if (hit.is_sky()) continue;
    const Eigen::Vector3d point = s.rays[i].origin_world + hit.t * s.rays[i].direction_world;
    const Eigen::Vector3d direction = s.sun_rays[i].direction_world;
    if (at_.scene().sky().is_night()) continue;
    Eigen::Vector3d normal = hit.normal_world();
    if (normal.dot(direction) <= 0.0) {
      if (hit.is_ground() || !is_translucent(s.surfaces[i].finish.material)) continue;
      normal = -normal;  // lit from behind
    }
    // Sun rays move up to close the ranks: their own entry is used, or comes later.
    s.sun_rays[s.sun_ray_of.size()] = {.origin_world = point + lift_m(hit, s.surfaces[i]) * normal,
                                       .direction_world = direction};
    s.sun_ray_of.push_back(static_cast<std::uint32_t>(i));
  }
  s.sun_rays.resize(s.sun_ray_of.size());
  cast_light(s.sun_rays, s.sun_ray_of, s);
  for (std::size_t i = 0; i < s.sun_ray_of.size(); ++i)
    if (s.is_occluded[i] == 0) s.sun_share[s.sun_ray_of[i]] = 1.0f;
}

/// Rays from each hit over the sky above it, as the cosine weights it. Of what lies lower than the hit only the
/// ground counts, which Ambient has.
void Radiance::cast_sky_rays(LightRays& s) const {
  const int num_sky_rays = sampling_.num_sky_rays;
  s.sky_share.assign(s.rays.size(), num_sky_rays > 0 ? 1.0f : -1.0f);
  if (num_sky_rays == 0) return;
  s.sky_rays.clear();
  s.sky_ray_of.clear();
  const Eigen::Vector3d up = at_.scene().daylight().up_world;
  for (std::size_t i = 0; i < s.rays.size(); ++i) {
    const world::SurfaceHit& hit = s.hits[i];
    if (hit.is_sky()) continue;
    const Eigen::Vector3d normal = hit.normal_world();
    const Eigen::Vector3d point = s.rays[i].origin_world + hit.t * s.rays[i].direction_world +
                                  lift_m(hit, s.surfaces[i]) * normal;
    const Eigen::Vector3d right = normal.unitOrthogonal();
    const Eigen::Vector3d aside = normal.cross(right);
    for (int ray = 0; ray < num_sky_rays; ++ray) {
      const Eigen::Vector2d disc = sampling_.sampler.place_on_disc(
          core::mix_bits(s.bits[i] + 0x736b79 + static_cast<std::uint64_t>(ray)), s.samples[i]);
      const Eigen::Vector3d direction =
          disc.x() * right + disc.y() * aside +
          std::sqrt(std::max(1.0 - disc.squaredNorm(), 1e-6)) * normal;
      if (direction.dot(up) <= 0.0) continue;
      s.sky_rays.push_back(
          {.origin_world = point, .direction_world = direction, .t_max = kSkyReach_m});
      s.sky_ray_of.push_back(static_cast<std::uint32_t>(i));
    }
  }
  cast_light(s.sky_rays, s.sky_ray_of, s);
  const float part = 1.0f / static_cast<float>(num_sky_rays);
  for (std::size_t i = 0; i < s.sky_ray_of.size(); ++i)
    if (s.is_occluded[i] != 0) s.sky_share[s.sky_ray_of[i]] -= part;
  for (float& share : s.sky_share) share = std::max(share, 0.0f);
}

/// Media between each hit and the sun. The sun's irradiance is that below the air.
void Radiance::dim_sun(LightRays& s) const {
  for (const std::unique_ptr<Medium>& medium : at_.scene().media().subspan(1))
    for (std::size_t i = 0; i < s.rays.size(); ++i)
      if (s.sun_share[i] > 0.0f)
        s.sun_share[i] *= static_cast<float>(medium->sun_transmittance(
            s.rays[i].origin_world + s.hits[i].t * s.rays[i].direction_world));
}

/// Media before each hit, each seen through the air before it. Surfaces are shaded through the air.
void Radiance::lay_media(const SampleWidth& width, LightRays& s) const {
  const std::span<const std::unique_ptr<Medium>> media = at_.scene().media();
  const Medium& air = *media.front();
  const auto sea_level_m = static_cast<float>(at_.scene().ground().climate().sea_level_m);
  std::uint64_t stream = 0x636c6f7564;  // "cloud"
  for (const std::unique_ptr<Medium>& medium : media.subspan(1)) {
    for (std::size_t i = 0; i < s.rays.size(); ++i) {
      const world::WorldRay& ray = s.rays[i];
      MediumRay through{
          .origin_world = ray.origin_world,
          .direction_world = ray.direction_world,
          .until_m = s.hits[i].t,
          .from_height_m =
              eye_height_m_
                  ? *eye_height_m_
                  : static_cast<float>(approximate_height_m(ray.origin_world)) - sea_level_m,
          .sample_width = width,
          .jitter = core::random_unit(s.bits[i], stream, static_cast<std::uint64_t>(s.samples[i]))};
      const SeenMedium seen = medium->look(through);
      if ((seen.transmittance == 1.0f).all()) continue;
      through.until_m = seen.distance_m;
      const SeenMedium before = air.look(through);
      s.radiance[i] = seen.transmittance * s.radiance[i] + seen.radiance * before.transmittance +
                      (1.0f - seen.transmittance) * before.radiance;
    }
    ++stream;
  }
}

}  // namespace terracast::scene
