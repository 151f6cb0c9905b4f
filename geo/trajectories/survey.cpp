#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/error.h"
#include "geo/paths/area.h"
#include "geo/paths/control_path.h"
#include "geo/paths/flight.h"
#include "geo/paths/ground_track.h"
#include "geo/trajectory.h"
#include "geo/units.h"

namespace terracast::geo {
namespace {

using core::ErrorKind;
using core::fail;

/// A camera's picture of level ground that it looks straight down at.
struct Footprint {
  double across_m, along_m;
};

/// The lines of a survey on the map.
struct Lines {
  Eigen::Vector2d along, across;                   ///< unit vectors
  std::vector<double> positions;                   ///< of the lines, across
  std::vector<std::pair<double, double>> extents;  ///< of each, along
};

class Survey final : public TrajectoryKind {
 public:
  void describe(core::SchemaVisitor& visit) override {
    visit.list("area", area_, "The corners of the area, in order; three or more.");
    visit.key("heading_deg", heading_deg_, "Direction of the first line, clockwise from north.",
              core::between(-360.0, 360.0));
    visit.key(
        "profile", profile_,
        "level: at one height, height_m above the highest measured ground of the area. terrain: "
        "height_m above the ground below, smoothed.",
        core::one_of({"level", "terrain"}));
    visit.key("height_m", height_m_, "Height above the ground, as profile says.",
              core::between(1.0, 20000.0));
    visit.key("view_across_deg", view_across_deg_,
              "The camera's field of view across the lines, looking straight down.",
              core::between(1.0, 170.0));
    visit.key("view_along_deg", view_along_deg_, "The same along the lines.",
              core::between(1.0, 170.0));
    visit.key("overlap", overlap_,
              "Share of a picture that the next of the line shows again, at height_m; the speed "
              "follows, with rate_hz.",
              core::between(0.0, 0.99));
    visit.key("sidelap", sidelap_,
              "Share that the picture of the next line shows again, at height_m.",
              core::between(0.0, 0.99));
    attitude_.describe(visit);
    visit.key("min_agl_m", min_agl_m_, "Least height above the measured ground.",
              core::between(0.0, 100000.0));
    visit.key("follow_length_m", follow_length_m_,
              "Length on both sides over which profile = \"terrain\" smooths the ground.",
              core::between(10.0, 20000.0));
    visit.key("max_climb_deg", max_climb_deg_, "Steepest climb or descent.",
              core::between(1.0, 80.0));
  }

  void validate() const override {
    if (min_agl_m_ > height_m_)
      fail(ErrorKind::Config, "min_agl_m = {} is more than height_m = {}", min_agl_m_, height_m_);
  }

  std::unique_ptr<TrajectoryKind> clone() const override { return std::make_unique<Survey>(*this); }

  std::unique_ptr<Trajectory> build(const TrajectoryContext& context) const override {
    validate();
    const Area area = resolve_area(area_, context);
    const Footprint footprint = footprint_at(height_m_);
    const FlightOptions flight = flight_options(footprint, context.rate_hz);
    const double radius_m = turn_radius_m(flight.speed_mps);
    const Lines lines = lines_over(area, footprint);
    const GroundTrack track = track_along(lines, radius_m, footprint);
    const std::size_t num_steps = steps_of(track, radius_m);
    const double spacing_m = track.length_m() / static_cast<double>(num_steps);
    std::vector<Eigen::Vector3d> controls;
    for (std::size_t i = 0; i <= num_steps; ++i) {
      const Eigen::Vector2d at = track.at(spacing_m * static_cast<double>(i));
      controls.emplace_back(at.x(), at.y(), 0.0);
    }
    if (profile_ == "level")
      fly_level(area, context, controls);
    else
      follow_terrain(context, spacing_m, controls);
    FlightPlan plan;
    plan.path = std::make_shared<ControlPath>(Flattened(context.frame.origin()), controls,
                                              spacing_m, attitude_.continuity_of_path());
    plan.attitude = attitude_.attitude();
    plan.how_to_raise = [](double) { return "raise height_m"; };
    return fly(plan, flight, context);
  }

