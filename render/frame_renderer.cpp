#include "render/frame_renderer.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "core/random.h"
#include "geo/sun.h"
#include "geo/units.h"
#include "render/pixel_blocks.h"
#include "render/sampler.h"
#include "render/scratch_pool.h"

namespace terracast::render {
namespace {

constexpr int kUnitSide = 16;
constexpr int kBlockPixels = kBlockSide * kBlockSide;
static_assert(kBlockPixels == kLanes);

// How much wider a sample on slanted ground counts than across the view: between 0 (aliases) and 1
// (blurs along it).
constexpr float kSlantExponent = 0.6f;
// The raised surface that shadow rays meet lies within this share of the tile's side above the true
// one.
constexpr double kShadowLiftPerSide = 2e-6;
constexpr double kShadowLift_m = 2e-3;

struct ColorScratch {
  std::vector<world::WorldRay> rays;
  std::vector<world::SurfaceHit> hits;
  std::vector<std::uint32_t> pixels;           ///< of the rays, within the unit
  std::vector<world::SurfaceSample> surfaces;  ///< of the rays that met the ground
  std::vector<world::WorldRay> sun_rays;
  std::vector<std::uint32_t> sun_ray_of;  ///< the ray that a sun ray belongs to
  std::vector<std::uint8_t> is_occluded;
  std::vector<float> sun_share;  ///< of the rays
  std::vector<Color> radiance;   ///< of the unit's pixels
  GroundPlaces places;
  GroundPacket packet;
  GroundLook look;
  ViewPacket view;
  Lanes3f shaded;
};

struct ColorImage {
  const world::RayQuery& query;
  const Ground& ground;
  const Sky& sky;
  const Exposure& exposure;
  const View& view;
  const PixelSampler& sampler;
  std::uint64_t seed;
  std::uint64_t stream;
  int num_samples;
  world::RayTrail* trail;
  Eigen::Vector3d sun_right;  ///< spans the sun's disc with sun_up, of its radius
  Eigen::Vector3d sun_up;

  /// Width of a sample's share of a pixel on ground that faces the camera, per metre of distance.
  double sample_angle(const PixelUnit& unit) const {
    const Eigen::Vector2d center(0.5 * (unit.x0 + unit.x1), 0.5 * (unit.y0 + unit.y1));
    const Eigen::Vector3d here = view.model->ray_from_pixel(center).normalized();
    const Eigen::Vector3d right =
        view.model->ray_from_pixel(center + Eigen::Vector2d(1.0, 0.0)).normalized();
    const Eigen::Vector3d below =
        view.model->ray_from_pixel(center + Eigen::Vector2d(0.0, 1.0)).normalized();
    const double pixel = std::sqrt((right - here).norm() * (below - here).norm());
    // Samples together resolve more than one of them; the pixel filters what they average.
    return pixel * std::max(0.5, std::pow(num_samples, -0.25));
  }

  void cast_rays(const PixelUnit& unit, ColorScratch& s) const {
    s.rays.clear();
    s.pixels.clear();
    for (int by = unit.y0; by < unit.y1; by += kBlockSide) {
      for (int bx = unit.x0; bx < unit.x1; bx += kBlockSide) {
        const PixelUnit block{bx, by, std::min(bx + kBlockSide, unit.x1),
                              std::min(by + kBlockSide, unit.y1)};
        for (int sample = 0; sample < num_samples; ++sample) {
          for_each_pixel(block, [&](int x, int y) {
            const auto index =
                static_cast<std::uint64_t>(y) * static_cast<std::uint64_t>(view.model->width_px()) +
                static_cast<std::uint64_t>(x);
            const std::uint64_t bits = core::random_bits(seed, stream, index);
            const Eigen::Vector2d place =
                Eigen::Vector2d(x, y) + sampler.place_in_pixel(bits, sample);
            s.rays.push_back({.origin_world = view.center_world,
                              .direction_world = view.ray_world(place).normalized()});
            s.pixels.push_back(
                static_cast<std::uint32_t>((y - unit.y0) * (unit.x1 - unit.x0) + (x - unit.x0)));
            const Eigen::Vector2d disc = sampler.place_on_disc(bits, sample);
            s.sun_rays.push_back({.origin_world = Eigen::Vector3d::Zero(),
                                  .direction_world = sky.daylight().sun_direction_world +
                                                     disc.x() * sun_right + disc.y() * sun_up});
          });
        }
      }
    }
    s.hits.resize(s.rays.size());
    s.surfaces.resize(s.rays.size());
    query.intersect(s.rays, s.hits, world::Coherence::Coherent, s.surfaces, trail);
  }

