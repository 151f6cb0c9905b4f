#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "tiler/country/occupancy.h"
#include "tiler/country/survey.h"

namespace terracast::tiler::country {

enum class RoadKind : std::uint8_t {
  Motorway,
  MotorwayLink,
  Primary,
  Secondary,
  Tertiary,
  Unclassified,
  Residential,
  Pedestrian,
  Service,
  Track
};

struct RoadRule {
  std::string_view highway;
  double width_m;  ///< of the carriageway
  double steepest;
  std::string_view surface;
  int lanes;
  int max_speed;
};
const RoadRule& rule_of(RoadKind kind);

/// A road, street or track on the ground. Ways that meet share a point.
struct Way {
  PointsWorld line;
  RoadKind kind = RoadKind::Residential;
  bool is_urban = false;  ///< with pavements and lamps
  double half_width_m() const { return 0.5 * rule_of(kind).width_m; }
};

/// Gives ways a common point wherever they cross or end at each other. Crossings within a few metres of a
/// corner take that corner.
void join_at_crossings(std::vector<Way>& ways, double half_size_m);

/// A part of a way that does not lie on the ground.
struct StructureSpan {
  double from_m;
  double to_m;
  bool is_tunnel;
};

/// Where lines are crossed: rivers, railways, motorways.
class Barriers {
 public:
  explicit Barriers(double half_size_m) : index_(half_size_m) {}
  /// clear_m   on each side of the line that is spanned
  void add(const PointsWorld& line, double clear_m);
  /// Where a way crosses them, as far as it is not clear of them.
  std::vector<StructureSpan> spans(const PointsWorld& way) const;
  /// Whether a piece of a line runs along one of theirs.
  bool has_piece(const Point& from, const Point& to) const;

 private:
  struct Piece {
    Point from, to;
    double clear_m;
  };
  /// From a place to what is kept clear, below 0 within; no more than a bound.
  double room_m(const Point& at, double most_m) const;

  std::vector<Piece> pieces_;
  PlaceIndex index_;
  mutable std::vector<std::int32_t> found_, found_near_;
};

/// Overlapping spans as one, none nearer than 30 m to the next, all within the line.
std::vector<StructureSpan> merged(std::vector<StructureSpan> spans, double length_m);
/// Writes a line in pieces, those of spans with bridge=yes or tunnel=yes and a layer.
void add_spanned_line(Survey& survey, Theme theme, const PointsWorld& line,
                      const std::vector<StructureSpan>& spans, const Tags& tags);

}  // namespace terracast::tiler::country
