#include "tiler/country/route_grid.h"

#include <algorithm>
#include <cmath>
#include <queue>

namespace terracast::tiler::country {
namespace {

struct Step {
  int di, dj;
};
constexpr Step kSteps[] = {{1, 0}, {0, 1}, {-1, 0}, {0, -1}, {1, 1},   {-1, 1},  {-1, -1}, {1, -1},
                           {2, 1}, {1, 2}, {-1, 2}, {-2, 1}, {-2, -1}, {-1, -2}, {1, -2},  {2, -1}};
constexpr int kTunnelSteps[] = {6, 10, 16, 24, 34};
constexpr double kMostNodes = 450.0;  ///< along a side
constexpr int kLeastVisits = 15000;
constexpr double kVisitsAround = 9.0;  ///< of the square of the distance in nodes
/// Costs are whole numbers of 1/16 m, so that no comparison hangs on rounding.
constexpr double kCostSteps = 16.0;

}  // namespace

RouteGrid::RouteGrid(const PlanGround& ground, const Grid<std::uint8_t>& is_river)
    : ground_(ground) {
  stride_ = ground.side() > kMostNodes ? 2 : 1;
  side_ = (ground.side() - 1) / stride_ + 1;
  spacing_m_ = stride_ * ground.spacing_m();
  const std::size_t count = static_cast<std::size_t>(side_) * static_cast<std::size_t>(side_);
  heights_m_.resize(count);
  slopes_.resize(count);
  land_m_.resize(count);
  is_river_.assign(count, 0);
  near_.assign(count, 0);
  for (int j = 0; j < side_; ++j)
    for (int i = 0; i < side_; ++i) {
      const std::size_t node = static_cast<std::size_t>(j) * static_cast<std::size_t>(side_) +
                               static_cast<std::size_t>(i);
      const Point at = ground.place(i * stride_, j * stride_);
      heights_m_[node] = ground.heights_m()(i * stride_, j * stride_);
      slopes_[node] = static_cast<float>(ground.slope(at));
      land_m_[node] = static_cast<float>(ground.land_distance_m(at));
      for (int dj = 0; dj < stride_; ++dj)
        for (int di = 0; di < stride_; ++di)
          if (is_river.contains(i * stride_ + di, j * stride_ + dj) &&
              is_river(i * stride_ + di, j * stride_ + dj) != 0)
            is_river_[node] = 1;
    }
}

int RouteGrid::node_at(const Point& at) const {
  const Point node = ground_.node_of(at) / stride_;
  const auto clamp = [&](double v) {
    return std::clamp(static_cast<int>(std::round(v)), 0, side_ - 1);
  };
  return clamp(node.y()) * side_ + clamp(node.x());
}

Point RouteGrid::place(int node) const {
  return ground_.place(node % side_ * stride_, node / side_ * stride_);
}

std::uint64_t RouteGrid::key_of(int a, int b) const {
  return static_cast<std::uint64_t>(std::min(a, b)) << 32 |
         static_cast<std::uint32_t>(std::max(a, b));
}

std::optional<std::vector<int>> RouteGrid::route(int from, int to, const RouteStyle& style) const {
  const std::size_t count = heights_m_.size();
  style.avoided->resize(count, -1.0F);
  std::vector<std::int32_t> best(count, INT32_MAX);
  std::vector<std::int32_t> before(count, -1);
  using Open = std::pair<std::int64_t, std::int32_t>;  // cost with what is still to go, node
  std::priority_queue<Open, std::vector<Open>, std::greater<>> open;
  const int goal_i = to % side_, goal_j = to / side_;
  const auto to_go = [&](int node) {
    const double di = node % side_ - goal_i, dj = node / side_ - goal_j;
    return static_cast<std::int64_t>(0.75 * std::sqrt(di * di + dj * dj) * spacing_m_ * kCostSteps);
  };
  best[static_cast<std::size_t>(from)] = 0;
  open.emplace(to_go(from), from);
  // Ways that go farther round are not worth their finding.
  const double far = (place(from) - place(to)).norm() / spacing_m_;
  const int most_visits = kLeastVisits + static_cast<int>(kVisitsAround * far * far);
  int visits = 0;
  std::vector<std::uint8_t> is_done(count, 0);
  while (!open.empty() && visits < most_visits) {
    const int node = open.top().second;
    open.pop();
    if (is_done[static_cast<std::size_t>(node)] != 0) continue;
    is_done[static_cast<std::size_t>(node)] = 1;
    ++visits;
    if (node == to) {
      std::vector<int> nodes;
      for (int at = to; at >= 0; at = before[static_cast<std::size_t>(at)]) nodes.push_back(at);
      std::reverse(nodes.begin(), nodes.end());
      return nodes;
    }
    const int i = node % side_, j = node / side_;
    const auto relax = [&](int next, double cost) {
      const std::int64_t total = best[static_cast<std::size_t>(node)] +
                                 static_cast<std::int64_t>(std::lround(cost * kCostSteps));
      if (total >= best[static_cast<std::size_t>(next)]) return;
      best[static_cast<std::size_t>(next)] = static_cast<std::int32_t>(total);
      before[static_cast<std::size_t>(next)] = node;
      open.emplace(total + to_go(next), next);
    };
    for (const Step& step : kSteps) {
      const int ni = i + step.di, nj = j + step.dj;
      if (ni < 0 || nj < 0 || ni >= side_ || nj >= side_) continue;
      const int next = nj * side_ + ni;
      const auto n = static_cast<std::size_t>(next);
      if (is_done[n] != 0) continue;
      const double length =
          spacing_m_ * std::sqrt(static_cast<double>(step.di * step.di + step.dj * step.dj));
      if (const auto known = edge_of_.find(key_of(node, next)); known != edge_of_.end()) {
        relax(next, length * style.reuse);
        continue;
      }
      double factor = 1.0;
      const double land_m = static_cast<double>(land_m_[n]);
      if (land_m > 0.0) {
        if (land_m > style.water_reach_m) continue;
        factor = style.water;
      } else {
        const double grade = std::abs(height_m(next) - height_m(node)) / length / style.steepest;
        factor += style.climb * grade * grade + (grade > 1.0 ? 25.0 * (grade - 1.0) : 0.0);
        factor += style.side_slope * static_cast<double>(slopes_[n]);
      }
      if (near_[n] == 1) factor *= style.beside;
      if (style.avoid) {
        float& more = (*style.avoided)[n];
        if (more < 0.0F) more = static_cast<float>(style.avoid(place(next)));
        if (more <= 0.0F) continue;
        factor *= static_cast<double>(more);
      }
      double cost = length * factor;
      if (is_river_[n] != 0) cost += style.river_m;
      relax(next, cost);
    }
    if (style.tunnel > 0.0 && slopes_[static_cast<std::size_t>(node)] > 0.12F)
      for (int direction = 0; direction < 8; ++direction)
        for (const int steps : kTunnelSteps) {
          const Step& step = kSteps[direction];
          const int ni = i + steps * step.di, nj = j + steps * step.dj;
          if (ni < 0 || nj < 0 || ni >= side_ || nj >= side_) break;
          const int next = nj * side_ + ni;
          if (land_m_[static_cast<std::size_t>(next)] > 0.0F ||
              is_done[static_cast<std::size_t>(next)] != 0)
            continue;
          const double length =
              steps * spacing_m_ *
              std::sqrt(static_cast<double>(step.di * step.di + step.dj * step.dj));
          const double grade = (height_m(next) - height_m(node)) / length;
          if (std::abs(grade) > 0.8 * style.steepest) continue;
          // All of it but its ends lies 12 m deep at least.
          bool is_deep = true;
          for (int k = 1; k < steps && is_deep; ++k) {
            const int between = (j + k * step.dj) * side_ + i + k * step.di;
            is_deep = height_m(between) > height_m(node) + grade * length * k / steps + 12.0;
          }
          if (is_deep) relax(next, length * style.tunnel + 300.0);
        }
  }
  return std::nullopt;
}

void RouteGrid::add(const std::vector<int>& nodes, int kind) {
  for (std::size_t k = 1; k < nodes.size(); ++k) {
    const int a = nodes[k - 1], b = nodes[k];
    if (!edge_of_.emplace(key_of(a, b), edges_.size()).second) continue;
    const int reach = std::max(std::abs(a % side_ - b % side_), std::abs(a / side_ - b / side_));
    edges_.push_back({std::min(a, b), std::max(a, b), kind, reach > 2});
  }
  for (const int node : nodes) {
    const int i = node % side_, j = node / side_;
    for (int dj = -1; dj <= 1; ++dj)
      for (int di = -1; di <= 1; ++di)
        if (i + di >= 0 && j + dj >= 0 && i + di < side_ && j + dj < side_) {
          std::uint8_t& near = near_[static_cast<std::size_t>((j + dj) * side_ + i + di)];
          near = std::max<std::uint8_t>(near, di == 0 && dj == 0 ? 2 : 1);
        }
  }
}

std::vector<Alignment> alignments(const RouteGrid& net, const PlanGround& ground,
                                  const Easing& easing) {
  const auto& edges = net.edges();
  std::unordered_map<int, std::vector<std::size_t>> edges_of;
  for (std::size_t e = 0; e < edges.size(); ++e) {
    edges_of[edges[e].from].push_back(e);
    edges_of[edges[e].to].push_back(e);
  }
  const auto other_end = [&](std::size_t e, int node) {
    return edges[e].from == node ? edges[e].to : edges[e].from;
  };
  std::unordered_map<int, Point> fixed;
  std::vector<std::uint8_t> is_used(edges.size(), 0);
  std::vector<std::size_t> order(edges.size());
  for (std::size_t e = 0; e < order.size(); ++e) order[e] = e;
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return edges[a].kind < edges[b].kind; });
  std::vector<Alignment> result;
  for (const std::size_t first : order) {
    if (is_used[first] != 0) continue;
    is_used[first] = 1;
    const int kind = edges[first].kind;
    std::vector<int> nodes{edges[first].from, edges[first].to};
    std::vector<std::uint8_t> tunnels{edges[first].is_tunnel};
    for (int pass = 0; pass < 2; ++pass) {
      for (;;) {
        const int node = nodes.back();
        const Point along = (net.place(node) - net.place(nodes[nodes.size() - 2])).normalized();
        std::size_t straightest = edges.size();
        double most = 0.1;
        for (const std::size_t e : edges_of[node]) {
          if (is_used[e] != 0 || edges[e].kind != kind) continue;
          const double cosine =
              along.dot((net.place(other_end(e, node)) - net.place(node)).normalized());
          if (cosine > most + (edges_of[node].size() == 2 ? -2.0 : 0.0)) {
            most = cosine;
            straightest = e;
          }
        }
        if (straightest == edges.size()) break;
        is_used[straightest] = 1;
        tunnels.push_back(edges[straightest].is_tunnel);
        nodes.push_back(other_end(straightest, node));
      }
      std::reverse(nodes.begin(), nodes.end());
      std::reverse(tunnels.begin(), tunnels.end());
    }
    // Places are drawn to the middle of their neighbours, but not far, and less on slopes, where a way
    // winds for a reason.
    const std::size_t n = nodes.size();
    PointsWorld points(n);
    std::vector<double> yields(n, 0.0);
    for (std::size_t k = 0; k < n; ++k) {
      const auto known = fixed.find(nodes[k]);
      points[k] = known != fixed.end() ? known->second : net.place(nodes[k]);
      const bool is_at_tunnel = (k > 0 && tunnels[k - 1] != 0) || (k + 1 < n && tunnels[k] != 0);
      if (known == fixed.end() && k > 0 && k + 1 < n && !is_at_tunnel)
        yields[k] = std::clamp(1.1 - 3.0 * ground.slope(points[k]), easing.least_yield, 1.0);
    }
    const PointsWorld start = points;
    const double reach_m = easing.reach * net.spacing_m();
    for (int round = 0; round < easing.rounds; ++round) {
      PointsWorld moved = points;
      for (std::size_t k = 1; k + 1 < n; ++k) {
        if (yields[k] == 0.0) continue;
        moved[k] += 0.5 * yields[k] * (0.5 * (points[k - 1] + points[k + 1]) - points[k]);
        const Point away = moved[k] - start[k];
        if (away.norm() > reach_m) moved[k] = start[k] + away * (reach_m / away.norm());
      }
      points = std::move(moved);
    }
    for (std::size_t k = 0; k < n; ++k) {
      points[k] = snapped(points[k]);
      fixed.emplace(nodes[k], points[k]);
    }
    Alignment alignment;
    alignment.kind = kind;
    // Between tunnels, which are straight, a curve.
    std::size_t begin = 0;
    while (begin + 1 < n) {
      std::size_t end = begin + 1;
      if (tunnels[begin] == 0)
        while (end + 1 < n && tunnels[end] == 0) ++end;
      const std::span<const Point> part(points.data() + begin, end - begin + 1);
      const PointsWorld curve = tunnels[begin] != 0 ? PointsWorld{part.front(), part.back()}
                                : part.size() == 2  ? resampled(part, 20.0)
                                                    : splined(part, 3);
      if (tunnels[begin] != 0) {
        const double at_m = length_of(alignment.line);
        alignment.tunnels_m.emplace_back(at_m, at_m + length_of(curve));
      }
      alignment.line.insert(alignment.line.end(), curve.begin() + (alignment.line.empty() ? 0 : 1),
                            curve.end());
      begin = end;
    }
    result.push_back(std::move(alignment));
  }
  return result;
}

}  // namespace terracast::tiler::country
