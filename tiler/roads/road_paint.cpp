#include "tiler/roads/road_paint.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <numbers>

#include "core/random.h"
#include "tiler/roads/road_bed.h"

namespace terracast::tiler {
namespace {

using Eigen::Vector2d;
using world::kHeightStep_m;
using world::Marking;
using world::Strip;

constexpr double kCell_m = 256.0;
/// A strip has no more points, so that tiles hold little of what lies beyond them.
constexpr std::size_t kMostPoints = 40;
/// Marks end so far before the edge of the way that is met.
constexpr double kUnmarked_m = 2.5;
constexpr double kMostTrim_m = 25.0;
constexpr double kZebraHalf_m = 1.75;
/// A crossing is on the way that is so near.
constexpr double kCrossingNear_m = 4.0;
/// Of junctions of streets that have zebras, where no source tells.
constexpr double kZebraShare = 0.4;
constexpr double kStand_m = 2.5;
constexpr double kStandDepth_m = 5.0;
constexpr double kStandRows_m = 16.0;  ///< two rows of stands and the lane between them

std::uint64_t key_of(std::int32_t i, std::int32_t j) {
  return static_cast<std::uint64_t>(static_cast<std::uint32_t>(i)) << 32 |
         static_cast<std::uint32_t>(j);
}
std::int32_t cell_of(double at) { return static_cast<std::int32_t>(std::floor(at / kCell_m)); }

std::int32_t steps_of(double value_m) {
  return static_cast<std::int32_t>(std::lround(value_m / kHeightStep_m));
}
Eigen::Vector2i steps_of(const Vector2d& at) { return {steps_of(at.x()), steps_of(at.y())}; }

/// What meets a line at a junction.
struct Meeting {
  std::uint32_t line;
  double along_m;
  bool is_end;
  double half_width_m;
  int rank;
  Vector2d tangent;
};

std::vector<std::vector<Meeting>> meetings_of(const RoadNetwork& network) {
  std::vector<std::vector<Meeting>> meetings(network.junctions().size());
  for (std::uint32_t l = 0; l < network.lines().size(); ++l) {
    const Line& line = network.lines()[l];
    for (std::size_t s = 0; s <= line.spans.size(); ++s) {
      const bool is_last = s == line.spans.size();
      const Span& span = line.spans[is_last ? s - 1 : s];
      if (is_last && line.is_closed) continue;
      const std::uint32_t p = is_last ? span.last_point : span.first_point;
      const WayStyle& style = network.style(span);
      meetings[is_last ? span.to_junction : span.from_junction].push_back(
          {l, line.points[p].along_m, !line.is_closed && (s == 0 || is_last), style.half_width_m,
           style.rank, line.points[p].tangent});
    }
  }
  return meetings;
}

/// What is left of a part of a line without its gaps.
std::vector<std::pair<double, double>> between_gaps(
    double from_m, double to_m, const std::vector<std::pair<double, double>>& gaps) {
  std::vector<std::pair<double, double>> left;
  for (const auto& [gap_from_m, gap_to_m] : gaps) {
    if (gap_to_m <= from_m || gap_from_m >= to_m) continue;
    if (gap_from_m - from_m > 1.0) left.emplace_back(from_m, gap_from_m);
    from_m = gap_to_m;
  }
  if (to_m - from_m > 0.5) left.emplace_back(from_m, to_m);
  return left;
}

/// The points of a line from one place to another.
PointsWorld points_between(const Line& line, double from_m, double to_m) {
  PointsWorld points;
  const auto at = [&](std::size_t p, double along_m) {
    const Line::Point& a = line.points[p];
    const Line::Point& b = line.points[p + 1];
    const double t = (along_m - a.along_m) / std::max(b.along_m - a.along_m, 1e-9);
    return Vector2d(a.at_world + std::clamp(t, 0.0, 1.0) * (b.at_world - a.at_world));
  };
  const auto first = static_cast<std::size_t>(
      std::upper_bound(line.points.begin() + 1, line.points.end() - 1, from_m,
                       [](double m, const Line::Point& point) { return m < point.along_m; }) -
      line.points.begin());
  points.push_back(at(first - 1, from_m));
  std::size_t p = first;
  for (; p + 1 < line.points.size() && line.points[p].along_m < to_m; ++p)
    points.push_back(line.points[p].at_world);
  points.push_back(at(p - 1, to_m));
  return points;
}

bool is_busy_street(int rank) { return rank >= 32 && rank <= 70; }

}  // namespace

std::uint8_t runway_number(std::string_view ref, const Vector2d& direction) {
  double bearing_deg = std::atan2(direction.x(), direction.y()) * 180.0 / std::numbers::pi;
  if (bearing_deg < 0.0) bearing_deg += 360.0;
  const auto off = [&](int number) {
    const double apart = std::abs(10.0 * number - bearing_deg);
    return std::min(apart, 360.0 - apart);
  };
  int best = static_cast<int>(std::lround(bearing_deg / 10.0));
  if (best == 0) best = 36;
  double best_off = 45.0;
  std::size_t at = 0;
  while (at < ref.size()) {
    int number = 0;
    const auto [end, error] = std::from_chars(ref.data() + at, ref.data() + ref.size(), number);
    if (error != std::errc()) {
      ++at;
      continue;
    }
    at = static_cast<std::size_t>(end - ref.data());
    if (number >= 1 && number <= 36 && off(number) < best_off) {
      best = number;
      best_off = off(number);
    }
  }
  return static_cast<std::uint8_t>(best);
}

/// A part of a line whose marks go on, and of it what is painted at once.
struct RoadPaint::Run {
  const Line& line;
  const Way& way;
  double from_m;  ///< along the line
  double to_m;
  double part_from_m;  ///< where the marks begin to count
  double part_to_m;
  double unmarked_start_m;
  double unmarked_end_m;
  bool is_reversed;
};

void RoadPaint::add_strip(const Strip& like, const PointsWorld& points, double start_m,
                          int coarsest_level) {
  Strip strip = like;
  strip.start_m = start_m;
  const double half_m = strip.half_width_steps * kHeightStep_m;
  double along_m = start_m;
  const auto finish = [&] {
    if (strip.points_steps.size() < 2) return;
    Painted<Strip> painted{.coat = strip,
                           .lowest = Vector2d::Constant(1e300),
                           .highest = Vector2d::Constant(-1e300),
                           .coarsest_level = coarsest_level};
    for (const Eigen::Vector2i& steps : strip.points_steps) {
      const Vector2d at = steps.cast<double>() * kHeightStep_m;
      painted.lowest = painted.lowest.cwiseMin(at);
      painted.highest = painted.highest.cwiseMax(at);
    }
    painted.lowest.array() -= half_m;
    painted.highest.array() += half_m;
    strips_.push_back(std::move(painted));
  };
  for (const Vector2d& point : points) {
    const Eigen::Vector2i steps = steps_of(point);
    if (!strip.points_steps.empty()) {
      if (strip.points_steps.back() == steps) continue;
      along_m += (steps - strip.points_steps.back()).cast<double>().norm() * kHeightStep_m;
    }
    strip.points_steps.push_back(steps);
    if (strip.points_steps.size() == kMostPoints) {
      finish();
      strip.points_steps = {steps};
      strip.start_m = along_m;
    }
  }
  finish();
}

void RoadPaint::add_run(const Run& run) {
  const WayStyle& style = run.way.style;
  if (run.to_m - run.from_m < 0.2) return;
  PointsWorld points = points_between(run.line, run.from_m, run.to_m);
  const double whole_m = run.part_to_m - run.part_from_m;
  double start_m = run.from_m - run.part_from_m;
  double unmarked_start_m = run.unmarked_start_m;
  double unmarked_end_m = run.unmarked_end_m;
  // A hard shoulder is on the right of who drives, so the line runs with the way.
  if (run.is_reversed && style.marking == Marking::Motorway) {
    std::reverse(points.begin(), points.end());
    start_m = run.part_to_m - run.to_m;
    std::swap(unmarked_start_m, unmarked_end_m);
  }
  Strip strip;
  strip.coating = {.feature = run.way.feature,
                   .order = style.order,
                   .paving = style.paving,
                   .semantic_class = style.semantic_class};
  strip.marking = style.marking;
  if (style.marking == Marking::Lanes && style.num_lanes == 2 && !style.is_oneway &&
      style.half_width_m < 3.2)
    strip.marking = Marking::Center;
  strip.num_lanes = static_cast<std::uint8_t>(style.num_lanes);
  if (style.marking == Marking::Runway)
    strip.num_lanes = runway_number(run.way.ref, points.back() - points.front());
  strip.half_width_steps = steps_of(style.half_width_m);
  strip.whole_m = whole_m;
  strip.unmarked_start_m = unmarked_start_m;
  strip.unmarked_end_m = unmarked_end_m;
  add_strip(strip, points, start_m, style.coarsest_level);
  if (style.sidewalk_m > 0.0) {
    strip.coating.order = kSidewalkOrder;
    strip.coating.paving = world::Paving::Concrete;
    strip.coating.semantic_class = core::SemanticClass::Path;
    strip.marking = Marking::None;
    strip.num_lanes = 1;
    strip.half_width_steps = steps_of(style.half_width_m + style.sidewalk_m);
    add_strip(strip, points, start_m, 2);
  }
}

void RoadPaint::add_network(const RoadNetwork& network, const Gaps& gaps) {
  const auto meetings = meetings_of(network);
  for (std::uint32_t l = 0; l < network.lines().size(); ++l) {
    const Line& line = network.lines()[l];
    const auto is_painted = [&](const Span& span) {
      const WayStyle& style = network.style(span);
      return !style.is_bridge && !style.is_tunnel;
    };
    // Where another way's edge is met at a junction: its half width by the angle.
    const auto edge_of_others = [&](std::uint32_t junction, const Vector2d& tangent,
                                    bool through_only, double& most_rank) {
      double edge_m = 0.0;
      for (const Meeting& meeting : meetings[junction]) {
        if (meeting.line == l || (through_only && meeting.is_end)) continue;
        const double sine =
            std::abs(tangent.x() * meeting.tangent.y() - tangent.y() * meeting.tangent.x());
        edge_m =
            std::max(edge_m, std::min(meeting.half_width_m / std::max(sine, 0.3), kMostTrim_m));
        most_rank = std::max(most_rank, static_cast<double>(meeting.rank));
      }
      return edge_m;
    };
    // Parts: marks begin anew at crossings, and where they change.
    std::size_t s = 0;
    while (s < line.spans.size()) {
      if (!is_painted(line.spans[s])) {
        ++s;
        continue;
      }
      const WayStyle& style = network.style(line.spans[s]);
      const bool is_strict = style.use == WayUse::Airfield;
      std::size_t last = s;
      while (last + 1 < line.spans.size()) {
        const Span& next = line.spans[last + 1];
        const WayStyle& there = network.style(next);
        if (!is_painted(next) || there.marking != style.marking || there.rank != style.rank ||
            there.num_lanes != style.num_lanes)
          break;
        double rank = 0.0;
        edge_of_others(next.from_junction, line.points[next.first_point].tangent, true, rank);
        if (!is_strict && style.use == WayUse::Road && rank >= 32.0) break;
        ++last;
      }
      const Span& first_span = line.spans[s];
      const Span& last_span = line.spans[last];
      const double part_from_m = line.points[first_span.first_point].along_m;
      const double part_to_m = line.points[last_span.last_point].along_m;
      double trim_from_m = 0.0;
      double trim_to_m = 0.0;
      double unmarked_start_m = 0.0;
      double unmarked_end_m = 0.0;
      if (style.use == WayUse::Road) {
        double rank = 0.0;
        const double most_m = 0.4 * (part_to_m - part_from_m);
        const auto& from_tangent = line.points[first_span.first_point].tangent;
        const auto& to_tangent = line.points[last_span.last_point].tangent;
        if (s == 0 && !line.is_closed)
          trim_from_m = std::min(
              0.9 * edge_of_others(first_span.from_junction, from_tangent, true, rank), most_m);
        if (last + 1 == line.spans.size() && !line.is_closed)
          trim_to_m =
              std::min(0.9 * edge_of_others(last_span.to_junction, to_tangent, true, rank), most_m);
        const double start_edge_m =
            edge_of_others(first_span.from_junction, from_tangent, false, rank);
        const double end_edge_m = edge_of_others(last_span.to_junction, to_tangent, false, rank);
        if (start_edge_m > 0.0) unmarked_start_m = start_edge_m + kUnmarked_m;
        if (end_edge_m > 0.0) unmarked_end_m = end_edge_m + kUnmarked_m;
      }
      // Of each part the spans of one way, as far as they are dry.
      for (std::size_t begin = s; begin <= last;) {
        std::size_t end = begin;
        while (end < last && line.spans[end + 1].way == line.spans[begin].way) ++end;
        const Way& way = network.ways()[line.spans[begin].way];
        for (const auto& [from_m, to_m] :
             between_gaps(line.points[line.spans[begin].first_point].along_m,
                          line.points[line.spans[end].last_point].along_m, gaps[l]))
          add_run({.line = line,
                   .way = way,
                   .from_m = std::max(from_m, part_from_m + trim_from_m),
                   .to_m = std::min(to_m, part_to_m - trim_to_m),
                   .part_from_m = part_from_m,
                   .part_to_m = part_to_m,
                   .unmarked_start_m = unmarked_start_m,
                   .unmarked_end_m = unmarked_end_m,
                   .is_reversed = line.spans[begin].is_reversed});
        begin = end + 1;
      }
      s = last + 1;
    }
  }
}

void RoadPaint::add_zebra(const RoadNetwork& network, const Line& line, std::uint32_t point,
                          const Span& span, const Vector2d& at_world, std::uint64_t feature) {
  const WayStyle& style = network.style(span);
  const Vector2d tangent = line.points[point].tangent;
  const Vector2d left(-tangent.y(), tangent.x());
  // Bars lie along the road, within its paving: whole ones, half a bar from the edge.
  const double half_m = std::max(1.0, std::floor(style.half_width_m - 0.25));
  Strip strip;
  strip.coating = {.feature = feature,
                   .order = kCrossingOrder,
                   .paving = style.paving,
                   .semantic_class = style.semantic_class};
  strip.marking = Marking::Crossing;
  strip.half_width_steps = steps_of(kZebraHalf_m);
  // Strips end round; there are no bars on their ends.
  constexpr double kEnd_m = 0.3;
  const double reach_m = half_m + kEnd_m;
  strip.whole_m = 2.0 * reach_m;
  strip.unmarked_start_m = strip.unmarked_end_m = kEnd_m;
  add_strip(strip, {at_world - reach_m * left, at_world + reach_m * left}, 0.0, 1);
  ++num_crossings_;
}

void RoadPaint::add_crossings(const RoadNetwork& network,
                              const std::vector<FootCrossing>& crossings, std::uint64_t seed) {
  struct Place {
    std::uint32_t line;
    std::uint32_t span;
    std::uint32_t point;
  };
  if (!crossings.empty()) {
    constexpr double kNear_m = 16.0;
    const auto cell = [](double at) { return static_cast<std::int32_t>(std::floor(at / kNear_m)); };
    std::unordered_map<std::uint64_t, std::vector<Place>> cells;
    for (std::uint32_t l = 0; l < network.lines().size(); ++l)
      for (std::uint32_t s = 0; s < network.lines()[l].spans.size(); ++s) {
        const Span& span = network.lines()[l].spans[s];
        const WayStyle& style = network.style(span);
        if (style.use != WayUse::Road || style.is_bridge || style.is_tunnel || style.rank > 75 ||
            style.rank < 25)
          continue;
        for (std::uint32_t p = span.first_point; p < span.last_point; ++p) {
          const Vector2d& at = network.lines()[l].points[p].at_world;
          cells[key_of(cell(at.x()), cell(at.y()))].push_back({l, s, p});
        }
      }
    for (const FootCrossing& crossing : crossings) {
      double nearest_m = kCrossingNear_m;
      const Place* best = nullptr;
      Vector2d foot = crossing.at_world;
      for (std::int32_t j = -1; j <= 1; ++j)
        for (std::int32_t i = -1; i <= 1; ++i) {
          const auto found =
              cells.find(key_of(cell(crossing.at_world.x()) + i, cell(crossing.at_world.y()) + j));
          if (found == cells.end()) continue;
          for (const Place& place : found->second) {
            const auto& points = network.lines()[place.line].points;
            const Vector2d a = points[place.point].at_world;
            const Vector2d step = points[place.point + 1].at_world - a;
            const double t = std::clamp(
                (crossing.at_world - a).dot(step) / std::max(step.squaredNorm(), 1e-9), 0.0, 1.0);
            const double distance_m = (a + t * step - crossing.at_world).norm();
            if (distance_m >= nearest_m) continue;
            nearest_m = distance_m;
            best = &place;
            foot = a + t * step;
          }
        }
      if (best == nullptr) continue;
      const Line& line = network.lines()[best->line];
      add_zebra(network, line, best->point, line.spans[best->span], foot, crossing.feature);
    }
    return;
  }
  // None is known: on arms of junctions of streets.
  const auto meetings = meetings_of(network);
  for (std::uint32_t l = 0; l < network.lines().size(); ++l) {
    const Line& line = network.lines()[l];
    for (const Span& span : line.spans) {
      const WayStyle& style = network.style(span);
      if (style.use != WayUse::Road || !is_busy_street(style.rank) || style.is_bridge ||
          style.is_tunnel || style.sidewalk_m == 0.0)
        continue;
      const double from_m = line.points[span.first_point].along_m;
      const double to_m = line.points[span.last_point].along_m;
      for (const bool is_start : {true, false}) {
        const std::uint32_t junction = is_start ? span.from_junction : span.to_junction;
        double edge_m = 0.0;
        for (const Meeting& meeting : meetings[junction])
          if (meeting.line != l && is_busy_street(meeting.rank))
            edge_m = std::max(edge_m, meeting.half_width_m);
        if (edge_m == 0.0 || to_m - from_m < 2.0 * edge_m + 16.0) continue;
        const std::uint64_t feature = network.ways()[span.way].feature;
        if (core::random_unit(seed, feature, 2 * span.first_point + (is_start ? 1 : 0)) >
            kZebraShare)
          continue;
        const double at_m = is_start ? from_m + edge_m + 4.0 : to_m - edge_m - 4.0;
        const PointsWorld place = points_between(line, at_m, at_m + 0.1);
        const auto point = static_cast<std::uint32_t>(
            std::upper_bound(line.points.begin(), line.points.end(), at_m,
                             [](double m, const Line::Point& p) { return m < p.along_m; }) -
            line.points.begin() - 1);
        add_zebra(network, line, point, span, place.front(), feature);
      }
    }
  }
}

void RoadPaint::add_areas(const std::vector<PaintedArea>& areas, const IsWater& is_water) {
  for (const PaintedArea& area : areas) {
    world::Area coat;
    coat.coating = {.feature = area.feature,
                    .order = area.style.order,
                    .paving = area.style.paving,
                    .semantic_class = area.style.semantic_class};
    Painted<world::Area> painted{.coat = {},
                                 .lowest = Vector2d::Constant(1e300),
                                 .highest = Vector2d::Constant(-1e300),
                                 .coarsest_level = area.style.coarsest_level};
    for (const PointsWorld& ring : area.rings_world) {
      std::vector<Eigen::Vector2i> steps;
      for (const Vector2d& at : ring) {
        if (steps.empty() || steps.back() != steps_of(at)) steps.push_back(steps_of(at));
        painted.lowest = painted.lowest.cwiseMin(at);
        painted.highest = painted.highest.cwiseMax(at);
      }
      if (steps.size() >= 3) coat.rings_steps.push_back(std::move(steps));
    }
    if (coat.rings_steps.empty()) continue;
    painted.coat = std::move(coat);
    areas_.push_back(std::move(painted));
    if (area.style.has_stands) add_stands(area, is_water);
  }
}

void RoadPaint::add_stands(const PaintedArea& area, const IsWater& is_water) {
  // Rows along the longest side, as far apart as two rows and a lane take, where all of it is inside and dry: areas
  // beside a harbour are drawn over its water.
  const PointsWorld& ring = area.rings_world.front();
  Vector2d direction(1.0, 0.0);
  double longest_m = 0.0;
  for (std::size_t i = 0; i < ring.size(); ++i) {
    const Vector2d edge = ring[(i + 1) % ring.size()] - ring[i];
    if (edge.norm() > longest_m) {
      longest_m = edge.norm();
      direction = edge / longest_m;
    }
  }
  if (longest_m < 2.0 * kStand_m) return;
  const Vector2d left(-direction.y(), direction.x());
  Vector2d low = Vector2d::Constant(1e300);
  Vector2d high = Vector2d::Constant(-1e300);
  for (const Vector2d& at : ring) {
    const Vector2d own(at.dot(direction), at.dot(left));
    low = low.cwiseMin(own);
    high = high.cwiseMax(own);
  }
  const Vector2d size = high - low;
  if (size.x() * size.y() > 4e5 || size.x() > 2000.0) return;
  if (size.y() < kStandDepth_m) return;
  // Middles of rows across.
  std::vector<double> rows_m;
  const int num_pairs = static_cast<int>(std::floor(size.y() / kStandRows_m));
  const double first_m = low.y() + 0.5 * (size.y() - num_pairs * kStandRows_m);
  for (int k = 0; k < num_pairs; ++k) {
    rows_m.push_back(first_m + k * kStandRows_m + 0.5 * kStandDepth_m);
    rows_m.push_back(first_m + (k + 1) * kStandRows_m - 0.5 * kStandDepth_m);
  }
  if (num_pairs == 0) rows_m.push_back(low.y() + 0.5 * kStandDepth_m + 0.3);
  Strip strip;
  strip.coating = {.feature = area.feature,
                   .order = kStandsOrder,
                   .paving = area.style.paving,
                   .semantic_class = area.style.semantic_class};
  strip.marking = Marking::Stands;
  strip.half_width_steps = steps_of(0.5 * kStandDepth_m);
  strip.unmarked_start_m = strip.unmarked_end_m = 0.0;
  for (const double across_m : rows_m) {
    const auto is_inside = [&](double along_m) {
      for (const double off : {-0.5, 0.0, 0.5}) {
        const Vector2d at = along_m * direction + (across_m + off * (kStandDepth_m - 0.1)) * left;
        if (!side_of_rings(area.rings_world, at).is_inside || is_water(at)) return false;
      }
      return true;
    };
    double from_m = 0.0;
    int num = 0;
    const auto finish = [&] {
      // The round ends of the strip lie inside too; lines keep away from them.
      constexpr double kEnd_m = 1.0;
      if (num >= 6) {
        const double length_m = (num - 4) * kStand_m;
        const double begin_m = from_m + 1.5 * kStand_m - kEnd_m;
        const double end_m = begin_m + length_m + 2.0 * kEnd_m;
        strip.whole_m = end_m - begin_m;
        strip.unmarked_start_m = kEnd_m;
        strip.unmarked_end_m = kEnd_m - 0.13;  // behind the last line
        add_strip(strip,
                  {begin_m * direction + across_m * left, end_m * direction + across_m * left}, 0.0,
                  1);
      }
      num = 0;
    };
    for (double along_m = low.x() + 1.0; along_m < high.x(); along_m += kStand_m) {
      if (is_inside(along_m)) {
        if (num == 0) from_m = along_m;
        ++num;
      } else {
        finish();
      }
    }
    finish();
  }
}

void RoadPaint::index() {
  const auto put = [](const auto& painted, auto& cells) {
    for (std::uint32_t k = 0; k < painted.size(); ++k)
      for (std::int32_t j = cell_of(painted[k].lowest.y()); j <= cell_of(painted[k].highest.y());
           ++j)
        for (std::int32_t i = cell_of(painted[k].lowest.x()); i <= cell_of(painted[k].highest.x());
             ++i)
          cells[key_of(i, j)].push_back(k);
  };
  put(strips_, strip_cells_);
  put(areas_, area_cells_);
}

void RoadPaint::add_to(const world::TileId& id, world::TileObjects& objects) const {
  const Vector2d low = id.corner_world();
  const Vector2d high = low.array() + id.side_m();
  const auto collect = [&](const auto& painted, const auto& cells, auto& out) {
    std::vector<std::uint32_t> found;
    if (id.side_m() > 16.0 * kCell_m) {
      for (std::uint32_t k = 0; k < painted.size(); ++k) found.push_back(k);
    } else {
      for (std::int32_t j = cell_of(low.y()); j <= cell_of(high.y()); ++j)
        for (std::int32_t i = cell_of(low.x()); i <= cell_of(high.x()); ++i) {
          const auto there = cells.find(key_of(i, j));
          if (there != cells.end())
            found.insert(found.end(), there->second.begin(), there->second.end());
        }
      std::sort(found.begin(), found.end());
      found.erase(std::unique(found.begin(), found.end()), found.end());
    }
    for (const std::uint32_t k : found)
      if (id.level <= painted[k].coarsest_level &&
          (painted[k].lowest.array() <= high.array()).all() &&
          (painted[k].highest.array() >= low.array()).all())
        out.push_back(painted[k].coat);
  };
  collect(strips_, strip_cells_, objects.strips);
  collect(areas_, area_cells_, objects.areas);
}

}  // namespace terracast::tiler
