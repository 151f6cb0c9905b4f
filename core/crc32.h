#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace terracast::core {

/// The CRC-32 of zlib, PNG and MCAP (polynomial 0xedb88320, reflected, inverted before and after).
/// before   the CRC of the bytes that precede these; 0: none do
std::uint32_t crc32_of(std::span<const std::byte> bytes, std::uint32_t before = 0);

}  // namespace terracast::core
