#include "tiler/roads/road_network.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <tuple>
#include <unordered_map>

#include "core/hash.h"
#include "core/random.h"
#include "tiler/roads/sound_ways.h"
#include "tiler/roads/way_place.h"

namespace terracast::tiler {
namespace {

using Eigen::Vector2d;

/// Ways go straight on where they turn by less than this; two alone by less than the second.
constexpr double kStraightOn_rad = 1.05;
constexpr double kBendOn_rad = 2.1;
/// A corner is rounded by so many chords that each turns by no more.
constexpr double kChordTurn_rad = 0.12;
constexpr double kLargestRadius_m = 400.0;
/// Ends of lines among others are gentle over so much.
constexpr double kGentle_m = 8.0;

double turn_rad(const Vector2d& from, const Vector2d& to) {
  return std::atan2(std::abs(from.x() * to.y() - from.y() * to.x()), from.dot(to));
}

}  // namespace

/// Of a way, between two junctions.
struct RoadNetwork::Edge {
  std::uint32_t way;
  std::uint32_t from;
  std::uint32_t to;
  PointsWorld points;
};

/// Edges that go on from each other.
struct RoadNetwork::Chain {
  struct Step {
    std::uint32_t edge;
    bool is_reversed;
  };
  std::vector<Step> steps;
  bool is_closed = false;
};

RoadNetwork::RoadNetwork(std::vector<Way> ways, double half_size_m) {
  ways_ = sound_ways(std::move(ways), half_size_m, counts_);
  const std::vector<Edge> edges = split();
  for (const Chain& chain : join(edges)) make_line(chain, edges);
  for (Junction& junction : junctions_)  // make_line() counts them from 1
    if (junction.station > 0) --junction.station;
}

std::vector<RoadNetwork::Edge> RoadNetwork::split() {
  // How often lines come to a place; ends count twice.
  std::unordered_map<PlaceKey, int, PlaceKeyHash> visits;
  for (const Way& way : ways_)
    for (std::size_t i = 0; i < way.points_world.size(); ++i)
      visits[key_of(way.points_world[i])] += i == 0 || i + 1 == way.points_world.size() ? 2 : 1;
  std::unordered_map<PlaceKey, std::uint32_t, PlaceKeyHash> numbers;
  const auto junction_at = [&](const Vector2d& at) {
    const auto [found, is_new] =
        numbers.emplace(key_of(at), static_cast<std::uint32_t>(junctions_.size()));
    if (is_new) {
      const PlaceKey key = key_of(at);
      junctions_.push_back({.at_world = kSamePlace_m * Vector2d(static_cast<double>(key.x),
                                                                static_cast<double>(key.y))});
    }
    ++junctions_[found->second].num_ends;
    return found->second;
  };
  std::vector<Edge> edges;
  for (std::uint32_t w = 0; w < ways_.size(); ++w) {
    const PointsWorld& points = ways_[w].points_world;
    std::size_t begin = 0;
    for (std::size_t i = 1; i < points.size(); ++i) {
      if (i + 1 < points.size() && visits[key_of(points[i])] < 2) continue;
      Edge edge{.way = w, .from = 0, .to = 0, .points = {}};
      edge.points.assign(points.begin() + static_cast<std::ptrdiff_t>(begin),
                         points.begin() + static_cast<std::ptrdiff_t>(i) + 1);
      begin = i;
      edge.from = junction_at(edge.points.front());
      edge.to = junction_at(edge.points.back());
      edge.points.front() = junctions_[edge.from].at_world;
      edge.points.back() = junctions_[edge.to].at_world;
      edges.push_back(std::move(edge));
    }
  }
  return edges;
}

std::vector<RoadNetwork::Chain> RoadNetwork::join(const std::vector<Edge>& edges) {
  // Ends are numbered 2 e (from) and 2 e + 1 (to).
  constexpr std::uint32_t kNone = ~0U;
  std::vector<std::vector<std::uint32_t>> ends_of(junctions_.size());
  for (std::uint32_t e = 0; e < edges.size(); ++e) {
    ends_of[edges[e].from].push_back(2 * e);
    ends_of[edges[e].to].push_back(2 * e + 1);
  }
  const auto outward = [&](std::uint32_t end) {
    const PointsWorld& points = edges[end / 2].points;
    const Vector2d step =
        end % 2 == 0 ? points[1] - points[0] : points[points.size() - 2] - points.back();
    return Vector2d(step.normalized());
  };
  std::vector<std::uint32_t> partner(2 * edges.size(), kNone);
  for (const auto& ends : ends_of) {
    struct Pair {
      double badness;
      std::uint32_t a;
      std::uint32_t b;
    };
    std::vector<Pair> pairs;
    for (std::size_t i = 0; i < ends.size() && ends.size() <= 16; ++i)
      for (std::size_t j = i + 1; j < ends.size(); ++j) {
        const WayStyle& a = ways_[edges[ends[i] / 2].way].style;
        const WayStyle& b = ways_[edges[ends[j] / 2].way].style;
        if (a.use != b.use || a.is_shaped != b.is_shaped) continue;
        const double turn = turn_rad(outward(ends[i]), -outward(ends[j]));
        if (turn > (ends.size() == 2 ? kBendOn_rad : kStraightOn_rad)) continue;
        const int least_rank = std::min(a.rank, b.rank);
        pairs.push_back({turn + 0.02 * std::abs(a.rank - b.rank) - 0.05 * least_rank +
                             (a.is_oneway != b.is_oneway ? 0.2 : 0.0),
                         ends[i], ends[j]});
      }
    std::sort(pairs.begin(), pairs.end(), [](const Pair& p, const Pair& q) {
      return std::tuple(p.badness, p.a, p.b) < std::tuple(q.badness, q.a, q.b);
    });
    for (const Pair& pair : pairs)
      if (partner[pair.a] == kNone && partner[pair.b] == kNone) {
        partner[pair.a] = pair.b;
        partner[pair.b] = pair.a;
      }
  }
  std::vector<bool> is_taken(edges.size(), false);
  std::vector<Chain> chains;
  const auto walk = [&](std::uint32_t start, bool is_closed) {
    // Enters the edge by the end `start`.
    Chain chain;
    chain.is_closed = is_closed;
    std::uint32_t end = start;
    while (end != kNone && !is_taken[end / 2]) {
      is_taken[end / 2] = true;
      chain.steps.push_back({.edge = end / 2, .is_reversed = end % 2 == 1});
      end = partner[end ^ 1U];
    }
    chains.push_back(std::move(chain));
  };
  for (std::uint32_t end = 0; end < 2 * edges.size(); ++end)
    if (partner[end] == kNone && !is_taken[end / 2]) walk(end, false);
  for (std::uint32_t e = 0; e < edges.size(); ++e)
    if (!is_taken[e]) walk(2 * e, true);
  return chains;
}

namespace {

/// A corner of a line before it is rounded.
struct Corner {
  Vector2d at;
  int new_span = -1;      ///< the span that begins here
  bool is_fixed = false;  ///< others meet the line here
  double bend_m = 1.0;
};

/// A line's points, and where its spans begin.
struct Rounded {
  PointsWorld points;
  std::vector<std::size_t> begins;
};

Rounded round_corners(const std::vector<Corner>& corners) {
  Rounded out;
  const auto put = [&](const Vector2d& at) {
    if (out.points.empty() || (at - out.points.back()).norm() > kSamePlace_m)
      out.points.push_back(at);
  };
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Corner& corner = corners[i];
    const bool is_inner = i > 0 && i + 1 < corners.size();
    double turn = 0.0;
    Vector2d back = Vector2d::Zero();
    Vector2d on = Vector2d::Zero();
    double reach_m = 0.0;
    if (is_inner && !corner.is_fixed) {
      back = corners[i - 1].at - corner.at;
      on = corners[i + 1].at - corner.at;
      turn = turn_rad(-back, on);
      const double half_sine = std::sin(0.5 * turn);
      // The middle of the curve lies off the corner by half the reach times the sine of half the turn.
      reach_m = std::min(0.48 * std::min(back.norm(), on.norm()),
                         std::min(2.0 * corner.bend_m / std::max(half_sine, 0.05),
                                  kLargestRadius_m * std::tan(0.5 * std::min(turn, 2.5))));
      back.normalize();
      on.normalize();
    }
    if (turn < 0.05 || reach_m < 0.2) {
      put(corner.at);
      if (corner.new_span >= 0) out.begins.push_back(out.points.size() - 1);
      continue;
    }
    const int num = std::clamp(static_cast<int>(std::ceil(turn / kChordTurn_rad)), 2, 24) / 2 * 2;
    for (int k = 0; k <= num; ++k) {
      const double t = static_cast<double>(k) / num;
      put(corner.at + reach_m * ((1 - t) * (1 - t) * back + t * t * on));
      if (2 * k == num && corner.new_span >= 0) out.begins.push_back(out.points.size() - 1);
    }
  }
  return out;
}

}  // namespace

