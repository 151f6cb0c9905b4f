#include "labels/matches.h"

#include <cmath>
#include <limits>

#include "capture/labels.h"
#include "core/error.h"
#include "core/parallel.h"
#include "geo/shutter.h"
#include "labels/shown_objects.h"
#include "scene/light/directions.h"
#include "sensors/camera/sight.h"

namespace terracast::labels {
namespace {

using core::ErrorKind;
using core::fail;
using Eigen::Vector2d;
using Eigen::Vector3d;

std::vector<geo::BodyState> states_of(const capture::SequenceReader& sequence) {
  std::vector<geo::BodyState> states;
  for (const capture::FrameRecord& record : sequence.frames()) states.push_back(record.state());
  return states;
}

std::vector<double> times_of(const capture::SequenceReader& sequence) {
  std::vector<double> times_s;
  for (const capture::FrameRecord& record : sequence.frames()) times_s.push_back(record.time_s);
  return times_s;
}

/// The places of bodies that are there, in order.
std::vector<std::size_t> present(const std::vector<std::optional<geo::BodyState>>& states) {
  std::vector<std::size_t> places;
  for (std::size_t i = 0; i < states.size(); ++i)
    if (states[i]) places.push_back(i);
  return places;
}

constexpr std::int64_t kRaysAtOnce = 1024;

}  // namespace

Matcher::Matcher(const capture::SequenceReader& sequence, const world::TileStore& store,
                 const scene::MovingBodies& moving, const world::RayQueryOptions& tracing)
    : sequence_(sequence),
      views_(states_of(sequence), sequence.info().cameras),
      scene_(store, cut_of(store, sequence.info()), moving,
             {.tracing = tracing,
              .conditions = {},
              .utc_start = sequence.info().utc_start,
              .viewer_world = views_.at(0, 0).center_world,
              .times_s = times_of(sequence)}) {}

scene::SceneAt Matcher::scene_at(int frame) const {
  return scene_.at(sequence_.frames()[static_cast<std::size_t>(frame)].time_s,
                   views_.longest_reach_s());
}

const std::vector<std::optional<geo::BodyState>>& Matcher::bodies_at(int frame) const {
  return sequence_.frames()[static_cast<std::size_t>(frame)].moving;
}

Recast Matcher::recast(const ImageOf& from, std::span<const Eigen::Vector2i> pixels,
                       world::SurfaceNeed need) const {
  return recast(from,
                sequence_.read_camera(from.frame, from.camera, capture::SequenceReader::kFacts),
                pixels, need);
}

Recast Matcher::recast(const ImageOf& from, const capture::CameraFrame& facts,
                       std::span<const Eigen::Vector2i> pixels, world::SurfaceNeed need) const {
  const sensors::OpenView view = views_.open(from.frame, from.camera);
  Recast cast;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    if (!std::isfinite(facts.range_m(pixels[i].x(), pixels[i].y()))) continue;
    const Vector2d center = capture::pixel_center(pixels[i].x(), pixels[i].y());
    const sensors::View of_line = view.of_line(center);
    cast.rays.push_back({.origin_world = of_line.origin_world(center),
                         .direction_world = of_line.ray_world(center).normalized()});
    cast.offsets_s.push_back(view.offset_of_line_s(center));
    cast.of_pixel.push_back(i);
  }
  cast.hits.resize(cast.rays.size());
  cast.surfaces.resize(cast.rays.size());
  const scene::SceneAt scene = scene_at(from.frame);
  core::parallel_for_blocks(
      static_cast<std::int64_t>(cast.rays.size()), kRaysAtOnce,
      [&](std::int64_t begin, std::int64_t end) {
        const auto first = static_cast<std::size_t>(begin);
        const auto count = static_cast<std::size_t>(end - begin);
        scene.trace(std::span(cast.rays).subspan(first, count),
                    std::span(cast.offsets_s).subspan(first, count),
                    std::span(cast.hits).subspan(first, count), world::Coherence::Coherent,
                    std::span(cast.surfaces).subspan(first, count), nullptr, need);
      });
  constexpr double kFloatEpsilon = std::numeric_limits<float>::epsilon();
  for (std::size_t k = 0; k < cast.rays.size(); ++k) {
    const Eigen::Vector2i& pixel = pixels[cast.of_pixel[k]];
    // The capture holds the range as a float.
    const double range_m = facts.range_m(pixel.x(), pixel.y());
    const double tolerance_m = 1e-3 + 2.0 * kFloatEpsilon * range_m;
    if (!(std::abs(cast.hits[k].t - range_m) <= tolerance_m))
      fail(ErrorKind::Input,
           "{}: frame {}, pixel ({}, {}) has range {:.3f} m, and its ray meets something at {:.3f} "
           "m; was the capture rendered from that world?",
           sequence_.info().name, from.frame, pixel.x(), pixel.y(), range_m, cast.hits[k].t);
  }
  return cast;
}

