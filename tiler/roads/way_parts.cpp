#include "tiler/roads/way_parts.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "tiler/roads/bridge_builder.h"
#include "world/road_marks.h"

namespace terracast::tiler {
namespace {

using Eigen::Vector2d;
using world::kHeightStep_m;
using world::Marking;

/// Pieces between gaps that are shorter than this lead nowhere.
constexpr double kLeast_m = 1.0;
constexpr double kSamePlace_m = 0.01;
/// From the end of the paving to the middle of the line at the edge of lanes.
constexpr double kEdge_m = world::kEdgeStrip_m + 0.5 * world::kLine_m;
constexpr double kMotorwayLeftEdge_m = world::kMotorwayEdgeStrip_m + 0.5 * world::kMotorwayLine_m;

std::int32_t steps_of(double value_m) {
  return static_cast<std::int32_t>(std::lround(value_m / kHeightStep_m));
}

/// Lanes as they are marked; on roads without marks they are no wider than their class has them.
void set_lanes(const WayStyle& style, world::WayPart& part) {
  const double half_m = style.half_width_m;
  double left_m = std::min(half_m, 0.5 * style.num_lanes * style.lane_m);
  double right_m = -left_m;
  if (style.marking == Marking::Rails) {
    left_m = half_m;  // tracks lie evenly across the whole bed
    right_m = -half_m;
  } else if (style.marking == Marking::Lanes || style.marking == Marking::Center) {
    left_m = half_m - kEdge_m;
    right_m = -left_m;
  } else if (style.marking == Marking::Motorway) {
    left_m = half_m - kMotorwayLeftEdge_m;
    right_m = std::clamp(left_m - world::kMotorwayLane_m * style.num_lanes,
                         kMotorwayLeftEdge_m - half_m, world::kMotorwayShoulder_m - half_m);
  }
  if (left_m - right_m < 0.5) {
    left_m = half_m;
    right_m = -half_m;
  }
  part.lanes_left_steps = steps_of(left_m);
  part.lanes_right_steps = steps_of(right_m);
}

world::WayPart part_like(const Way& way) {
  const WayStyle& style = way.style;
  world::WayPart part;
  part.feature = way.feature;
  part.kind = style.kind;
  const bool has_traffic =
      style.use == WayUse::Railway || (style.use == WayUse::Road && style.has_motor_traffic);
  part.may_go_forward = has_traffic && !(style.is_oneway && style.is_against);
  part.may_go_backward = has_traffic && (!style.is_oneway || style.is_against);
  part.is_bridge = style.is_bridge;
  part.is_tunnel = style.is_tunnel;
  part.is_siding = style.is_siding;
  part.num_lanes = static_cast<std::uint8_t>(style.num_lanes);
  part.max_speed_kmph = static_cast<std::uint16_t>(style.max_speed_kmph);
  part.half_width_steps = steps_of(style.half_width_m);
  part.sidewalk_steps = style.is_bridge ? 0 : steps_of(style.sidewalk_m);
  set_lanes(style, part);
  return part;
}

}  // namespace

std::uint32_t WayParts::node_at(const Vector2d& place_world) {
  const std::pair key(std::llround(place_world.x() / kSamePlace_m),
                      std::llround(place_world.y() / kSamePlace_m));
  const auto [found, is_new] = nodes_.emplace(key, network_.num_nodes);
  if (is_new) ++network_.num_nodes;
  return found->second;
}

void WayParts::add_piece(const RoadNetwork& network, const RoadHeights* heights, const Line& line,
                         const Span& span, double from_m, double to_m) {
  world::WayPart part = part_like(network.ways()[span.way]);
  TERRACAST_CHECK(!part.is_bridge || heights != nullptr, "a bridge of feature {} without heights",
                  part.feature);
  const auto put = [&](const Vector2d& at, double level_m) {
    const double z = part.is_bridge ? z_of(at, level_m) + kDeckAbove_m : 0.0;
    const Eigen::Vector3i steps(steps_of(at.x()), steps_of(at.y()), steps_of(z));
    if (part.points_steps.empty() || part.points_steps.back().head<2>() != steps.head<2>())
      part.points_steps.push_back(steps);
  };
  for (std::uint32_t p = span.first_point; p < span.last_point; ++p) {
    const Line::Point& a = line.points[p];
    const Line::Point& b = line.points[p + 1];
    const double length_m = b.along_m - a.along_m;
    const double low = std::clamp((from_m - a.along_m) / length_m, 0.0, 1.0);
    const double high = std::clamp((to_m - a.along_m) / length_m, 0.0, 1.0);
    if (high <= low) continue;
    const double level_a = heights == nullptr ? 0.0 : heights->level_m(a);
    const double level_b = heights == nullptr ? 0.0 : heights->level_m(b);
    for (const double share : {low, high})
      put(a.at_world + share * (b.at_world - a.at_world), level_a + share * (level_b - level_a));
  }
  if (part.points_steps.size() < 2) return;
  const double first_m = line.points[span.first_point].along_m;
  const double last_m = line.points[span.last_point].along_m;
  part.from_node = from_m <= first_m ? node_at(network.junctions()[span.from_junction].at_world)
                                     : network_.num_nodes++;
  part.to_node = to_m >= last_m ? node_at(network.junctions()[span.to_junction].at_world)
                                : network_.num_nodes++;
  if (span.is_reversed) {
    std::reverse(part.points_steps.begin(), part.points_steps.end());
    std::swap(part.from_node, part.to_node);
  }
  network_.parts.push_back(std::move(part));
}

void WayParts::add(const RoadNetwork& network, const RoadHeights* heights,
                   const std::vector<std::vector<std::pair<double, double>>>& gaps) {
  for (std::size_t l = 0; l < network.lines().size(); ++l) {
    const Line& line = network.lines()[l];
    for (const Span& span : line.spans) {
      const WayStyle& style = network.style(span);
      if (style.use == WayUse::Airfield) continue;
      double from_m = line.points[span.first_point].along_m;
      const double end_m = line.points[span.last_point].along_m;
      for (const auto& [gap_from_m, gap_to_m] : gaps[l]) {
        if (gap_to_m <= from_m || gap_from_m >= end_m) continue;
        if (gap_from_m - from_m > kLeast_m)
          add_piece(network, heights, line, span, from_m, gap_from_m);
        from_m = gap_to_m;
      }
      if (end_m > from_m) add_piece(network, heights, line, span, from_m, end_m);
    }
  }
}

}  // namespace terracast::tiler
