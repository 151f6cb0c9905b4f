#include "core/ledger.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <random>

namespace terracast::core {
namespace {

constexpr std::array<KnownName, 3> kKnown{{{"height", "how high it is"},
                                           {"addr:*", "addresses show nowhere", false},
                                           {"roof:shape", "the roof"}}};

TEST(Ledger, SortsNamesByWhatAReaderKnows) {
  Ledger ledger;
  for (const char* name : {"height", "height", "addr:street", "addr:", "addr", "roof:shapes"})
    ledger.count(name, kKnown);
  ledger.misunderstand("height", "tall");
  ledger.misunderstand("height", "tall");
  const auto& entries = ledger.entries();
  EXPECT_EQ(entries.at("height").num_used, 2);
  EXPECT_EQ(entries.at("height").not_understood.at("tall"), 2);
  EXPECT_EQ(entries.at("addr:street").num_ignored, 1);
  EXPECT_EQ(entries.at("addr:").num_ignored, 1);
  EXPECT_EQ(entries.at("addr:street").why, "addresses show nowhere");
  EXPECT_EQ(entries.at("addr").num_unknown, 1);
  EXPECT_EQ(entries.at("roof:shapes").num_unknown, 1);
  const std::vector<std::string> lines = ledger.warnings();
  ASSERT_EQ(lines.size(), 3U);
  EXPECT_EQ(lines[0], "height: not understood: \"tall\" (2 times)");
  EXPECT_EQ(lines[1], "addr is not known, and stands 1 times");
  EXPECT_EQ(ledger.warnings(1).back(), "and 2 more kinds");
  EXPECT_NE(ledger.table().find("ignored: addresses show nowhere"), std::string::npos);
  EXPECT_EQ(Ledger::of(ledger.json()), ledger);
}

// What is kept of 3000 names and 50 values, whatever the order.
TEST(Ledger, IsTheSameInAnyOrderAndKeepsNoMoreThanItMay) {
  std::vector<int> order(3000);
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = static_cast<int>(i);
  std::mt19937 random(7);
  const auto made = [&] {
    Ledger whole;
    std::array<Ledger, 4> parts;
    for (std::size_t i = 0; i < order.size(); ++i) {
      Ledger& part = parts[random() % parts.size()];
      const std::string name = fmt::format("name {:05}", order[i]);
      if (order[i] % 3 == 0) part.use(name);
      if (order[i] % 3 == 1) part.miss(name);
      if (order[i] % 3 == 2) part.ignore(name, "no reason");
      if (order[i] < 50) part.misunderstand("height", fmt::format("value {}", order[i]));
    }
    for (const Ledger& part : parts) whole.merge(part);
    return whole;
  };
  const Ledger first = made();
  EXPECT_EQ(first.entries().size(), 1000U);
  std::int64_t times = first.num_of_others();
  for (const auto& [name, entry] : first.entries())
    times += entry.num_used + entry.num_ignored + entry.num_unknown;
  EXPECT_EQ(times, 3000);
  EXPECT_EQ(first.entries().at("height").not_understood.size(), 20U);
  EXPECT_EQ(first.entries().at("height").num_not_understood(), 50);
  for (int i = 0; i < 3; ++i) {
    std::shuffle(order.begin(), order.end(), random);
    EXPECT_EQ(made(), first);
  }
}

TEST(Ledger, KeepsNamesAsTheyMayBeShown) {
  Ledger ledger;
  ledger.miss("two\nlines \x1b[31m");
  ledger.miss(std::string(10000, 'x'));
  for (const auto& [name, entry] : ledger.entries()) {
    EXPECT_LT(name.size(), 400U);
    EXPECT_EQ(name.find('\n'), std::string::npos);
    EXPECT_EQ(name.find('\x1b'), std::string::npos);
  }
}

}  // namespace
}  // namespace terracast::core