std::vector<std::optional<ShownPoint>> Matcher::points(
    const ImageOf& from, std::span<const Eigen::Vector2i> pixels) const {
  return points(from,
                sequence_.read_camera(from.frame, from.camera, capture::SequenceReader::kFacts),
                pixels);
}

std::vector<std::optional<ShownPoint>> Matcher::points(
    const ImageOf& from, const capture::CameraFrame& facts,
    std::span<const Eigen::Vector2i> pixels) const {
  const Recast cast = recast(from, facts, pixels, world::SurfaceNeed::Object);
  const std::vector<std::size_t> bodies = present(bodies_at(from.frame));
  std::vector<std::optional<ShownPoint>> points(pixels.size());
  for (std::size_t k = 0; k < cast.rays.size(); ++k) {
    const world::SurfaceHit& hit = cast.hits[k];
    ShownPoint point{.point_world =
                         cast.rays[k].origin_world + hit.t * cast.rays[k].direction_world};
    if (hit.is_moving()) {
      point.body = bodies.at(hit.object);
      const geo::Rigid3d world_from_body =
          bodies_at(from.frame)[*point.body]->pose_after(cast.offsets_s[k]);
      point.point_body =
          world_from_body.rotation.conjugate() * (point.point_world - world_from_body.translation);
    }
    points[cast.of_pixel[k]] = point;
  }
  return points;
}

std::vector<std::optional<Sighting>> Matcher::follow(std::span<const ShownPoint> points,
                                                     const ImageOf& to) const {
  const sensors::OpenView view = views_.open(to.frame, to.camera);
  const geo::CameraModel& model = *view.middle.model;
  const scene::SceneAt scene = scene_at(to.frame);
  std::vector<std::optional<Sighting>> sightings(points.size());
  core::parallel_for_blocks(
      static_cast<std::int64_t>(points.size()), kRaysAtOnce,
      [&](std::int64_t begin, std::int64_t end) {
        std::vector<world::WorldRay> rays;
        std::vector<double> offsets_s;
        std::vector<std::size_t> found;
        for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i) {
          const std::optional<geo::BodyState>* body =
              points[i].body ? &bodies_at(to.frame)[*points[i].body] : nullptr;
          if (body != nullptr && !*body) continue;  // it is not there
          const auto point_world_at = [&](double offset_s) -> Vector3d {
            return body == nullptr ? points[i].point_world
                                   : (*body)->pose_after(offset_s) * points[i].point_body;
          };
          const auto seen = geo::find_seen(
              view.motion.shutter, model.width_px(), model.height_px(),
              [&](double offset_s) { return view.at(offset_s).project(point_world_at(offset_s)); });
          if (!seen) continue;
          const Vector3d origin_world = view.at(seen->offset_s).origin_world(seen->pixel);
          const Vector3d way_world = point_world_at(seen->offset_s) - origin_world;
          const bool is_in_image = model.contains(seen->pixel);
          sightings[i] = Sighting{
              .pixel = seen->pixel, .range_m = way_world.norm(), .is_in_image = is_in_image};
          if (!is_in_image) continue;
          rays.push_back({.origin_world = origin_world,
                          .direction_world = way_world,
                          .t_max = scene::kJustBeyond});
          offsets_s.push_back(seen->offset_s);
          found.push_back(i);
        }
        std::vector<world::SurfaceHit> hits(rays.size());
        std::vector<world::SurfaceSample> surfaces(rays.size());
        scene.trace(rays, offsets_s, hits, world::Coherence::Incoherent, surfaces, nullptr,
                    world::SurfaceNeed::Object);
        for (std::size_t k = 0; k < hits.size(); ++k) {
          Sighting& sighting = *sightings[found[k]];
          sighting.is_visible = sensors::is_at_point(hits[k].t);
          if (!sighting.is_visible && !hits[k].is_sky() && !hits[k].is_ground())
            sighting.occluder_id = surfaces[k].provenance.instance_id;
        }
      });
  return sightings;
}

bool Matcher::is_there(const ShownPoint& point, int frame) const {
  return !point.body || bodies_at(frame)[*point.body].has_value();
}

std::optional<Vector3d> Matcher::place(const ShownPoint& point, int frame) const {
  if (!point.body) return point.point_world;
  const std::optional<geo::BodyState>& body = bodies_at(frame)[*point.body];
  if (!body) return std::nullopt;
  return Vector3d(body->world_from_body * point.point_body);
}

std::optional<Vector3d> Matcher::motion(const ShownPoint& point, int to_frame) const {
  const std::optional<Vector3d> there_world = place(point, to_frame);
  if (!there_world) return std::nullopt;
  return Vector3d(*there_world - point.point_world);
}

}  // namespace terracast::labels