void RoadNetwork::make_line(const Chain& chain, const std::vector<Edge>& edges) {
  std::vector<Corner> corners;
  Line line;
  line.is_closed = chain.is_closed;
  for (std::size_t k = 0; k < chain.steps.size(); ++k) {
    const auto& step = chain.steps[k];
    const Edge& edge = edges[step.edge];
    Span span{.way = edge.way,
              .is_reversed = step.is_reversed,
              .from_junction = step.is_reversed ? edge.to : edge.from,
              .to_junction = step.is_reversed ? edge.from : edge.to};
    PointsWorld points = edge.points;
    if (step.is_reversed) std::reverse(points.begin(), points.end());
    const double bend_m = ways_[edge.way].style.bend_m;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const bool is_last_of_all = k + 1 == chain.steps.size() && i + 1 == points.size();
      if (i + 1 == points.size() && !is_last_of_all) continue;  // the next span's first
      Corner corner{.at = points[i], .bend_m = bend_m};
      if (i == 0) {
        corner.new_span = static_cast<int>(k);
        corner.is_fixed = junctions_[span.from_junction].num_ends > 2;
      }
      corners.push_back(corner);
    }
    line.spans.push_back(span);
  }
  const Rounded rounded = round_corners(corners);
  if (rounded.points.size() < 2 || rounded.begins.size() != line.spans.size()) return;

  const auto line_number = static_cast<std::uint32_t>(lines_.size());
  double along_m = 0.0;
  const auto station_of = [&](std::uint32_t junction, const Vector2d& at, double at_m) {
    Junction& place = junctions_[junction];
    if (place.station == 0) {
      if (place.num_ends <= 2) place.at_world = at;
      stations_.push_back({.at_world = place.at_world, .line = line_number, .along_m = at_m});
      place.station = static_cast<std::uint32_t>(stations_.size());
    }
    return place.station - 1;
  };
  std::vector<Span> kept;
  for (std::size_t k = 0; k < line.spans.size(); ++k) {
    Span span = line.spans[k];
    const std::size_t first = rounded.begins[k];
    const std::size_t last =
        k + 1 < line.spans.size() ? rounded.begins[k + 1] : rounded.points.size() - 1;
    if (last <= first) {  // too short for a point of its own: its ends are one height
      const std::uint32_t from = station_of(span.from_junction, rounded.points[first], along_m);
      const std::uint32_t to = station_of(span.to_junction, rounded.points[first], along_m);
      if (from != to)
        links_.push_back({.from = from, .to = to, .length_m = kSamePlace_m, .way = span.way});
      continue;
    }
    double length_m = 0.0;
    for (std::size_t i = first; i < last; ++i)
      length_m += (rounded.points[i + 1] - rounded.points[i]).norm();
    const int num_links = std::max(1, static_cast<int>(std::ceil(length_m / kStation_m)));
    const double link_m = length_m / num_links;
    std::vector<std::uint32_t> stations = {
        station_of(span.from_junction, rounded.points[first], along_m)};
    for (int i = 1; i < num_links; ++i) {
      stations.push_back(static_cast<std::uint32_t>(stations_.size()));
      stations_.push_back(
          {.at_world = Vector2d::Zero(), .line = line_number, .along_m = along_m + i * link_m});
    }
    stations.push_back(station_of(span.to_junction, rounded.points[last], along_m + length_m));
    // Who ends among others comes to them gently.
    const auto is_busy = [&](std::uint32_t junction) { return junctions_[junction].num_ends > 2; };
    const bool ends_before = k == 0 && !line.is_closed && is_busy(span.from_junction);
    const bool ends_after =
        k + 1 == line.spans.size() && !line.is_closed && is_busy(span.to_junction);
    for (int i = 0; i < num_links; ++i) {
      const auto at = static_cast<std::size_t>(i);
      const double middle_m = (i + 0.5) * link_m;
      links_.push_back({.from = stations[at],
                        .to = stations[at + 1],
                        .length_m = link_m,
                        .way = span.way,
                        .is_at_junction = (ends_before && middle_m < kGentle_m) ||
                                          (ends_after && length_m - middle_m < kGentle_m)});
    }
    // The corners, and the stations between them.
    const auto add = [&](const Vector2d& at, double in_span_m) {
      double place = std::clamp(in_span_m / link_m, 0.0, static_cast<double>(num_links));
      if (std::abs(place - std::round(place)) < 1e-9) place = std::round(place);  // at a station
      const auto link =
          std::min(static_cast<std::size_t>(place), static_cast<std::size_t>(num_links) - 1);
      line.points.push_back({.at_world = at,
                             .tangent = Vector2d::Zero(),
                             .along_m = along_m + in_span_m,
                             .station = stations[link],
                             .next_station = stations[link + 1],
                             .share = place - static_cast<double>(link)});
    };
    if (k == 0 || line.points.empty()) add(rounded.points[first], 0.0);
    span.first_point = static_cast<std::uint32_t>(line.points.size() - 1);
    double in_span_m = 0.0;
    int next_station = 1;
    for (std::size_t i = first; i < last; ++i) {
      const Vector2d from = rounded.points[i];
      const Vector2d step = rounded.points[i + 1] - from;
      const double step_m = step.norm();
      while (next_station < num_links && next_station * link_m <= in_span_m + step_m) {
        const double at_m = next_station * link_m;
        const double share = (at_m - in_span_m) / step_m;
        const Vector2d at = from + share * step;
        stations_[stations[static_cast<std::size_t>(next_station)]].at_world = at;
        if (at_m > in_span_m + kSamePlace_m && at_m < in_span_m + step_m - kSamePlace_m)
          add(at, at_m);
        ++next_station;
      }
      in_span_m += step_m;
      add(rounded.points[i + 1], i + 1 == last ? length_m : in_span_m);
    }
    for (; next_station < num_links; ++next_station)
      stations_[stations[static_cast<std::size_t>(next_station)]].at_world = rounded.points[last];
    span.last_point = static_cast<std::uint32_t>(line.points.size() - 1);
    along_m += length_m;
    kept.push_back(span);
  }
  if (kept.empty() || line.points.size() < 2) return;
  line.spans = std::move(kept);
  // Cross-sections: square to the mean of the directions before and after.
  const std::size_t count = line.points.size();
  for (std::size_t i = 0; i < count; ++i) {
    const Vector2d at = line.points[i].at_world;
    const bool wraps = line.is_closed && (i == 0 || i + 1 == count);
    const Vector2d before = at - (i > 0   ? line.points[i - 1].at_world
                                  : wraps ? line.points[count - 2].at_world
                                          : at);
    const Vector2d after = (i + 1 < count ? line.points[i + 1].at_world
                            : wraps       ? line.points[1].at_world
                                          : at) -
                           at;
    const Vector2d sum = (before.norm() > 0.0 ? Vector2d(before.normalized()) : before) +
                         (after.norm() > 0.0 ? Vector2d(after.normalized()) : after);
    line.points[i].tangent = sum.norm() > 1e-6    ? Vector2d(sum.normalized())
                             : after.norm() > 0.0 ? Vector2d(after.normalized())
                                                  : Vector2d(1.0, 0.0);
  }
  lines_.push_back(std::move(line));
}

