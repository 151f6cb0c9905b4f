#include "job/traffic/routes.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <optional>

#include "core/random.h"
#include "tiler/objects/vehicle_mix.h"

namespace terracast::job {
namespace {

using world::kHeightStep_m;
using world::WayKind;
using world::WayPart;

/// Sharper than this nobody turns.
constexpr double kMostTurn_rad = 2.5;
constexpr double kTurn_rad = 0.5;
/// So much likelier one goes straight on than turns.
constexpr double kStraightOn = 3.0;
/// Vehicles come to ways without traffic of their own rarely.
constexpr double kQuietPerLaneKm = 0.3;
constexpr double kMostTries = 400.0;
constexpr double kTriesPerSecond = 40.0;
/// At the end of a way the curve into the next one begins so far before it at most.
constexpr double kRunOut_m = 20.0;
/// Trains turn no sharper than this from one track into another, trams at corners of streets.
constexpr double kTrainTurn_rad = 0.35;
constexpr double kTramTurn_rad = 1.2;
/// What turns by less goes straight on over a switch.
constexpr double kSwitch_rad = 0.02;
/// So much likelier a train keeps to the straight track, and off sidings.
constexpr double kMainTrack = 8.0;
/// Beside walkers.
constexpr double kBody_m = 0.35;
constexpr double kStepsShare = 0.6;  ///< of the speed on the level

/// An arm that one may take next, and the leg that it becomes.
struct Option {
  Leg leg;
  int lane = 0;
  double weight = 1.0;
};

double seconds_of(const WayGraph& graph, const Leg& leg) {
  return graph.length_m(leg.arm.part) / leg.limit_mps;
}

/// Depth first, at each node in an order that is drawn with the options' weights.
class Search {
 public:
  using Options = std::function<std::vector<Option>(const Option& from)>;
  Search(const WayGraph& graph, std::uint64_t key, Options options)
      : graph_(graph), key_(key), options_(std::move(options)) {}

  Route from(const Option& first, double along_m, double lasts_s) {
    way_ = {first};
    most_tries_ = kMostTries + kTriesPerSecond * lasts_s;
    const double left_m = graph_.length_m(first.leg.arm.part) - along_m - kRunOut_m;
    if (!go_on(lasts_s - left_m / first.leg.limit_mps))
      return {.legs = {}, .is_given_up = num_tries_ > most_tries_};
    Route route;
    for (const Option& option : way_) route.legs.push_back(option.leg);
    return route;
  }

