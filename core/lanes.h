#pragma once

#include <array>
#include <cstddef>

namespace terracast::core {

/// How many samples are shaded together.
inline constexpr int kLanes = 16;

/// One value for each sample of a packet. Loops over all kLanes of it are what the compiler turns
/// into vector code.
template <class T>
struct Lanes {
  T values[kLanes];
  T& operator[](int lane) { return values[lane]; }
  const T& operator[](int lane) const { return values[lane]; }
};

/// A vector or colour for each sample.
using Lanes3f = std::array<Lanes<float>, 3>;
using Lanes3d = std::array<Lanes<double>, 3>;

}  // namespace terracast::core
