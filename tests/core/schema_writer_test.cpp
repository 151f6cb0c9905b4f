#include "core/schema_writer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/random.h"
#include "core/toml_reader.h"

namespace terracast::core {
namespace {

struct Inner {
  double speed_m_per_s = 1.0;
  std::vector<std::int64_t> counts;
  bool operator==(const Inner&) const = default;

  template <class Visitor>
  void describe(Visitor& visit) {
    visit.key("counts", counts, "Counts.");
    visit.key("speed_m_per_s", speed_m_per_s, "Speed.", at_least(0.0));
  }
};

struct Item {
  std::string name = "item";
  Inner inner;
  std::vector<Inner> parts;
  bool operator==(const Item&) const = default;

  template <class Visitor>
  void describe(Visitor& visit) {
    visit.section("inner", inner, "Inner.");
    visit.key("name", name, "Name | title.", required(one_of({"item", "b"})));
    visit.list("parts", parts, "Parts.");
  }
};

/// A list of at least one value that may be left out, and so be empty, and one that may not.
struct Lists {
  std::vector<std::string> some;
  std::vector<std::string> needed;

  template <class Visitor>
  void describe(Visitor& visit) {
    visit.key("some", some, "Some; none: all.", {.min_size = 1});
    visit.key("needed", needed, "Needed.", required({.min_size = 1}));
  }
};

struct Everything {
  bool flag = false;
  std::int64_t count = 0;
  double focal_length_mm = 0.0;
  std::string text;
  Path path;
  std::vector<double> numbers;
  std::vector<std::int64_t> integers;
  std::vector<std::string> texts;
  std::vector<Path> paths;
  Item item;
  std::vector<Item> items = {Item(), Item()};
  double last_s = 0.0;
  bool operator==(const Everything&) const = default;

  template <class Visitor>
  void describe(Visitor& visit) {
    visit.key("flag", flag, "A flag.");
    visit.key("count", count, "A count.");
    visit.section("item", item, "A section before keys.");
    visit.key("focal_length_mm", focal_length_mm, "A length.", between(-1e308, 1e308));
    visit.key("text", text, "A text.");
    visit.key("path", path, "A path.");
    visit.list("items", items, "A list before keys.");
    visit.key("numbers", numbers, "Numbers.", size_of(3));
    visit.key("integers", integers, "Integers.");
    visit.key("texts", texts, "Texts.");
    visit.key("paths", paths, "Paths.");
    visit.key("last_s", last_s, "The last one.");
  }
};

/// Values of every kind from random bits: any finite double, any integer, control letters, quotes,
/// several bytes.
class RandomValues {
 public:
  explicit RandomValues(std::uint64_t seed) : seed_(seed) {}

  std::uint64_t bits() { return random_bits(seed_, 0, next_++); }
  std::size_t size(std::size_t limit) { return bits() % (limit + 1); }
  double number() {
    while (true) {
      const std::uint64_t pattern = bits();
      double value = 0.0;
      std::memcpy(&value, &pattern, sizeof value);
      if (pattern % 5 == 0)
        value = static_cast<double>(static_cast<std::int64_t>(pattern % 2001) - 1000);
      if (pattern % 35 == 0) value = -0.0;
      if (std::isfinite(value) && std::abs(value) <= 1e308) return value;
    }
  }
  std::string text() {
    static const std::vector<std::string> kLetters = {"a",    "\"",   "\\", "\n", "\t", "\r",
                                                      "\x01", "é",    "漢", "'",  "#",  "=",
                                                      "[",    "\x7f", " ",  "$",  "{",  "\b"};
    std::string value;
    for (std::size_t i = size(8); i > 0; --i) value += kLetters[bits() % kLetters.size()];
    // "${" asks for a name: it never stands in a value that came from a config.
    for (std::size_t at; (at = value.find("${")) != std::string::npos;) value.erase(at, 1);
    return value;
  }
  Path path() {
    const std::string written = text();
    return {written, written};
  }
  Inner inner() {
    Inner value;
    value.speed_m_per_s = std::abs(number());
    for (std::size_t i = size(3); i > 0; --i)
      value.counts.push_back(static_cast<std::int64_t>(bits()));
    return value;
  }
  Item item() {
    Item value;
    value.name = size(1) == 0 ? "item" : "b";
    value.inner = inner();
    for (std::size_t i = size(2); i > 0; --i) value.parts.push_back(inner());
    return value;
  }
  Everything everything() {
    Everything value;
    value.flag = size(1) == 1;
    value.count = static_cast<std::int64_t>(bits());
    value.focal_length_mm = number();
    value.text = text();
    value.path = path();
    value.numbers = {number(), number(), number()};
    for (std::size_t i = size(3); i > 0; --i)
      value.integers.push_back(static_cast<std::int64_t>(bits()));
    for (std::size_t i = size(3); i > 0; --i) value.texts.push_back(text());
    for (std::size_t i = size(3); i > 0; --i) value.paths.push_back(path());
    value.item = item();
    value.items.clear();
    for (std::size_t i = size(3); i > 0; --i) value.items.push_back(item());
    value.last_s = number();
    return value;
  }

