#include "sensors/camera/frame_renderer.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/lanes.h"
#include "core/random.h"
#include "core/scratch_pool.h"
#include "geo/sun.h"
#include "geo/units.h"
#include "scene/light/hit_shader.h"
#include "scene/water/water_light.h"
#include "sensors/camera/pixel_blocks.h"
#include "sensors/camera/sampler.h"
#include "world/sea_bed.h"

namespace terracast::sensors {
namespace {

constexpr int kColorUnitSide = 16;
constexpr int kBlockPixels = kBlockSide * kBlockSide;
static_assert(kBlockPixels == core::kLanes);

// The raised surface that shadow rays meet lies within this share of the tile's side above the true
// one.
constexpr double kShadowLiftPerSide = 2e-6;
constexpr double kShadowLift_m = 2e-3;
// Of objects the surface itself is met, exactly; what lies on it (signs, marks) is this thick.
constexpr double kObjectShadowLift_m = 2e-3;
// How far off things take the light of the sky from a place. What stands farther takes hardly any from
// most places, and all places of a town alike.
constexpr double kSkyReach_m = 30.0;

/// Water takes most of the light; a camera in it opens so much further.
constexpr double kInWaterExposure = 2.5;

struct ColorScratch {
  std::vector<world::WorldRay> rays;
  std::vector<double> offsets_s;  ///< of the rays
  std::vector<world::SurfaceHit> hits;
  std::vector<std::uint32_t> pixels;           ///< of the rays, within the unit
  std::vector<world::SurfaceSample> surfaces;  ///< of the rays that met something
  std::vector<world::WorldRay> sun_rays;
  std::vector<std::uint32_t> sun_ray_of;  ///< the ray that a sun ray belongs to
  std::vector<double> light_offsets_s;    ///< of the sun rays, or of the sky rays
  std::vector<std::uint64_t> bits;        ///< of the rays' pixels
  std::vector<int> samples;               ///< of the rays, in their pixels
  std::vector<world::WorldRay> sky_rays;
  std::vector<std::uint32_t> sky_ray_of;
  std::vector<std::uint8_t> is_occluded;
  std::vector<float> sun_share;        ///< of the rays
  std::vector<float> sky_share;        ///< of the rays
  std::vector<scene::Color> radiance;  ///< that the rays bring
  std::vector<scene::Color> sums;      ///< of the unit's pixels
  std::vector<scene::Color> below;     ///< of the rays that met water
  std::vector<scene::Color> mirrored;
  std::vector<float> reflectance;
  std::vector<float> spread;  ///< of the rays: LitHits::spread
  scene::HitShader::Scratch shader;
  scene::WaterLight::Scratch water;
};

struct ColorImage {
  world::Scene scene;
  world::Scene viewed;    ///< what the camera looks at: `scene`, or that of viewers in water
  scene::WaterAbove eye;  ///< the water at the camera; its depth is 0 above it
  const scene::Clouds& clouds;
  float sea_level_m;
  const scene::HitShader& shader;
  const scene::WaterLight* water;  ///< null: it is opaque
  const scene::Sky& sky;
  const View& view;      ///< at the frame's time
  const OpenView* open;  ///< null: the shutter is open for an instant, the lens a pinhole
  const PixelSampler& sampler;
  std::uint64_t seed;
  std::uint64_t stream;
  int num_samples;
  int num_sky_rays;
  world::RayTrail* trail;
  Eigen::Vector3d sun_right;  ///< spans the sun's disc with sun_up, of its radius
  Eigen::Vector3d sun_up;

  /// Width of a sample's share of a pixel on ground that faces the camera.
  scene::SampleWidth sample_width(const PixelUnit& unit) const {
    // Samples together resolve more than one of them; the pixel filters what they average.
    const double share = std::max(0.5, std::pow(num_samples, -0.25));
    return scene::sample_width(*view.model, {0.5 * (unit.x0 + unit.x1), 0.5 * (unit.y0 + unit.y1)},
                               share);
  }

  OpenView::LensRay ray_through(const Eigen::Vector2d& place, std::uint64_t bits,
                                int sample) const {
    if (open == nullptr)
      return {.origin_world = view.origin_world(place),
              .direction_world = view.ray_world(place).normalized()};
    return open->lens_ray(place, sampler.place_in_time(bits, sample),
                          sampler.place_on_disc(core::mix_bits(bits ^ 0x6c656e73), sample));
  }

