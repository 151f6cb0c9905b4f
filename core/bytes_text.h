#pragma once

#include <string>

namespace terracast::core {

/// A size for people, three digits: "30.7 MB". Units are powers of 1000.
std::string bytes_text(double bytes);

}  // namespace terracast::core
