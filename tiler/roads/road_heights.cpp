#include "tiler/roads/road_heights.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>
#include <unordered_map>

#include "core/parallel.h"
#include "core/random.h"

namespace terracast::tiler {
namespace {

using Eigen::Vector2d;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// What a line is planned with of its class's grade: rounding off and heights' lattice take the rest.
constexpr double kPlannedShare = 0.98;
/// Where a way ends among others it is not steeper than this, so that they meet at one height all over.
constexpr double kJunctionGrade = 0.06;
/// Banks between ways that are near each other rise so much.
constexpr double kBankSlope = 2.0 / 3.0;
/// Ways so near to each other's shoulders are kept to that.
constexpr double kNear_m = 6.0;
constexpr int kSmoothRounds = 160;
constexpr double kNominalStation_m = 8.0;
/// Water below a bridge that is not told to be higher.
constexpr double kWaterClearance_m = 1.5;
constexpr int kBridgeRounds = 4;
/// Ways rise to bridges, and are apart from what these cross, over no more than this.
constexpr double kRamp_m = 160.0;
/// Decks that are raised fall no more from where they must be highest.
constexpr double kDeckGrade = 0.025;

std::int64_t cell_key(double x, double y, double cell_m) {
  const auto i = static_cast<std::int64_t>(std::floor(x / cell_m));
  const auto j = static_cast<std::int64_t>(std::floor(y / cell_m));
  return i * 0x100000000LL + j;
}

double reach_of(const WayStyle& style) { return style.half_width_m + style.shoulder_m; }

bool is_off_ground(const WayStyle& style) { return style.is_bridge || style.is_tunnel; }

}  // namespace

RoadHeights::RoadHeights(const RoadNetwork& network, const RoadGroundFunction& ground) {
  crossings_ = bridge_crossings(network);
  follow_ground(network, ground);
  add_limits(network);
  couple(network);
  smooth(network, kSmoothRounds);
  bound_grades();
  smooth(network, 6);
  bound_grades();
  raise_bridges(network);
}

void RoadHeights::follow_ground(const RoadNetwork& network, const RoadGroundFunction& ground) {
  const auto& stations = network.stations();
  const std::size_t count = stations.size();
  grounds_.resize(count);
  core::parallel_for_blocks(
      static_cast<std::int64_t>(count), 256, [&](std::int64_t begin, std::int64_t end) {
        for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i)
          grounds_[i] = ground(stations[i].at_world);
      });
  is_free_.assign(count, 1);
  for (const Link& link : network.links())
    if (!is_off_ground(network.ways()[link.way].style)) is_free_[link.from] = is_free_[link.to] = 0;
  levels_m_.resize(count);
  for (std::size_t i = 0; i < count; ++i) levels_m_[i] = grounds_[i].level_m;

  // Bridges and tunnels begin straight from end to end.
  for (const Line& line : network.lines()) {
    const auto& spans = line.spans;
    for (std::size_t k = 0; k < spans.size();) {
      if (!is_off_ground(network.style(spans[k]))) {
        ++k;
        continue;
      }
      std::size_t last = k;
      while (last + 1 < spans.size() && is_off_ground(network.style(spans[last + 1]))) ++last;
      const Line::Point& a = line.points[spans[k].first_point];
      const Line::Point& b = line.points[spans[last].last_point];
      const double from_m = level_m(a);
      const double to_m = level_m(b);
      for (std::uint32_t p = spans[k].first_point; p <= spans[last].last_point; ++p) {
        const Line::Point& point = line.points[p];
        const double share = (point.along_m - a.along_m) / std::max(b.along_m - a.along_m, 1e-6);
        const double straight_m = from_m + share * (to_m - from_m);
        if (point.share == 0.0 && is_free_[point.station] != 0)
          levels_m_[point.station] = straight_m;
        if (point.share == 1.0 && is_free_[point.next_station] != 0)
          levels_m_[point.next_station] = straight_m;
      }
      k = last + 1;
    }
  }
}

void RoadHeights::add_limits(const RoadNetwork& network) {
  limits_.assign(levels_m_.size(), {});
  for (const Link& link : network.links()) {
    const WayStyle& style = network.ways()[link.way].style;
    double grade = kPlannedShare * style.max_grade;
    if (link.is_at_junction) grade = std::min(grade, kJunctionGrade);
    const double most_m = grade * link.length_m;
    limits_[link.from].push_back({link.to, most_m});
    limits_[link.to].push_back({link.from, most_m});
  }
}

