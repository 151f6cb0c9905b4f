#include "sensors/events/scene_looks.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "core/random.h"
#include "geo/frames.h"

namespace terracast::sensors::events {
namespace {

/// Rays that are cast together.
constexpr std::size_t kMostRays = 4096;
/// Of the cells of an image within which all samples are as wide.
constexpr double kCellSide_px = 16.0;
/// To both sides of a time, over which the image's motion is measured.
constexpr double kAside_s = 5e-5;
constexpr double kCandelas = 1e3;  // a kcd

}  // namespace

SceneLooks::SceneLooks(const SensorSite& site, const geo::CameraModel& model,
                       const PixelOptions& options, const scene::PixelSampler& sampler,
                       int num_samples, const TimeSpan& span, world::RayTrail* trail)
    : site_(site),
      model_(model),
      options_(options),
      sampler_(sampler),
      num_samples_(num_samples),
      middle_s_(0.5 * (span.start_s + span.end_s)),
      at_(site.scene, middle_s_, span.end_s - middle_s_),
      radiance_(at_, {.sampler = sampler, .num_sky_rays = 0}, view_at(middle_s_).center_world,
                model.is_central(), trail) {}

View SceneLooks::view_at(double time_s) const {
  const geo::Rigid3d world_from_sensor = site_.world_from_sensor(time_s);
  return {.model = &model_,
          .center_world = world_from_sensor.translation,
          .world_from_camera =
              world_from_sensor.rotation.toRotationMatrix() * geo::rig_from_forward_camera()};
}

const std::array<View, 3>& SceneLooks::views_at(double time_s, Scratch& scratch) const {
  const auto found = scratch.views.find(time_s);
  if (found != scratch.views.end()) return found->second;
  return scratch.views
      .emplace(time_s,
               std::array{view_at(time_s), view_at(time_s - kAside_s), view_at(time_s + kAside_s)})
      .first->second;
}

Eigen::Vector2d SceneLooks::centre_of(std::uint32_t pixel) const {
  const auto width_px = static_cast<std::uint32_t>(model_.width_px());
  return {pixel % width_px + 0.5, pixel / width_px + 0.5};
}

Eigen::Vector2d SceneLooks::middle_of_cell(std::uint32_t pixel) const {
  const Eigen::Vector2d corner =
      kCellSide_px * (centre_of(pixel) / kCellSide_px).array().floor().matrix();
  const Eigen::Vector2d size(model_.width_px(), model_.height_px());
  return 0.5 * (corner + (corner.array() + kCellSide_px).min(size.array()).matrix());
}

double SceneLooks::flow_pxps(const LookPlace& place, double nearest_m, Scratch& scratch) const {
  const auto& [now, before, after] = views_at(place.time_s, scratch);
  const Eigen::Vector2d here = centre_of(place.pixel);
  const Eigen::Vector3d ray_world = now.ray_world(here).normalized();
  const bool is_far = !std::isfinite(nearest_m);
  const auto seen_in = [&](const View& view) {
    // The sky stands still: it moves as directions do.
    return view.project((is_far ? view.center_world : now.center_world) +
                        (is_far ? 1.0 : nearest_m) * ray_world);
  };
  const std::optional<Eigen::Vector2d> was = seen_in(before);
  const std::optional<Eigen::Vector2d> will = seen_in(after);
  if (!was || !will) return 0.0;
  return (*will - *was).norm() / (2.0 * kAside_s);
}

void SceneLooks::look_at_some(std::span<const LookPlace> places, std::span<Look> looks,
                              Scratch& scratch) const {
  const auto width_px = static_cast<std::uint32_t>(model_.width_px());
  scene::LightRays& light = scratch.light;
  light.clear();
  std::vector<std::uint32_t> place_of;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const std::uint32_t pixel = places[i].pixel;
    const View& view = views_at(places[i].time_s, scratch)[0];
    const std::uint64_t bits =
        core::random_bits(site_.stream_seed, core::mix_bits(0x6c6f6f6b), pixel);  // "look"
    for (int sample = 0; sample < num_samples_; ++sample) {
      const Eigen::Vector2d image_point = Eigen::Vector2d(pixel % width_px, pixel / width_px) +
                                          sampler_.place_in_pixel(bits, sample);
      const Eigen::Vector3d direction_world = view.ray_world(image_point).normalized();
      if (!direction_world.allFinite()) continue;  // no light comes in
      light.rays.push_back({.origin_world = view.center_world, .direction_world = direction_world});
      light.offsets_s.push_back(places[i].time_s - middle_s_);
      light.bits.push_back(bits);
      light.samples.push_back(sample);
      light.spread.push_back(static_cast<float>(sampler_.place_between(bits, sample)));
      light.sun_rays.push_back(
          {.origin_world = Eigen::Vector3d::Zero(),
           .direction_world = radiance_.toward_sun(sampler_.place_on_disc(bits, sample))});
      place_of.push_back(static_cast<std::uint32_t>(i));
    }
  }
  // As wide as samples of cameras' images are.
  const double share = std::max(0.5, std::pow(num_samples_, -0.25));
  radiance_.find(scene::sample_width(model_, middle_of_cell(places.front().pixel), share), light);
  std::vector<double> luminance(places.size());
  std::vector<double> nearest_m(places.size(), std::numeric_limits<double>::infinity());
  for (std::size_t i = 0; i < place_of.size(); ++i) {
    luminance[place_of[i]] += static_cast<double>(scene::luminance_of(light.radiance[i]));
    nearest_m[place_of[i]] = std::min(nearest_m[place_of[i]], light.hits[i].t);
  }
  for (std::size_t i = 0; i < places.size(); ++i)
    looks[i] = {.log_light = options_.log_light(kCandelas * luminance[i] / num_samples_),
                .flow_pxps = flow_pxps(places[i], nearest_m[i], scratch)};
}

void SceneLooks::look(std::span<const LookPlace> places, std::span<Look> looks,
                      Scratch& scratch) const {
  const std::size_t most =
      std::max<std::size_t>(1, kMostRays / static_cast<std::size_t>(num_samples_));
  for (std::size_t first = 0; first < places.size();) {
    const Eigen::Vector2d cell = middle_of_cell(places[first].pixel);
    std::size_t end = first + 1;
    while (end < places.size() && end - first < most && middle_of_cell(places[end].pixel) == cell)
      ++end;
    look_at_some(places.subspan(first, end - first), looks.subspan(first, end - first), scratch);
    first = end;
  }
}

}  // namespace terracast::sensors::events
