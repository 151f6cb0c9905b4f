#include "scene/light/hit_shader.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "scene/ground/noise.h"
#include "scene/objects/object_shading.h"

namespace terracast::scene {
namespace {

// How much wider a sample on slanted ground counts than across the view: between 0 (aliases) and 1
// (blurs along it).
constexpr float kSlantExponent = 0.6f;

// Streams of noise on objects.
constexpr std::uint32_t kObjectCoarse = 211;
constexpr std::uint32_t kObjectFine = 223;

Eigen::Vector3d point_of(const LitHits& hits, std::size_t i) {
  return hits.rays[i].origin_world + hits.hits[i].t * hits.rays[i].direction_world;
}

/// Where noise on an object is looked up: in the world, or on what moves.
Eigen::Vector3d noise_place_of(const LitHits& hits, std::size_t i) {
  return hits.hits[i].is_moving() ? hits.surfaces[i].in_body_m.cast<double>() : point_of(hits, i);
}

}  // namespace

double footprint_m(const LitHits& hits, std::size_t i) {
  const auto facing = static_cast<float>(
      std::max(-hits.rays[i].direction_world.dot(hits.hits[i].normal_world()), 0.01));
  const double across_m = hits.sample_width.at(hits.hits[i].t);
  if (hits.hits[i].is_ground() && world::is_water(hits.surfaces[i].cover) &&
      !hits.surfaces[i].paint.is_painted)
    return across_m / static_cast<double>(facing);
  return across_m * static_cast<double>(std::pow(facing, -kSlantExponent));
}

void SurfaceLooks::part(const LitHits& hits, Scratch& s) {
  s.ground.clear();
  s.objects.clear();
  for (std::size_t i = 0; i < hits.rays.size(); ++i)
    if (!hits.hits[i].is_sky()) (hits.hits[i].is_ground() ? s.ground : s.objects).push_back(i);
}

void SurfaceLooks::look_at_ground(const LitHits& hits, std::span<const std::size_t> lanes,
                                  Scratch& s) const {
  for (int lane = 0; lane < kLanes; ++lane) {
    const std::size_t i = lanes[std::min(static_cast<std::size_t>(lane), lanes.size() - 1)];
    s.ground_places.set(lane, point_of(hits, i), hits.hits[i].normal_world(), hits.surfaces[i],
                        footprint_m(hits, i));
    if (!hits.sea_depth_m.empty()) s.ground_places.sea_depth_m[lane] = hits.sea_depth_m[i];
  }
  ground_.set(s.ground_places, s.packet);
  ground_.look(s.packet, s.look);
  imagery_.drape(s.ground_places, s.packet, ground_.climate().seed, s.imagery, s.look);
}

void SurfaceLooks::look_at_objects(const LitHits& hits, const Eigen::Vector3f& up,
                                   Scratch& s) const {
  const std::uint32_t seed = ground_.climate().seed;
  s.places.clear();
  s.noisy.clear();
  for (const std::size_t i : s.objects) {
    if (needs_noise(hits.surfaces[i].finish.material)) s.noisy.push_back(s.places.size());
    s.places.push_back(object_place(hits.hits[i], hits.surfaces[i], up,
                                    static_cast<float>(footprint_m(hits, i)), seed));
    if (hits.surfaces[i].finish.material == world::Material::Textured) {
      ObjectPlace& place = s.places.back();
      const Color albedo = textured_albedo(textures_, place.finish, hits.surfaces[i].uv,
                                           place.footprint_m * hits.surfaces[i].uv_per_m);
      place.color = {albedo[0], albedo[1], albedo[2]};
    }
  }
  for (std::size_t first = 0; first < s.noisy.size(); first += kLanes) {
    Lanes3d points;
    Lanes<double> footprints_m;
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      const std::size_t at = s.noisy[std::min(first + lane, s.noisy.size() - 1)];
      const Eigen::Vector3d point = noise_place_of(hits, s.objects[at]);
      for (std::size_t k = 0; k < 3; ++k)
        points[k][static_cast<int>(lane)] = point[static_cast<int>(k)];
      footprints_m[static_cast<int>(lane)] = static_cast<double>(s.places[at].footprint_m);
    }
    NoisePlaces places;
    places.set(points, footprints_m);
    const NoiseSum coarse = sum_noise(places, 3, 0, seed + kObjectCoarse);
    const NoiseSum fine = sum_noise(places, -1, -4, seed + kObjectFine);
    for (std::size_t lane = 0; lane < kLanes && first + lane < s.noisy.size(); ++lane) {
      s.places[s.noisy[first + lane]].coarse = coarse.value[static_cast<int>(lane)];
      s.places[s.noisy[first + lane]].fine = fine.value[static_cast<int>(lane)];
    }
  }
}

