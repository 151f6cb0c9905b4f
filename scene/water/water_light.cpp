#include "scene/water/water_light.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

#include "core/random.h"
#include "scene/ground/blend.h"
#include "scene/light/shading.h"
#include "scene/objects/object_look.h"
#include "scene/water/rough_water.h"
#include "scene/water/water.h"

namespace terracast::scene {
namespace {

using Eigen::Vector3d;
using world::Cover;

constexpr float kPi = 3.14159265f;

// Channels of linear sRGB taken as 610, 550 and 465 nm.
const Color kPureAbsorption_per_m(0.264f, 0.0565f, 0.0101f);  // Pope and Fry 1997, table 3
/// Half of what pure sea water scatters (Morel 1974), by lambda^-4.3.
const Color kPureBackscatter_per_m(0.00060f, 0.00095f, 0.0020f);
/// Yellow substance, 1 at 550 nm: exp(-0.014 (lambda - 550)) (Bricaud et al. 1981).
const Color kYellow(0.43f, 1.0f, 3.29f);

/// Light that has gone farther through water does not tell of what lies there.
constexpr double kFarthestBottom_m = 160.0;
/// What is mirrored is looked for so far, from so near, and where the surface reflects so much.
constexpr double kFarthestMirrored_m = 4000.0;
constexpr double kMirrorDistance_m = 5000.0;
constexpr float kLeastReflectance = 0.03f;
/// Facets of a sample point so far apart that what they mirror is seen as wide as this at least.
constexpr double kMirrorSpread_rad = 0.05;
/// One facet stands for all of its sample, so what it meets would be seen as specks: from this distance on
/// to thrice it the sky, which most others mirror, comes to count as much as it does.
constexpr float kSpecks_m = 200.0f;
/// Slopes of the waves that bend rays of cameras in water: root mean square, sea and inland.
constexpr double kSeaSlope = 0.05;
constexpr double kLakeSlope = 0.015;
/// Water thinner than this is foam where waves run up.
constexpr float kSurfDepth_m = 0.5f;
/// None is where it is thicker than this: noise would have to be 16 times its root mean square, and
/// six octaves never reach 14 (each is below 1 / 0.176 of its own, core/noise.cpp).
constexpr float kNoSurfDepth_m = 5.0f;
/// Radiance of water beside and above, per irradiance, where it only scatters.
constexpr float kSideGlow = 0.07f;
constexpr float kUpGlow = 0.22f;
/// Lines of gathered light on the bed.
constexpr float kCausticWidth = 0.28f;
constexpr float kCausticDepth_m = 8.0f;
/// By how much a ray that goes down turns with the slope of the surface: 1 - 1 / n.
constexpr double kBendPerSlope = 0.25;
/// Sine of the least elevation of mirrored rays.
constexpr double kLeastRise = 0.004;
/// Mirrored rays start this far above the surface.
constexpr double kLift_m = 2e-3;
constexpr double kLiftPerSpacing = 5e-4;

std::uint64_t bits_of(const Vector3d& point) {
  return core::random_bits(std::bit_cast<std::uint64_t>(point.x()),
                           std::bit_cast<std::uint64_t>(point.y()), 0x776176);
}

/// About normally distributed, of variance 1: a sum of four uniform numbers.
double drawn_slope(std::uint64_t bits, std::uint64_t stream) {
  double sum = -2.0;
  for (std::uint64_t k = 0; k < 4; ++k) sum += core::random_unit(bits, stream, k);
  return sum * 1.7320508;
}

/// What waves gather of the sun's light on the bed: two nets of bright lines, brightest where they cross. On average 1.
/// first, second   noise whose zeros the lines follow
float gathered(const NoiseSum& first, const NoiseSum& second, int lane) {
  constexpr float kMeanLine = 0.1942f;  // of a normal deviate
  const auto line = [&](const NoiseSum& noise) {
    const float off = noise.value[lane] / kCausticWidth;
    return kMeanLine + (std::exp(-off * off) - kMeanLine) * (1.0f - ramp(noise.left_out[lane]));
  };
  const float one = line(first);
  const float other = line(second);
  return 0.620f + 0.750f * (one + other) + 2.352f * one * other;
}

/// Of an object in water, with what hides it from the light above.
Color albedo_of(const world::SurfaceHit& hit, const world::SurfaceSample& surface,
                const Eigen::Vector3f& up, float footprint_m, std::uint32_t seed) {
  const ObjectLook look = look_at_object(object_place(hit, surface, up, footprint_m, seed));
  return Color(look.albedo.r, look.albedo.g, look.albedo.b) * (look.openness * look.crown_openness);
}

/// Share of the light from above that a surface takes up and sends to its viewer; blades do so from both sides.
float lit_share(const world::SurfaceHit& hit, const world::SurfaceSample& surface,
                const Vector3d& up) {
  const auto cosine = static_cast<float>(hit.normal_world().dot(up));
  if (!hit.is_ground() && is_translucent(surface.finish.material))
    return 0.55f + 0.45f * std::abs(cosine);
  return 0.25f + 0.75f * std::max(cosine, 0.0f);
}

double offset_of(const LitHits& hits, std::size_t ray) {
  return hits.offsets_s.empty() ? 0.0 : hits.offsets_s[ray];
}

/// What a sample becomes that a facet mirrors.
SampleWidth mirrored(const SampleWidth& width) {
  const double angle_rad = std::max(4.0 * width.angle_rad, kMirrorSpread_rad);
  if (width.is_central()) return {.angle_rad = angle_rad};
  return {.start_m = Eigen::Vector2d::Constant(4.0 * width.start_m.maxCoeff()),
          .growth = Eigen::Vector2d::Constant(angle_rad)};
}

}  // namespace

Color WaterOptics::deep_reflectance() const {
  const Color u = backscatter_per_m / (absorption_per_m + backscatter_per_m);
  return (0.084f + 0.170f * u) * u;
}

WaterOptics optics_of(Cover cover, double visibility_m) {
  double yellow_share = 0.05;
  double visible_m = visibility_m;
  double backscatter_share = 0.015;
  if (cover == Cover::Lake) {
    visible_m = std::min(0.4 * visibility_m, 10.0);
    yellow_share = 0.12;
  } else if (cover == Cover::River) {
    visible_m = std::min(0.2 * visibility_m, 4.0);
    yellow_share = 0.14;
    backscatter_share = 0.022;
  }
  const auto added_per_m = static_cast<float>(
      std::max(3.912 / visible_m - static_cast<double>(kPureAbsorption_per_m[1]), 0.004));
  const auto yellow = static_cast<float>(yellow_share);
  WaterOptics optics;
  optics.absorption_per_m = kPureAbsorption_per_m + added_per_m * yellow * kYellow;
  // Particles scatter a little more of the blue.
  const Color particles = added_per_m * (1.0f - yellow) * Color(0.93f, 1.0f, 1.12f);
  optics.scatter_per_m = particles + 2.0f * kPureBackscatter_per_m;
  optics.backscatter_per_m =
      static_cast<float>(backscatter_share) * particles + kPureBackscatter_per_m;
  return optics;
}

bool refract(const Vector3d& direction, const Vector3d& normal, double eta, Vector3d& refracted) {
  const double cos_in = -direction.dot(normal);
  const double cos2_out = 1.0 - eta * eta * (1.0 - cos_in * cos_in);
  if (cos2_out < 0.0) return false;
  refracted = eta * direction + (eta * cos_in - std::sqrt(cos2_out)) * normal;
  return true;
}

float fresnel_reflectance(float cos_incidence, float eta) {
  const float sin2_out = eta * eta * (1.0f - cos_incidence * cos_incidence);
  if (sin2_out >= 1.0f) return 1.0f;
  const float cos_out = std::sqrt(1.0f - sin2_out);
  const float across = (eta * cos_incidence - cos_out) / (eta * cos_incidence + cos_out);
  const float along = (cos_incidence - eta * cos_out) / (cos_incidence + eta * cos_out);
  return 0.5f * (across * across + along * along);
}

WaterLight::WaterLight(const world::TimedQuery& whole, const world::TimedQuery& bed,
                       const Ground& ground, const Sky& sky, const HitShader& shader,
                       double visibility_m)
    : whole_(whole),
      bed_(bed),
      ground_(ground),
      sky_(sky),
      shader_(shader),
      sea_(optics_of(Cover::Sea, visibility_m)),
      lake_(optics_of(Cover::Lake, visibility_m)),
      river_(optics_of(Cover::River, visibility_m)) {}

void WaterLight::look(const LitHits& hits, Scratch& s, const SeenWater& seen,
                      world::RayTrail* trail) const {
  s.water.clear();
  s.normals.clear();
  s.blur.clear();
  for (std::size_t i = 0; i < hits.rays.size(); ++i) {
    seen.below[i] = seen.mirrored[i] = Color(-1.0f, 0.0f, 0.0f);
    seen.reflectance[i] = -1.0f;
    const world::SurfaceHit& hit = hits.hits[i];
    if (hit.is_sky() || !hit.is_ground() || !world::is_water(hits.surfaces[i].cover) ||
        hits.surfaces[i].paint.is_painted ||
        hit.normal_world().dot(hits.rays[i].direction_world) > -1e-6)
      continue;
    s.water.push_back(i);
  }
  if (s.water.empty()) return;
  draw_facets(hits, s, seen.reflectance);
  look_down(hits, s, seen.below, trail);
  look_up(hits, s, seen, trail);
}

/// One facet for each ray: on the waves that its footprint tells one by one, of those that it does not
/// one as they are seen.
void WaterLight::draw_facets(const LitHits& hits, Scratch& s, std::span<float> reflectance) const {
  for (std::size_t first = 0; first < s.water.size(); first += kLanes) {
    const std::size_t count = std::min<std::size_t>(kLanes, s.water.size() - first);
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      const std::size_t i = s.water[first + std::min(lane, count - 1)];
      s.places.set(static_cast<int>(lane),
                   hits.rays[i].origin_world + hits.hits[i].t * hits.rays[i].direction_world,
                   hits.hits[i].normal_world(), hits.surfaces[i], footprint_m(hits, i));
    }
    ground_.set(s.places, s.packet);
    ground_.look(s.packet, s.look);
    for (std::size_t lane = 0; lane < count; ++lane) {
      const std::size_t i = s.water[first + lane];
      const int at = static_cast<int>(lane);
      const Vector3d& direction = hits.rays[i].direction_world;
      const Vector3d flat = hits.hits[i].normal_world();
      Vector3d mean(static_cast<double>(s.look.normal[0][at]),
                    static_cast<double>(s.look.normal[1][at]),
                    static_cast<double>(s.look.normal[2][at]));
      // Waves that turn away lie behind others.
      if (mean.dot(direction) > -0.01) mean = flat;
      const double cosine = -mean.dot(direction);
      const Vector3d level = -direction - cosine * mean;
      const double sine = level.norm();
      Vector3d facet = mean;
      const double deviation = std::sqrt(0.5 * static_cast<double>(s.look.wave_variance[at]));
      if (sine > 1e-6) {
        const std::uint64_t bits = bits_of(hits.rays[i].origin_world + hits.hits[i].t * direction);
        const double share = hits.spread.empty() ? core::random_unit(bits, 1, 0)
                                                 : static_cast<double>(hits.spread[i]);
        const Vector3d toward = level / sine;
        facet += seen_slope(share, deviation, cosine / sine) * toward +
                 deviation * drawn_slope(bits, 2) * mean.cross(toward);
        facet.normalize();
      }
      if (facet.dot(direction) > -1e-3) facet = mean;
      s.normals.push_back(facet);
      s.blur.push_back(2.0 * kBendPerSlope * deviation);
      reflectance[i] = water_reflectance(static_cast<float>(-facet.dot(direction)));
    }
  }
}

