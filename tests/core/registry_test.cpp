#include "core/registry.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <functional>

#include "core/random.h"

namespace terracast::core {
namespace {

/// Edit distance straight from its definition.
std::size_t distance_by_definition(std::string_view a, std::string_view b) {
  if (a.empty()) return b.size();
  if (b.empty()) return a.size();
  const std::size_t same = distance_by_definition(a.substr(1), b.substr(1));
  if (a[0] == b[0]) return same;
  return 1 + std::min({same, distance_by_definition(a.substr(1), b),
                       distance_by_definition(a, b.substr(1))});
}

TEST(RegistryTest, EditDistanceAgreesWithItsDefinition) {
  EXPECT_EQ(edit_distance("kitten", "sitting"), 3U);
  for (std::uint64_t round = 0; round < 300; ++round) {
    std::string words[2];
    for (std::uint64_t w = 0; w < 2; ++w)
      for (std::uint64_t i = random_bits(1, w, round) % 7; i > 0; --i)
        words[w] += static_cast<char>('a' + random_bits(2 + w, i, round) % 3);
    EXPECT_EQ(edit_distance(words[0], words[1]), distance_by_definition(words[0], words[1]))
        << words[0] << " " << words[1];
  }
}

TEST(RegistryTest, NearestNameForgivesAThird) {
  const std::vector<std::string> known = {"colmap", "kitti", "tartanair"};
  EXPECT_EQ(nearest_name("kiti", known), "kitti");
  EXPECT_EQ(nearest_name("KITTI", known), "kitti");
  EXPECT_EQ(nearest_name("tartan-air", known), "tartanair");
  EXPECT_EQ(nearest_name("euroc", known), "");
  EXPECT_EQ(nearest_name("", known), "");
  EXPECT_EQ(nearest_name("x", {}), "");
  EXPECT_EQ(nearest_name(std::string(100000, 'k'), known), "");
}

struct Info {
  const char* name;
  int value;
};
constexpr std::array<Info, 2> kTable = {{{"alpha", 1}, {"beta", 2}}};

TEST(RegistryTest, FindsOrNamesTheNearest) {
  const std::span<const Info> table = kTable;
  EXPECT_EQ(find_registered(table, "letter", "beta").value, 2);
  try {
    find_registered(table, "letter", "bet");
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::Config);
    EXPECT_STREQ(error.what(), "unknown letter \"bet\" (nearest: \"beta\"; known: alpha, beta)");
  }
  EXPECT_EQ(unknown_name_message("letter", "zzz", {}), "unknown letter \"zzz\" (known: none)");
}

}  // namespace
}  // namespace terracast::core
