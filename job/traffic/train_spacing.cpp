#include "job/traffic/train_spacing.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <unordered_map>

namespace terracast::job {
namespace {

/// Tracks of a part that are nearer are one.
constexpr double kOneTrack_m = 0.5;
/// A way that is followed beyond a route has no more parts.
constexpr int kMostParts = 2000;

/// How far a track is to the right of a part's own line.
double across_of(const Leg& leg) { return leg.arm.is_forward ? leg.right_m : -leg.right_m; }

/// The arm that goes on most nearly straight on the same kind of railway.
std::optional<Arm> straight_on(const WayGraph& graph, const Arm& from) {
  std::optional<Arm> best;
  double best_rad = 0.35;
  for (const Arm& arm : graph.after(from)) {
    if (arm.part == from.part || graph.part(arm).kind != graph.part(from).kind) continue;
    const double turn_rad = std::abs(graph.turn_rad(from, arm));
    if (turn_rad >= best_rad) continue;
    best_rad = turn_rad;
    best = arm;
  }
  return best;
}

/// The part of a course's way where its track lies, from `from_m` on behind its end.
struct Ahead {
  Leg leg;
  double from_m = 0.0;
};
std::vector<Ahead> ahead_of(const WayGraph& graph, const TrainCourse& course) {
  std::vector<Ahead> ahead;
  double at_m = -course.end_m;
  for (const Leg& leg : course.legs) {
    ahead.push_back({leg, at_m});
    at_m += graph.length_m(leg.arm.part);
  }
  for (int more = 0; more < kMostParts && at_m < course.length_m + course.room_m; ++more) {
    const Leg& last = ahead.back().leg;
    const std::optional<Arm> next = straight_on(graph, last.arm);
    if (!next) break;
    ahead.push_back({{.arm = *next, .right_m = last.right_m, .limit_mps = last.limit_mps}, at_m});
    at_m += graph.length_m(next->part);
  }
  return ahead;
}

/// Whether a course comes too near to another, which begins on one of the parts of its way.
bool comes_near(const WayGraph& graph, const TrainCourse& own, const Ahead& part,
                const TrainCourse& other) {
  const Leg& leg = other.legs.front();
  if (std::abs(across_of(leg) - across_of(part.leg)) > kOneTrack_m) return false;
  const bool is_one_way = leg.arm.is_forward == part.leg.arm.is_forward;
  const double end_m =
      part.from_m + (is_one_way ? other.end_m : graph.length_m(leg.arm.part) - other.end_m);
  const double gap_m = end_m - own.length_m - (is_one_way ? 0.0 : other.length_m);
  return end_m >= 0.0 && gap_m < own.room_m;
}

}  // namespace

std::vector<std::uint8_t> find_too_near(const WayGraph& graph,
                                        std::span<const TrainCourse> courses) {
  std::unordered_map<std::uint32_t, std::vector<std::size_t>> by_part;
  for (std::size_t k = 0; k < courses.size(); ++k)
    by_part[courses[k].legs.front().arm.part].push_back(k);
  std::vector<std::uint8_t> gives_way(courses.size(), 0);
  for (std::size_t k = 0; k < courses.size(); ++k)
    for (const Ahead& part : ahead_of(graph, courses[k])) {
      const auto found = by_part.find(part.leg.arm.part);
      if (found == by_part.end()) continue;
      for (const std::size_t other : found->second)
        if (other != k && comes_near(graph, courses[k], part, courses[other]))
          gives_way[courses[k].key > courses[other].key ? k : other] = 1;
    }
  return gives_way;
}

}  // namespace terracast::job