  /// Rays from the ground to a place on the sun's disc each; what faces away is dark without.
  void cast_sun_rays(ColorScratch& s) const {
    s.sun_share.assign(s.rays.size(), 0.0f);
    s.sun_ray_of.clear();
    for (std::size_t i = 0; i < s.rays.size(); ++i) {
      const world::SurfaceHit& hit = s.hits[i];
      if (hit.is_sky()) continue;
      const Eigen::Vector3d point = s.rays[i].origin_world + hit.t * s.rays[i].direction_world;
      const Eigen::Vector3d direction = s.sun_rays[i].direction_world;
      const Eigen::Vector3d normal = hit.normal_world();
      if (sky.is_night() || normal.dot(direction) <= 0.0) continue;
      const double lift_m =
          kShadowLift_m + kShadowLiftPerSide * world::kTileCells * s.surfaces[i].spacing_m;
      // Sun rays move up to close the ranks: their own place is taken, or behind.
      s.sun_rays[s.sun_ray_of.size()] = {.origin_world = point + lift_m * normal,
                                         .direction_world = direction};
      s.sun_ray_of.push_back(static_cast<std::uint32_t>(i));
    }
    s.sun_rays.resize(s.sun_ray_of.size());
    s.is_occluded.resize(s.sun_rays.size());
    query.occluded(s.sun_rays, s.is_occluded, trail);
    for (std::size_t i = 0; i < s.sun_ray_of.size(); ++i)
      if (s.is_occluded[i] == 0) s.sun_share[s.sun_ray_of[i]] = 1.0f;
  }

  void shade_lanes(const std::vector<std::size_t>& rays, double angle, ColorScratch& s) const {
    s.view.camera_height_m =
        static_cast<float>(approximate_height_m(view.center_world) - ground.climate().sea_level_m);
    for (int lane = 0; lane < kLanes; ++lane) {
      const std::size_t i = rays[std::min(static_cast<std::size_t>(lane), rays.size() - 1)];
      const world::WorldRay& ray = s.rays[i];
      const world::SurfaceHit& hit = s.hits[i];
      const Eigen::Vector3d normal = hit.normal_world();
      const auto facing = static_cast<float>(std::max(-ray.direction_world.dot(normal), 0.01));
      const double footprint_m =
          hit.t * angle * static_cast<double>(std::pow(facing, -kSlantExponent));
      s.places.set(lane, ray.origin_world + hit.t * ray.direction_world, normal, s.surfaces[i],
                   footprint_m);
      for (std::size_t k = 0; k < 3; ++k)
        s.view.direction[k][lane] = static_cast<float>(ray.direction_world[static_cast<int>(k)]);
      s.view.distance_m[lane] = static_cast<float>(hit.t);
      s.view.sun_share[lane] = s.sun_share[i];
    }
    ground.set(s.places, s.packet);
    ground.look(s.packet, s.look);
    shade_ground(s.packet, s.look, s.view, sky, s.shaded);
    for (std::size_t lane = 0; lane < rays.size(); ++lane) {
      const int at = static_cast<int>(lane);
      s.radiance[s.pixels[rays[lane]]] += Color(s.shaded[0][at], s.shaded[1][at], s.shaded[2][at]);
    }
  }

