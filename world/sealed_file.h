#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace terracast::world {

/// A kind of file whose content is deflated behind a header: 6 bytes of magic, u16 version, u64 XXH3 of every byte
/// behind it, u64 bytes of the content inflated; little-endian.
struct SealedKind {
  std::array<char, 6> magic;
  std::uint16_t version;
  std::size_t most_bytes;  ///< of the content, inflated
  std::string_view what;   ///< it holds, for messages: "a prototype"
};

std::vector<std::byte> sealed(const SealedKind& kind, std::span<const std::uint8_t> content);

/// The content of a file's bytes.
/// throws   Input: another kind or version, damaged, or longer than the kind may be; names `file`. Takes no more
///          memory than 1032 times the file's size, which is as tight as deflate packs.
std::vector<std::uint8_t> unsealed(const SealedKind& kind, std::span<const std::byte> bytes,
                                   const std::string& file);

}  // namespace terracast::world