void WaterLight::look_down(const LitHits& hits, Scratch& s, std::span<Color> below,
                           world::RayTrail* trail) const {
  s.rays.clear();
  s.offsets_s.clear();
  for (std::size_t k = 0; k < s.water.size(); ++k) {
    const std::size_t i = s.water[k];
    world::WorldRay ray;
    ray.origin_world = hits.rays[i].origin_world + hits.hits[i].t * hits.rays[i].direction_world;
    refract(hits.rays[i].direction_world, s.normals[k], 1.0 / kWaterIndex, ray.direction_world);
    ray.direction_world.normalize();
    ray.t_max = kFarthestBottom_m;
    s.rays.push_back(ray);
    s.offsets_s.push_back(offset_of(hits, i));
  }
  s.hits.resize(s.rays.size());
  s.surfaces.resize(s.rays.size());
  bed_.intersect(s.rays, s.offsets_s, s.hits, world::Coherence::Incoherent, s.surfaces, trail);
  shade_bottom(hits, s, 0.0, trail);

  const Vector3d sun = sky_.daylight().sun_direction_world;
  const Vector3d up = sky_.daylight().up_world;
  const auto sun_height = static_cast<float>(std::max(sun.dot(up), 0.0));
  const float sin_sun_water =
      std::sqrt(1.0f - sun_height * sun_height) / static_cast<float>(kWaterIndex);
  const float cos_sun_water = std::sqrt(1.0f - sin_sun_water * sin_sun_water);
  const Color diffuse = 0.934f * sky_.ambient().irradiance(up.cast<float>());
  for (std::size_t k = 0; k < s.water.size(); ++k) {
    const std::size_t i = s.water[k];
    const WaterOptics& water = optics(hits.surfaces[i].cover);
    const Color irradiance = irradiance_below(hits.sun_share[i]);
    const Color u = water.backscatter_per_m / water.fading_per_m();
    Color leaving = water.deep_reflectance();
    if (s.way_m[k] >= 0.0) {
      const auto way = static_cast<float>(s.way_m[k]);
      const float down = static_cast<float>(s.depth_m[k]) / cos_sun_water;
      const Color up_column = 1.03f * (1.0f + 2.4f * u).sqrt() * way;
      const Color up_bottom = 1.04f * (1.0f + 5.4f * u).sqrt() * way;
      leaving = leaving * (1.0f - (-water.fading_per_m() * (down + up_column)).exp()) +
                s.bottom[k] / kPi * (-water.fading_per_m() * (down + up_bottom)).exp();
    }
    const auto index2 = static_cast<float>(kWaterIndex * kWaterIndex);
    below[i] = irradiance * leaving / index2;
    if (s.foam[k] > 0.0f) {
      const Color white =
          0.75f / kPi * (sky_.sun_irradiance() * (sun_height * hits.sun_share[i]) + diffuse);
      below[i] += s.foam[k] * (white - below[i]);
    }
    below[i] = below[i].max(0.0f);
  }
}

