#include "core/hash.h"

#include <fmt/format.h>
#include <xxhash.h>

#include <memory>

#include "core/atomic_file.h"
#include "core/error.h"

namespace terracast::core {

namespace {

std::string hexadecimal(const XXH128_hash_t& hash) {
  return fmt::format("{:016x}{:016x}", hash.high64, hash.low64);
}

}  // namespace

std::string content_hash(std::span<const std::byte> bytes) {
  return hexadecimal(XXH3_128bits(bytes.data(), bytes.size()));
}

std::string content_hash(std::string_view text) {
  return hexadecimal(XXH3_128bits(text.data(), text.size()));
}

std::string content_hash_of_file(const std::filesystem::path& file) {
  const std::unique_ptr<XXH3_state_t, decltype(&XXH3_freeState)> state(XXH3_createState(),
                                                                       &XXH3_freeState);
  TERRACAST_CHECK(state != nullptr && XXH3_128bits_reset(state.get()) == XXH_OK);
  read_file_blocks(file, [&](std::span<const std::byte> block) {
    XXH3_128bits_update(state.get(), block.data(), block.size());
  });
  return hexadecimal(XXH3_128bits_digest(state.get()));
}

std::uint64_t content_hash64(std::span<const std::byte> bytes) {
  return XXH3_64bits(bytes.data(), bytes.size());
}

}  // namespace terracast::core