  void cast_rays(const PixelUnit& unit, ColorScratch& s) const {
    s.rays.clear();
    s.offsets_s.clear();
    s.pixels.clear();
    s.bits.clear();
    s.samples.clear();
    s.spread.clear();
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
            const OpenView::LensRay ray = ray_through(place, bits, sample);
            if (!ray.direction_world.allFinite()) return;  // no light comes in
            s.rays.push_back(
                {.origin_world = ray.origin_world, .direction_world = ray.direction_world});
            s.offsets_s.push_back(ray.offset_s);
            s.bits.push_back(bits);
            s.samples.push_back(sample);
            s.spread.push_back(static_cast<float>(sampler.place_between(bits, sample)));
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
    viewed.intersect(s.rays, s.offsets_s, s.hits, world::Coherence::Coherent, s.surfaces, trail);
  }

  double lift_m(const world::SurfaceHit& hit, const world::SurfaceSample& surface) const {
    return hit.is_ground()
               ? kShadowLift_m + kShadowLiftPerSide * world::kTileCells * surface.spacing_m
               : kObjectShadowLift_m;
  }

  /// Sets is_occluded of rays to light.
  /// ray_of   the camera's ray whose time each has
  void cast_light(std::span<const world::WorldRay> rays, std::span<const std::uint32_t> ray_of,
                  ColorScratch& s) const {
    s.light_offsets_s.clear();
    for (const std::uint32_t ray : ray_of) s.light_offsets_s.push_back(s.offsets_s[ray]);
    s.is_occluded.resize(rays.size());
    scene.occluded(rays, s.light_offsets_s, s.is_occluded, trail);
  }

  /// Rays from what was met to a place on the sun's disc each; what faces away is dark without.
  void cast_sun_rays(ColorScratch& s) const {
    s.sun_share.assign(s.rays.size(), 0.0f);
    s.sun_ray_of.clear();
    for (std::size_t i = 0; i < s.rays.size(); ++i) {
      const world::SurfaceHit& hit = s.hits[i];
      if (hit.is_sky()) continue;
      const Eigen::Vector3d point = s.rays[i].origin_world + hit.t * s.rays[i].direction_world;
      const Eigen::Vector3d direction = s.sun_rays[i].direction_world;
      if (sky.is_night()) continue;
      Eigen::Vector3d normal = hit.normal_world();
      if (normal.dot(direction) <= 0.0) {
        if (hit.is_ground() || !scene::is_translucent(s.surfaces[i].finish.material)) continue;
        normal = -normal;  // lit from behind
      }
      // Sun rays move up to close the ranks: their own place is taken, or behind.
      s.sun_rays[s.sun_ray_of.size()] = {
          .origin_world = point + lift_m(hit, s.surfaces[i]) * normal,
          .direction_world = direction};
      s.sun_ray_of.push_back(static_cast<std::uint32_t>(i));
    }
    s.sun_rays.resize(s.sun_ray_of.size());
    cast_light(s.sun_rays, s.sun_ray_of, s);
    for (std::size_t i = 0; i < s.sun_ray_of.size(); ++i)
      if (s.is_occluded[i] == 0) s.sun_share[s.sun_ray_of[i]] = 1.0f;
  }