  void render_unit(const PixelUnit& unit, core::Image8& image, ColorScratch& s) const {
    s.sun_rays.clear();
    cast_rays(unit, s);
    cast_sun_rays(s);
    s.radiance.assign(static_cast<std::size_t>(unit.num_pixels()), Color::Zero());
    const double angle = sample_angle(unit);
    std::vector<std::size_t> lanes;
    lanes.reserve(kLanes);
    for (std::size_t i = 0; i < s.rays.size(); ++i) {
      if (s.hits[i].is_sky()) {
        s.radiance[s.pixels[i]] += shade_sky(sky, s.rays[i].direction_world);
      } else {
        lanes.push_back(i);
        if (lanes.size() == kLanes) {
          shade_lanes(lanes, angle, s);
          lanes.clear();
        }
      }
    }
    if (!lanes.empty()) shade_lanes(lanes, angle, s);

    const float share = 1.0f / static_cast<float>(num_samples);
    std::size_t pixel = 0;
    for (int y = unit.y0; y < unit.y1; ++y)
      for (int x = unit.x0; x < unit.x1; ++x)
        exposure.develop(s.radiance[pixel++] * share, &image(x, y));
  }
};

}  // namespace

Daylight daylight_of(const SequencePlan& plan, const geo::WorldFrame& frame) {
  const Eigen::Vector3d place =
      plan.states.empty() ? Eigen::Vector3d::Zero()
                          : Eigen::Vector3d(plan.states.front().world_from_body.translation);
  Daylight daylight;
  daylight.up_world = frame.up_world(place);
  daylight.visibility_m = plan.conditions.visibility_km * 1e3;
  daylight.sun_direction_world = geo::sun_direction_world(
      frame, frame.geodetic_from_world(place), geo::unix_seconds_from_utc(plan.utc_start));
  const ConditionOptions& conditions = plan.conditions;
  if (conditions.has_sun_azimuth() || conditions.has_sun_elevation()) {
    const Eigen::Matrix3d world_from_enu = frame.world_from_enu(place);
    const Eigen::Vector3d sun_enu = world_from_enu.transpose() * daylight.sun_direction_world;
    double azimuth = std::atan2(sun_enu.x(), sun_enu.y());
    double elevation = std::asin(std::clamp(sun_enu.z(), -1.0, 1.0));
    if (conditions.has_sun_azimuth())
      azimuth = geo::radians_from_degrees(conditions.sun_azimuth_deg);
    if (conditions.has_sun_elevation())
      elevation = geo::radians_from_degrees(conditions.sun_elevation_deg);
    daylight.sun_direction_world =
        world_from_enu * Eigen::Vector3d(std::cos(elevation) * std::sin(azimuth),
                                         std::cos(elevation) * std::cos(azimuth),
                                         std::sin(elevation));
  }
  return daylight;
}

FrameRenderer::FrameRenderer(const SequencePlan& plan, const world::TileStore& store,
                             const world::RayQuery& query)
    : views_(plan.states, plan.cameras),
      query_(query),
      ground_(climate_of(store, static_cast<std::uint32_t>(core::mix_bits(store.manifest().seed)))),
      sky_(daylight_of(plan, geo::WorldFrame(store.manifest().origin))),
      exposure_(sky_, plan.conditions.exposure),
      num_samples_(static_cast<int>(plan.conditions.color_samples)),
      sampler_(num_samples_),
      seed_(static_cast<std::uint64_t>(plan.seed)) {}

core::Image8 FrameRenderer::color(int frame, int camera, world::RayTrail* trail) const {
  const View& view = views_.at(frame, camera);
  const Eigen::Vector3d sun = sky_.daylight().sun_direction_world;
  const Eigen::Vector3d beside =
      std::abs(sun.z()) < 0.9 ? Eigen::Vector3d::UnitZ() : Eigen::Vector3d::UnitX();
  const double radius = std::tan(geo::kSunAngularRadius_rad);
  const Eigen::Vector3d right = sun.cross(beside).normalized();
  const ColorImage image{
      .query = query_,
      .ground = ground_,
      .sky = sky_,
      .exposure = exposure_,
      .view = view,
      .sampler = sampler_,
      .seed = seed_,
      .stream = core::stream_of(core::stream_of(core::mix_bits(0x636f6c6f72),  // "color"
                                                static_cast<std::uint64_t>(frame)),
                                static_cast<std::uint64_t>(camera)),
      .num_samples = num_samples_,
      .trail = trail,
      .sun_right = right * radius,
      .sun_up = sun.cross(right) * radius};
  core::Image8 pixels(view.model->width_px(), view.model->height_px(), 3);
  const PixelGrid grid{pixels.width(), pixels.height(), kUnitSide};
  ScratchPool<ColorScratch> pool;
  core::parallel_for_blocks(grid.num_units(), 1, [&](std::int64_t unit, std::int64_t) {
    ScratchPool<ColorScratch>::Lease scratch(pool);
    image.render_unit(grid.unit(unit), pixels, *scratch);
  });
  return pixels;
}

}  // namespace terracast::render
