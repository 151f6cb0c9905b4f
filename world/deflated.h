#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace terracast::world {

/// Appends bytes, deflated.
/// returns   how many were appended
std::uint32_t append_deflated(std::vector<std::byte>& bytes, std::span<const std::uint8_t> raw);

/// throws Input: what does not inflate to so many bytes; names `file`
std::vector<std::uint8_t> inflated(std::span<const std::byte> deflated, std::size_t num_bytes,
                                   const std::string& file);

}  // namespace terracast::world
