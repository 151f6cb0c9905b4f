#include "render/labels/matches.h"

#include <cmath>
#include <limits>

#include "capture/labels.h"
#include "core/error.h"
#include "core/parallel.h"
#include "render/ground_truth.h"
#include "render/labels/shown_objects.h"

namespace terracast::render {
namespace {

using core::ErrorKind;
using core::fail;
using Eigen::Vector2d;
using Eigen::Vector3d;

std::vector<geo::BodyState> states_of(const capture::SequenceReader& sequence) {
  std::vector<geo::BodyState> states;
  for (const capture::FrameRecord& record : sequence.frames())
    states.push_back({.time_s = record.time_s,
                      .world_from_body = record.world_from_body,
                      .velocity_world_mps = record.velocity_world_mps,
                      .acceleration_world_mps2 = record.acceleration_world_mps2,
                      .angular_velocity_body_radps = record.angular_velocity_body_radps});
  return states;
}

}  // namespace

Matcher::Matcher(const capture::SequenceReader& sequence, const world::TileStore& store,
                 const world::RayQueryOptions& tracing)
    : sequence_(sequence),
      views_(states_of(sequence), sequence.info().cameras),
      whole_(store, cut_of(store, sequence.info()), tracing) {
  const Vector3d& center = views_.at(0, 0).center_world;
  const std::optional<double> surface_z = whole_.surface_z_world(center.x(), center.y());
  if (surface_z && center.z() < *surface_z)
    in_water_.emplace(whole_, world::RayQuery::WithoutWater{.memory_bytes = tracing.memory_bytes,
                                                            .viewers_in_water = true});
}

std::vector<std::optional<Vector3d>> Matcher::points_world(
    const ImageOf& from, std::span<const Eigen::Vector2i> pixels) const {
  const capture::CameraFrame facts =
      sequence_.read_camera(from.frame, from.camera, capture::SequenceReader::kFacts);
  const OpenView view = views_.open(from.frame, from.camera);
  std::vector<world::WorldRay> rays;
  std::vector<std::size_t> asked;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    if (!std::isfinite(facts.range_m(pixels[i].x(), pixels[i].y()))) continue;
    const Vector2d center = capture::pixel_center(pixels[i].x(), pixels[i].y());
    const View of_line = view.of_line(center);
    rays.push_back({.origin_world = of_line.origin_world(center),
                    .direction_world = of_line.ray_world(center).normalized()});
    asked.push_back(i);
  }
  std::vector<world::SurfaceHit> hits(rays.size());
  const world::RayQuery& query = in_water_ ? *in_water_ : whole_;
  constexpr std::int64_t kRaysAtOnce = 4096;
  core::parallel_for_blocks(static_cast<std::int64_t>(rays.size()), kRaysAtOnce,
                            [&](std::int64_t begin, std::int64_t end) {
                              const auto first = static_cast<std::size_t>(begin);
                              const auto count = static_cast<std::size_t>(end - begin);
                              query.intersect(std::span(rays).subspan(first, count),
                                              std::span(hits).subspan(first, count),
                                              world::Coherence::Coherent);
                            });
  constexpr double kFloatEpsilon = std::numeric_limits<float>::epsilon();
  std::vector<std::optional<Vector3d>> points(pixels.size());
  for (std::size_t k = 0; k < rays.size(); ++k) {
    const Eigen::Vector2i& pixel = pixels[asked[k]];
    // The capture holds the range as a float.
    const double range_m = facts.range_m(pixel.x(), pixel.y());
    const double tolerance_m = 1e-3 + 2.0 * kFloatEpsilon * range_m;
    if (!(std::abs(hits[k].t - range_m) <= tolerance_m))
      fail(ErrorKind::Input,
           "{}: frame {}, pixel ({}, {}) has range {:.3f} m, and its ray meets something at {:.3f} "
           "m; was the capture rendered from that world?",
           sequence_.info().name, from.frame, pixel.x(), pixel.y(), range_m, hits[k].t);
    points[asked[k]] = rays[k].origin_world + hits[k].t * rays[k].direction_world;
  }
  return points;
}

std::vector<std::optional<Match>> Matcher::find(std::span<const Vector3d> points_world,
                                                const ImageOf& to) const {
  const OpenView view = views_.open(to.frame, to.camera);
  const std::vector<std::uint8_t> is_visible =
      visible_in_view(in_water_ ? *in_water_ : whole_, view, points_world);
  std::vector<std::optional<Match>> matches(points_world.size());
  for (std::size_t i = 0; i < points_world.size(); ++i) {
    const std::optional<OpenView::SeenFrom> seen = view.that_sees(points_world[i]);
    const std::optional<Vector2d> pixel = seen ? seen->view.project(points_world[i]) : std::nullopt;
    if (pixel && view.middle.model->contains(*pixel))
      matches[i] = Match{.pixel = *pixel, .is_visible = is_visible[i] != 0};
  }
  return matches;
}

}  // namespace terracast::render
