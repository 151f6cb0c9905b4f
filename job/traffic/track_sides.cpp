#include "job/traffic/track_sides.h"

#include <algorithm>
#include <cmath>

namespace terracast::job {
namespace {

using Eigen::Vector2d;
using world::WayPart;

/// Of tracks that belong together, from middle to middle.
constexpr double kNearest_m = 2.5;
constexpr double kFarthest_m = 7.5;
/// The cosine of how much their directions differ at most.
constexpr double kParallel = 0.97;

struct Middle {
  Vector2d at;
  Vector2d direction;
};
Middle middle_of(const WayPart& part, double length_m) {
  double left_m = 0.5 * length_m;
  for (std::size_t i = 0; i + 1 < part.points_steps.size(); ++i) {
    const Vector2d a = part.at_world(i), step = part.at_world(i + 1) - a;
    const double step_m = step.norm();
    if (step_m >= left_m || i + 2 == part.points_steps.size())
      return {a + std::min(left_m / step_m, 1.0) * step, step / step_m};
    left_m -= step_m;
  }
  return {part.at_world(0), Vector2d::UnitX()};
}

}  // namespace

TrackSides::TrackSides(const WayGraph& graph, bool on_left) : graph_(graph), on_left_(on_left) {
  for (std::uint32_t p = 0; p < graph.parts().size(); ++p) {
    const WayPart& part = graph.parts()[p];
    if (!world::is_railway(part.kind) || part.is_siding) continue;
    Box box{p, part.at_world(0), part.at_world(0)};
    for (std::size_t i = 1; i < part.points_steps.size(); ++i) {
      box.low = box.low.cwiseMin(part.at_world(i));
      box.high = box.high.cwiseMax(part.at_world(i));
    }
    tracks_.push_back(box);
  }
}

void TrackSides::look_beside(std::uint32_t p, bool& at_left, bool& at_right) const {
  const WayPart& part = graph_.parts()[p];
  const Middle middle = middle_of(part, graph_.length_m(p));
  for (const Box& box : tracks_) {
    const WayPart& other = graph_.parts()[box.part];
    if (box.part == p || other.kind != part.kind ||
        (middle.at - middle.at.cwiseMax(box.low).cwiseMin(box.high)).norm() > kFarthest_m)
      continue;
    for (std::size_t i = 0; i + 1 < other.points_steps.size(); ++i) {
      const Vector2d a = other.at_world(i), step = other.at_world(i + 1) - a;
      const double share = (middle.at - a).dot(step) / step.squaredNorm();
      if (share < 0.0 || share > 1.0) continue;
      const Vector2d off = a + share * step - middle.at;
      if (off.norm() < kNearest_m || off.norm() > kFarthest_m ||
          std::abs(step.normalized().dot(middle.direction)) < kParallel)
        continue;
      (middle.direction.x() * off.y() - middle.direction.y() * off.x() > 0.0 ? at_left : at_right) =
          true;
    }
  }
}

bool TrackSides::goes(const Arm& arm) const {
  const WayPart& part = graph_.part(arm);
  if (num_lanes(part, arm.is_forward) == 0) return false;
  if (part.num_lanes > 1 || part.is_siding || !part.may_go_forward || !part.may_go_backward)
    return !part.is_siding;
  bool at_left = false, at_right = false;
  look_beside(arm.part, at_left, at_right);
  if (at_left == at_right) return true;
  // Seen along the line it is the right one of two where the other is at its left.
  const bool is_right_one = at_left;
  return is_right_one == (arm.is_forward != on_left_);
}

}  // namespace terracast::job
