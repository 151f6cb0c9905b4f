#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "core/semantic_class.h"

namespace terracast::world {

/// What a strip or an area of the ground is covered with; how it is drawn is render's.
enum class Paving : std::uint8_t {
  Asphalt = 0,
  Concrete,
  Cobbles,
  Gravel,
  Earth,
  Ballast,  ///< of railways, with sleepers and rails
  Grass,
  Sand,
  Water,  ///< of streams too narrow for the terrain
};
inline constexpr int kNumPavings = 9;

/// What is marked on a strip.
enum class Marking : std::uint8_t {
  None = 0,
  Center,  ///< a broken line along the middle
  CenterSolid,
  Lanes,     ///< edges solid, lanes broken
  Motorway,  ///< as Lanes, with a hard shoulder on the right
  Runway,    ///< centre line, edges, thresholds and numbers at both ends
  Taxiway,   ///< a yellow line along the middle
  Crossing,  ///< zebra; the line is the way of those who walk
  Rails,     ///< two rails a track
  Stands,    ///< parking places across; wider than 10 m: a row on each side of a lane
};
inline constexpr int kNumMarkings = 10;

/// What is painted on the ground: it has no thickness. Where several lie over each other, the one
/// with the highest order is seen; among equals, the one with the greater feature; of one feature,
/// the strip whose line is nearest, then the tile's first; an area where there is no strip.
struct Coating {
  std::uint8_t layer = 0;     ///< row of WorldManifest::layers
  std::uint64_t feature = 0;  ///< of its source
  std::int16_t order = 0;
  Paving paving = Paving::Asphalt;
  core::SemanticClass semantic_class = core::SemanticClass::Road;
  bool operator==(const Coating&) const = default;
};

/// A band along a line: all places within half its width of the line, ends and bends round.
struct Strip {
  Coating coating;
  Marking marking = Marking::None;
  std::uint8_t num_lanes = 1;  ///< over the whole width; Rails: tracks; Runway: its number, 1 … 36
  std::int32_t half_width_steps = 0;  ///< of kHeightStep_m, as the points
  /// Of the first point, along the whole line of which this is a part, m: so that marks go on.
  double start_m = 0.0;
  double whole_m = 0.0;           ///< length of the whole line
  double unmarked_start_m = 0.0;  ///< of the whole line, at its start: a junction
  double unmarked_end_m = 0.0;
  std::vector<Eigen::Vector2i> points_steps;  ///< world x, y; at least two, no two alike in a row

  bool operator==(const Strip&) const = default;
};

/// An area: all places that an odd number of its rings goes round.
struct Area {
  Coating coating;
  /// World x, y, in steps of kHeightStep_m; each ring is closed by its first point, which is not
  /// repeated.
  std::vector<std::vector<Eigen::Vector2i>> rings_steps;

  bool operator==(const Area&) const = default;
};

/// What is painted at a place.
struct PaintSample {
  bool is_painted = false;
  Coating coating;
  // Of a strip; of an area, Marking::None.
  Marking marking = Marking::None;
  std::uint8_t num_lanes = 1;
  double across_m = 0.0;  ///< from its line, to the left
  double along_m = 0.0;   ///< along the whole line
  double half_width_m = 0.0;
  double whole_m = 0.0;
  double unmarked_start_m = 0.0;
  double unmarked_end_m = 0.0;
};

}  // namespace terracast::world
