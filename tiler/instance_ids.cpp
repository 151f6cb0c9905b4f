#include "tiler/instance_ids.h"

#include <algorithm>
#include <cstddef>
#include <numeric>

#include "core/error.h"
#include "core/hash.h"
#include "core/random.h"

namespace terracast::tiler {

std::vector<std::uint32_t> InstanceIds::assign(std::string_view space,
                                               std::span<const std::uint64_t> keys) {
  constexpr std::uint32_t kMask = 0x7fffffffU;
  const std::uint64_t seed = core::content_hash64(std::as_bytes(std::span(space)));
  // In the order of the keys: which of two gets the next hash must not depend on theirs in the source.
  std::vector<std::size_t> order(keys.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return keys[a] < keys[b]; });
  std::vector<std::uint32_t> ids(keys.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    const std::uint64_t key = keys[order[i]];
    TERRACAST_CHECK(i == 0 || key != keys[order[i - 1]], "{} has the key {} twice", space, key);
    std::uint32_t id = 0;
    for (std::uint64_t attempt = 0; id == 0 || !taken_.insert(id).second; ++attempt)
      id = static_cast<std::uint32_t>(core::random_bits(seed, key, attempt)) & kMask;
    ids[order[i]] = id;
  }
  return ids;
}

}  // namespace terracast::tiler
