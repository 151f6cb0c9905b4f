#include "tiler/tag_values.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace terracast::tiler {
namespace {

/// Products of decimal fractions are rounded once or twice in double.
constexpr double kRounding = 1e-12;

/// The only length that a text states; NaN: it is not understood, or states several.
double length_m(const std::string& text) {
  const auto amount = length_from_tag(text);
  return amount && amount->lowest == amount->highest ? amount->lowest
                                                     : std::numeric_limits<double>::quiet_NaN();
}

TEST(TagValues, LengthsHaveUnits) {
  const std::vector<std::pair<std::string, double>> lengths = {{"12", 12.0},
                                                               {"12.5", 12.5},
                                                               {"12 m", 12.0},
                                                               {"12m", 12.0},
                                                               {"12 M", 12.0},
                                                               {"12 m.", 12.0},
                                                               {"12 metres", 12.0},
                                                               {"12 meter", 12.0},
                                                               {"1250 cm", 12.5},
                                                               {"1250cm", 12.5},
                                                               {"12500 mm", 12.5},
                                                               {"125 dm", 12.5},
                                                               {"0.25 km", 250.0},
                                                               {"10 yd", 9.144},
                                                               {"1 mi", 1609.344},
                                                               {"0.5 nmi", 926.0},
                                                               {"6 in", 0.1524},
                                                               {"6\"", 0.1524},
                                                               {"40 ft", 12.192},
                                                               {"40ft", 12.192},
                                                               {"40 feet", 12.192},
                                                               {"1 foot", 0.3048},
                                                               {"40'", 12.192},
                                                               {"-0.5", -0.5},
                                                               {"+3", 3.0},
                                                               {".5", 0.5},
                                                               {"  12 m  ", 12.0},
                                                               {"12\xC2\xA0m", 12.0},
                                                               {"1e+01", 10.0},
                                                               {"2.5e-1 m", 0.25},
                                                               {"~12", 12.0},
                                                               {"ca. 12 m", 12.0},
                                                               {"\xE2\x89\x88"
                                                                "3",
                                                                3.0},
                                                               {"approx. 12", 12.0},
                                                               {"2\xC2\xBD", 2.5}};
  for (const auto& [text, metres] : lengths) EXPECT_NEAR(length_m(text), metres, kRounding) << text;
}

// 40 feet and 6 inches are 486 inches of 0.0254 m, whatever signs are used.
TEST(TagValues, FeetAndInchesAreOneLength) {
  for (const char* text : {"40'6\"", "40' 6\"", "40'-6\"", "40'6''", "40'6", "40 ft 6 in",
                           "40ft 6in", "40 ft. 6 in.", "40 feet 6 inches",
                           "40\xE2\x80\xB2"
                           "6\xE2\x80\xB3",
                           "40\xE2\x80\x99"
                           "6\xE2\x80\x9D",
                           "40\xC2\xB4 6\xE2\x80\x9D"})
    EXPECT_NEAR(length_m(text), 486 * 0.0254, kRounding) << text;
  EXPECT_NEAR(length_m("7'4.5\""), 88.5 * 0.0254, kRounding);
  EXPECT_NEAR(length_m("12'"), 12 * 0.3048, kRounding);
  EXPECT_NEAR(length_m("12'6"), 12.5 * 0.3048, kRounding);
  EXPECT_NEAR(length_m("12'06"), 12.5 * 0.3048, kRounding);
  EXPECT_NEAR(length_m("12'11"), 155 * 0.0254, kRounding);
  EXPECT_NEAR(length_m("12'0\""), 12 * 0.3048, kRounding);
  // A foot has twelve inches, and no inches have three digits.
  for (const char* text : {"40'16\"", "40'6\"7", "40 ft 6", "40 ft 6 m", "40'6 m", "12'016\"",
                           "1'011 in", "1'011'", "1'011 ft"})
    EXPECT_FALSE(length_from_tag(text).has_value()) << text;
}

TEST(TagValues, DecimalSignsAndGroupsOfAnyCountry) {
  const std::vector<std::pair<std::string, double>> numbers = {{"12,5", 12.5},
                                                               {"89,10", 89.1},
                                                               {"0,125", 0.125},
                                                               {"1.250", 1.25},
                                                               {"1.250,5", 1250.5},
                                                               {"1,250.5", 1250.5},
                                                               {"1.250.000", 1.25e6},
                                                               {"1,250,000", 1.25e6},
                                                               {"1 250", 1250.0},
                                                               {"1 250,5", 1250.5},
                                                               {"12,5 m", 12.5},
                                                               {"1250,25", 1250.25},
                                                               {"1\xE2\x80\xAF"
                                                                "250.5",
                                                                1250.5},
                                                               {"12,3456", 12.3456},
                                                               {"1'011", 1011.0},
                                                               {"1'250.5", 1250.5},
                                                               {"1'250'000", 1.25e6},
                                                               {"1\xE2\x80\x99"
                                                                "250 m",
                                                                1250.0},
                                                               {"12.", 12.0},
                                                               {"12. m", 12.0},
                                                               {",5", 0.5},
                                                               {"1.234.567,89", 1234567.89}};
  for (const auto& [text, value] : numbers)
    EXPECT_NEAR(length_m(text), value, kRounding * value) << text;
  // Either a decimal comma or a group of three; signs that group otherwise.
  for (const char* text : {"1,250", "12,345 m", "1.25.0", "12.50,5.1", "1,25,000", "1.2,5.0",
                           "1.25,0,0", "12 5", "12 34 m", "1 2500", "1,2 5", "1'2500", "1250'500",
                           "1'25", "1'250'00", "1.5'250", "12,", "12.5.", "12.m"})
    EXPECT_FALSE(length_from_tag(text).has_value()) << text;
}

TEST(TagValues, RangesAndListsAreAmounts) {
  const std::vector<std::pair<std::string, Amount>> amounts = {
      {"3-5", {3, 5}},
      {"3 - 5 m", {3, 5}},
      {"3m-5m", {3, 5}},
      {"5-3", {3, 5}},
      {"3..5", {3, 5}},
      {"3\xE2\x80\x93"
       "5",
       {3, 5}},
      {"2;3", {2, 3}},
      {"3; 2;7", {2, 7}},
      {"2;4-6", {2, 6}},
      {"30-50 cm", {0.3, 0.5}},
      {"~3-5", {3, 5}},
      {"-2--1", {-2, -1}},
      {"5'-6'", {5 * 0.3048, 6 * 0.3048}},
      {"2 - 3 ft", {2 * 0.3048, 3 * 0.3048}},
      {"3m-5", {3, 5}},
      {"10;12 ft", {10 * 0.3048, 12 * 0.3048}},
      {"10; 12 ft", {10 * 0.3048, 12 * 0.3048}},
      {"10-12;14'", {10 * 0.3048, 14 * 0.3048}},
      {"50;80;120 cm", {0.5, 1.2}},
      {"3 m;4;12 ft", {4 * 0.3048, 12 * 0.3048}},
      {"12 ft;3", {3, 12 * 0.3048}},
      {"12.;15.", {12, 15}},
      {"12..15", {12, 15}}};
  for (const auto& [text, amount] : amounts) {
    const auto read = length_from_tag(text);
    ASSERT_TRUE(read.has_value()) << text;
    EXPECT_NEAR(read->lowest, amount.lowest, kRounding) << text;
    EXPECT_NEAR(read->highest, amount.highest, kRounding) << text;
  }
  EXPECT_EQ(Amount({3, 5}).middle(), 4.0);
}

TEST(TagValues, WhatIsNotReadToItsEndIsNotUnderstood) {
  for (const char* text : {"",
                           " ",
                           "tall",
                           "12 storeys",
                           "12 m high",
                           "12 x",
                           "12m2",
                           "m",
                           "12.5.3 m",
                           "nan",
                           "inf",
                           "1e999",
                           "0x10",
                           "--3",
                           "3-",
                           "-",
                           "2;",
                           ";2",
                           "12 m 5",
                           "<3",
                           ">3",
                           "12+",
                           "3-5-7",
                           ">10",
                           "10+",
                           "2+1",
                           "4 levels",
                           "3 storeys",
                           "\xD9\xA1\xD9\xA2",
                           "'",
                           "\""})
    EXPECT_FALSE(length_from_tag(text).has_value()) << text;
  EXPECT_FALSE(length_from_tag(std::string(100'000, '9')).has_value());
}

TEST(TagValues, CountsMayBeBrokenAndBelowZero) {
  EXPECT_EQ(count_from_tag("3"), (Amount{3, 3}));
  EXPECT_EQ(count_from_tag("2.5"), (Amount{2.5, 2.5}));
  EXPECT_EQ(count_from_tag("2,5"), (Amount{2.5, 2.5}));
  EXPECT_EQ(count_from_tag("2;3"), (Amount{2, 3}));
  EXPECT_EQ(count_from_tag("1-2"), (Amount{1, 2}));
  EXPECT_EQ(count_from_tag("-2"), (Amount{-2, -2}));
  EXPECT_EQ(count_from_tag("-2;-1;0"), (Amount{-2, 0}));
  EXPECT_EQ(count_from_tag("+3"), (Amount{3, 3}));
  EXPECT_EQ(count_from_tag("~ 3"), (Amount{3, 3}));
  EXPECT_EQ(count_from_tag(".5"), (Amount{0.5, 0.5}));
  EXPECT_EQ(count_from_tag("2."), (Amount{2, 2}));
  // What is counted may be named.
  EXPECT_EQ(count_from_tag("4 levels"), (Amount{4, 4}));
  EXPECT_EQ(count_from_tag("3 storeys"), (Amount{3, 3}));
  EXPECT_EQ(count_from_tag("1 Floor"), (Amount{1, 1}));
  EXPECT_EQ(count_from_tag("2;3 lanes"), (Amount{2, 3}));
  // Two storeys and an attic, or three; at least ten.
  for (const char* text : {"2 m", "two", "2F", "EG", "2/3", "2+1", ">10", "10+", "2 1/2", "3 x"})
    EXPECT_FALSE(count_from_tag(text).has_value()) << text;
}

TEST(TagValues, DirectionsAreOneCircle) {
  for (int deg = -720; deg <= 720; ++deg) {
    const auto read = direction_deg_from_tag(std::to_string(deg));
    ASSERT_TRUE(read.has_value()) << deg;
    EXPECT_EQ(*read, (deg + 720) % 360) << deg;
  }
  const std::vector<std::pair<std::string, double>> directions = {{"180\xC2\xB0", 180.0},
                                                                  {"180 deg", 180.0},
                                                                  {"22.5 degrees", 22.5},
                                                                  {"22,5", 22.5},
                                                                  {"N", 0.0},
                                                                  {"nne", 22.5},
                                                                  {"North", 0.0},
                                                                  {"south", 180.0},
                                                                  {"north-east", 45.0},
                                                                  {"NorthEast", 45.0},
                                                                  {"north_east", 45.0},
                                                                  {"SSW", 202.5},
                                                                  {"south-southwest", 202.5},
                                                                  {"west", 270.0},
                                                                  {"NNW", 337.5},
                                                                  {"90-270", 180.0},
                                                                  {"270-90", 0.0},
                                                                  {"350-10", 0.0},
                                                                  {"~45", 45.0}};
  for (const auto& [text, deg] : directions) {
    const auto read = direction_deg_from_tag(text);
    ASSERT_TRUE(read.has_value()) << text;
    EXPECT_NEAR(std::remainder(*read - deg, 360.0), 0.0, kRounding) << text;
  }
  for (const char* text :
       {"", "forward", "clockwise", "up", "1800", "90 m", "N90", "90;180", "1e9"})
    EXPECT_FALSE(direction_deg_from_tag(text).has_value()) << text;
}

TEST(TagValues, SlopesSpeedsAndVolts) {
  EXPECT_EQ(slope_deg_from_tag("30"), 30.0);
  EXPECT_EQ(slope_deg_from_tag("30\xC2\xB0"), 30.0);
  EXPECT_EQ(slope_deg_from_tag("20-30"), 25.0);
  EXPECT_NEAR(slope_deg_from_tag("100%").value_or(0.0), 45.0, kRounding);
  for (const char* text : {"-5", "90", "steep", "30 m"})
    EXPECT_FALSE(slope_deg_from_tag(text).has_value()) << text;
  EXPECT_EQ(speed_kmph_from_tag("50"), 50.0);
  EXPECT_EQ(speed_kmph_from_tag("50 km/h"), 50.0);
  EXPECT_EQ(speed_kmph_from_tag("30 mph"), 30 * 1.609344);
  EXPECT_EQ(speed_kmph_from_tag("30mph"), 30 * 1.609344);
  EXPECT_EQ(speed_kmph_from_tag("10 knots"), 18.52);
  for (const char* text : {"walk", "none", "RU:urban", "50;70", "50 m", ""})
    EXPECT_FALSE(speed_kmph_from_tag(text).has_value()) << text;
  EXPECT_EQ(volts_from_tag("110000"), (Amount{110000, 110000}));
  EXPECT_EQ(volts_from_tag("380000;110000"), (Amount{110000, 380000}));
  EXPECT_EQ(volts_from_tag("20000/400"), (Amount{400, 20000}));
  EXPECT_EQ(volts_from_tag("110 kV"), (Amount{110000, 110000}));
  EXPECT_EQ(volts_from_tag("220/110 kV"), (Amount{110000, 220000}));
  EXPECT_EQ(volts_from_tag("220;110;20 kV"), (Amount{20000, 220000}));
  EXPECT_EQ(volts_from_tag("1.1-1.2 kV"), (Amount{1100, 1200}));
  for (const char* text : {"medium", "110000;20 kV", "1e9"})
    EXPECT_FALSE(volts_from_tag(text).has_value()) << text;
}

TEST(TagValues, FlagsInAllTheirSpellings) {
  for (const char* text : {"yes", "YES", "y", "Y", "t", "T", "true", "True", "on", "1", " yes "})
    EXPECT_EQ(flag_from_tag(text), true) << text;
  for (const char* text : {"no", "No", "n", "N", "f", "F", "false", "FALSE", "off", "0"})
    EXPECT_EQ(flag_from_tag(text), false) << text;
  for (const char* text : {"", "viaduct", "yesno", "2", "-1", "partial"})
    EXPECT_FALSE(flag_from_tag(text).has_value()) << text;
}

TEST(TagValues, ChoicesAreWhole) {
  EXPECT_TRUE(is_one_of("b", "a|b|cd"));
  EXPECT_TRUE(is_one_of("cd", "a|b|cd"));
  for (const char* text : {"c", "a|b", "", "bc"}) EXPECT_FALSE(is_one_of(text, "a|b|cd")) << text;
}

}  // namespace
}  // namespace terracast::tiler