std::uint32_t RoadNetwork::junction_at(const Line::Point& point) {
  junctions_.push_back(
      {.at_world = point.at_world, .num_ends = 2, .station = point.station_here()});
  return static_cast<std::uint32_t>(junctions_.size() - 1);
}

void RoadNetwork::run_below_ground(const std::vector<Stretch>& stretches) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> tunnel_of;  // of two stations
  for (auto at = stretches.begin(); at != stretches.end();) {
    const std::uint32_t l = at->line;
    Line& line = lines_[l];
    std::vector<Span> spans;
    for (std::uint32_t s = 0; s < line.spans.size(); ++s) {
      Span rest = line.spans[s];
      const std::uint32_t last_point = rest.last_point;
      const std::uint32_t to_junction = rest.to_junction;
      for (; at != stretches.end() && at->line == l && at->span == s; ++at) {
        if (at->first_point > rest.first_point) {
          Span before = rest;
          before.last_point = at->first_point;
          before.to_junction = junction_at(line.points[at->first_point]);
          rest.from_junction = before.to_junction;
          spans.push_back(before);
        }
        Span tunnel = rest;
        tunnel.first_point = at->first_point;
        tunnel.last_point = at->last_point;
        tunnel.to_junction =
            at->last_point < last_point ? junction_at(line.points[at->last_point]) : to_junction;
        tunnel.way = static_cast<std::uint32_t>(ways_.size());
        Way below = ways_[rest.way];
        below.style.is_tunnel = true;
        below.style.is_bridge = false;
        below.style.level = -1;
        ways_.push_back(std::move(below));
        // From station to station: some have no point of their own, being too near to a corner.
        std::uint32_t last_station = line.points[tunnel.first_point].station_here();
        const auto go_to = [&](std::uint32_t station) {
          if (station != last_station) tunnel_of[std::minmax(last_station, station)] = tunnel.way;
          last_station = station;
        };
        for (std::uint32_t p = tunnel.first_point + 1; p <= tunnel.last_point; ++p) {
          const Line::Point& point = line.points[p];
          if (point.is_at_station()) {
            go_to(point.station_here());
          } else {
            go_to(point.station);
            go_to(point.next_station);
          }
        }
        rest.first_point = tunnel.last_point;
        rest.from_junction = tunnel.to_junction;
        spans.push_back(tunnel);
      }
      if (rest.first_point < last_point) spans.push_back(rest);
    }
    line.spans = std::move(spans);
  }
  for (Link& link : links_)
    if (const auto found = tunnel_of.find(std::minmax(link.from, link.to));
        found != tunnel_of.end())
      link.way = found->second;
}

}  // namespace terracast::tiler
