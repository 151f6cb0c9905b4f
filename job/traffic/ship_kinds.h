#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace terracast::job {

/// A kind of boat or ship that is on its way.
struct ShipKind {
  std::string_view thing;
  double share = 0.0;  ///< of all that are under way
  double speed_mps = 0.0;
  double draught_m = 0.0;
  bool is_at_sea_alone = false;
};
std::span<const ShipKind> ship_kinds();
/// Their things, for messages.
std::vector<std::string> ship_names();

/// Ships and boats that are under way, on a square kilometre of water that is open to all of them.
inline constexpr double kShipsPerKm2 = 0.5;

}  // namespace terracast::job
