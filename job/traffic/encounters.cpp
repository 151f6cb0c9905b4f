#include "job/traffic/encounters.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>
#include <utility>

#include "core/parallel.h"

namespace terracast::job {
namespace {

using Eigen::Vector2d;

/// Of the map; what is larger is in the way of more of them.
constexpr double kCell_m = 24.0;
/// Decks so far above each other carry traffic that does not meet.
constexpr double kDeckApart_m = 3.0;
/// The cosine of how much two differ in direction that go the same way.
constexpr double kSameWay = 0.8;

std::int64_t cell_of(double at_m) { return static_cast<std::int64_t>(std::floor(at_m / kCell_m)); }
std::uint64_t key_of(std::int64_t x, std::int64_t y) {
  return static_cast<std::uint64_t>(x) << 32U ^ (static_cast<std::uint64_t>(y) & 0xffffffffU);
}

/// How far something reaches from its middle, with its room.
double reach_of(const Footprint& footprint) {
  return std::hypot(0.5 * footprint.length_m + footprint.room_along_m,
                    0.5 * footprint.width_m + kRoomAside_m);
}

/// Footprints by where they are.
class Map {
 public:
  void add(const Footprint& footprint, std::uint32_t number) {
    farthest_m_ = std::max(farthest_m_, reach_of(footprint));
    cells_[key_of(cell_of(footprint.at_world.x()), cell_of(footprint.at_world.y()))].push_back(
        {footprint, number});
  }
  /// All that reach as near to a place, and some others.
  template <class Visit>
  void visit_near(const Vector2d& at, double near_m, const Visit& visit) const {
    const double far_m = near_m + farthest_m_;
    for (std::int64_t j = cell_of(at.y() - far_m); j <= cell_of(at.y() + far_m); ++j)
      for (std::int64_t i = cell_of(at.x() - far_m); i <= cell_of(at.x() + far_m); ++i)
        if (const auto found = cells_.find(key_of(i, j)); found != cells_.end())
          for (const Entry& entry : found->second) visit(entry.footprint, entry.number);
  }

