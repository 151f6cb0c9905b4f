#include "sensors/camera/fact_options.h"

#include <algorithm>

#include "capture/channel.h"

namespace terracast::sensors {

std::vector<std::string> FactOptions::all_flags() {
  std::vector<std::string> names;
  for (const capture::FlagGroup& group : capture::flag_groups()) names.emplace_back(group.name);
  return names;
}

std::uint32_t FactOptions::flag_bits() const {
  std::uint32_t bits = 0;
  for (const capture::FlagGroup& group : capture::flag_groups())
    if (std::find(flags.begin(), flags.end(), group.name) != flags.end()) bits |= group.bits;
  return bits;
}

void FactOptions::describe(core::SchemaVisitor& visit) {
  visit.key("flags", flags,
            "Which flags the capture holds of each pixel: edge (beside what else it shows: what is "
            "exported needs it), next and previous (whether the point is seen in the next and the "
            "previous frame: flow's masks), cameras (whether the rig's other cameras see it). Each "
            "costs a ray a pixel and more; those that are left out stay 0.",
            core::one_of(all_flags()));
}

}  // namespace terracast::sensors