const WaterOptics& WaterLight::optics(Cover cover) const {
  return cover == Cover::Lake ? lake_ : (cover == Cover::River ? river_ : sea_);
}

/// Of a level plane just below the surface, by sun and sky.
Color WaterLight::irradiance_below(float sun_share) const {
  const auto height = static_cast<float>(
      std::max(sky_.daylight().sun_direction_world.dot(sky_.daylight().up_world), 0.0));
  const float in = 1.0f - fresnel_reflectance(height, 1.0f / static_cast<float>(kWaterIndex));
  return 0.934f * sky_.ambient().irradiance(sky_.daylight().up_world.cast<float>()) +
         sky_.sun_irradiance() * (in * height * sun_share);
}

/// Radiance of endless water in a direction, per irradiance that comes down at the eye: from below what
/// scatters back, from the sides and above more, since water scatters forward.
/// rise   sine of the direction's elevation
Color WaterLight::glow(const WaterOptics& water, float rise) const {
  const Color scattered = water.scatter_per_m / water.beam_per_m();
  const Color down = water.deep_reflectance().max(1e-5f);
  const Color side = (kSideGlow * scattered).max(1e-5f);
  const Color up = kUpGlow * scattered;
  if (rise >= 0.0f) return side + rise * rise * (up - side);
  return side * (down / side).pow(-rise);
}

