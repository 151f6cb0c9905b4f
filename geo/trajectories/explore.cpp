#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/error.h"
#include "core/random.h"
#include "geo/paths/area.h"
#include "geo/paths/control_path.h"
#include "geo/paths/flight.h"
#include "geo/trajectory.h"
#include "geo/units.h"

namespace terracast::geo {
namespace {

using core::ErrorKind;
using core::fail;

/// Corners of a way through the air, in flattened coordinates.
using Corners = std::vector<Eigen::Vector3d>;

class Explore final : public TrajectoryKind {
 public:
  Explore() { flight_.terrain_following = true; }

  void describe(core::SchemaVisitor& visit) override {
    visit.list("area", area_, "The corners of the area that is not left, in order; three or more.");
    visit.key("seed", seed_, "Another seed, another flight.");
    visit.key("num_legs", num_legs_, "Number of legs between random places.",
              core::between(1.0, 10000.0));
    visit.key(
        "max_leg_m", max_leg_m_,
        "Longest leg; the shortest is what the turns at both ends need at this speed and bank.",
        core::between(1.0, 100000.0));
    visit.key("lowest_agl_m", lowest_agl_m_, "Least height of a random place above ground.",
              core::between(0.0, 100000.0));
    visit.key("highest_agl_m", highest_agl_m_, "Its greatest height above ground.",
              core::between(0.0, 100000.0));
    visit.key("clearance_m", clearance_m_,
              "By how much legs and turns pass above min_agl_m, before the last look.",
              core::between(0.0, 10000.0));
    flight_.describe(visit);
  }

  void validate() const override {
    if (lowest_agl_m_ > highest_agl_m_)
      fail(ErrorKind::Config, "lowest_agl_m = {} is more than highest_agl_m = {}", lowest_agl_m_,
           highest_agl_m_);
    if (lowest_agl_m_ < flight_.min_agl_m + clearance_m_)
      fail(ErrorKind::Config,
           "lowest_agl_m = {} is less than min_agl_m = {} and clearance_m = {} together",
           lowest_agl_m_, flight_.min_agl_m, clearance_m_);
    if (max_leg_m_ < shortest_leg_m())
      fail(ErrorKind::Config,
           "max_leg_m = {}; turns at {} m/s need legs of {:.1f} m: lengthen it, fly slower or bank "
           "more",
           max_leg_m_, flight_.speed_mps, shortest_leg_m());
  }

  std::unique_ptr<TrajectoryKind> clone() const override {
    return std::make_unique<Explore>(*this);
  }

  std::unique_ptr<Trajectory> build(const TrajectoryContext& context) const override {
    validate();
    const Area area = resolve_area(area_, context);
    double spacing_m = std::clamp(turn_reach_m() / 8.0, 0.5, 10.0);
    const std::vector<Eigen::Vector3d> controls = rounded(find_corners(area, context), spacing_m);
    FlightPlan plan;
    plan.path = std::make_shared<ControlPath>(Flattened(context.frame.origin()), controls,
                                              spacing_m, flight_.continuity_of_path());
    plan.attitude = flight_.attitude();
    plan.how_to_raise = [](double) { return "raise lowest_agl_m or clearance_m"; };
    return fly(plan, flight_, context);
  }

 private:
  static constexpr double kMostTurn_rad = 0.5 * std::numbers::pi;

  // A corner of angle a that is averaged over a length r to both sides bends most in its middle, by 2
  // sin(a / 2) / (r cos^2(a / 2)): the second derivative of the averaged line is the step of its
  // direction times the triangle's peak 1 / r, its first one cos(a / 2).
  double turn_reach_m() const {
    constexpr double kShareOfBank = 0.8, kLeastBank_deg = 5.0, kUsualBank_deg = 30.0;
    const double bank_deg =
        flight_.bank == "none" ? kUsualBank_deg : std::max(flight_.max_bank_deg, kLeastBank_deg);
    const double radius_m =
        flight_.speed_mps * flight_.speed_mps /
        (kGravity_mps2 * std::tan(radians_from_degrees(kShareOfBank * bank_deg)));
    const double half = 0.5 * kMostTurn_rad;
    return std::max(1.0, radius_m * 2.0 * std::sin(half) / (std::cos(half) * std::cos(half)));
  }
  double shortest_leg_m() const {
    constexpr double kRoom = 1.1;
    return 2.0 * kRoom * turn_reach_m();
  }

