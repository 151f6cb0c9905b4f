#include "job/traffic/ship_kinds.h"

#include <array>

namespace terracast::job {
namespace {

// Knots over the ground of what such ships usually make: yachts 6 under sail, motor boats 16 and 18, trawlers 9, coasters
// 12, ferries 21, container ships 18 (slow steaming), tankers and bulkers 14. Draughts are those of the things
// (`terracast list things`) and of like boats. Shares: many small, few large, as on a coast by day.
constexpr std::array<ShipKind, 10> kKinds = {{{"sailing_yacht", 0.40, 3.1, 2.0, false},
                                              {"motor_boat", 0.20, 8.2, 0.6, false},
                                              {"motor_yacht", 0.12, 9.3, 1.2, false},
                                              {"fishing_boat", 0.08, 4.6, 3.0, false},
                                              {"coaster", 0.06, 6.2, 5.5, true},
                                              {"ferry", 0.05, 10.8, 6.5, true},
                                              {"feeder_ship", 0.04, 9.3, 8.5, true},
                                              {"tanker", 0.03, 7.2, 12.0, true},
                                              {"bulk_carrier", 0.01, 7.2, 14.4, true},
                                              {"container_ship", 0.01, 9.3, 12.04, true}}};

}  // namespace

std::span<const ShipKind> ship_kinds() { return kKinds; }

std::vector<std::string> ship_names() {
  std::vector<std::string> names;
  for (const ShipKind& kind : kKinds) names.emplace_back(kind.thing);
  return names;
}

}  // namespace terracast::job
