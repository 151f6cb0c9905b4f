#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "world/tile.h"

namespace terracast::world {

/// What a way is for, as OpenStreetMap's `highway`, or `railway`, has it.
enum class WayKind : std::uint8_t {
  Motorway = 0,
  Trunk,
  Primary,
  Secondary,
  Tertiary,
  MotorwayLink,
  TrunkLink,
  PrimaryLink,
  SecondaryLink,
  TertiaryLink,
  Unclassified,
  Road,
  Residential,
  LivingStreet,
  Service,
  Busway,
  Track,
  Pedestrian,
  Footway,
  Cycleway,
  Path,
  Bridleway,
  Steps,
  Rail,
  LightRail,
  Tram,
  NarrowGauge,
  Subway,
  Preserved,
  Funicular,
};
inline constexpr int kNumWayKinds = 30;
constexpr bool is_railway(WayKind kind) { return kind >= WayKind::Rail; }

/// A part of a way between two places where ways meet or end, as it lies in the world, its corners rounded.
struct WayPart {
  std::uint8_t layer = 0;     ///< row of WorldManifest::layers
  std::uint64_t feature = 0;  ///< of its source
  WayKind kind = WayKind::Residential;
  bool may_go_forward = true;  ///< along its points; for vehicles, or trains
  bool may_go_backward = true;
  bool is_bridge = false;
  bool is_tunnel = false;
  bool is_siding = false;            ///< a track of a yard, a siding, a spur or a crossover
  std::uint8_t num_lanes = 1;        ///< of both directions; tracks of a railway
  std::uint16_t max_speed_kmph = 0;  ///< as its source says; 0: it does not
  /// Of the paving, and of a sidewalk beside it on both sides (0: there is none), in steps of kHeightStep_m.
  std::int32_t half_width_steps = 0;
  std::int32_t sidewalk_steps = 0;
  /// Lanes of equal width lie between these, from the line to the left.
  std::int32_t lanes_left_steps = 0;
  std::int32_t lanes_right_steps = 0;
  std::uint32_t from_node = 0;
  std::uint32_t to_node = 0;
  /// World x, y, and z of a bridge's deck, elsewhere 0; in the direction of its source's way; at least two.
  std::vector<Eigen::Vector3i> points_steps;

  Eigen::Vector2d at_world(std::size_t point) const {
    return points_steps[point].head<2>().cast<double>() * kHeightStep_m;
  }
  bool operator==(const WayPart&) const = default;
};

/// The ways of a world, and how they hang together: parts with a node in common meet there.
struct WayNetwork {
  std::uint32_t num_nodes = 0;
  std::vector<WayPart> parts;

  bool operator==(const WayNetwork&) const = default;
};

inline constexpr std::uint16_t kWayFileVersion = 2;

/// The file `ways.bin` of a world's folder: a header with a checksum, and the network, deflated, little-endian.
std::vector<std::byte> encode_ways(const WayNetwork& network);
/// throws   Input: damaged, or of another version; names `file`
WayNetwork decode_ways(std::span<const std::byte> bytes, const std::string& file);

}  // namespace terracast::world