  /// Draws a corner after the other; where none is found, the last one is taken back.
  Corners find_corners(const Area& area, const TrajectoryContext& context) const {
    constexpr std::uint64_t kTriesForOne = 60, kMostTries = 300000;
    Corners corners;
    std::uint64_t num_tries = 0, num_failures = 0;
    const auto num_corners = static_cast<std::size_t>(num_legs_) + 1;
    while (corners.size() < num_corners) {
      bool is_found = false;
      for (std::uint64_t i = 0; i < kTriesForOne && !is_found; ++i) {
        if (++num_tries > kMostTries)
          fail(ErrorKind::Input,
               "no way of {} legs was found in {} tries: make the area larger, fly slower, shorten "
               "max_leg_m, or widen lowest_agl_m to highest_agl_m",
               num_legs_, kMostTries);
        const auto corner = draw(area, corners, num_tries, context);
        if (!corner) continue;
        corners.push_back(*corner);
        is_found = true;
      }
      if (is_found) continue;
      // The more often it fails, the farther back it begins anew.
      ++num_failures;
      const std::size_t num_back = std::min<std::size_t>(corners.size(), 1 + num_failures % 8);
      corners.resize(corners.size() - num_back);
    }
    return corners;
  }

  /// A corner that can be flown to from the last one; nothing where this draw led nowhere.
  std::optional<Eigen::Vector3d> draw(const Area& area, const Corners& corners, std::uint64_t index,
                                      const TrajectoryContext& context) const {
    enum Stream : std::uint64_t { kEast, kNorth, kHeight };
    const auto drawn = [&](double lowest, double highest, Stream stream) {
      return core::random_between(lowest, highest, static_cast<std::uint64_t>(seed_), stream,
                                  index);
    };
    Eigen::Vector2d place;
    if (corners.empty()) {
      const auto [west, east] = area.extent(Eigen::Vector2d::UnitX());
      const auto [south, north] = area.extent(Eigen::Vector2d::UnitY());
      place = {drawn(west, east, kEast), drawn(south, north, kNorth)};
    } else {
      const bool has_heading = corners.size() > 1;
      const Eigen::Vector3d before =
          has_heading ? Eigen::Vector3d(corners.back() - corners[corners.size() - 2])
                      : Eigen::Vector3d::UnitX();
      const double most_turn = has_heading ? kMostTurn_rad : std::numbers::pi;
      const double heading =
          std::atan2(before.y(), before.x()) + drawn(-most_turn, most_turn, kEast);
      const double length_m = drawn(shortest_leg_m(), max_leg_m_, kNorth);
      place = corners.back().head<2>() +
              length_m * Eigen::Vector2d(std::cos(heading), std::sin(heading));
    }
    if (!area.contains(place)) return std::nullopt;
    const double near_w_m = corners.empty() ? 0.0 : corners.back().z();
    const Eigen::Vector3d corner(
        place.x(), place.y(),
        ground_w_m(place, near_w_m, context) + drawn(lowest_agl_m_, highest_agl_m_, kHeight));
    if (!corners.empty() && !can_fly(area, corners, corner, context)) return std::nullopt;
    return corner;
  }

