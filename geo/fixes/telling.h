#pragma once

#include <string>

#include "core/log.h"
#include "geo/fixes/fix.h"

namespace terracast::geo {

/// What a file of a recording says besides its fixes, for the log.
struct FileFacts {
  core::Ledger ledger;
  std::map<std::string, std::size_t> empty;
  std::vector<std::string> remarks;
};

/// Tells what was assumed, what is empty, what is ignored, and warns of the first hundred kinds of what is not known
/// or not understood.
/// file   as the config calls it
void tell_of_file(const FileFacts& facts, const std::string& file, const core::Log& log);

}  // namespace terracast::geo
