#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/schema.h"

namespace terracast::sensors {

/// Config `[facts]`: what of a capture's facts is looked for.
struct FactOptions {
  std::vector<std::string> flags = all_flags();  ///< names of capture::flag_groups()

  static std::vector<std::string> all_flags();
  /// Their bits.
  std::uint32_t flag_bits() const;
  void describe(core::SchemaVisitor& visit);
};

}  // namespace terracast::sensors