 private:
  struct Entry {
    Footprint footprint;
    std::uint32_t number;
  };
  std::unordered_map<std::uint64_t, std::vector<Entry>> cells_;
  double farthest_m_ = 0.0;
};

/// Half of what a footprint and its room take up along a direction.
double half_along(const Footprint& of, const Vector2d& direction) {
  const Vector2d left(-of.forward.y(), of.forward.x());
  return (0.5 * of.length_m + of.room_along_m) * std::abs(of.forward.dot(direction)) +
         (0.5 * of.width_m + kRoomAside_m) * std::abs(left.dot(direction));
}

bool share_a_level(const Footprint& a, const Footprint& b) {
  const bool has_a = std::isfinite(a.deck_z_world), has_b = std::isfinite(b.deck_z_world);
  if (has_a && has_b) return std::abs(a.deck_z_world - b.deck_z_world) <= kDeckApart_m;
  return (!has_a || a.is_deck_end) && (!has_b || b.is_deck_end);
}

/// Whether one that goes from a place to another in its headway passes the middle of another, which goes that way too.
bool follows(const Footprint& here, const Footprint& soon, const Footprint& ahead) {
  if (here.forward.dot(ahead.forward) < kSameWay && soon.forward.dot(ahead.forward) < kSameWay)
    return false;
  if (!share_a_level(here, ahead) && !share_a_level(soon, ahead)) return false;
  if ((ahead.at_world - here.at_world).dot(here.forward) <= 0.0 ||
      (soon.at_world - ahead.at_world).dot(soon.forward) <= 0.0)
    return false;
  const Vector2d way = soon.at_world - here.at_world;
  const Vector2d off = ahead.at_world - here.at_world;
  const double share = std::clamp(off.dot(way) / way.squaredNorm(), 0.0, 1.0);
  return (off - share * way).norm() < 0.5 * (here.width_m + ahead.width_m);
}

bool gives_way(const Traveller& one, const Traveller& other) {
  if (one.goes_first() != other.goes_first()) return other.goes_first();
  return one.key() > other.key();
}

}  // namespace

bool meet(const Footprint& a, const Footprint& b) {
  if (!share_a_level(a, b)) return false;
  const Vector2d apart = b.at_world - a.at_world;
  for (const Vector2d& forward : {a.forward, b.forward})
    for (const Vector2d& axis : {forward, Vector2d(-forward.y(), forward.x())})
      if (std::abs(apart.dot(axis)) > half_along(a, axis) + half_along(b, axis)) return false;
  return true;
}

std::optional<Footprint> Obstacle::at(double time_s) const {
  for (std::size_t i = 0; i < states.size(); ++i) {
    if (!states[i]) continue;
    const bool is_last = i + 1 == states.size() || !states[i + 1];
    const double from_s = states[i]->time_s;
    const double to_s = is_last ? from_s + kLook_s : states[i + 1]->time_s;
    if (time_s < from_s - kLook_s || time_s > to_s) continue;
    Footprint footprint{.length_m = length_m, .width_m = width_m};
    const Eigen::Vector3d forward = states[i]->world_from_body.rotation * Eigen::Vector3d::UnitX();
    if (forward.head<2>().norm() > 1e-3) footprint.forward = forward.head<2>().normalized();
    footprint.at_world = states[i]->world_from_body.translation.head<2>();
    if (!is_last)
      footprint.at_world +=
          std::clamp((time_s - from_s) / (to_s - from_s), 0.0, 1.0) *
          (states[i + 1]->world_from_body.translation.head<2>() - footprint.at_world);
    return footprint;
  }
  return std::nullopt;
}

Encounters find_encounters(std::span<const Traveller* const> travellers,
                           std::span<const Obstacle> obstacles, std::span<const Footprint> standing,
                           double duration_s) {
  const std::size_t num = travellers.size();
  Encounters found{std::vector<std::uint8_t>(num, 0), std::vector<std::uint8_t>(num, 0)};
  Map still;
  for (const Footprint& footprint : standing) still.add(footprint, 0);
  const int num_looks = static_cast<int>(std::ceil(duration_s / kLook_s)) + 1;
  std::vector<Footprint> here(num);
  std::vector<Footprint> soon(num);  // after its headway
  const auto look = [&](int index, const auto& each) {
    const double time_s = std::min(index * kLook_s, duration_s);
    core::parallel_for_blocks(
        static_cast<std::int64_t>(num), 64, [&](std::int64_t begin, std::int64_t end) {
          for (auto k = static_cast<std::size_t>(begin); k < static_cast<std::size_t>(end); ++k) {
            here[k] = travellers[k]->at(time_s);
            if (travellers[k]->headway_s() > 0.0)
              soon[k] = travellers[k]->at(time_s + travellers[k]->headway_s());
          }
        });
    each(time_s);
  };
  for (int index = 0; index < num_looks; ++index)
    look(index, [&](double time_s) {
      Map moving;
      for (const Obstacle& obstacle : obstacles)
        if (const auto footprint = obstacle.at(time_s)) moving.add(*footprint, 0);
      for (std::size_t k = 0; k < num; ++k)
        for (const Map* map : {&still, &moving})
          map->visit_near(
              here[k].at_world, reach_of(here[k]), [&](const Footprint& other, std::uint32_t) {
                Footprint own = here[k];
                // Who is on the ground is so wherever the other is; of what moves it is
                // not known what carries it.
                if (!std::isfinite(own.deck_z_world) || !std::isfinite(other.deck_z_world))
                  own.deck_z_world = other.deck_z_world;
                if (meet(own, other)) found.is_blocked[k] = 1;
              });
    });
  for (int index = 0; index < num_looks; ++index)
    look(index, [&](double) {
      Map map;
      for (std::uint32_t k = 0; k < num; ++k)
        if (found.is_blocked[k] == 0) map.add(here[k], k);
      for (std::uint32_t k = 0; k < num; ++k) {
        if (found.is_blocked[k] != 0) continue;
        map.visit_near(here[k].at_world, reach_of(here[k]),
                       [&](const Footprint& other, std::uint32_t number) {
                         if (gives_way(*travellers[k], *travellers[number]) && meet(here[k], other))
                           found.gives_way[k] = 1;
                       });
        if (travellers[k]->headway_s() <= 0.0) continue;
        const Vector2d way = soon[k].at_world - here[k].at_world;
        map.visit_near(
            here[k].at_world + 0.5 * way, 0.5 * way.norm() + here[k].width_m,
            [&](const Footprint& other, std::uint32_t number) {
              if (number == k || travellers[number]->headway_s() <= 0.0 ||
                  !follows(here[k], soon[k], other))
                return;
              found.gives_way[gives_way(*travellers[k], *travellers[number]) ? k : number] = 1;
            });
      }
    });
  return found;
}

}  // namespace terracast::job
