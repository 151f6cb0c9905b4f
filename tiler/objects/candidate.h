#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string_view>
#include <vector>

namespace terracast::tiler {

/// What puts things into a world. Of two that want one place the earlier in this list stands.
enum class Rule : std::uint8_t {
  Placements,
  PowerLines,
  Landmarks,
  Aircraft,
  Ships,
  Ports,
  Boats,
  Yards,
  StreetLamps,
  Barriers,
  ParkedCars,
  Traffic,
};
inline constexpr int kNumRules = 12;
std::string_view rule_name(Rule rule);

/// On what a thing may stand.
enum class Footing : std::uint8_t {
  Land,   ///< dry ground that no other layer holds
  Paved,  ///< dry ground, where roads and parking places may be
  Water,
  Any,  ///< wherever a list says
};

/// A thing that may come to stand at a place: it is decided by what is there, once for the world.
struct Candidate {
  Rule rule = Rule::Placements;
  Footing footing = Footing::Land;
  std::uint64_t feature = 0;
  std::uint64_t key = 0;  ///< of itself, the same whatever else there is
  Eigen::Vector2d place_world = Eigen::Vector2d::Zero();
  std::uint16_t heading = 0;  ///< as world::Instance
  std::uint16_t scale = 4096;
  std::uint32_t thing = 0;  ///< row of all_things(); beyond them, of the models
  std::uint8_t variant = 0;
  std::uint8_t num_stacked = 1;
  double above_m = 0.0;   ///< over the ground or water
  double steepest = 1.0;  ///< ground on which it may stand, rise over run
  bool joins = false;     ///< it reaches to what stands there: it neither takes room nor needs any
};

/// In 2^-16 turns anticlockwise from east.
std::uint16_t heading_of(const Eigen::Vector2d& direction);
/// deg   clockwise from north
std::uint16_t heading_of_compass(double deg);

}  // namespace terracast::tiler