void SurfaceLooks::find_albedo(const LitHits& hits, const Eigen::Vector3f& up, Scratch& s,
                               std::span<Color> albedo) const {
  std::fill(albedo.begin(), albedo.end(), Color::Constant(std::numeric_limits<float>::quiet_NaN()));
  part(hits, s);
  const std::span<const std::size_t> ground(s.ground);
  for (std::size_t first = 0; first < ground.size(); first += kLanes) {
    const auto lanes = ground.subspan(first, std::min<std::size_t>(kLanes, ground.size() - first));
    look_at_ground(hits, lanes, s);
    for (std::size_t lane = 0; lane < lanes.size(); ++lane) {
      const int at = static_cast<int>(lane);
      albedo[lanes[lane]] = Color(s.look.albedo[0][at], s.look.albedo[1][at], s.look.albedo[2][at]);
    }
  }
  s.imagery.let_go();
  look_at_objects(hits, up, s);
  for (std::size_t at = 0; at < s.objects.size(); ++at) {
    const Rgb rgb = look_at_object(s.places[at]).albedo;
    albedo[s.objects[at]] = Color(rgb.r, rgb.g, rgb.b);
  }
}

float HitShader::height_over_sea_m(const Eigen::Vector3d& point_world) const {
  return static_cast<float>(approximate_height_m(point_world) -
                            looks_.ground().climate().sea_level_m);
}

void HitShader::shade(const LitHits& hits, Scratch& s, std::span<Color> radiance) const {
  for (std::size_t i = 0; i < hits.rays.size(); ++i)
    if (hits.hits[i].is_sky()) radiance[i] = shade_sky(sky_, hits.rays[i].direction_world);
  SurfaceLooks::part(hits, s);
  const std::span<const std::size_t> ground(s.ground);
  for (std::size_t first = 0; first < ground.size(); first += kLanes)
    shade_ground_lanes(hits,
                       ground.subspan(first, std::min<std::size_t>(kLanes, ground.size() - first)),
                       s, radiance);
  s.imagery.let_go();
  if (!s.objects.empty()) shade_objects(hits, s, radiance);
}

void HitShader::shade_ground_lanes(const LitHits& hits, std::span<const std::size_t> lanes,
                                   Scratch& s, std::span<Color> radiance) const {
  looks_.look_at_ground(hits, lanes, s);
  for (int lane = 0; lane < kLanes; ++lane) {
    const std::size_t i = lanes[std::min(static_cast<std::size_t>(lane), lanes.size() - 1)];
    for (std::size_t k = 0; k < 3; ++k)
      s.view.direction[k][lane] =
          static_cast<float>(hits.rays[i].direction_world[static_cast<int>(k)]);
    s.view.distance_m[lane] = static_cast<float>(hits.hits[i].t);
    s.view.start_height_m[lane] = height_over_sea_m(hits.rays[i].origin_world);
    s.view.sun_share[lane] = hits.sun_share[i];
    s.view.sky_share[lane] = hits.sky_share[i] < 0.0f ? 1.0f : hits.sky_share[i];
    for (std::size_t k = 0; k < 3; ++k) {
      const int at = static_cast<int>(k);
      s.view.below[k][lane] = hits.below.empty() ? -1.0f : hits.below[i][at];
      s.view.mirrored[k][lane] = hits.mirrored.empty() ? -1.0f : hits.mirrored[i][at];
    }
    s.view.reflectance[lane] = hits.reflectance.empty() ? -1.0f : hits.reflectance[i];
  }
  shade_ground(s.packet, s.look, s.view, sky_, s.shaded);
  for (std::size_t lane = 0; lane < lanes.size(); ++lane) {
    const int at = static_cast<int>(lane);
    radiance[lanes[lane]] = Color(s.shaded[0][at], s.shaded[1][at], s.shaded[2][at]);
  }
}

void HitShader::shade_objects(const LitHits& hits, Scratch& s, std::span<Color> radiance) const {
  const Eigen::Vector3f sun = sky_.daylight().sun_direction_world.cast<float>();
  looks_.look_at_objects(hits, sky_.daylight().up_world.cast<float>(), s);
  for (std::size_t at = 0; at < s.objects.size(); ++at) {
    const std::size_t i = s.objects[at];
    const Eigen::Vector3f direction = hits.rays[i].direction_world.cast<float>();
    const Color leaving = object_radiance(
        look_at_object(s.places[at]),
        {.to_camera = -direction, .sun_share = hits.sun_share[i], .sky_share = hits.sky_share[i]},
        sky_);
    const auto height_m = height_over_sea_m(point_of(hits, i));
    const AirPath air =
        sky_.air(static_cast<float>(hits.hits[i].t), height_over_sea_m(hits.rays[i].origin_world),
                 height_m, direction.dot(sun));
    radiance[i] = leaving * air.transmittance + air.inscatter;
  }
}

}  // namespace terracast::scene
