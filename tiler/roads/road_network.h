#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "tiler/roads/way_style.h"
#include "tiler/vector_source.h"

namespace terracast::tiler {

/// A way as its source has it.
struct Way {
  std::uint64_t feature = 0;
  WayStyle style;
  std::string ref = {};  ///< of runways
  PointsWorld points_world;
};

/// What was repaired or left out.
struct NetworkCounts {
  std::int64_t num_without_length = 0;
  std::int64_t num_not_finite = 0;  ///< points
  std::int64_t num_duplicates = 0;
  std::int64_t num_thinned = 0;  ///< ways of too many points, all in all or in a square
  std::int64_t num_crowded = 0;  ///< parts of ways within the square, left out where too many lie
  std::int64_t num_outside = 0;  ///< ways that lie beyond the square, or leave it
};

/// A place where ways meet or end.
struct Junction {
  Eigen::Vector2d at_world;
  int num_ends = 0;
  std::uint32_t station = 0;
};

/// A place of a network whose height is solved for.
struct Station {
  Eigen::Vector2d at_world;
  std::uint32_t line = 0;  ///< one of those that pass
  double along_m = 0.0;    ///< that line
};

/// A part of a line that is of one way, from a junction to the next.
struct Span {
  std::uint32_t way = 0;  ///< of RoadNetwork::ways
  bool is_reversed = false;
  std::uint32_t from_junction = 0;
  std::uint32_t to_junction = 0;
  std::uint32_t first_point = 0;  ///< of the line
  std::uint32_t last_point = 0;
};

/// A way as it is driven: spans that go on from each other, with its corners rounded.
struct Line {
  struct Point {
    Eigen::Vector2d at_world;
    Eigen::Vector2d tangent =
        Eigen::Vector2d::Zero();  ///< of length 1; the line's cross-section is square to it
    double along_m = 0.0;
    // Its height lies between two stations'.
    std::uint32_t station = 0;
    std::uint32_t next_station = 0;
    double share = 0.0;  ///< of the next one

    bool is_at_station() const { return share == 0.0 || share == 1.0; }
    /// Of points at a station.
    std::uint32_t station_here() const { return share == 0.0 ? station : next_station; }
  };
  std::vector<Point> points;
  std::vector<Span> spans;
  bool is_closed = false;

  double length_m() const { return points.back().along_m; }
};

/// A part of one span, from a station to another.
struct Stretch {
  std::uint32_t line = 0;
  std::uint32_t span = 0;  ///< of its line
  std::uint32_t first_point = 0;
  std::uint32_t last_point = 0;
};

/// Two stations of a line, one after the other.
struct Link {
  std::uint32_t from = 0;
  std::uint32_t to = 0;
  double length_m = 0.0;
  std::uint32_t way = 0;
  bool is_at_junction = false;  ///< its line ends near, where others meet
};

/// Ways split where they meet and joined where they go on: the same for the same ways in any order.
class RoadNetwork {
 public:
  /// half_size_m   of the world's square; what lies beyond it by more than some metres is cut off
  RoadNetwork(std::vector<Way> ways, double half_size_m);

  const std::vector<Way>& ways() const { return ways_; }
  const std::vector<Junction>& junctions() const { return junctions_; }
  const std::vector<Line>& lines() const { return lines_; }
  const std::vector<Station>& stations() const { return stations_; }
  const std::vector<Link>& links() const { return links_; }
  const NetworkCounts& counts() const { return counts_; }

  const WayStyle& style(const Span& span) const { return ways_[span.way].style; }

  /// Makes tunnels of stretches, which become spans of their own.
  /// stretches   sorted along the lines
  void run_below_ground(const std::vector<Stretch>& stretches);

 private:
  struct Edge;
  struct Chain;

  std::vector<Edge> split();
  std::vector<Chain> join(const std::vector<Edge>& edges);
  void make_line(const Chain& chain, const std::vector<Edge>& edges);
  std::uint32_t junction_at(const Line::Point& point);

  std::vector<Way> ways_;
  std::vector<Junction> junctions_;
  std::vector<Line> lines_;
  std::vector<Station> stations_;
  std::vector<Link> links_;
  NetworkCounts counts_;
};

}  // namespace terracast::tiler
