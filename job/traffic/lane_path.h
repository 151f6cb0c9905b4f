#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <limits>
#include <span>
#include <vector>

#include "job/traffic/way_graph.h"

namespace terracast::job {

/// A place on the way of something.
struct PathPoint {
  Eigen::Vector2d at_world;
  double limit_mps = 0.0;
  double deck_z_world =
      std::numeric_limits<double>::quiet_NaN();  ///< of a bridge; NaN: there is none
  /// The deck ends so near that what is long is on the ground there too.
  bool is_deck_end = false;
};

/// An arm, gone along so far to the right of its line.
struct Leg {
  Arm arm;
  double right_m = 0.0;
  double limit_mps = 0.0;
};

/// How one turns where ways meet: on a curve of about such a radius, to the side on which one goes and to the other.
struct TurnRadii {
  double right_m = 4.0;
  double left_m = 7.0;
};

/// The way over arms that follow each other, as points so far apart. At junctions it leaves the lines beside which it
/// goes for a smooth curve between them. Decks are known 8 m beyond their ends, and as far on both sides of these, and of
/// the path's own, they count as the ground too.
std::vector<PathPoint> lane_path(const WayGraph& graph, std::span<const Leg> legs,
                                 const TurnRadii& radii, double spacing_m);

/// What is needed of a path: from some way before a start, whose bends are still felt, for as long as it takes at least.
/// Parts of one lane are cut at the same places.
/// behind_m  of what is as long, behind the start
/// start_m   along the path; afterwards along its curve
std::vector<PathPoint> cut_out(const std::vector<PathPoint>& path, double spacing_m, double lasts_s,
                               double behind_m, double& start_m);

/// The uniform cubic B-spline of a path's points: curvature is continuous, and it keeps to the path within a sixth of
/// how far its neighbours' middle is off each point. It begins at the second point and ends at the last but one.
class PathCurve {
 public:
  /// points   four or more
  explicit PathCurve(std::vector<PathPoint> points);

  double length_m() const { return starts_m_.back(); }
  struct Place {
    Eigen::Vector2d at_world;
    Eigen::Vector2d tangent;       ///< of length 1
    double curvature_per_m = 0.0;  ///< above 0: to the left
    double limit_mps = 0.0;
    double deck_z_world = 0.0;
    bool is_deck_end = false;
  };
  /// at_m       along the curve, in [0, length_m]
  /// accuracy   of how far along it is: 1e-6 m over points 2 m apart that turn at 4 m radius, 1e-5 m in a hairpin of
  ///            90 degrees at each of two points; continuous. PathCurve tests, against the sum of short chords
  Place at(double at_m) const;

 private:
  struct Local;
  Local local(std::size_t segment, double u) const;
  double length_of(std::size_t segment, double to_u) const;

  std::vector<PathPoint> points_;
  std::vector<double> starts_m_;  ///< of each segment, and of what would follow the last
};

/// Whether all of a curve from one place to another stays clear of the border of a world's square.
bool is_inside(const PathCurve& curve, double from_m, double to_m, double half_size_m);

/// Where no deck is: what rides its way looks for none so low.
inline constexpr double kNoDeck_m = -1e5;

}  // namespace terracast::job
