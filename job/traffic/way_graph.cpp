#include "job/traffic/way_graph.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"

namespace terracast::job {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using world::kHeightStep_m;
using world::WayKind;
using world::WayPart;

/// A line's direction at its end is that of a chord so long.
constexpr double kChord_m = 2.0;
/// On one lane for both directions one drives at the side where it is as wide as this.
constexpr double kTwoAbreast_m = 4.4;

/// Where the law says no more: Germany's and Switzerland's limits, and what is driven on small roads.
struct Limit {
  WayKind kind;
  double outside_kmph;
  double town_kmph;
};
constexpr Limit kLimits[] = {
    {WayKind::Motorway, 120.0, 120.0},    {WayKind::Trunk, 100.0, 70.0},
    {WayKind::Primary, 80.0, 50.0},       {WayKind::Secondary, 80.0, 50.0},
    {WayKind::Tertiary, 70.0, 50.0},      {WayKind::MotorwayLink, 60.0, 60.0},
    {WayKind::TrunkLink, 60.0, 50.0},     {WayKind::PrimaryLink, 50.0, 40.0},
    {WayKind::SecondaryLink, 50.0, 40.0}, {WayKind::TertiaryLink, 40.0, 40.0},
    {WayKind::Unclassified, 60.0, 40.0},  {WayKind::Road, 50.0, 40.0},
    {WayKind::Residential, 30.0, 30.0},   {WayKind::LivingStreet, 12.0, 12.0},
    {WayKind::Service, 15.0, 15.0},       {WayKind::Busway, 50.0, 40.0},
    {WayKind::Rail, 100.0, 100.0},        {WayKind::LightRail, 70.0, 70.0},
    {WayKind::Tram, 40.0, 40.0},          {WayKind::NarrowGauge, 60.0, 60.0},
    {WayKind::Subway, 70.0, 70.0}};
/// Tracks on which trains do not run through.
constexpr double kSiding_kmph = 40.0;

Vector2d start_chord(const std::vector<Vector3d>& points) {
  for (const Vector3d& point : points) {
    const Vector2d step = (point - points.front()).head<2>();
    if (step.norm() >= kChord_m || &point == &points.back()) return step.normalized();
  }
  return Vector2d::UnitX();
}

}  // namespace

WayGraph::WayGraph(world::WayNetwork network) : network_(std::move(network)) {
  for (const WayPart& part : network_.parts) {
    double length_m = 0.0;
    for (std::size_t i = 0; i + 1 < part.points_steps.size(); ++i)
      length_m += (part.at_world(i + 1) - part.at_world(i)).norm();
    lengths_m_.push_back(length_m);
  }
  first_of_node_.assign(network_.num_nodes + 1, 0);
  for (const WayPart& part : network_.parts)
    for (const std::uint32_t node : {part.from_node, part.to_node}) ++first_of_node_[node + 1];
  for (std::size_t i = 1; i < first_of_node_.size(); ++i)
    first_of_node_[i] += first_of_node_[i - 1];
  arms_.resize(2 * network_.parts.size());
  std::vector<std::uint32_t> next = first_of_node_;
  for (std::uint32_t p = 0; p < network_.parts.size(); ++p) {
    arms_[next[network_.parts[p].from_node]++] = {p, true};
    arms_[next[network_.parts[p].to_node]++] = {p, false};
  }
}

std::span<const Arm> WayGraph::after(const Arm& arm) const {
  const std::uint32_t node = arm.is_forward ? part(arm).to_node : part(arm).from_node;
  return std::span(arms_).subspan(first_of_node_[node],
                                  first_of_node_[node + 1] - first_of_node_[node]);
}

std::vector<Vector3d> WayGraph::points(const Arm& arm) const {
  std::vector<Vector3d> points;
  for (const Eigen::Vector3i& steps : part(arm).points_steps)
    points.push_back(steps.cast<double>() * kHeightStep_m);
  if (!arm.is_forward) std::reverse(points.begin(), points.end());
  return points;
}

Vector2d WayGraph::direction_at_start(const Arm& arm) const { return start_chord(points(arm)); }

Vector2d WayGraph::direction_at_end(const Arm& arm) const {
  return -direction_at_start({arm.part, !arm.is_forward});
}

double WayGraph::turn_rad(const Arm& from, const Arm& to) const {
  const Vector2d a = direction_at_end(from), b = direction_at_start(to);
  return std::atan2(a.x() * b.y() - a.y() * b.x(), a.dot(b));
}

int num_lanes(const WayPart& part, bool is_forward) {
  if (!(is_forward ? part.may_go_forward : part.may_go_backward)) return 0;
  const int num = part.num_lanes;
  if (!part.may_go_forward || !part.may_go_backward || num == 1) return num;
  return is_forward ? num - num / 2 : num / 2;
}

double lane_right_m(const WayPart& part, bool is_forward, int lane, bool on_left) {
  TERRACAST_CHECK(lane >= 0 && lane < num_lanes(part, is_forward), "lane {} of {}", lane,
                  num_lanes(part, is_forward));
  const double left_m = part.lanes_left_steps * kHeightStep_m;
  const double right_m = part.lanes_right_steps * kHeightStep_m;
  const double width_m = (left_m - right_m) / part.num_lanes;
  const double to_travel = is_forward ? -1.0 : 1.0;  // from across the line, to its left
  if (part.num_lanes == 1 && part.may_go_forward && part.may_go_backward) {
    const bool has_room = width_m >= kTwoAbreast_m && !world::is_railway(part.kind);
    const double aside_m = has_room ? 0.25 * width_m : 0.0;
    return to_travel * 0.5 * (left_m + right_m) + (on_left ? -aside_m : aside_m);
  }
  const bool from_right_edge = is_forward != on_left;  // of the line
  const double across_m =
      from_right_edge ? right_m + (lane + 0.5) * width_m : left_m - (lane + 0.5) * width_m;
  return to_travel * across_m;
}

double speed_limit_kmph(const WayPart& part) {
  if (part.max_speed_kmph > 0) return part.max_speed_kmph;
  if (part.is_siding) return kSiding_kmph;
  for (const Limit& limit : kLimits)
    if (limit.kind == part.kind)
      return part.sidewalk_steps > 0 ? limit.town_kmph : limit.outside_kmph;
  return 10.0;
}

}  // namespace terracast::job
