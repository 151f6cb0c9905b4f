#include <gtest/gtest.h>

#include "capture/sequence_files.h"
#include "capture/stream.h"

namespace terracast::capture {
namespace {

std::string wrong(const std::vector<StreamChannel>& channels) { return wrong_channels(channels); }

TEST(StreamChannels, OfWhichATableCanBeMadeAreRight) {
  EXPECT_EQ(wrong({{.name = "range_m", .unit = "m"}}), "");
  EXPECT_EQ(wrong({{.name = "a", .unit = ""}, {.name = "a2", .unit = "m/s^2"}}), "");
  EXPECT_EQ(wrong({{.name = "angle_deg", .unit = "°"}}), "");
  EXPECT_EQ(wrong({{.name = std::string(64, 'x'), .unit = std::string(32, 'm')}}), "");
}

TEST(StreamChannels, ThatWouldBreakTheirTablesAreNamed) {
  EXPECT_NE(wrong({}), "");
  EXPECT_NE(wrong(std::vector<StreamChannel>(kMaxStreamChannels + 1, {.name = "a", .unit = ""})),
            "");
  for (const std::string name :
       {"", "A", "2a", "_a", "a b", "a,b", "a\n", "a\"", "ä", "time_s", "a.b"})
    EXPECT_NE(wrong({{.name = name, .unit = "m"}}), "") << name;
  EXPECT_NE(wrong({{.name = std::string(65, 'x'), .unit = ""}}), "");
  EXPECT_NE(wrong({{.name = std::string("a\0b", 3), .unit = ""}}), "");
  for (const std::string unit : {"m,s", "m\n", "\"m\"", "a\\b", "\xff"})
    EXPECT_NE(wrong({{.name = "a", .unit = unit}}), "") << unit;
  EXPECT_NE(wrong({{.name = "a", .unit = std::string(33, 'm')}}), "");
  EXPECT_EQ(
      wrong({{.name = "a", .unit = ""}, {.name = "b", .unit = ""}, {.name = "a", .unit = ""}}),
      "has the channel \"a\" twice");
}

}  // namespace
}  // namespace terracast::capture