 private:
  bool go_on(double left_s) {
    if (left_s <= 0.0) return true;
    if (++num_tries_ > most_tries_) return false;
    std::vector<std::pair<double, Option>> order;
    for (const Option& option : options_(way_.back())) {
      const double unit = core::random_unit(key_, way_.size(), order.size());
      order.emplace_back(-std::log1p(-unit) / option.weight, option);
    }
    std::stable_sort(order.begin(), order.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    for (const auto& [drawn, option] : order) {
      way_.push_back(option);
      if (go_on(left_s - seconds_of(graph_, option.leg))) return true;
      way_.pop_back();
    }
    return false;
  }

  const WayGraph& graph_;
  std::uint64_t key_;
  Options options_;
  std::vector<Option> way_;
  double most_tries_ = kMostTries;
  int num_tries_ = 0;
};

double busy(WayKind kind) {
  for (const tiler::RoadTraffic& road : tiler::road_traffic())
    if (road.kind == kind) return kQuietPerLaneKm + road.per_lane_km;
  return kQuietPerLaneKm;
}

Option option_of(const WayGraph& graph, const Arm& arm, int lane, double speed, bool on_left) {
  const WayPart& part = graph.part(arm);
  return {.leg = {.arm = arm,
                  .right_m = lane_right_m(part, arm.is_forward, lane, on_left),
                  .limit_mps = speed * speed_limit_kmph(part) / 3.6},
          .lane = lane};
}

/// Arms after one, in an order that does not depend on that of the parts.
std::vector<std::pair<double, Arm>> turns_after(const WayGraph& graph, const Arm& from) {
  std::vector<std::pair<double, Arm>> turns;
  for (const Arm& arm : graph.after(from))
    if (arm.part != from.part) turns.emplace_back(graph.turn_rad(from, arm), arm);
  std::sort(turns.begin(), turns.end(), [&](const auto& a, const auto& b) {
    if (a.first != b.first) return a.first < b.first;
    return graph.part(a.second).feature < graph.part(b.second).feature;
  });
  return turns;
}

}  // namespace

bool is_road(WayKind kind) { return kind <= WayKind::Busway; }
bool is_path(WayKind kind) { return !is_road(kind) && !world::is_railway(kind); }

Route drive_route(const WayGraph& graph, const Start& start, int lane, double speed, bool on_left) {
  const auto options = [&](const Option& from) {
    std::vector<Option> found;
    std::vector<Option> quiet;
    const int num_here = num_lanes(graph.part(from.leg.arm), from.leg.arm.is_forward);
    for (const auto& [turn_rad, arm] : turns_after(graph, from.leg.arm)) {
      const WayPart& part = graph.part(arm);
      const int num = num_lanes(part, arm.is_forward);
      if (!is_road(part.kind) || part.kind == WayKind::Busway || part.is_tunnel || num == 0 ||
          std::abs(turn_rad) > kMostTurn_rad)
        continue;
      const bool is_turn = std::abs(turn_rad) > kTurn_rad;
      const bool is_to_own_side = (turn_rad < 0.0) != on_left;
      if (is_turn && from.lane != (is_to_own_side ? 0 : num_here - 1)) continue;
      const int to_lane = !is_turn ? std::min(from.lane, num - 1) : is_to_own_side ? 0 : num - 1;
      Option option = option_of(graph, arm, to_lane, speed, on_left);
      option.weight = busy(part.kind) * (is_turn ? 1.0 : kStraightOn);
      (part.kind == WayKind::Service ? quiet : found).push_back(option);
    }
    return found.empty() ? quiet : found;
  };
  return Search(graph, start.key, options)
      .from(option_of(graph, start.arm, lane, speed, on_left), start.along_m, start.lasts_s);
}

Route rail_route(const WayGraph& graph, const TrackSides& sides, const Start& start, int lane,
                 double speed, bool on_left, double most_mps) {
  const WayKind kind = graph.part(start.arm).kind;
  const double most_turn_rad = kind == WayKind::Tram ? kTramTurn_rad : kTrainTurn_rad;
  const auto option_on = [&](const Arm& arm, int track) {
    Option option = option_of(graph, arm, track, speed, on_left);
    option.leg.limit_mps = std::min(option.leg.limit_mps, most_mps);
    return option;
  };
  const auto options = [&](const Option& from) {
    std::vector<Option> found, of_wrong_side;
    for (const auto& [turn_rad, arm] : turns_after(graph, from.leg.arm)) {
      const WayPart& part = graph.part(arm);
      const int num = num_lanes(part, arm.is_forward);
      if (part.kind != kind || part.is_tunnel || num == 0 || std::abs(turn_rad) > most_turn_rad)
        continue;
      Option option = option_on(arm, std::min(from.lane, num - 1));
      if (std::abs(turn_rad) < kSwitch_rad) option.weight *= kMainTrack;
      if (!part.is_siding) option.weight *= kMainTrack;
      (part.is_siding || sides.goes(arm) ? found : of_wrong_side).push_back(option);
    }
    return found.empty() ? of_wrong_side : found;
  };
  return Search(graph, start.key, options)
      .from(option_on(start.arm, lane), start.along_m, start.lasts_s);
}

Route walk_route(const WayGraph& graph, const Start& start, const Walker& walker) {
  const auto step_on = [&](const Arm& arm) {
    const WayPart& part = graph.part(arm);
    const double half_m = part.half_width_steps * kHeightStep_m;
    const double sidewalk_m = part.sidewalk_steps * kHeightStep_m;
    Option option{.leg = {.arm = arm, .right_m = 0.0, .limit_mps = walker.speed_mps}};
    option.leg.right_m = walker.side == 0
                             ? walker.aside * std::max(half_m - kBody_m, 0.0)
                             : walker.side * (half_m + 0.5 * sidewalk_m) +
                                   walker.aside * std::max(0.5 * sidewalk_m - kBody_m, 0.0);
    if (part.kind == WayKind::Steps) option.leg.limit_mps *= kStepsShare;
    return option;
  };
  const auto options = [&](const Option& from) {
    std::vector<Option> found;
    const auto turns = turns_after(graph, from.leg.arm);
    if (walker.side == 0) {
      for (const auto& [turn_rad, arm] : turns) {
        const WayPart& part = graph.part(arm);
        if (!is_path(part.kind) || part.is_tunnel || std::abs(turn_rad) > kMostTurn_rad) continue;
        found.push_back(step_on(arm));
        if (std::abs(turn_rad) < kTurn_rad) found.back().weight = kStraightOn;
      }
      return found;
    }
    // The next road at one's own hand.
    std::optional<std::pair<double, Arm>> next;
    for (const auto& turn : turns)
      if (is_road(graph.part(turn.second).kind) &&
          graph.part(turn.second).kind != WayKind::Service &&
          (!next || (walker.side < 0 && turn.first > next->first)))
        next = turn;
    if (next && graph.part(next->second).sidewalk_steps > 0 &&
        !graph.part(next->second).is_tunnel && std::abs(next->first) < kMostTurn_rad)
      found.push_back(step_on(next->second));
    return found;
  };
  return Search(graph, start.key, options).from(step_on(start.arm), start.along_m, start.lasts_s);
}

}  // namespace terracast::job