  /// Rays from what was met to all sides of the sky above it, as much light comes from there. Of what
  /// lies lower than the place only the ground counts, which Ambient has.
  void cast_sky_rays(ColorScratch& s) const {
    s.sky_share.assign(s.rays.size(), num_sky_rays > 0 ? 1.0f : -1.0f);
    if (num_sky_rays == 0) return;
    s.sky_rays.clear();
    s.sky_ray_of.clear();
    const Eigen::Vector3d up = sky.daylight().up_world;
    for (std::size_t i = 0; i < s.rays.size(); ++i) {
      const world::SurfaceHit& hit = s.hits[i];
      if (hit.is_sky()) continue;
      const Eigen::Vector3d normal = hit.normal_world();
      const Eigen::Vector3d point = s.rays[i].origin_world + hit.t * s.rays[i].direction_world +
                                    lift_m(hit, s.surfaces[i]) * normal;
      const Eigen::Vector3d right = normal.unitOrthogonal();
      const Eigen::Vector3d aside = normal.cross(right);
      for (int ray = 0; ray < num_sky_rays; ++ray) {
        const Eigen::Vector2d disc = sampler.place_on_disc(
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

  /// Clouds between what was met and the sun.
  void dim_sun(ColorScratch& s) const {
    if (clouds.is_empty()) return;
    for (std::size_t i = 0; i < s.rays.size(); ++i)
      if (s.sun_share[i] > 0.0f)
        s.sun_share[i] *= static_cast<float>(clouds.sun_transmittance(
            s.rays[i].origin_world + s.hits[i].t * s.rays[i].direction_world));
  }

  /// Clouds before what was met, seen through the air.
  void lay_clouds(const scene::SampleWidth& width, ColorScratch& s) const {
    if (clouds.is_empty()) return;
    const auto height_m = [&](const Eigen::Vector3d& place_world) {
      return static_cast<float>(scene::approximate_height_m(place_world)) - sea_level_m;
    };
    const float center_height_m = height_m(view.center_world);
    for (std::size_t i = 0; i < s.rays.size(); ++i) {
      const world::WorldRay& ray = s.rays[i];
      const double jitter =
          core::random_unit(s.bits[i], 0x636c6f7564, static_cast<std::uint64_t>(s.samples[i]));
      const scene::Clouds::Seen cloud =
          clouds.look(ray.origin_world, ray.direction_world, s.hits[i].t, width, jitter, sky);
      if (cloud.transmittance == 1.0f) continue;
      const Eigen::Vector3d place = ray.origin_world + cloud.distance_m * ray.direction_world;
      const scene::AirPath air = sky.air(
          static_cast<float>(cloud.distance_m),
          view.model->is_central() ? center_height_m : height_m(ray.origin_world), height_m(place),
          static_cast<float>(ray.direction_world.dot(sky.daylight().sun_direction_world)));
      s.radiance[i] = cloud.transmittance * s.radiance[i] + cloud.radiance * air.transmittance +
                      (1.0f - cloud.transmittance) * air.inscatter;
    }
  }

  /// Leaves the radiance of the unit's pixels in s.sums.
  void render_unit(const PixelUnit& unit, ColorScratch& s) const {
    s.sun_rays.clear();
    cast_rays(unit, s);
    if (eye.depth_m > 0.0) {
      s.sun_share.assign(s.rays.size(), 1.0f);
      s.sky_share.assign(s.rays.size(), -1.0f);
    } else {
      cast_sun_rays(s);
      dim_sun(s);
      cast_sky_rays(s);
    }
    s.radiance.resize(s.rays.size());
    scene::LitHits lit{.rays = s.rays,
                       .offsets_s = s.offsets_s,
                       .hits = s.hits,
                       .surfaces = s.surfaces,
                       .sun_share = s.sun_share,
                       .sky_share = s.sky_share,
                       .sample_width = sample_width(unit),
                       .spread = s.spread};
    if (eye.depth_m > 0.0) {
      water->look_in_water(lit, eye, s.water, s.radiance, trail);
    } else {
      if (water != nullptr) {
        s.below.resize(s.rays.size());
        s.mirrored.resize(s.rays.size());
        s.reflectance.resize(s.rays.size());
        water->look(lit, s.water, {s.below, s.mirrored, s.reflectance}, trail);
        lit.below = s.below;
        lit.mirrored = s.mirrored;
        lit.reflectance = s.reflectance;
      }
      shader.shade(lit, s.shader, s.radiance);
      lay_clouds(lit.sample_width, s);
    }
    s.sums.assign(static_cast<std::size_t>(unit.num_pixels()), scene::Color::Zero());
    for (std::size_t i = 0; i < s.rays.size(); ++i) s.sums[s.pixels[i]] += s.radiance[i];

    const float share = 1.0f / static_cast<float>(num_samples);
    for (scene::Color& sum : s.sums) sum *= share;
  }
};

/// Of the cameras, where some have imaging.
std::vector<const geo::CameraModel*> models_of(const CameraPlan& plan, const ViewTable& views) {
  std::vector<const geo::CameraModel*> models;
  if (plan.imaging.empty()) return models;
  for (int camera = 0; camera < views.num_cameras(); ++camera)
    models.push_back(views.at(0, camera).model);
  return models;
}

std::vector<double> times_of(const CameraPlan& plan) {
  std::vector<double> times_s;
  for (const geo::BodyState& state : plan.states) times_s.push_back(state.time_s);
  return times_s;
}

/// Blocks of pixels, evenly spread over an image, into all of which light comes.
std::vector<PixelUnit> metering_spots(const geo::CameraModel& model) {
  constexpr int kColumns = 16;
  constexpr int kRows = 12;
  const auto has_light = [&](const PixelUnit& spot) {
    for (const double x : {spot.x0, spot.x1})
      for (const double y : {spot.y0, spot.y1})
        if (!model.ray_from_pixel({x, y}).allFinite()) return false;
    return true;
  };
  std::vector<PixelUnit> spots;
  for (int row = 0; row < kRows; ++row)
    for (int column = 0; column < kColumns; ++column) {
      const int x0 = (2 * column + 1) * model.width_px() / (2 * kColumns) / kBlockSide * kBlockSide;
      const int y0 = (2 * row + 1) * model.height_px() / (2 * kRows) / kBlockSide * kBlockSide;
      const PixelUnit spot{x0, y0, std::min(x0 + kBlockSide, model.width_px()),
                           std::min(y0 + kBlockSide, model.height_px())};
      if (has_light(spot)) spots.push_back(spot);
    }
  return spots;
}

/// Calls visit(x, y, index) for a unit's pixels row by row.
template <class Visit>
void for_each_in_rows(const PixelUnit& unit, const Visit& visit) {
  std::size_t index = 0;
  for (int y = unit.y0; y < unit.y1; ++y)
    for (int x = unit.x0; x < unit.x1; ++x) visit(x, y, index++);
}

}  // namespace

FrameRenderer::FrameRenderer(const CameraPlan& plan, const world::TileStore& store,
                             const world::RayQuery& query, const world::RayQuery* bed,
                             bool is_in_water)
    : views_(plan.states, plan.cameras),
      query_(query),
      bed_(bed),
      water_visibility_m_(plan.conditions.water_visibility_m),
      wants_bottom_(plan.conditions.bottom_range && !is_in_water),
      flags_(plan.facts.flag_bits()),
      is_in_water_(is_in_water),
      moving_(plan.moving, query, geo::WorldFrame(store.manifest().origin)),
      ground_(scene::climate_of(store, world::sea_bed::noise_seed(store.manifest().seed))),
      imagery_(store, query.imagery_budget_bytes()),
      textures_(store),
      sky_(scene::daylight_at(
          plan.states.empty() ? Eigen::Vector3d(Eigen::Vector3d::Zero())
                              : Eigen::Vector3d(plan.states.front().world_from_body.translation),
          plan.utc_start, plan.conditions, geo::WorldFrame(store.manifest().origin))),
      clouds_(store, sky_.daylight().sun_direction_world),
      exposure_(sky_, plan.conditions.exposure * (is_in_water ? kInWaterExposure : 1.0)),
      sampling_{.sampler = PixelSampler(static_cast<int>(plan.conditions.color_samples)),
                .num_samples = static_cast<int>(plan.conditions.color_samples),
                .num_sky_rays = static_cast<int>(plan.conditions.ambient_rays)},
      seed_(static_cast<std::uint64_t>(plan.seed)),
      imagers_(plan.imaging, plan.cameras, models_of(plan, views_), times_of(plan), plan.seed,
               plan.name, exposure_.level(), exposure_.balance(),
               [this](int frame, int camera) { return meter(frame, camera); }) {}

scene::WaterAbove FrameRenderer::water_at(const Eigen::Vector3d& center_world,
                                          world::RayTrail* trail) const {
  scene::WaterAbove above;
  scene::find_water_above(query_, std::span(&center_world, 1), std::span(&above, 1), trail);
  // Near a shore the surface's cover may be the land's.
  if (!world::is_water(above.cover)) {
    const std::optional<double> surface_z =
        query_.surface_z_world(center_world.x(), center_world.y());
    above = {.depth_m = surface_z.value_or(0.0) - center_world.z(), .cover = world::Cover::Sea};
  }
  above.depth_m = std::max(above.depth_m, 1e-3);
  return above;
}

Photo FrameRenderer::photo(int frame, int camera, world::RayTrail* trail) const {
  const geo::CameraModel& model = *views_.at(frame, camera).model;
  const PixelGrid grid = PixelGrid::of_squares(model.width_px(), model.height_px(), kColorUnitSide);
  std::vector<PixelUnit> units;
  for (const int i : grid.units_by_place()) units.push_back(grid.unit(i));
  if (!imagers_.has(camera)) {
    Photo photo{.color = core::Image8(model.width_px(), model.height_px(), 3),
                .raw = {},
                .exposure_ev = std::nullopt};
    gather_light(frame, camera, units, sampling_, trail,
                 [&](const PixelUnit& unit, std::span<const scene::Color> radiance) {
                   for_each_in_rows(unit, [&](int x, int y, std::size_t i) {
                     exposure_.develop(radiance[i], &photo.color(x, y));
                   });
                 });
    return photo;
  }
  core::ImageF light(model.width_px(), model.height_px(), 3);
  gather_light(frame, camera, units, sampling_, trail,
               [&](const PixelUnit& unit, std::span<const scene::Color> radiance) {
                 for_each_in_rows(unit, [&](int x, int y, std::size_t i) {
                   for (int k = 0; k < 3; ++k) light(x, y, k) = radiance[i][k];
                 });
               });
  return imagers_.photograph(std::move(light), frame, camera);
}

std::vector<scene::Color> FrameRenderer::meter(int frame, int camera) const {
  const geo::CameraModel& model = *views_.at(frame, camera).model;
  const std::vector<PixelUnit> spots = metering_spots(model);
  std::vector<scene::Color> seen(spots.size());
  gather_light(frame, camera, spots,
               {.sampler = PixelSampler(1), .num_samples = 1, .num_sky_rays = 0}, nullptr,
               [&](const PixelUnit& unit, std::span<const scene::Color> radiance) {
                 scene::Color sum = scene::Color::Zero();
                 for (const scene::Color& color : radiance) sum += color;
                 const auto spot = static_cast<std::size_t>(&unit - spots.data());
                 seen[spot] = sum * exposure_.scale() / static_cast<float>(radiance.size());
               });
  return seen;
}

void FrameRenderer::gather_light(int frame, int camera, const std::vector<PixelUnit>& units,
                                 const Sampling& sampling, world::RayTrail* trail,
                                 const TakeLight& take) const {
  const View& view = views_.at(frame, camera);
  const OpenView open = views_.open(frame, camera);
  const world::MovingScene moving = moving_.scene(frame, views_.longest_reach_s());
  const world::Scene whole(query_, moving);
  const world::Scene bed(bed_ != nullptr ? *bed_ : query_, moving);
  const Eigen::Vector3d sun = sky_.daylight().sun_direction_world;
  const Eigen::Vector3d beside =
      std::abs(sun.z()) < 0.9 ? Eigen::Vector3d::UnitZ() : Eigen::Vector3d::UnitX();
  const double radius = std::tan(geo::kSunAngularRadius_rad);
  const Eigen::Vector3d right = sun.cross(beside).normalized();
  const scene::HitShader shader(ground_, imagery_, textures_, sky_);
  std::optional<scene::WaterLight> water;
  if (bed_ != nullptr) water.emplace(whole, bed, ground_, sky_, shader, water_visibility_m_);
  const ColorImage image{
      .scene = whole,
      .viewed = is_in_water_ ? bed : whole,
      .eye = is_in_water_ ? water_at(view.center_world, trail) : scene::WaterAbove{},
      .clouds = clouds_,
      .sea_level_m = static_cast<float>(ground_.climate().sea_level_m),
      .shader = shader,
      .water = water ? &*water : nullptr,
      .sky = sky_,
      .view = view,
      .open = open.is_pinhole_instant() ? nullptr : &open,
      .sampler = sampling.sampler,
      .seed = seed_,
      .stream = core::stream_of(core::stream_of(core::mix_bits(0x636f6c6f72),  // "color"
                                                static_cast<std::uint64_t>(frame)),
                                static_cast<std::uint64_t>(camera)),
      .num_samples = sampling.num_samples,
      .num_sky_rays = sampling.num_sky_rays,
      .trail = trail,
      .sun_right = right * radius,
      .sun_up = sun.cross(right) * radius};
  core::ScratchPool<ColorScratch> pool;
  query_.run_units(static_cast<std::int64_t>(units.size()), [&](std::int64_t i) {
    core::ScratchPool<ColorScratch>::Lease scratch(pool);
    const PixelUnit& unit = units[static_cast<std::size_t>(i)];
    image.render_unit(unit, *scratch);
    take(unit, (*scratch).sums);
  });
}

}  // namespace terracast::sensors
