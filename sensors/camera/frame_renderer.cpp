#include "sensors/camera/frame_renderer.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/lanes.h"
#include "core/random.h"
#include "core/scratch_pool.h"
#include "scene/light/radiance.h"
#include "scene/light/sampler.h"
#include "sensors/camera/pixel_blocks.h"

namespace terracast::sensors {
namespace {

constexpr int kColorUnitSide = 16;
constexpr int kBlockPixels = kBlockSide * kBlockSide;
static_assert(kBlockPixels == core::kLanes);

/// Water takes most of the light; a camera in it opens so much further.
constexpr double kInWaterExposure = 2.5;

struct ColorScratch {
  scene::LightRays light;
  std::vector<std::uint32_t> pixels;  ///< of the rays, within the unit
  std::vector<scene::Color> sums;     ///< of the unit's pixels
};

struct ColorImage {
  const scene::Radiance& radiance;
  const View& view;      ///< at the frame's time
  const OpenView* open;  ///< null: the shutter is open for an instant, the lens a pinhole
  const scene::PixelSampler& sampler;
  std::uint64_t seed;
  std::uint64_t stream;
  int num_samples;

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

  void add_rays(const PixelUnit& unit, ColorScratch& s) const {
    scene::LightRays& light = s.light;
    light.clear();
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
            const OpenView::LensRay ray = ray_through(place, bits, sample);
            if (!ray.direction_world.allFinite()) return;  // no light comes in
            light.rays.push_back(
                {.origin_world = ray.origin_world, .direction_world = ray.direction_world});
            light.offsets_s.push_back(ray.offset_s);
            light.bits.push_back(bits);
            light.samples.push_back(sample);
            light.spread.push_back(static_cast<float>(sampler.place_between(bits, sample)));
            light.sun_rays.push_back(
                {.origin_world = Eigen::Vector3d::Zero(),
                 .direction_world = radiance.toward_sun(sampler.place_on_disc(bits, sample))});
            s.pixels.push_back(
                static_cast<std::uint32_t>((y - unit.y0) * (unit.x1 - unit.x0) + (x - unit.x0)));
          });
        }
      }
    }
  }

  /// Leaves the radiance of the unit's pixels in s.sums.
  void render_unit(const PixelUnit& unit, ColorScratch& s) const {
    add_rays(unit, s);
    radiance.find(sample_width(unit), s.light);
    s.sums.assign(static_cast<std::size_t>(unit.num_pixels()), scene::Color::Zero());
    for (std::size_t i = 0; i < s.pixels.size(); ++i) s.sums[s.pixels[i]] += s.light.radiance[i];
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

scene::SceneOptions scene_options(const CameraPlan& plan, const ViewTable& views,
                                  const world::RayQueryOptions& tracing) {
  return {.tracing = tracing,
          .conditions = plan.conditions,
          .utc_start = plan.utc_start,
          .position_world = plan.states.front().world_from_body.translation,
          .viewer_world = views.at(0, 0).center_world,
          .times_s = times_of(plan)};
}

FrameRenderer::FrameRenderer(const CameraPlan& plan, const ViewTable& views,
                             const scene::Scene& scene)
    : views_(views),
      scene_(scene),
      wants_bottom_(plan.conditions.bottom_range && !scene.is_in_water()),
      flags_(plan.facts.flag_bits()),
      times_s_(times_of(plan)),
      exposure_(scene.sky(),
                plan.conditions.exposure * (scene.is_in_water() ? kInWaterExposure : 1.0)),
      sampling_{.sampler = scene::PixelSampler(static_cast<int>(plan.conditions.color_samples)),
                .num_samples = static_cast<int>(plan.conditions.color_samples),
                .num_sky_rays = static_cast<int>(plan.conditions.ambient_rays)},
      seed_(static_cast<std::uint64_t>(plan.seed)),
      imagers_(plan.imaging, plan.cameras, models_of(plan, views_), times_s_, plan.seed, plan.name,
               exposure_.level(), exposure_.balance(),
               [this](int frame, int camera) { return meter(frame, camera); }) {}

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
               {.sampler = scene::PixelSampler(1), .num_samples = 1, .num_sky_rays = 0}, nullptr,
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
  const scene::SceneAt at =
      scene_.at(times_s_[static_cast<std::size_t>(frame)], views_.longest_reach_s());
  const scene::Radiance radiance(
      at, {.sampler = sampling.sampler, .num_sky_rays = sampling.num_sky_rays}, view.center_world,
      view.model->is_central(), trail);
  const ColorImage image{
      .radiance = radiance,
      .view = view,
      .open = open.is_pinhole_instant() ? nullptr : &open,
      .sampler = sampling.sampler,
      .seed = seed_,
      .stream = core::stream_of(core::stream_of(core::mix_bits(0x636f6c6f72),  // "color"
                                                static_cast<std::uint64_t>(frame)),
                                static_cast<std::uint64_t>(camera)),
      .num_samples = sampling.num_samples};
  core::ScratchPool<ColorScratch> pool;
  scene_.whole().run_units(static_cast<std::int64_t>(units.size()), [&](std::int64_t i) {
    core::ScratchPool<ColorScratch>::Lease scratch(pool);
    const PixelUnit& unit = units[static_cast<std::size_t>(i)];
    image.render_unit(unit, *scratch);
    take(unit, (*scratch).sums);
  });
}

}  // namespace terracast::sensors
