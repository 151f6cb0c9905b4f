#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/error.h"
#include "geo/paths/area.h"
#include "geo/paths/control_path.h"
#include "geo/paths/flight.h"
#include "geo/paths/ground_track.h"
#include "geo/paths/over_ground.h"
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
    visit.key("double_grid", double_grid_,
              "Fly the area a second time, with lines across the first ones.");
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
    const double radius_m = attitude_.turn_radius_m(flight.speed_mps);
    GroundTrack track = track_along(lines_over(area, footprint, heading_deg_), radius_m, footprint);
    if (double_grid_) {
      const Lines across = lines_over(area, footprint, heading_deg_ + 90.0);
      go_along(across, radius_m, footprint, track);
    }
    TrackControls controls = controls_along(track, radius_m, "Fly higher, or over a smaller area");
    if (profile_ == "level")
      fly_level(area, context, controls);
    else
      follow_terrain({.height_m = height_m_,
                      .min_agl_m = min_agl_m_,
                      .follow_length_m = follow_length_m_,
                      .max_climb_deg = max_climb_deg_,
                      .continuity = attitude_.continuity_of_path()},
                     context, controls);
    FlightPlan plan;
    plan.path = std::make_shared<ControlPath>(Flattened(context.frame.origin()), controls.controls,
                                              controls.spacing_m, attitude_.continuity_of_path());
    plan.attitude = attitude_.attitude();
    plan.how_to_raise = [](double) { return "raise height_m"; };
    plan.how_to_follow = "set profile = \"terrain\"";
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

  // The area's width is shared out evenly, so that the outer lines lie half a spacing inside.
  Lines lines_over(const Area& area, const Footprint& footprint, double heading_deg) const {
    const double heading = radians_from_degrees(heading_deg);
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

  GroundTrack track_along(const Lines& lines, double radius_m, const Footprint& footprint) const {
    GroundTrack track(start_of(lines, footprint), lines.along);
    go_along(lines, radius_m, footprint, track);
    return track;
  }

  double run_out_m(const Footprint& footprint) const {
    return footprint.along_m * (1.0 - overlap_);
  }

  /// Where the first line begins.
  Eigen::Vector2d start_of(const Lines& lines, const Footprint& footprint) const {
    return (lines.extents[0].first - run_out_m(footprint)) * lines.along +
           lines.positions[0] * lines.across;
  }

  // Each line goes on by a picture's advance at both ends, and to where the turn to the next begins
  // and ends beside it.
  void go_along(const Lines& lines, double radius_m, const Footprint& footprint,
                GroundTrack& track) const {
    const auto begin_of = [&](std::size_t i) {  // in the direction of line i
      const auto& extent = lines.extents[i];
      return (i % 2 == 0 ? extent.first : -extent.second) - run_out_m(footprint);
    };
    const auto end_of = [&](std::size_t i) {
      const auto& extent = lines.extents[i];
      return (i % 2 == 0 ? extent.second : -extent.first) + run_out_m(footprint);
    };
    if (track.length_m() > 0.0) track.go_to(start_of(lines, footprint), lines.along, radius_m);
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
  }

  void fly_level(const Area& area, const TrajectoryContext& context, TrackControls& track) const {
    // A grid over the area, and the ground below the path itself.
    constexpr int kCells = 100;
    const auto [west, east] = area.extent(Eigen::Vector2d::UnitX());
    const auto [south, north] = area.extent(Eigen::Vector2d::UnitY());
    double highest_w_m = ground_w_m(track.controls.front().head<2>(), 0.0, context);
    for (int i = 0; i <= kCells; ++i)
      for (int k = 0; k <= kCells; ++k) {
        const Eigen::Vector2d at(west + (east - west) * i / kCells,
                                 south + (north - south) * k / kCells);
        if (area.contains(at))
          highest_w_m = std::max(highest_w_m, ground_w_m(at, highest_w_m, context));
      }
    highest_w_m = highest_ground_w_m(track, highest_w_m, context);
    for (Eigen::Vector3d& control : track.controls) control.z() = highest_w_m + height_m_;
  }

  std::vector<Corner> area_;
  double heading_deg_ = 0.0;
  bool double_grid_ = false;
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