void RoadHeights::couple(const RoadNetwork& network) {
  struct Mark {
    std::uint32_t station;
    double reach_m;
    double grade;
    Vector2d direction = Vector2d::Zero();
    std::uint32_t line;
    double along_m;
    int level;
  };
  // Of each station on the ground the widest way that passes.
  std::vector<Mark> marks(levels_m_.size(), {0, -1.0, 0.0, Vector2d::Zero(), 0, 0.0, 0});
  double widest_m = 0.0;
  for (std::uint32_t l = 0; l < network.lines().size(); ++l) {
    const Line& line = network.lines()[l];
    for (const Span& span : line.spans) {
      const WayStyle& style = network.style(span);
      if (is_off_ground(style) || !style.is_shaped) continue;
      for (std::uint32_t p = span.first_point; p <= span.last_point; ++p) {
        const Line::Point& point = line.points[p];
        if (point.share != 0.0 && point.share != 1.0) continue;
        const std::uint32_t station = point.share == 0.0 ? point.station : point.next_station;
        if (marks[station].reach_m >= reach_of(style)) continue;
        marks[station] = {station, reach_of(style), style.max_grade, point.tangent,
                          l,       point.along_m,   style.level};
        widest_m = std::max(widest_m, std::min(reach_of(style), 40.0));
      }
    }
  }
  // Bridges with the ways that lead to them lie above what they cross; where abutments end there are walls.
  std::unordered_map<std::uint32_t, std::vector<const BridgeCrossing*>> over;
  for (const BridgeCrossing& crossing : crossings_) over[crossing.line_below].push_back(&crossing);
  const auto is_over = [&](const Mark& above, const Mark& below) {
    const auto found = over.find(below.line);
    if (found == over.end() || above.line == below.line) return false;
    const Vector2d& at = network.stations()[above.station].at_world;
    return std::any_of(found->second.begin(), found->second.end(), [&](const auto* crossing) {
      const Line& line = network.lines()[crossing->line_above];
      const Span& span = line.spans[crossing->span_above];
      const double bridge_m =
          line.points[span.last_point].along_m - line.points[span.first_point].along_m;
      return (at - crossing->at_world).norm() < bridge_m + kRamp_m &&
             std::abs(below.along_m - crossing->along_below_m) < bridge_m + kRamp_m;
    });
  };
  const double cell_m = 2.0 * widest_m + kNear_m + 1.0;
  std::unordered_map<std::int64_t, std::vector<std::uint32_t>> cells;
  for (const Mark& mark : marks)
    if (mark.reach_m >= 0.0) {
      const Vector2d& at = network.stations()[mark.station].at_world;
      cells[cell_key(at.x(), at.y(), cell_m)].push_back(mark.station);
    }
  for (const Mark& mark : marks) {
    if (mark.reach_m < 0.0) continue;
    const Vector2d& at = network.stations()[mark.station].at_world;
    for (int dy = -1; dy <= 1; ++dy)
      for (int dx = -1; dx <= 1; ++dx) {
        const auto found = cells.find(cell_key(at.x() + dx * cell_m, at.y() + dy * cell_m, cell_m));
        if (found == cells.end()) continue;
        for (const std::uint32_t other : found->second) {
          if (other <= mark.station) continue;
          const Mark& beside = marks[other];
          if (beside.level != mark.level) continue;
          if (beside.line == mark.line && std::abs(beside.along_m - mark.along_m) < 40.0) continue;
          if (is_over(mark, beside) || is_over(beside, mark)) continue;
          const Vector2d apart = network.stations()[other].at_world - at;
          const double on_m = std::abs(apart.dot(mark.direction));
          const double distance_m = apart.norm();
          const double gap_m =
              distance_m - std::min(mark.reach_m, 40.0) - std::min(beside.reach_m, 40.0);
          if (gap_m > kNear_m || on_m > 8.0) continue;
          const double most_m =
              kBankSlope * std::max(gap_m, 0.0) + std::min(mark.grade, beside.grade) * on_m + 0.02;
          limits_[mark.station].push_back({other, most_m});
          limits_[other].push_back({mark.station, most_m});
        }
      }
  }
}

void RoadHeights::smooth(const RoadNetwork& network, int num_rounds) {
  // Diffusion: after n rounds of share k the ground is averaged over sqrt(2 k n) links.
  const std::size_t count = levels_m_.size();
  std::vector<double> share(count, 0.5);
  std::vector<double> weight(count, 0.0);
  for (const Link& link : network.links()) {
    const double links = network.ways()[link.way].style.smooth_m / kNominalStation_m;
    const double wanted = std::min(0.5, links * links / (2.0 * kSmoothRounds));
    for (const std::uint32_t end : {link.from, link.to}) share[end] = std::min(share[end], wanted);
    const double by_length = 1.0 / std::max(link.length_m, 0.5);
    weight[link.from] += by_length;
    weight[link.to] += by_length;
  }
  std::vector<double> sum(count);
  for (int round = 0; round < num_rounds; ++round) {
    std::fill(sum.begin(), sum.end(), 0.0);
    for (const Link& link : network.links()) {
      const double by_length = 1.0 / std::max(link.length_m, 0.5);
      sum[link.from] += by_length * levels_m_[link.to];
      sum[link.to] += by_length * levels_m_[link.from];
    }
    for (std::size_t i = 0; i < count; ++i)
      if (weight[i] > 0.0) levels_m_[i] += share[i] * (sum[i] / weight[i] - levels_m_[i]);
  }
}