void WaterLight::look_in_water(const LitHits& hits, const WaterAbove& eye, Scratch& s,
                               std::span<Color> radiance, world::RayTrail* trail) const {
  const double depth_m = eye.depth_m;
  const Vector3d up = sky_.daylight().up_world;
  const Color light = irradiance_below(1.0f);
  // All that is met, with the places on the bed in packets.
  s.rays.assign(hits.rays.begin(), hits.rays.end());
  s.hits.assign(hits.hits.begin(), hits.hits.end());
  s.surfaces.assign(hits.surfaces.begin(), hits.surfaces.end());
  s.water.clear();
  std::vector<std::size_t> through;
  std::vector<Vector3d> normals(hits.rays.size(), Vector3d::Zero());
  for (std::size_t i = 0; i < hits.rays.size(); ++i) {
    s.water.push_back(i);
    const bool is_surface = !hits.hits[i].is_sky() && hits.hits[i].is_ground() &&
                            world::is_water(hits.surfaces[i].cover);
    if (!is_surface) continue;
    through.push_back(i);
    s.hits[i].t = std::numeric_limits<double>::infinity();  // no bed
    const double slope = hits.surfaces[i].cover == Cover::Sea ? kSeaSlope : kLakeSlope;
    const std::uint64_t bits =
        bits_of(hits.rays[i].origin_world + hits.hits[i].t * hits.rays[i].direction_world);
    normals[i] = -(hits.hits[i].normal_world() +
                   slope * Vector3d(drawn_slope(bits, 1), drawn_slope(bits, 2), 0.0))
                      .normalized();
  }
  const WaterOptics& water = optics(eye.cover);
  shade_bottom(hits, s, depth_m, trail);
  const Color fading = water.fading_per_m() * 1.15f;  // light comes down aslant
  std::vector<Color> at_end(hits.rays.size(), Color::Zero());
  for (std::size_t i = 0; i < hits.rays.size(); ++i) {
    if (s.way_m[i] < 0.0) continue;
    const auto deep =
        static_cast<float>(depth_m - hits.rays[i].direction_world.dot(up) * s.way_m[i]);
    at_end[i] = s.bottom[i] / kPi * light * lit_share(hits.hits[i], hits.surfaces[i], up) *
                (-fading * std::max(deep, 0.0f)).exp();
  }
  // Through the surface, and off it.
  s.rays.clear();
  s.offsets_s.clear();
  s.of_water.clear();
  for (const std::size_t i : through) {
    const Vector3d& direction = hits.rays[i].direction_world;
    Vector3d normal = normals[i];
    if (-direction.dot(normal) < 1e-3) normal = -hits.hits[i].normal_world();
    const auto cos_in = static_cast<float>(std::clamp(-direction.dot(normal), 0.0, 1.0));
    const float reflected = fresnel_reflectance(cos_in, static_cast<float>(kWaterIndex));
    const Vector3d away = direction - 2.0 * direction.dot(normal) * normal;
    at_end[i] = reflected * light * glow(water, static_cast<float>(away.dot(up)));
    Vector3d out;
    if (reflected >= 1.0f || !refract(direction, normal, kWaterIndex, out)) continue;
    s.rays.push_back({.origin_world = hits.rays[i].origin_world + hits.hits[i].t * direction +
                                      (kLift_m + kLiftPerSpacing * hits.surfaces[i].spacing_m) *
                                          hits.hits[i].normal_world(),
                      .direction_world = out.normalized()});
    s.offsets_s.push_back(offset_of(hits, i));
    s.of_water.push_back(i);
  }
  if (!s.rays.empty()) {
    s.hits.resize(s.rays.size());
    s.surfaces.resize(s.rays.size());
    whole_.intersect(s.rays, s.offsets_s, s.hits, world::Coherence::Incoherent, s.surfaces, trail);
    s.sun_share.assign(s.rays.size(), 1.0f);
    s.sky_share.assign(s.rays.size(), -1.0f);
    s.radiance.resize(s.rays.size());
    shader_.shade({.rays = s.rays,
                   .hits = s.hits,
                   .surfaces = s.surfaces,
                   .sun_share = s.sun_share,
                   .sky_share = s.sky_share,
                   .sample_width = {.angle_rad = 2.0 * hits.sample_width.angle_rad}},
                  s.shader, s.radiance);
    for (std::size_t r = 0; r < s.rays.size(); ++r) {
      const std::size_t i = s.of_water[r];
      const auto cos_in = static_cast<float>(
          std::clamp(std::abs(hits.rays[i].direction_world.dot(normals[i])), 0.0, 1.0));
      // A cone of light is narrower in water: radiance grows by the square of the index.
      const float passed = (1.0f - fresnel_reflectance(cos_in, static_cast<float>(kWaterIndex))) *
                           static_cast<float>(kWaterIndex * kWaterIndex);
      at_end[i] += passed * s.radiance[r].max(0.0f);
    }
  }
  const Color here = light * (-fading * static_cast<float>(depth_m)).exp();
  const Color beam = water.beam_per_m();
  for (std::size_t i = 0; i < hits.rays.size(); ++i) {
    const auto rise = static_cast<float>(hits.rays[i].direction_world.dot(up));
    const auto way = static_cast<float>(std::min(hits.hits[i].t, 1e4));
    radiance[i] = at_end[i] * (-beam * way).exp();
    // Light along the way grows towards the surface.
    const Color net = (beam - rise * fading).max(1e-4f);
    radiance[i] +=
        here * glow(water, rise) * beam / net.max(0.3f * beam) * (1.0f - (-net * way).exp());
  }
}

