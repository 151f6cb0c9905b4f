#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>

namespace terracast::core {

/// 128-bit content hash (XXH3), as 32 lower-case hexadecimal digits. Not cryptographic: it finds
/// damage and change, not malice.
std::string content_hash(std::span<const std::byte> bytes);
std::string content_hash(std::string_view text);
/// throws Io: the file cannot be read; Input: a device or pipe
std::string content_hash_of_file(const std::filesystem::path& file);
/// 64-bit form, for headers.
std::uint64_t content_hash64(std::span<const std::byte> bytes);

}  // namespace terracast::core
