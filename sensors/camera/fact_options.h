#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/schema.h"

namespace terracast::sensors {

/// Config `[facts]`: what of a capture's facts is looked for.
struct FactOptions {
  /// Stands for the flags that a config's exports need.
  static constexpr const char* kNeeded = "needed";

  std::vector<std::string> flags = {kNeeded};  ///< names of capture::flag_groups(), and kNeeded
  bool follow_exports = false;                 ///< resolve() replaced kNeeded

  static std::vector<std::string> all_flags();
  /// All flags.
  static FactOptions all() { return {.flags = all_flags()}; }
  /// Replaces kNeeded by the groups of bits.
  void resolve(std::uint32_t needed_bits);
  /// Bits of the named flags, without those that kNeeded stands for.
  std::uint32_t flag_bits() const;
  bool has_needed() const;
  void describe(core::SchemaVisitor& visit);
};

}  // namespace terracast::sensors
