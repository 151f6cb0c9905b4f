#include "labels/pair_sight.h"

#include <algorithm>
#include <limits>

#include "capture/labels.h"
#include "capture/object_labels.h"
#include "core/error.h"
#include "core/parallel.h"

namespace terracast::labels {
namespace {

using core::ErrorKind;
using core::fail;
using Eigen::Vector2d;

/// Two sequences trace rays at once, in the memory of one.
world::RayQueryOptions tracing_of(bool has_other) {
  world::RayQueryOptions tracing;
  if (has_other) tracing.memory_bytes *= 0.5;
  return tracing;
}

/// Else a point on the ground of the one would be above or below that of the other.
void check_same_geometry(const capture::SequenceInfo& from, const capture::SequenceInfo& to) {
  const auto is_same = [](const capture::ShownTile& a, const capture::ShownTile& b) {
    return a.level == b.level && a.x == b.x && a.y == b.y && a.content_hash == b.content_hash;
  };
  const auto& own = from.geometry.tiles;
  const auto& others = to.geometry.tiles;
  if (!std::equal(own.begin(), own.end(), others.begin(), others.end(), is_same))
    fail(ErrorKind::Config,
         "sequences {} and {} were captured with different geometries; capture them with "
         "shared_geometry = true",
         from.name, to.name);
}

std::vector<std::optional<std::size_t>> bodies_by_name(const std::vector<capture::MovingBody>& from,
                                                       const std::vector<capture::MovingBody>& to) {
  std::vector<std::optional<std::size_t>> places;
  for (const capture::MovingBody& body : from) {
    const auto found = std::find_if(to.begin(), to.end(), [&](const capture::MovingBody& other) {
      return other.name == body.name && other.thing == body.thing &&
             other.is_part() == body.is_part();
    });
    places.push_back(found == to.end()
                         ? std::nullopt
                         : std::optional(static_cast<std::size_t>(found - to.begin())));
  }
  return places;
}

}  // namespace

PairSight::Other::Other(const LabelInputs& inputs, const capture::SequenceReader& to)
    : moving(captured_bodies(to, inputs.job.things_of(to.info()))),
      matcher(to, inputs.store, moving, tracing_of(true)),
      bodies(bodies_by_name(inputs.sequence.info().moving, to.info().moving)) {}

PairSight::PairSight(const LabelInputs& inputs, const capture::SequenceReader* to)
    : from_(inputs.sequence),
      to_(to == nullptr ? inputs.sequence : *to),
      matcher_(inputs.sequence, inputs.store, inputs.moving, tracing_of(to != nullptr)),
      source_(capture::labels_source(inputs.sequence)) {
  if (to == nullptr) return;
  check_same_geometry(from_.info(), to->info());
  other_ = std::make_unique<const Other>(inputs, *to);
  source_ += " " + capture::labels_source(*to);
}

std::optional<ShownPoint> PairSight::as_other_has_it(const ShownPoint& point) const {
  if (!point.body) return point;
  const std::optional<std::size_t> body = other_->bodies[*point.body];
  if (!body) return std::nullopt;
  ShownPoint same = point;
  same.body = body;
  return same;
}

std::vector<std::optional<Sighting>> PairSight::follow(std::span<const ShownPoint> points,
                                                       const ImageOf& to) const {
  if (!other_) return matcher_.follow(points, to);
  std::vector<ShownPoint> known;
  std::vector<std::size_t> places;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::optional<ShownPoint> same = as_other_has_it(points[i]);
    if (!same) continue;
    known.push_back(*same);
    places.push_back(i);
  }
  const std::vector<std::optional<Sighting>> found = other_->matcher.follow(known, to);
  std::vector<std::optional<Sighting>> of_points(points.size());
  for (std::size_t k = 0; k < found.size(); ++k) of_points[places[k]] = found[k];
  return of_points;
}

bool PairSight::is_there(const ShownPoint& point, int to_frame) const {
  if (!other_) return matcher_.is_there(point, to_frame);
  const std::optional<ShownPoint> same = as_other_has_it(point);
  return same && other_->matcher.is_there(*same, to_frame);
}

std::vector<std::optional<Vector2d>> PairSight::sky_flow(const ImageOf& from,
                                                         std::span<const Eigen::Vector2i> pixels,
                                                         const ImageOf& to) const {
  const Matcher& other = other_ ? other_->matcher : matcher_;
  const capture::CameraView first =
      from_.view(matcher_.model(from.camera), from.frame, from.camera);
  const capture::CameraView second = to_.view(other.model(to.camera), to.frame, to.camera);
  std::vector<std::optional<Vector2d>> flow(pixels.size());
  constexpr std::int64_t kPixelsAtOnce = 1024;
  core::parallel_for_blocks(
      static_cast<std::int64_t>(pixels.size()), kPixelsAtOnce,
      [&](std::int64_t begin, std::int64_t end) {
        for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i)
          flow[i] =
              capture::flow(first, second, capture::pixel_center(pixels[i].x(), pixels[i].y()),
                            std::numeric_limits<double>::infinity());
      });
  return flow;
}

std::optional<Eigen::Vector3d> PairSight::motion(const ShownPoint& point, int to_frame) const {
  if (!other_) return matcher_.motion(point, to_frame);
  if (const std::optional<ShownPoint> same = as_other_has_it(point))
    return other_->matcher.motion(*same, to_frame);
  if (to_frame >= static_cast<int>(from_.frames().size())) return std::nullopt;
  return matcher_.motion(point, to_frame);
}

}  // namespace terracast::labels
