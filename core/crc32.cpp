#include "core/crc32.h"

#include <libdeflate.h>

namespace terracast::core {

std::uint32_t crc32_of(std::span<const std::byte> bytes, std::uint32_t before) {
  // For a null pointer libdeflate returns its start value, whatever came before.
  return bytes.empty() ? before : libdeflate_crc32(before, bytes.data(), bytes.size());
}

}  // namespace terracast::core
