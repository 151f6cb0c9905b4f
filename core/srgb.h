#pragma once

#include <cstdint>

namespace terracast::core {

/// Linear value of a code of 8 bits by the transfer function of sRGB (IEC 61966-2-1), 0 … 1.
float linear_from_srgb8(std::uint8_t code);

/// The code whose linear value is nearest in sRGB; what is no number or below 0 is 0, above 1 is 255.
std::uint8_t srgb8_from_linear(float linear);

}  // namespace terracast::core
