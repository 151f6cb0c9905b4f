#include "core/bytes_text.h"

#include <gtest/gtest.h>

namespace terracast::core {
namespace {

TEST(BytesText, HasThreeDigitsAndTheUnitThatFits) {
  EXPECT_EQ(bytes_text(0.0), "0 B");
  EXPECT_EQ(bytes_text(999.0), "999 B");
  EXPECT_EQ(bytes_text(1000.0), "1 kB");
  EXPECT_EQ(bytes_text(30712345.0), "30.7 MB");
  EXPECT_EQ(bytes_text(999400000.0), "999 MB");
  EXPECT_EQ(bytes_text(999600000.0), "1 GB");
  EXPECT_EQ(bytes_text(123.4e15), "123400 TB");
}

}  // namespace
}  // namespace terracast::core