 private:
  Footprint footprint_at(double agl_m) const {
    return {2.0 * agl_m * std::tan(0.5 * radians_from_degrees(view_across_deg_)),
            2.0 * agl_m * std::tan(0.5 * radians_from_degrees(view_along_deg_))};
  }

  FlightOptions flight_options(const Footprint& footprint, double rate_hz) const {
    FlightOptions flight;
    static_cast<AttitudeOptions&>(flight) = attitude_;
    flight.speed_mps = footprint.along_m * (1.0 - overlap_) * rate_hz;
    constexpr double kLeast_mps = 0.01, kMost_mps = 1000.0;
    if (flight.speed_mps < kLeast_mps || flight.speed_mps > kMost_mps)
      fail(ErrorKind::Config,
           "a picture of {:.1f} m of ground and overlap = {} at {} Hz make a speed of {:.3f} m/s; "
           "it is to be {} to {}: change rate_hz",
           footprint.along_m, overlap_, rate_hz, flight.speed_mps, kLeast_mps, kMost_mps);
    flight.min_agl_m = min_agl_m_;
    // The profile keeps clear of the ground at its controls; between them a little may be missing.
    flight.terrain_following = profile_ == "terrain";
    flight.follow_length_m = follow_length_m_;
    flight.max_climb_deg = max_climb_deg_;
    return flight;
  }

  /// Of a turn that banks by four fifths of what is allowed, or by 24 degrees where none banks.
  double turn_radius_m(double speed_mps) const {
    constexpr double kShareOfBank = 0.8, kLeastBank_deg = 5.0, kUsualBank_deg = 30.0;
    const double bank_deg = attitude_.bank == "none"
                                ? kUsualBank_deg
                                : std::max(attitude_.max_bank_deg, kLeastBank_deg);
    return std::max(1.0,
                    speed_mps * speed_mps /
                        (kGravity_mps2 * std::tan(radians_from_degrees(kShareOfBank * bank_deg))));
  }

  // The area's width is shared out evenly, so that the outer lines lie half a spacing inside.
  Lines lines_over(const Area& area, const Footprint& footprint) const {
    const double heading = radians_from_degrees(heading_deg_);
    Lines lines;
    lines.along = {std::sin(heading), std::cos(heading)};
    lines.across = {std::cos(heading), -std::sin(heading)};
    const auto [lowest, highest] = area.extent(lines.across);
    const double widest_m = footprint.across_m * (1.0 - sidelap_);
    const double wanted = std::max(1.0, std::ceil((highest - lowest) / widest_m));
    constexpr double kMostLines = 10000.0;
    if (wanted > kMostLines)
      fail(ErrorKind::Config,
           "the area is {:.0f} m wide and lines are {:.2f} m apart: {:.0f} lines; at most {:.0f} "
           "are flown. Fly higher, or over a smaller area",
           highest - lowest, widest_m, wanted, kMostLines);
    const double spacing_m = (highest - lowest) / wanted;
    for (std::size_t i = 0; i < static_cast<std::size_t>(wanted); ++i) {
      const double position = lowest + (static_cast<double>(i) + 0.5) * spacing_m;
      const auto extent = area.extent_of_strip(
          lines.along, lines.across, position - 0.5 * spacing_m, position + 0.5 * spacing_m);
      if (!extent) continue;
      lines.positions.push_back(position);
      lines.extents.push_back(*extent);
    }
    return lines;
  }

  // Each line goes on by a picture's advance at both ends, and to where the turn to the next begins
  // and ends beside it.
  GroundTrack track_along(const Lines& lines, double radius_m, const Footprint& footprint) const {
    const double run_out_m = footprint.along_m * (1.0 - overlap_);
    const auto begin_of = [&](std::size_t i) {  // in the direction of line i
      const auto& extent = lines.extents[i];
      return (i % 2 == 0 ? extent.first : -extent.second) - run_out_m;
    };
    const auto end_of = [&](std::size_t i) {
      const auto& extent = lines.extents[i];
      return (i % 2 == 0 ? extent.second : -extent.first) + run_out_m;
    };
    const Eigen::Vector2d start = begin_of(0) * lines.along + lines.positions[0] * lines.across;
    GroundTrack track(start, lines.along);
    double at = begin_of(0);
    for (std::size_t i = 0; i < lines.positions.size(); ++i) {
      const bool is_last = i + 1 == lines.positions.size();
      const double end = is_last ? end_of(i) : std::max(end_of(i), -begin_of(i + 1));
      track.go_straight(end - at);
      if (is_last) break;
      const double across_m = lines.positions[i + 1] - lines.positions[i];
      track.turn_back(i % 2 == 0 ? -across_m : across_m, radius_m);
      at = -end;
    }
    return track;
  }

