#include "tiler/country/blocks.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace terracast::tiler::country {
namespace {

using Lattice = std::pair<std::int64_t, std::int64_t>;

Lattice lattice_of(const Point& at) {
  return {std::llround(at.x() / kPlanStep_m), std::llround(at.y() / kPlanStep_m)};
}

struct HalfEdge {
  int from, to;
  RoadKind kind;
  int next = -1;
  bool is_seen = false;
};

}  // namespace

std::vector<Block> find_blocks(const std::vector<Way>& ways) {
  std::map<Lattice, int> node_of;
  std::vector<Lattice> places;
  std::vector<HalfEdge> edges;  // pairs: e and e ^ 1 run against each other
  std::map<std::pair<int, int>, bool> known;
  const auto node = [&](const Point& at) {
    const auto [found, is_new] = node_of.emplace(lattice_of(at), static_cast<int>(places.size()));
    if (is_new) places.push_back(found->first);
    return found->second;
  };
  for (const Way& way : ways)
    for (std::size_t k = 1; k < way.line.size(); ++k) {
      const int a = node(way.line[k - 1]), b = node(way.line[k]);
      if (a == b || !known.emplace(std::pair(std::min(a, b), std::max(a, b)), true).second)
        continue;
      edges.push_back({a, b, way.kind});
      edges.push_back({b, a, way.kind});
    }
  std::vector<std::vector<int>> leaving(places.size());
  for (std::size_t e = 0; e < edges.size(); ++e)
    leaving[static_cast<std::size_t>(edges[e].from)].push_back(static_cast<int>(e));
  const auto vector_of = [&](int e) {
    const Lattice& from = places[static_cast<std::size_t>(edges[static_cast<std::size_t>(e)].from)];
    const Lattice& to = places[static_cast<std::size_t>(edges[static_cast<std::size_t>(e)].to)];
    return Lattice{to.first - from.first, to.second - from.second};
  };
  for (auto& fan : leaving) {
    std::sort(fan.begin(), fan.end(), [&](int a, int b) {
      const Lattice u = vector_of(a), v = vector_of(b);
      const auto half = [](const Lattice& w) {
        return w.second < 0 || (w.second == 0 && w.first < 0);
      };
      if (half(u) != half(v)) return half(u) < half(v);
      const std::int64_t turn = u.first * v.second - u.second * v.first;
      return turn != 0 ? turn > 0 : a < b;
    });
    // Coming in along the twin of an edge, the face on the left goes on by the edge before it.
    for (std::size_t k = 0; k < fan.size(); ++k)
      edges[static_cast<std::size_t>(fan[k] ^ 1)].next = fan[(k + fan.size() - 1) % fan.size()];
  }
  std::vector<Block> blocks;
  for (std::size_t first = 0; first < edges.size(); ++first) {
    if (edges[first].is_seen) continue;
    Block block;
    for (std::size_t e = first; !edges[e].is_seen; e = static_cast<std::size_t>(edges[e].next)) {
      edges[e].is_seen = true;
      const Lattice& at = places[static_cast<std::size_t>(edges[e].from)];
      block.ring.emplace_back(static_cast<double>(at.first) * kPlanStep_m,
                              static_cast<double>(at.second) * kPlanStep_m);
      block.kinds.push_back(edges[e].kind);
    }
    block.area_m2 = signed_area(block.ring);
    blocks.push_back(std::move(block));
  }
  return blocks;
}

Block tidied(const Block& block, double tolerance_m) {
  // Dead ends: there and back again.
  PointsWorld ring;
  std::vector<RoadKind> kinds;
  for (std::size_t k = 0; k < block.ring.size(); ++k) {
    ring.push_back(block.ring[k]);
    kinds.push_back(block.kinds[k]);
    while (ring.size() >= 3 && ring[ring.size() - 1] == ring[ring.size() - 3]) {
      ring.resize(ring.size() - 2);
      kinds[ring.size() - 1] = kinds.back();
      kinds.resize(ring.size());
    }
  }
  bool is_changed = true;
  while (is_changed && ring.size() >= 4) {
    is_changed = false;
    const std::size_t n = ring.size();
    if (ring[n - 2] == ring[0]) {
      ring.resize(n - 2);
      kinds.resize(n - 2);
      is_changed = true;
    } else if (ring[n - 1] == ring[1]) {
      ring.erase(ring.begin());
      ring.pop_back();
      kinds.erase(kinds.begin());
      kinds.pop_back();
      is_changed = true;
    }
  }
  // Nearly straight corners, the least first.
  while (ring.size() > 3) {
    const std::size_t n = ring.size();
    double least_m = tolerance_m;
    std::size_t least = n;
    for (std::size_t k = 0; k < n; ++k) {
      const std::size_t before = (k + n - 1) % n;
      const double off_m = distance_to_segment(ring[k], ring[before], ring[(k + 1) % n]);
      if (off_m < least_m && kinds[before] == kinds[k]) {
        least_m = off_m;
        least = k;
      }
    }
    if (least == n) break;
    ring.erase(ring.begin() + static_cast<std::ptrdiff_t>(least));
    kinds.erase(kinds.begin() + static_cast<std::ptrdiff_t>(least));
  }
  return {ring, kinds, signed_area(ring)};
}

Point longest_edge(const Block& block) {
  Point longest = Point::UnitX();
  double most_m = 0.0;
  for (std::size_t k = 0; k < block.ring.size(); ++k) {
    const Point edge = block.ring[(k + 1) % block.ring.size()] - block.ring[k];
    if (edge.norm() <= most_m) continue;
    most_m = edge.norm();
    longest = edge / most_m;
  }
  return longest;
}

}  // namespace terracast::tiler::country