 private:
  std::uint64_t seed_;
  std::uint64_t next_ = 0;
};

TEST(SchemaWriterTest, TomlReadsBackToEqualValues) {
  for (std::uint64_t seed = 0; seed < 500; ++seed) {
    const Everything value = RandomValues(seed).everything();
    const std::string text = toml_text(value);
    Everything back;
    ASSERT_NO_THROW(TomlDocument::parse(text, "x.toml").read(back)) << text;
    ASSERT_EQ(back, value) << text;
    ASSERT_EQ(std::signbit(back.focal_length_mm), std::signbit(value.focal_length_mm)) << text;
    ASSERT_EQ(toml_text(back), text);
  }
}

TEST(SchemaWriterTest, TomlIsPlain) {
  Item item;
  item.parts.resize(1);
  item.inner.counts = {1, 2};
  EXPECT_EQ(toml_text(item),
            "name = \"item\"\n"
            "\n[inner]\ncounts = [1, 2]\nspeed_m_per_s = 1.0\n"
            "\n[[parts]]\ncounts = []\nspeed_m_per_s = 1.0\n");
}

TEST(SchemaWriterTest, AListThatMayBeLeftOutMayBeEmpty) {
  const std::vector<KeyInfo> keys = list_keys<Lists>();
  EXPECT_EQ(keys[0].range, "");
  EXPECT_EQ(keys[1].range, "at least 1 value; required");
  // As its page says.
  Lists lists;
  TomlDocument::parse("some = []\nneeded = [\"a\"]\n", "demo.toml").read(lists);
  EXPECT_TRUE(lists.some.empty());
  EXPECT_EQ(toml_text(lists), "needed = [\"a\"]\n");
  EXPECT_THROW(TomlDocument::parse("needed = []\n", "demo.toml").read(lists), Error);
}

TEST(SchemaWriterTest, ListsKeysWithUnitsRangesAndDefaults) {
  const std::vector<KeyInfo> keys = list_keys<Everything>();
  std::vector<std::string> names;
  for (const KeyInfo& key : keys) names.push_back(key.name);
  EXPECT_THAT(names,
              testing::ElementsAre("flag", "count", "item.inner.counts", "item.inner.speed_m_per_s",
                                   "item.name", "item.parts[].counts", "item.parts[].speed_m_per_s",
                                   "focal_length_mm", "text", "path", "items[].inner.counts",
                                   "items[].inner.speed_m_per_s", "items[].name",
                                   "items[].parts[].counts", "items[].parts[].speed_m_per_s",
                                   "numbers", "integers", "texts", "paths", "last_s"));
  EXPECT_EQ(keys[0].unit, "");
  EXPECT_EQ(keys[0].type, "bool");
  EXPECT_EQ(keys[0].default_value, "false");
  EXPECT_EQ(keys[3].unit, "m/s");
  EXPECT_EQ(keys[3].range, "at least 0");
  EXPECT_EQ(keys[3].default_value, "1.0");
  EXPECT_EQ(keys[4].range, "one of item, b; required");
  EXPECT_EQ(keys[4].default_value, "");
  EXPECT_EQ(keys[7].unit, "mm");
  EXPECT_EQ(keys[15].range, "3 values");
  EXPECT_EQ(keys[15].type, "list of numbers");
  EXPECT_EQ(keys[19].unit, "s");
}

TEST(SchemaWriterTest, MarkdownEscapesCells) {
  const std::string table = markdown_table(list_keys<Item>());
  EXPECT_THAT(table, testing::StartsWith("| key | unit | default | range | meaning |\n"));
  EXPECT_THAT(
      table, testing::HasSubstr("| `name` |  |  | one of item, b; required | Name \\| title. |\n"));
}

}  // namespace
}  // namespace terracast::core