  static std::size_t steps_of(const GroundTrack& track, double radius_m) {
    constexpr double kMostSteps = 400000.0;
    const double step_m = std::clamp(radius_m / 6.0, 0.5, 10.0);
    const double steps = std::ceil(track.length_m() / step_m);
    if (steps > kMostSteps)
      fail(ErrorKind::Config,
           "the lines are {:.0f} km long; that is more than {:.0f} steps of {:.1f} m. Fly higher, "
           "or over a smaller area",
           track.length_m() / 1000.0, kMostSteps, step_m);
    return std::max<std::size_t>(static_cast<std::size_t>(steps), 4);
  }

  void fly_level(const Area& area, const TrajectoryContext& context,
                 std::vector<Eigen::Vector3d>& controls) const {
    // A grid over the area, and the ground below the path itself.
    constexpr int kCells = 100;
    const auto [west, east] = area.extent(Eigen::Vector2d::UnitX());
    const auto [south, north] = area.extent(Eigen::Vector2d::UnitY());
    double highest_w_m = ground_w_m(controls.front().head<2>(), 0.0, context);
    for (int i = 0; i <= kCells; ++i)
      for (int k = 0; k <= kCells; ++k) {
        const Eigen::Vector2d at(west + (east - west) * i / kCells,
                                 south + (north - south) * k / kCells);
        if (area.contains(at))
          highest_w_m = std::max(highest_w_m, ground_w_m(at, highest_w_m, context));
      }
    for (const Eigen::Vector3d& control : controls)
      highest_w_m = std::max(highest_w_m, ground_w_m(control.head<2>(), highest_w_m, context));
    for (Eigen::Vector3d& control : controls) control.z() = highest_w_m + height_m_;
  }

  void follow_terrain(const TrajectoryContext& context, double spacing_m,
                      std::vector<Eigen::Vector3d>& controls) const {
    std::vector<double> ground_m;
    for (const Eigen::Vector3d& control : controls)
      ground_m.push_back(
          ground_w_m(control.head<2>(), ground_m.empty() ? 0.0 : ground_m.back(), context));
    const int reach = std::max(1, static_cast<int>(std::ceil(follow_length_m_ / spacing_m)));
    std::vector<double> heights = smoothed(ground_m, reach, false);
    // The spline stays within so many controls on both sides.
    const std::vector<double> obstacles =
        widened(ground_m, UniformSpline::reach_of(attitude_.continuity_of_path()), false);
    for (std::size_t i = 0; i < heights.size(); ++i)
      heights[i] = std::max(heights[i] + height_m_, obstacles[i] + min_agl_m_);
    constexpr double kShareOfClimb = 0.95;  // what is left is for the last corrections
    limit_steps(heights,
                spacing_m * std::tan(radians_from_degrees(kShareOfClimb * max_climb_deg_)));
    for (std::size_t i = 0; i < controls.size(); ++i) controls[i].z() = heights[i];
  }

  std::vector<Corner> area_;
  double heading_deg_ = 0.0;
  std::string profile_ = "level";
  double height_m_ = 120.0;
  double view_across_deg_ = 60.0;
  double view_along_deg_ = 45.0;
  double overlap_ = 0.8;
  double sidelap_ = 0.6;
  AttitudeOptions attitude_;
  double min_agl_m_ = 5.0;
  double follow_length_m_ = 200.0;
  double max_climb_deg_ = 30.0;
};

}  // namespace

TrajectoryKindInfo survey_trajectory() {
  return {.name = "survey",
          .summary =
              "Parallel lines over an area, with overlap and sidelap, level or over the terrain.",
          .make = [] { return std::unique_ptr<TrajectoryKind>(new Survey); }};
}

}  // namespace terracast::geo
