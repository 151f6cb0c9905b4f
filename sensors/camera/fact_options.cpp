#include "sensors/camera/fact_options.h"

#include <algorithm>

#include "capture/channel.h"

namespace terracast::sensors {

std::vector<std::string> FactOptions::all_flags() {
  std::vector<std::string> names;
  for (const capture::FlagGroup& group : capture::flag_groups()) names.emplace_back(group.name);
  return names;
}

bool FactOptions::has_needed() const {
  return std::find(flags.begin(), flags.end(), kNeeded) != flags.end();
}

void FactOptions::resolve(std::uint32_t needed_bits) {
  if (!has_needed()) return;
  follow_exports = true;
  const std::uint32_t bits = flag_bits() | needed_bits;
  flags.clear();
  for (const capture::FlagGroup& group : capture::flag_groups())
    if ((group.bits & bits) != 0) flags.emplace_back(group.name);
}

std::uint32_t FactOptions::flag_bits() const {
  std::uint32_t bits = 0;
  for (const capture::FlagGroup& group : capture::flag_groups())
    if (std::find(flags.begin(), flags.end(), group.name) != flags.end()) bits |= group.bits;
  return bits;
}

void FactOptions::describe(core::SchemaVisitor& visit) {
  std::vector<std::string> choices = all_flags();
  choices.emplace_back(kNeeded);
  visit.key("flags", flags,
            "Which flags the capture holds of each pixel: edge (beside what else it shows), next "
            "and previous (whether the point is seen in the next and the previous frame: flow's "
            "masks), cameras (whether the rig's other cameras see it), needed (those that the "
            "exports need). Each costs a ray a pixel and more; those that are left out stay 0.",
            core::one_of(std::move(choices)));
}

}  // namespace terracast::sensors
