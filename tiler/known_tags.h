#pragma once

#include <vector>

#include "core/ledger.h"

namespace terracast::tiler {

/// What layers know of tags, for the documentation: of each those that it uses, then those that all ignore.
std::vector<core::KnownTable> known_tag_tables();

}  // namespace terracast::tiler