/// start_depth_m   of the rays' starts below the surface
void WaterLight::shade_bottom(const LitHits& hits, Scratch& s, double start_depth_m,
                              world::RayTrail* trail) const {
  s.bottom.assign(s.rays.size(), Color::Zero());
  s.way_m.assign(s.rays.size(), -1.0);
  s.depth_m.assign(s.rays.size(), 0.0);
  s.foam.assign(s.rays.size(), 0.0f);
  const Vector3d up = sky_.daylight().up_world;
  s.of_water.clear();
  for (std::size_t k = 0; k < s.rays.size(); ++k) {
    if (s.hits[k].is_sky()) continue;
    s.way_m[k] = s.hits[k].t;
    s.depth_m[k] = std::max(start_depth_m - s.hits[k].t * s.rays[k].direction_world.dot(up), 0.0);
    s.of_water.push_back(k);
  }
  find_sea(hits, s, start_depth_m > 0.0, trail);
  for (std::size_t first = 0; first < s.of_water.size(); first += kLanes) {
    const std::size_t count = std::min<std::size_t>(kLanes, s.of_water.size() - first);
    std::array<float, kLanes> widths_m;
    bool has_bed = false;
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      const std::size_t k = s.of_water[first + std::min(lane, count - 1)];
      const std::size_t i = s.water[k];
      const int at = static_cast<int>(lane);
      // Waves that are not told one by one blur the bed: else each sample met another patch of it.
      const double seen_m =
          start_depth_m > 0.0
              ? hits.sample_width.at(std::min(hits.hits[i].t, 1e5))
              : footprint_m(hits, i) + s.hits[k].t * (hits.sample_width.angle_rad + s.blur[k]);
      widths_m[lane] = static_cast<float>(seen_m);
      const Vector3d place = s.rays[k].origin_world + s.hits[k].t * s.rays[k].direction_world;
      s.places.set(at, place, s.hits[k].normal_world(), s.surfaces[k], seen_m);
      s.places.sea_depth_m[at] = s.sea_depth_m[k];
      has_bed = has_bed || s.hits[k].is_ground();
      if (s.hits[k].is_ground()) continue;
      // Of objects only what waves gather on them is asked for here.
      s.places.cover[at] = static_cast<std::uint8_t>(Cover::Seabed);
      s.places.is_painted[at] = 0;
    }
    ground_.set(s.places, s.packet);
    if (has_bed) ground_.look(s.packet, s.look);
    const NoiseSum long_lines = sum_noise(s.packet.places, 0, -2, ground_.climate().seed + 311);
    const NoiseSum lines = sum_noise(s.packet.places, -1, -3, ground_.climate().seed + 313);
    for (std::size_t lane = 0; lane < count; ++lane) {
      const std::size_t k = s.of_water[first + lane];
      const int at = static_cast<int>(lane);
      const bool is_bed = s.hits[k].is_ground();
      s.bottom[k] = is_bed
                        ? Color(s.look.albedo[0][at], s.look.albedo[1][at], s.look.albedo[2][at]) *
                              s.look.openness[at]
                        : albedo_of(s.hits[k], s.surfaces[k], up.cast<float>(), widths_m[lane],
                                    ground_.climate().seed);
      const auto deep_m = static_cast<float>(s.depth_m[k]);
      const float caustic = gathered(long_lines, lines, at);
      s.bottom[k] *= 1.0f + (caustic - 1.0f) * 0.7f * std::exp(-deep_m / kCausticDepth_m) *
                                ramp(deep_m / 0.5f);
    }
    if (start_depth_m <= 0.0) find_foam(hits, s, std::span(s.of_water).subspan(first, count));
  }
}

