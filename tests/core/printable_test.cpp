#include "core/printable.h"

#include <gtest/gtest.h>

#include "core/json.h"

namespace terracast::core {
namespace {

/// The bytes that a printable text stands for.
std::string bytes_of(const std::string& text) {
  std::string bytes;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text.compare(i, 2, "\\x") != 0) {
      bytes += text[i];
      continue;
    }
    bytes += static_cast<char>(std::stoi(text.substr(i + 2, 2), nullptr, 16));
    i += 3;
  }
  return bytes;
}

TEST(Printable, LeavesTextAndShowsBytesThatAreNone) {
  EXPECT_EQ(printable("façade, Zürich, 山, 🛩"), "façade, Zürich, 山, 🛩");
  EXPECT_EQ(printable("bad\xff.png"), "bad\\xff.png");
  EXPECT_EQ(printable("C:\\data"), "C:\\data");
  EXPECT_EQ(printable("a\\xff"), "a\\x5cxff");
  EXPECT_EQ(printable("two\nlines\x1b[2J\x7f"), "two\\x0alines\\x1b[2J\\x7f");
  EXPECT_EQ(printable("\xc2\x9b"), "\\xc2\\x9b");
  // A letter cut off, one longer than it must be, half a pair, and beyond the last one.
  EXPECT_EQ(printable("\xe5\xb1"), "\\xe5\\xb1");
  EXPECT_EQ(printable("\xc0\xaf"), "\\xc0\\xaf");
  EXPECT_EQ(printable("\xed\xa0\x80"), "\\xed\\xa0\\x80");
  EXPECT_EQ(printable("\xf4\x90\x80\x80"), "\\xf4\\x90\\x80\\x80");
}

TEST(Printable, AnyBytesBecomeJsonAndCanBeHadBack) {
  const std::string few = "\\x\xc2\x80\xe0\xa0\xed\x9f\xf0\x90\xf4\x8f\xff\n a";
  std::uint64_t state = 1;
  for (int i = 0; i < 20000; ++i) {
    std::string bytes;
    for (int k = 0; k < 12; ++k) {
      state = state * 6364136223846793005U + 1442695040888963407U;
      const auto draw = static_cast<std::size_t>(state >> 33);
      bytes += draw % 4 == 0 ? static_cast<char>(draw / 4) : few[draw / 4 % few.size()];
    }
    const std::string text = printable(bytes);
    ASSERT_EQ(bytes_of(text), bytes);
    ASSERT_NO_THROW(Json(text).text());
  }
}

TEST(FirstLetters, CutNoLetterInTwo) {
  EXPECT_EQ(first_letters("Zürich", 10), "Zürich");
  EXPECT_EQ(first_letters("Zürich", 2), "Z");
  EXPECT_EQ(first_letters("Zürich", 3), "Zü");
  EXPECT_EQ(first_letters("🛩🛩", 7), "🛩");
  EXPECT_EQ(first_letters("", 3), "");
  EXPECT_EQ(first_letters("\x80\x80\x80\x80\x80\x80", 5).size(), 5U);
}

}  // namespace
}  // namespace terracast::core
