#pragma once

#include <string>

namespace terracast::cli {

/// docs/sources.md: what the readers of foreign files make of the tags, keys, attributes and elements that they know.
std::string sources_page();

}  // namespace terracast::cli
