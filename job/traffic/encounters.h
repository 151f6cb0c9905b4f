#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "geo/trajectory.h"

namespace terracast::job {

/// Room before and behind whatever goes along, and beside it.
inline constexpr double kRoomAlong_m = 1.0;
inline constexpr double kRoomAside_m = 0.12;

/// What something takes up on the map.
struct Footprint {
  Eigen::Vector2d at_world = Eigen::Vector2d::Zero();
  Eigen::Vector2d forward = Eigen::Vector2d::UnitX();  ///< of length 1
  double length_m = 0.0;
  double width_m = 0.0;
  /// Of the deck that carries it; NaN: it is on the ground.
  double deck_z_world = std::numeric_limits<double>::quiet_NaN();
  /// The deck ends near: it is on the ground too.
  bool is_deck_end = false;
  double room_along_m = kRoomAlong_m;  ///< of what does not go: kRoomAside_m
};

/// Whether two of them would be on one place, with their room. One on a deck, not at its end, and one on the ground, or
/// two on decks of different heights, are not.
bool meet(const Footprint& a, const Footprint& b);

/// Something else that moves on the ground, at times of its own; between them it goes straight.
struct Obstacle {
  std::vector<std::optional<geo::BodyState>>
      states;  ///< nothing: it is not there, or not low enough to be in the way
  double length_m = 0.0;
  double width_m = 0.0;
  std::optional<Footprint> at(double time_s) const;
};

/// Someone who goes: where, at any time.
class Traveller {
 public:
  virtual ~Traveller() = default;
  /// Whose is higher gives way; those of one key, as cars of a train, do not meet.
  virtual std::uint64_t key() const = 0;
  /// Whoever does not gives way to it.
  virtual bool goes_first() const { return false; }
  virtual Footprint at(double time_s) const = 0;
  /// So long after another that goes before it in one line it is where that one was, from middle to middle, if both
  /// have headways; 0: it has none.
  virtual double headway_s() const { return 0.0; }
};

/// How those fared who would meet something.
struct Encounters {
  std::vector<std::uint8_t> is_blocked;  ///< by what is no traveller
  std::vector<std::uint8_t> gives_way;   ///< to another traveller that is not blocked
};

/// Looks at all times up to `duration_s`, kLook_s apart, and for headways as far beyond. Two that go the same way in one
/// line, nearer in time than the headway of the one behind, meet as well. Things may be of any size. Who stays does not
/// depend on who is left out for others: so it is the same wherever one looks at a part of them only.
/// standing   what never moves; its deck is its own height
Encounters find_encounters(std::span<const Traveller* const> travellers,
                           std::span<const Obstacle> obstacles, std::span<const Footprint> standing,
                           double duration_s);
inline constexpr double kLook_s = 0.1;

}  // namespace terracast::job