/// Foam of waves that run up, above places of s.packet.
void WaterLight::find_foam(const LitHits& hits, Scratch& s,
                           std::span<const std::size_t> lanes) const {
  const auto may_break = [&](std::size_t k) {
    return s.hits[k].is_ground() && hits.surfaces[s.water[k]].cover == Cover::Sea &&
           static_cast<float>(s.depth_m[k]) < kNoSurfDepth_m;
  };
  if (std::none_of(lanes.begin(), lanes.end(), may_break)) return;
  const NoiseSum runs = sum_noise(s.packet.places, 4, -1, ground_.climate().seed + 307);
  for (std::size_t lane = 0; lane < lanes.size(); ++lane) {
    const std::size_t k = lanes[lane];
    if (!may_break(k)) continue;
    const float depth = static_cast<float>(s.depth_m[k]) / kSurfDepth_m;
    const float broken =
        step_up(0.55f + 0.75f * runs.value[static_cast<int>(lane)] - 1.3f * depth, 0.45f);
    if (broken > 0.0f) s.foam[k] = surf_at(s.rays[k].origin_world.head<2>()) * 0.85f * broken;
  }
}

/// Where the water above what was met is the sea's: rays from above know its surface, for viewers
/// in water it is asked for.
void WaterLight::find_sea(const LitHits& hits, Scratch& s, bool is_viewer_in_water,
                          world::RayTrail* trail) const {
  s.sea_depth_m.assign(s.rays.size(), 0.0);
  if (!is_viewer_in_water) {
    for (const std::size_t k : s.of_water)
      if (hits.surfaces[s.water[k]].cover == Cover::Sea) s.sea_depth_m[k] = s.depth_m[k];
    return;
  }
  s.bed_places.clear();
  for (const std::size_t k : s.of_water)
    if (s.hits[k].is_ground())
      s.bed_places.push_back(s.rays[k].origin_world + s.hits[k].t * s.rays[k].direction_world);
  s.above.resize(s.bed_places.size());
  find_water_above(whole_.still(), s.bed_places, s.above, trail);
  std::size_t at = 0;
  for (const std::size_t k : s.of_water)
    if (s.hits[k].is_ground()) s.sea_depth_m[k] = s.above[at++].sea_depth_m();
}

