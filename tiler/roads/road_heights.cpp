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

void RoadHeights::raise_bridges(const RoadNetwork& network) {
  // Where bridges cross what lies below.
  struct Piece {
    std::uint32_t line;
    std::uint32_t point;
    std::uint32_t way;
  };
  constexpr double kCell_m = 32.0;
  std::unordered_map<std::int64_t, std::vector<Piece>> cells;
  const auto visit_cells = [&](const Vector2d& a, const Vector2d& b, const auto& visit) {
    const Vector2d low = a.cwiseMin(b);
    const Vector2d high = a.cwiseMax(b);
    for (double y = std::floor(low.y() / kCell_m); y <= std::floor(high.y() / kCell_m); y += 1.0)
      for (double x = std::floor(low.x() / kCell_m); x <= std::floor(high.x() / kCell_m); x += 1.0)
        visit(cell_key((x + 0.5) * kCell_m, (y + 0.5) * kCell_m, kCell_m));
  };
  bool has_bridges = false;
  for (std::uint32_t l = 0; l < network.lines().size(); ++l)
    for (const Span& span : network.lines()[l].spans) {
      has_bridges = has_bridges || network.style(span).is_bridge;
      if (network.style(span).is_tunnel) continue;
      for (std::uint32_t p = span.first_point; p < span.last_point; ++p) {
        const auto& points = network.lines()[l].points;
        visit_cells(points[p].at_world, points[p + 1].at_world, [&](std::int64_t key) {
          cells[key].push_back({l, p, span.way});
        });
      }
    }
  if (!has_bridges) return;

  struct Crossing {
    const Line::Point* above;  ///< the bridge's piece begins here
    double above_share;
    const Line::Point* below;
    double below_share;
    double room_m;  ///< from the lower way to the bridge's own
    const Line* line;
    const Span* span;
    double along_m;
  };
  std::vector<Crossing> crossings;
  std::vector<Clearance> fixed;
  for (std::uint32_t l = 0; l < network.lines().size(); ++l) {
    const Line& line = network.lines()[l];
    for (const Span& span : line.spans) {
      const WayStyle& style = network.style(span);
      if (!style.is_bridge) continue;
      const double deck = deck_m(style);
      for (std::uint32_t p = span.first_point; p < span.last_point; ++p) {
        const Line::Point& a = line.points[p];
        const Line::Point& b = line.points[p + 1];
        if (p > span.first_point && grounds_[a.station].is_water && a.share == 0.0)
          fixed.push_back({a.station, grounds_[a.station].level_m + kWaterClearance_m + deck});
        std::vector<Piece> near;
        visit_cells(a.at_world, b.at_world, [&](std::int64_t key) {
          const auto& there = cells[key];
          near.insert(near.end(), there.begin(), there.end());
        });
        std::sort(near.begin(), near.end(), [](const Piece& x, const Piece& y) {
          return std::pair(x.line, x.point) < std::pair(y.line, y.point);
        });
        for (std::size_t k = 0; k < near.size(); ++k) {
          const Piece& piece = near[k];
          if (k > 0 && near[k - 1].line == piece.line && near[k - 1].point == piece.point) continue;
          const WayStyle& other = network.ways()[piece.way].style;
          if (other.is_bridge && other.level >= style.level) continue;
          const Line::Point& c = network.lines()[piece.line].points[piece.point];
          const Line::Point& d = network.lines()[piece.line].points[piece.point + 1];
          const Vector2d u = b.at_world - a.at_world;
          const Vector2d v = d.at_world - c.at_world;
          const double cross = u.x() * v.y() - u.y() * v.x();
          if (cross == 0.0) continue;
          const Vector2d w = c.at_world - a.at_world;
          const double t = (w.x() * v.y() - w.y() * v.x()) / cross;
          const double s = (w.x() * u.y() - w.y() * u.x()) / cross;
          if (t < 0.0 || t > 1.0 || s < 0.0 || s > 1.0) continue;
          // Ways that meet at the bridge's end do not cross it.
          const double from_start =
              a.along_m + t * (b.along_m - a.along_m) - line.points[span.first_point].along_m;
          const double from_end =
              line.points[span.last_point].along_m - a.along_m - t * (b.along_m - a.along_m);
          if (std::min(from_start, from_end) < 0.5) continue;
          // The lower way is as wide as it is.
          const double sine = std::abs(cross) / (u.norm() * v.norm());
          const double wide_m = kDeckGrade * other.half_width_m / std::max(sine, 0.3);
          crossings.push_back({&a, t, &c, s, other.clearance_m + deck + 0.2 + wide_m, &line, &span,
                               a.along_m + t * (b.along_m - a.along_m)});
        }
      }
    }
  }
  num_crossings_ = static_cast<std::int64_t>(crossings.size());
  const auto between = [&](const Line::Point* from, double share) {
    return (1.0 - share) * level_m(from[0]) + share * level_m(from[1]);
  };
  for (int round = 0; round < kBridgeRounds; ++round) {
    std::vector<double> least(levels_m_.size(), -kInfinity);
    const auto raise = [&](std::uint32_t station, double to_m) {
      if (levels_m_[station] < to_m) least[station] = std::max(least[station], to_m);
    };
    for (const Clearance& clearance : fixed) raise(clearance.station, clearance.least_m);
    for (const Crossing& crossing : crossings) {
      const double needed_m = between(crossing.below, crossing.below_share) + crossing.room_m;
      if (between(crossing.above, crossing.above_share) >= needed_m - 1e-3) continue;
      // The whole deck, so that it does not bend where it crosses.
      for (std::uint32_t p = crossing.span->first_point; p <= crossing.span->last_point; ++p) {
        const Line::Point& point = crossing.line->points[p];
        const double to_m = needed_m + kDeckGrade * (kNominalStation_m -
                                                     std::abs(point.along_m - crossing.along_m));
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
  for (const Crossing& crossing : crossings)
    if (between(crossing.above, crossing.above_share) <
        between(crossing.below, crossing.below_share) + crossing.room_m - 0.25)
      ++num_low_;
}

}  // namespace terracast::tiler
