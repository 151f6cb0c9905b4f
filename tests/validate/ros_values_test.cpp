// Messages of ROS 2 whose definitions are hostile: what they need in memory is bounded.

#include "validate/readers/ros_values.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "core/error.h"
#include "tests/support/expect_error.h"

namespace terracast::test {
namespace {

using core::ErrorKind;

/// A message of CDR whose bytes after the head and the first number are all 0.
std::vector<std::byte> message_of(std::uint8_t first, std::size_t num_zeros) {
  std::vector<std::byte> bytes(4 + 1 + num_zeros);
  bytes[1] = std::byte{1};
  bytes[4] = static_cast<std::byte>(first);
  return bytes;
}

std::string many_fields(const std::string& type, int count) {
  std::string text;
  for (int i = 0; i < count; ++i) text += type + " f" + std::to_string(i) + "\n";
  return text;
}

TEST(RosValues, NestedFieldsAreCountedWhereTheyFanOut) {
  // A hundred of a hundred of a hundred bytes: a million values of a megabyte.
  const std::string text = many_fields("a/B", 100) + "====\nMSG: a/B\n" + many_fields("a/C", 100) +
                           "====\nMSG: a/C\n" + many_fields("uint8", 100);
  const validate::RosDefinition definition(text, "hostile");
  const auto bytes = message_of(0, 999'999);
  expect_error(ErrorKind::Input, {"hostile", "200000 values"},
               [&] { definition.read(bytes, bytes.size()); });
}

TEST(RosValues, ItemsAndTheirFieldsAreCounted) {
  const std::string text = "a/B[10000] all\n====\nMSG: a/B\n" + many_fields("uint8", 50);
  const validate::RosDefinition definition(text, "hostile");
  const auto bytes = message_of(0, 499'999);
  expect_error(ErrorKind::Input, {"hostile", "200000 values"},
               [&] { definition.read(bytes, bytes.size()); });
}

TEST(RosValues, NumbersOfArraysAreCounted) {
  const validate::RosDefinition definition(many_fields("int16[10000]", 99) +
                                               "a/B[2] more\n====\nMSG: a/B\n" +
                                               many_fields("int16[10000]", 60),
                                           "hostile");
  const auto bytes = message_of(0, 4'399'999);
  expect_error(ErrorKind::Input, {"hostile", "2000000 numbers"},
               [&] { definition.read(bytes, bytes.size()); });
}

TEST(RosValues, NamesThatEachValueRepeatsAreShort) {
  expect_error(ErrorKind::Input, {"hostile", "256 letters", "255"},
               [] { validate::RosDefinition("uint8 " + std::string(256, 'x'), "hostile"); });
  EXPECT_NO_THROW(validate::RosDefinition("uint8 " + std::string(255, 'x'), "fine"));
}

TEST(RosValues, MessagesWithinTheLimitsAreRead) {
  const validate::RosDefinition definition(
      "a/B[1000] all\n====\nMSG: a/B\n" + many_fields("uint8", 50), "large");
  const auto bytes = message_of(7, 49'999);
  const validate::RosValue value = definition.read(bytes, bytes.size());
  ASSERT_EQ(value.at("all").items.size(), 1000U);
  EXPECT_EQ(value.at("all").items.front().at("f0").number, 7.0);
  EXPECT_EQ(value.at("all").items.back().at("f49").number, 0.0);
}

}  // namespace
}  // namespace terracast::test
