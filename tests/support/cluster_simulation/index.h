#pragma once

#include <cstddef>

namespace terracast::test {

/// The place in a vector that an int names.
inline std::size_t at(int index) { return static_cast<std::size_t>(index); }

}  // namespace terracast::test