std::vector<double> RoadHeights::spread_up(std::vector<double> least_m) const {
  using Entry = std::pair<double, std::uint32_t>;
  std::priority_queue<Entry> queue;  // the highest first
  for (std::uint32_t i = 0; i < least_m.size(); ++i)
    if (least_m[i] > -kInfinity) queue.push({least_m[i], i});
  while (!queue.empty()) {
    const auto [level_m, at] = queue.top();
    queue.pop();
    if (level_m < least_m[at]) continue;
    for (const Limit& limit : limits_[at]) {
      const double there_m = level_m - limit.most_m;
      if (there_m > least_m[limit.to]) {
        least_m[limit.to] = there_m;
        queue.push({there_m, limit.to});
      }
    }
  }
  return least_m;
}

void RoadHeights::bound_grades() {
  // The least function within the limits that is nowhere below the wanted one, and the greatest nowhere
  // above it; so is their mean.
  std::vector<double> lower(levels_m_.size());
  for (std::size_t i = 0; i < levels_m_.size(); ++i) lower[i] = -levels_m_[i];
  const std::vector<double> above = spread_up(levels_m_);
  lower = spread_up(std::move(lower));
  for (std::size_t i = 0; i < levels_m_.size(); ++i) levels_m_[i] = 0.5 * (above[i] - lower[i]);
}

bool RoadHeights::may_part(std::uint32_t above, std::uint32_t below, double by_m) const {
  using Entry = std::pair<double, std::uint32_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;  // the nearest first
  std::unordered_map<std::uint32_t, double> nearest_m = {{above, 0.0}};
  queue.push({0.0, above});
  while (!queue.empty()) {
    const auto [far_m, at] = queue.top();
    queue.pop();
    if (at == below) return false;
    if (far_m > nearest_m.at(at)) continue;
    for (const Limit& limit : limits_[at]) {
      const double there_m = far_m + limit.most_m;
      if (there_m >= by_m) continue;
      const auto [known, is_new] = nearest_m.try_emplace(limit.to, there_m);
      if (!is_new && known->second <= there_m) continue;
      known->second = there_m;
      queue.push({there_m, limit.to});
    }
  }
  return true;
}

void RoadHeights::raise_bridges(const RoadNetwork& network) {
  std::vector<std::pair<std::uint32_t, double>> over_water;  // stations, and their least levels
  for (const Line& line : network.lines())
    for (const Span& span : line.spans) {
      if (!network.style(span).is_bridge) continue;
      for (std::uint32_t p = span.first_point + 1; p < span.last_point; ++p)
        if (const Line::Point& at = line.points[p];
            at.share == 0.0 && grounds_[at.station].is_water)
          over_water.emplace_back(at.station, grounds_[at.station].level_m + kWaterClearance_m +
                                                  deck_m(network.style(span)));
    }
  // Ways that the limits tie together would be raised by turns for ever.
  std::vector<const BridgeCrossing*> raised;
  for (const BridgeCrossing& crossing : crossings_)
    if (may_part(network.lines()[crossing.line_above].points[crossing.point_above].station,
                 network.lines()[crossing.line_below].points[crossing.point_below].station,
                 crossing.wanted_m))
      raised.push_back(&crossing);
  const auto measure = [&] {
    for (BridgeCrossing& crossing : crossings_)
      crossing.room_m = level_between_m(network.lines()[crossing.line_above], crossing.point_above,
                                        crossing.share_above) -
                        level_between_m(network.lines()[crossing.line_below], crossing.point_below,
                                        crossing.share_below);
  };
  for (int round = 0; round < kBridgeRounds; ++round) {
    std::vector<double> least(levels_m_.size(), -kInfinity);
    const auto raise = [&](std::uint32_t station, double to_m) {
      if (levels_m_[station] < to_m) least[station] = std::max(least[station], to_m);
    };
    for (const auto& [station, least_m] : over_water) raise(station, least_m);
    measure();
    for (const BridgeCrossing* of_raised : raised) {
      const BridgeCrossing& crossing = *of_raised;
      if (crossing.room_m >= crossing.wanted_m - 1e-3) continue;
      const Line& line = network.lines()[crossing.line_above];
      const Span& span = line.spans[crossing.span_above];
      const double needed_m = level_between_m(line, crossing.point_above, crossing.share_above) +
                              crossing.wanted_m - crossing.room_m;
      // The whole deck, so that it does not bend where it crosses.
      for (std::uint32_t p = span.first_point; p <= span.last_point; ++p) {
        const Line::Point& point = line.points[p];
        const double to_m =
            needed_m +
            kDeckGrade * (kNominalStation_m - std::abs(point.along_m - crossing.along_above_m));
        if (point.share == 0.0) raise(point.station, to_m);
        if (point.share == 1.0) raise(point.next_station, to_m);
      }
    }
    if (std::all_of(least.begin(), least.end(), [](double level) { return level == -kInfinity; }))
      break;
    least = spread_up(std::move(least));
    for (std::size_t i = 0; i < levels_m_.size(); ++i)
      levels_m_[i] = std::max(levels_m_[i], least[i]);
  }
  measure();
}

}  // namespace terracast::tiler
