#include "tiler/roads/sound_ways.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <tuple>
#include <unordered_map>
#include <unordered_set>

#include "tiler/roads/way_place.h"

namespace terracast::tiler {
namespace {

using Eigen::Vector2d;

/// A way of more points is thinned to those this far apart.
constexpr std::size_t kMostPoints = 50000;
constexpr double kThinned_m = 2.0;
/// In a square so wide, of a grid, lie no more pieces of ways, each kStation_m long at most, before
/// corners are rounded: what lies about a place is looked at for each of them. They are 16 m of way
/// on each square metre, or a labyrinth that has a point each half metre.
constexpr double kCrowd_m = 32.0;
constexpr int kMostInCrowd = 2048;
/// Lines are cut so far beyond the square.
constexpr double kBeyond_m = 40.0;

/// How many pieces of ways lie in squares of kCrowd_m.
class Crowd {
 public:
  /// Nothing is taken in of a way for which there is no room.
  bool take_in(const PointsWorld& points) {
    std::unordered_map<PlaceKey, int, PlaceKeyHash> own;
    for (std::size_t i = 0; i + 1 < points.size(); ++i) {
      const Vector2d step = points[i + 1] - points[i];
      const int num = std::max(1, static_cast<int>(std::ceil(step.norm() / kStation_m)));
      for (int k = 0; k < num; ++k) {
        const Vector2d at = (points[i] + (k + 0.5) / num * step) / kCrowd_m;
        const PlaceKey square{std::llround(at.x()), std::llround(at.y())};
        const auto others = num_in_.find(square);
        if (++own[square] + (others == num_in_.end() ? 0 : others->second) > kMostInCrowd)
          return false;
      }
    }
    for (const auto& [square, num] : own) num_in_[square] += num;
    return true;
  }

 private:
  std::unordered_map<PlaceKey, int, PlaceKeyHash> num_in_;
};

/// Points so far apart, the ends and those that are to be kept among them; one alone where all are
/// one place.
template <class IsKept>
PointsWorld thinned(const PointsWorld& points, const IsKept& is_kept) {
  PointsWorld thin = {points.front()};
  for (const Vector2d& at : points)
    if ((at - thin.back()).norm() >= kThinned_m ||
        (is_kept(at) && key_of(at) != key_of(thin.back())))
      thin.push_back(at);
  if (key_of(thin.back()) != key_of(points.back())) thin.push_back(points.back());
  return thin;
}

/// Places at which several ways have a point: they meet there.
std::unordered_set<PlaceKey, PlaceKeyHash> shared_places(const std::vector<Way>& ways) {
  std::unordered_map<PlaceKey, std::size_t, PlaceKeyHash> first;
  std::unordered_set<PlaceKey, PlaceKeyHash> shared;
  for (std::size_t row = 0; row < ways.size(); ++row)
    for (const Vector2d& at : ways[row].points_world)
      if (first.emplace(key_of(at), row).first->second != row) shared.insert(key_of(at));
  return shared;
}

/// The parts of a line within a square about the origin, cut at its sides.
std::vector<PointsWorld> parts_within(const PointsWorld& line, double half_m) {
  std::vector<PointsWorld> parts;
  PointsWorld part;
  for (std::size_t i = 0; i + 1 < line.size(); ++i) {
    const Vector2d step = line[i + 1] - line[i];
    double from = 0.0;
    double to = 1.0;
    for (int axis = 0; axis < 2 && from <= to; ++axis)
      for (const double side : {-1.0, 1.0}) {
        // side * (line + t step) <= half
        const double room = half_m - side * line[i][axis];
        const double rate = side * step[axis];
        if (rate == 0.0) {
          if (room < 0.0) to = -1.0;
        } else if (rate > 0.0) {
          to = std::min(to, room / rate);
        } else {
          from = std::max(from, room / rate);
        }
      }
    if (from > to) {
      if (part.size() > 1) parts.push_back(std::move(part));
      part = {};
      continue;
    }
    if (part.empty()) part.push_back(from == 0.0 ? line[i] : Vector2d(line[i] + from * step));
    part.push_back(to == 1.0 ? line[i + 1] : Vector2d(line[i] + to * step));
    if (to < 1.0) {
      if (part.size() > 1) parts.push_back(std::move(part));
      part = {};
    }
  }
  if (part.size() > 1) parts.push_back(std::move(part));
  return parts;
}

/// Leaves out what is scribbled, or comes where too many are; not what is only drawn too finely.
void thin_crowds(std::vector<Way>& ways, NetworkCounts& counts) {
  Crowd crowd;
  std::optional<std::unordered_set<PlaceKey, PlaceKeyHash>> shared;
  for (Way& way : ways) {
    if (crowd.take_in(way.points_world)) continue;
    if (!shared) shared = shared_places(ways);
    way.points_world =
        thinned(way.points_world, [&](const Vector2d& at) { return shared->contains(key_of(at)); });
    if (way.points_world.size() > 1 && crowd.take_in(way.points_world)) {
      ++counts.num_thinned;
      continue;
    }
    ++counts.num_crowded;
    way.points_world.clear();
  }
  std::erase_if(ways, [](const Way& way) { return way.points_world.empty(); });
}

}  // namespace

std::vector<Way> sound_ways(std::vector<Way> ways, double half_size_m, NetworkCounts& counts) {
  std::vector<Way> sound;
  for (Way& way : ways) {
    PointsWorld points;
    for (const Vector2d& at : way.points_world) {
      if (!at.allFinite()) {
        ++counts.num_not_finite;
        continue;
      }
      if (points.empty() || key_of(at) != key_of(points.back())) points.push_back(at);
    }
    if (points.size() > kMostPoints) {
      ++counts.num_thinned;
      points = thinned(points, [](const Vector2d&) { return false; });
    }
    if (points.size() < 2) {
      ++counts.num_without_length;
      continue;
    }
    std::vector<PointsWorld> parts = parts_within(points, half_size_m + kBeyond_m);
    if (parts.size() != 1 || parts.front().size() != points.size()) ++counts.num_outside;
    for (PointsWorld& part : parts) {
      PointsWorld kept;
      for (const Vector2d& at : part)
        if (kept.empty() || key_of(at) != key_of(kept.back())) kept.push_back(at);
      if (kept.size() > 1)
        sound.push_back(
            {.feature = way.feature, .style = way.style, .ref = way.ref, .points_world = kept});
    }
  }
  // Whatever their order was.
  const auto order = [](const Way& a, const Way& b) {
    if (a.feature != b.feature) return a.feature < b.feature;
    if (a.style.use != b.style.use) return a.style.use < b.style.use;
    return std::lexicographical_compare(
        a.points_world.begin(), a.points_world.end(), b.points_world.begin(), b.points_world.end(),
        [](const Vector2d& p, const Vector2d& q) {
          return std::tuple(p.x(), p.y()) < std::tuple(q.x(), q.y());
        });
  };
  std::stable_sort(sound.begin(), sound.end(), order);
  // Of two on the same points the first stays.
  std::map<std::pair<std::vector<PlaceKey>, int>, int> known;
  std::erase_if(sound, [&](const Way& way) {
    std::vector<PlaceKey> keys;
    for (const Vector2d& at : way.points_world) keys.push_back(key_of(at));
    if (keys.back() < keys.front()) std::reverse(keys.begin(), keys.end());
    const auto use = static_cast<int>(way.style.use);
    const bool is_known = !known.emplace(std::pair(std::move(keys), use), 0).second;
    counts.num_duplicates += is_known ? 1 : 0;
    return is_known;
  });
  thin_crowds(sound, counts);
  return sound;
}

}  // namespace terracast::tiler
