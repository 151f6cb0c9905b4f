#pragma once

#include <cstdint>
#include <span>
#include <string_view>
#include <unordered_set>
#include <vector>

namespace terracast::tiler {

/// Gives the things of a world their ids: 1 … 2^31 - 1; those above are vegetation's, which counts its
/// own. An id is a hash of what the thing is. Only where two things of a world would get the same one
/// (the chance of any such pair is n^2 / 2^32 for n things) does the later one get its next hash: so a
/// thing has the same id whatever the tiles, the order of the source and, but for that, what else
/// stands in the world.
/// threads   one at a time
class InstanceIds {
 public:
  /// space   what the keys count, as "buildings"
  /// keys    of things, no two alike
  /// returns as many ids
  /// throws  Internal: a key that is there twice
  std::vector<std::uint32_t> assign(std::string_view space, std::span<const std::uint64_t> keys);

 private:
  std::unordered_set<std::uint32_t> taken_;
};

}  // namespace terracast::tiler
