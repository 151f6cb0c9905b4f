#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "core/semantic_class.h"
#include "tiler/vector_source.h"
#include "world/ground_paint.h"
#include "world/way_network.h"

namespace terracast::tiler {

/// Ways of one use are joined end to end; those of different uses only meet.
enum class WayUse : std::uint8_t { Road, Path, Railway, Airfield };

/// How a way is built: what its tags say, completed by its class and bounded.
struct WayStyle {
  WayUse use = WayUse::Road;
  int rank = 0;                                ///< the higher goes straight on where ways meet
  double half_width_m = 3.0;                   ///< of the paving
  double shoulder_m = 1.5;                     ///< level beside it
  double sidewalk_m = 0.0;                     ///< paved on both sides, within the shoulder
  int num_lanes = 1;                           ///< as world::Strip::num_lanes
  double lane_m = 3.0;                         ///< of a road's class
  int level = 0;                               ///< `layer`
  world::WayKind kind = world::WayKind::Road;  ///< of roads, paths and railways
  int max_speed_kmph = 0;                      ///< 0: no tag says
  bool is_oneway = false;
  bool is_against = false;        ///< one-way, against the order of its points
  bool has_motor_traffic = true;  ///< of roads
  bool is_siding = false;         ///< of railways: no track that trains run through on
  bool is_bridge = false;
  bool is_tunnel = false;
  bool is_shaped = true;     ///< the ground is cut and filled for it
  bool is_lit_town = false;  ///< class of streets between houses
  double max_grade = 0.1;
  double smooth_m = 30.0;    ///< the ground is smoothed over about so much along it
  double bend_m = 1.0;       ///< corners of its line are cut by no more
  double clearance_m = 5.0;  ///< that what crosses above it leaves
  world::Paving paving = world::Paving::Asphalt;
  world::Marking marking = world::Marking::None;
  core::SemanticClass semantic_class = core::SemanticClass::Road;
  std::int16_t order = 0;
  int coarsest_level = 5;  ///< of tiles on which it is painted

  bool operator==(const WayStyle&) const = default;
};

/// nullopt: it is no way that is built: none of the keys, or planned, razed, indoors.
/// num_repaired   is raised where a width or a number of lanes was no plausible one
std::optional<WayStyle> way_style(const FeatureTags& tags, std::int64_t& num_repaired);

/// Whether it is a class of roads (`highway`), and no path.
bool is_road_class(std::string_view highway);

/// Width of the lanes of a class of roads (`highway`) where tags say no more.
/// throws   Internal: no such class
double class_lane_m(std::string_view highway);

enum class PadUse : std::uint8_t { Painted, Level, Airfield, Pier };

/// How an area is built.
struct PadStyle {
  PadUse use = PadUse::Painted;
  world::Paving paving = world::Paving::Asphalt;
  core::SemanticClass semantic_class = core::SemanticClass::Parking;
  std::int16_t order = 0;
  bool has_stands = false;
  int coarsest_level = 4;
};

/// nullopt: it is none of the areas that are built, or is carried by a bridge. Whether it can be seen is not looked at.
std::optional<PadStyle> pad_style(const FeatureTags& tags);

/// Painting orders of what has no way of its own.
constexpr std::int16_t kSidewalkOrder = 150;
constexpr std::int16_t kStandsOrder = 95;
constexpr std::int16_t kCrossingOrder = 520;

}  // namespace terracast::tiler
