#include "core/error.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace terracast::core {
namespace {

TEST(ErrorTest, ExitStatusesAreThoseOfTheManual) {
  EXPECT_EQ(exit_status(ErrorKind::Usage), 2);
  EXPECT_EQ(exit_status(ErrorKind::Config), 2);
  EXPECT_EQ(exit_status(ErrorKind::Input), 3);
  EXPECT_EQ(exit_status(ErrorKind::Io), 4);
  EXPECT_EQ(exit_status(ErrorKind::Internal), 70);
  EXPECT_EQ(exit_status(ErrorKind::Interrupted), 75);
}

TEST(ErrorTest, ContextIsAddedFromTheInsideOut) {
  try {
    with_context(
        [] {
          with_context([] { fail(ErrorKind::Input, "{}: band {} is empty", "a.tif", 2); },
                       "building tile 3/0/-1");
        },
        "running stage tile");
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::Input);
    EXPECT_EQ(error.message(), "a.tif: band 2 is empty");
    EXPECT_THAT(error.context(),
                testing::ElementsAre("building tile 3/0/-1", "running stage tile"));
    EXPECT_STREQ(error.what(),
                 "a.tif: band 2 is empty\n  while building tile 3/0/-1\n  while running stage "
                 "tile");
  }
}

TEST(ErrorTest, ContextPassesValuesOn) {
  EXPECT_EQ(with_context([] { return 7; }, "counting"), 7);
}

TEST(ErrorTest, ChecksNameConditionPlaceAndValues) {
  try {
    const int count = 3;
    TERRACAST_CHECK(count == 4, "count is {}", count);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::Internal);
    EXPECT_THAT(error.what(), testing::MatchesRegex("core/error_test.cpp:[0-9]+: the check "
                                                    "\"count == 4\" failed: count is 3; .*"));
  }
  EXPECT_NO_THROW(TERRACAST_CHECK(true));
  EXPECT_THROW(TERRACAST_CHECK(false), Error);
}

}  // namespace
}  // namespace terracast::core