/// Share of the surf of an open coast.
float WaterLight::surf_at(const Eigen::Vector2d& place_world) const {
  const SeaExposure* exposure = ground_.climate().exposure.get();
  return exposure == nullptr ? 1.0f : static_cast<float>(exposure->surf(place_world));
}

void WaterLight::look_up(const LitHits& hits, Scratch& s, const SeenWater& seen,
                         world::RayTrail* trail) const {
  s.rays.clear();
  s.offsets_s.clear();
  s.of_water.clear();
  for (std::size_t k = 0; k < s.water.size(); ++k) {
    const std::size_t i = s.water[k];
    const Vector3d& direction = hits.rays[i].direction_world;
    const Vector3d flat = hits.hits[i].normal_world();
    Vector3d away = direction - 2.0 * direction.dot(s.normals[k]) * s.normals[k];
    // What goes down meets other waves, and is mirrored up by them.
    const double rise = away.dot(flat);
    if (rise < kLeastRise) away += (std::max(-rise, kLeastRise) - rise) * flat;
    away.normalize();
    seen.mirrored[i] = sky_.radiance(away.cast<float>());
    if (hits.hits[i].t > kMirrorDistance_m || seen.reflectance[i] < kLeastReflectance) continue;
    s.rays.push_back(
        {.origin_world = hits.rays[i].origin_world + hits.hits[i].t * direction +
                         (kLift_m + kLiftPerSpacing * hits.surfaces[i].spacing_m) * flat,
         .direction_world = away,
         .t_max = kFarthestMirrored_m});
    s.offsets_s.push_back(offset_of(hits, i));
    s.of_water.push_back(k);
  }
  if (s.rays.empty()) return;
  s.hits.resize(s.rays.size());
  s.surfaces.resize(s.rays.size());
  whole_.intersect(s.rays, s.offsets_s, s.hits, world::Coherence::Incoherent, s.surfaces, trail);
  std::size_t num_met = 0;
  for (std::size_t r = 0; r < s.rays.size(); ++r) {
    if (s.hits[r].is_sky() || (s.hits[r].is_ground() && world::is_water(s.surfaces[r].cover)))
      continue;
    s.rays[num_met] = s.rays[r];
    s.hits[num_met] = s.hits[r];
    s.surfaces[num_met] = s.surfaces[r];
    s.of_water[num_met++] = s.of_water[r];
  }
  if (num_met == 0) return;
  s.sun_share.assign(num_met, 1.0f);
  s.sky_share.assign(num_met, -1.0f);
  s.radiance.resize(num_met);
  shader_.shade({.rays = std::span(s.rays).first(num_met),
                 .hits = std::span(s.hits).first(num_met),
                 .surfaces = std::span(s.surfaces).first(num_met),
                 .sun_share = s.sun_share,
                 .sky_share = s.sky_share,
                 .sample_width = mirrored(hits.sample_width)},
                s.shader, s.radiance);
  for (std::size_t r = 0; r < num_met; ++r) {
    const std::size_t i = s.water[s.of_water[r]];
    const float far = 0.5f * (static_cast<float>(hits.hits[i].t) / kSpecks_m - 1.0f);
    const Color met = s.radiance[r].max(0.0f);
    seen.mirrored[i] = met + 0.5f * ramp(far) * (seen.mirrored[i] - met);
  }
}

}  // namespace terracast::scene
