#include "tiler/instance_ids.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <set>

#include "core/error.h"

namespace terracast {
namespace {

std::vector<std::uint64_t> keys_up_to(std::uint64_t count) {
  std::vector<std::uint64_t> keys(count);
  std::iota(keys.begin(), keys.end(), std::uint64_t{1});
  return keys;
}

TEST(InstanceIds, AreUniqueAndBelowThoseOfVegetation) {
  // Of 300 000 keys about 21 pairs hash alike, so that the second hash is taken, too.
  tiler::InstanceIds ids;
  std::set<std::uint32_t> seen;
  for (const char* space : {"buildings", "things"})
    for (const std::uint32_t id : ids.assign(space, keys_up_to(300'000))) {
      EXPECT_GT(id, 0u);
      EXPECT_LT(id, 0x80000000U);
      EXPECT_TRUE(seen.insert(id).second);
    }
  EXPECT_EQ(seen.size(), 600'000u);
}

TEST(InstanceIds, DoNotDependOnTheOrderOfKeysNorOnWhatElseIsThere) {
  std::vector<std::uint64_t> keys = keys_up_to(1000);
  tiler::InstanceIds first;
  const auto ids = first.assign("buildings", keys);
  std::reverse(keys.begin(), keys.end());
  tiler::InstanceIds second;
  second.assign("trees", keys);
  auto reversed = second.assign("buildings", keys);
  std::reverse(reversed.begin(), reversed.end());
  EXPECT_EQ(ids, reversed);
  keys.resize(10);
  tiler::InstanceIds third;
  const auto few = third.assign("buildings", keys);
  for (std::size_t i = 0; i < few.size(); ++i) EXPECT_EQ(few[i], ids[keys[i] - 1]);
}

TEST(InstanceIds, AKeyTwiceIsABug) {
  tiler::InstanceIds ids;
  const std::vector<std::uint64_t> keys = {4, 7, 4};
  EXPECT_THROW(ids.assign("buildings", keys), core::Error);
}

}  // namespace
}  // namespace terracast