  bool can_fly(const Area& area, const Corners& corners, const Eigen::Vector3d& next,
               const TrajectoryContext& context) const {
    const Eigen::Vector3d leg = next - corners.back();
    constexpr double kShareOfClimb = 0.9;
    if (std::abs(leg.z()) > leg.head<2>().norm() * std::tan(radians_from_degrees(
                                                       kShareOfClimb * flight_.max_climb_deg)))
      return false;
    if (!is_clear(area, corners.back(), next, context)) return false;
    if (corners.size() < 2) return true;
    // The rounded corner lies in the triangle of its legs' last and first metres.
    const Eigen::Vector3d& corner = corners.back();
    const Eigen::Vector3d back =
        turn_reach_m() * (corners[corners.size() - 2] - corner).normalized();
    const Eigen::Vector3d on = turn_reach_m() * leg.normalized();
    for (const double share : {0.25, 0.5, 0.75, 1.0})
      if (!is_clear(area, corner + share * back, corner + share * on, context)) return false;
    return true;
  }

  /// A straight line stays in the area and clear of the ground.
  bool is_clear(const Area& area, const Eigen::Vector3d& from, const Eigen::Vector3d& to,
                const TrajectoryContext& context) const {
    constexpr double kSpacing_m = 5.0;
    const auto count = static_cast<int>(std::ceil((to - from).norm() / kSpacing_m)) + 1;
    for (int i = 0; i <= count; ++i) {
      const Eigen::Vector3d at = from + (to - from) * (static_cast<double>(i) / count);
      if (!area.contains(at.head<2>())) return false;
      if (at.z() - ground_w_m(at.head<2>(), at.z(), context) < flight_.min_agl_m + clearance_m_)
        return false;
    }
    return true;
  }

  /// Controls along the legs, averaged so that corners become turns.
  /// spacing_m   wanted; what divides the length evenly comes back
  std::vector<Eigen::Vector3d> rounded(const Corners& corners, double& spacing_m) const {
    std::vector<double> lengths(1, 0.0);
    for (std::size_t i = 1; i < corners.size(); ++i)
      lengths.push_back(lengths.back() + (corners[i] - corners[i - 1]).norm());
    constexpr double kMostSteps = 400000.0;
    const double steps = std::ceil(lengths.back() / spacing_m);
    if (steps > kMostSteps)
      fail(ErrorKind::Config,
           "the legs are {:.0f} km long; at most {:.0f} km are flown at this speed",
           lengths.back() / 1000.0, kMostSteps * spacing_m / 1000.0);
    spacing_m = lengths.back() / steps;
    std::vector<double> axes[3];
    std::size_t leg = 1;
    for (std::size_t i = 0; i <= static_cast<std::size_t>(steps); ++i) {
      const double length_m = std::min(spacing_m * static_cast<double>(i), lengths.back());
      while (leg + 1 < corners.size() && lengths[leg] < length_m) ++leg;
      const double share = (length_m - lengths[leg - 1]) / (lengths[leg] - lengths[leg - 1]);
      const Eigen::Vector3d at = corners[leg - 1] + share * (corners[leg] - corners[leg - 1]);
      for (int axis = 0; axis < 3; ++axis) axes[axis].push_back(at[axis]);
    }
    const int reach = static_cast<int>(std::ceil(turn_reach_m() / spacing_m));
    for (auto& axis : axes) axis = smoothed(axis, reach, false);
    std::vector<Eigen::Vector3d> controls;
    for (std::size_t i = 0; i < axes[0].size(); ++i)
      controls.emplace_back(axes[0][i], axes[1][i], axes[2][i]);
    return controls;
  }

  std::vector<Corner> area_;
  std::int64_t seed_ = 1;
  std::int64_t num_legs_ = 20;
  double max_leg_m_ = 600.0;
  double lowest_agl_m_ = 60.0;
  double highest_agl_m_ = 150.0;
  double clearance_m_ = 10.0;
  FlightOptions flight_;
};

}  // namespace

TrajectoryKindInfo explore_trajectory() {
  return {.name = "explore",
          .summary = "Random legs within an area, clear of the ground.",
          .make = [] { return std::unique_ptr<TrajectoryKind>(new Explore); }};
}

}  // namespace terracast::geo
