#pragma once

#include <string>
#include <string_view>

namespace terracast::batch {

/// A relative path as a URL (RFC 3986): bytes that a URL's path does not hold as they are become %XX.
std::string url_path(std::string_view path);

}  // namespace terracast::batch
