#include "core/json.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/random.h"
#include "tests/support/test_data.h"

namespace terracast::core {
namespace {

using ::testing::HasSubstr;

template <class Work>
std::string error_of(Work&& work, ErrorKind kind = ErrorKind::Input) {
  try {
    work();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), kind) << error.what();
    return error.what();
  }
  ADD_FAILURE() << "nothing was thrown";
  return {};
}

std::string parse_error(const std::string& text) {
  return error_of([&] { Json::parse(text, "a.json"); });
}

TEST(JsonTest, WritesMembersInOrderOfInsertion) {
  Json record = Json::object();
  record.set("z", 1).set("a", Json::array_of(std::vector<double>{1.0, 0.1})).set("n", Json());
  record.set("z", true);
  Json list = Json::array();
  list.push(Json::object()).push(Json::object().set("x", "y"));
  record.set("list", list);
  EXPECT_EQ(record.text(-1), R"({"z":true,"a":[1.0,0.1],"n":null,"list":[{},{"x":"y"}]})");
  EXPECT_EQ(record.text(),
            "{\n  \"z\": true,\n  \"a\": [1.0, 0.1],\n  \"n\": null,\n  \"list\": [\n    {},\n"
            "    {\n      \"x\": \"y\"\n    }\n  ]\n}");
}

TEST(JsonTest, DoublesReadBackToTheSameBitsInTheShortestForm) {
  std::vector<double> values = {0.0,
                                -0.0,
                                1.0,
                                100000.0,
                                1e22,
                                0.1,
                                std::numeric_limits<double>::max(),
                                std::numeric_limits<double>::denorm_min(),
                                9007199254740993.0};
  for (std::uint64_t i = 0; values.size() < 20000; ++i) {
    const std::uint64_t bits = random_bits(1, 2, i);
    double value = 0.0;
    std::memcpy(&value, &bits, sizeof value);
    if (std::isfinite(value)) values.push_back(value);
  }
  const Json back = Json::parse(Json::array_of(values).text(), "x");
  ASSERT_EQ(back.size(), values.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double value = back.at(i).number();
    ASSERT_EQ(std::memcmp(&value, &values[i], sizeof value), 0) << values[i] << " " << value;
    // The scientific form with the fewest digits that read back is no shorter, but for the ".0".
    char scientific[64];
    for (int digits = 0; digits <= 17; ++digits) {
      std::snprintf(scientific, sizeof scientific, "%.*e", digits, values[i]);
      if (std::strtod(scientific, nullptr) == values[i]) break;
    }
    ASSERT_LE(back.at(i).text().size(), std::strlen(scientific) + 2) << scientific;
  }
}

TEST(JsonTest, IntegersKeepAllTheirDigits) {
  const Json list =
      Json::parse("[-9223372036854775808, 9223372036854775807, 18446744073709551615]", "a.json");
  EXPECT_EQ(list.at(std::size_t{0}).integer(), std::numeric_limits<std::int64_t>::min());
  EXPECT_EQ(list.at(1).integer(), std::numeric_limits<std::int64_t>::max());
  EXPECT_EQ(list.text(-1), "[-9223372036854775808,9223372036854775807,18446744073709551615]");
  EXPECT_THAT(error_of([&] { list.at(2).integer(); }), HasSubstr("too large"));
}

TEST(JsonTest, TextKeepsEveryLetter) {
  std::string text;
  for (int c = 1; c < 128; ++c) text += static_cast<char>(c);
  text += "é漢😀";
  text += '\0';
  EXPECT_EQ(Json::parse(Json(text).text(), "x").string(), text);
  EXPECT_THAT(error_of([] { (void)Json("\xff").text(); }), HasSubstr("UTF-8"));
}

TEST(JsonTest, NumbersThatAreNotFiniteAreRefused) {
  for (const double value : {std::nan(""), std::numeric_limits<double>::infinity()})
    EXPECT_THROW((void)Json(value).text(), Error);
}

TEST(JsonTest, MissingMembersAndWrongTypesSayWhere) {
  const Json json = Json::parse(R"({"cameras": [{"f": "x"}, 5], "t": 1.5})", "rig.json");
  EXPECT_EQ(error_of([&] { json.at("rate"); }), "rig.json: the top value has no member \"rate\"");
  EXPECT_EQ(error_of([&] { json.at("cameras").at(std::size_t{0}).at("f").number(); }),
            "rig.json: cameras[0].f is text, but must be a number");
  EXPECT_EQ(error_of([&] { json.at("cameras").at(7); }),
            "rig.json: cameras has 2 items, but item 7 is wanted");
  EXPECT_EQ(error_of([&] { json.at("t").integer(); }),
            "rig.json: t is a number, but must be a whole number");
  EXPECT_EQ(error_of([&] { json.at("cameras").numbers(); }),
            "rig.json: cameras[0] is an object, but must be a number");
  EXPECT_EQ(error_of([&] { json.at("t").at("x"); }),
            "rig.json: t is a number, but must be an object");
  EXPECT_EQ(error_of([&] { json.members()[1].second.boolean(); }),
            "rig.json: t is a number, but must be true or false");
}

TEST(JsonTest, SyntaxErrorsHaveLineAndColumn) {
  EXPECT_THAT(parse_error("{\n  \"a\": 1,\n  b\n}"), HasSubstr("a.json:3:3: not JSON"));
  EXPECT_THAT(parse_error(""), HasSubstr("a.json:1:1: not JSON"));
  EXPECT_THAT(parse_error("[1, 2"), HasSubstr("a.json:1:6: not JSON"));
  EXPECT_THAT(parse_error("[1] 2"), HasSubstr("a.json:1:5: not JSON"));
  EXPECT_THAT(parse_error("[NaN]"), HasSubstr("not JSON"));
  EXPECT_THAT(parse_error("[1e999]"), HasSubstr("not JSON"));
  EXPECT_THAT(parse_error("\"\xff\""), HasSubstr("not JSON"));
}

TEST(JsonTest, DoubledMembersAndDeepNestingAreRefused) {
  EXPECT_THAT(parse_error(R"({"a": 1, "a": 2})"), HasSubstr("\"a\" stands twice"));
  EXPECT_THAT(parse_error(std::string(1000000, '[')), HasSubstr("nested deeper"));
  std::string objects;
  for (int i = 0; i < 100000; ++i) objects += "{\"a\":";
  EXPECT_THAT(parse_error(objects), HasSubstr("nested deeper"));
}

TEST(JsonTest, DamagedTextNeverCrashes) {
  const std::string good = R"({"a": [1, 2.5e3, "x\u00e9\n"], "b": {"c": null, "d": true}})";
  for (std::uint64_t round = 0; round < 5000; ++round) {
    std::string text = good;
    for (std::uint64_t i = 0; i <= random_bits(1, 0, round) % 3; ++i)
      text[random_bits(2, i, round) % text.size()] =
          static_cast<char>(random_bits(3, i, round) % 256);
    text.erase(text.size() - random_bits(4, 0, round) % 3);
    try {
      (void)Json::parse(text, "x").text();
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::Input);
    }
  }
}

TEST(JsonTest, FilesReadBack) {
  const test::ScratchFolder folder;
  const Json record = Json::object().set("a", 0.25).set(
      "names", Json::array_of(std::vector<std::string>{"x", "y"}));
  record.write(folder / "a.json");
  EXPECT_EQ(read_text_file(folder / "a.json"), record.text() + "\n");
  const Json back = Json::read(folder / "a.json");
  EXPECT_EQ(back.at("a").number(), 0.25);
  EXPECT_THAT(back.at("names").strings(), testing::ElementsAre("x", "y"));
  EXPECT_THAT(error_of([&] { Json::read(folder / "gone.json"); }, ErrorKind::Io),
              HasSubstr("gone.json"));
}

TEST(JsonTest, AContentHashFindsEveryEditAndNoRewriting) {
  Json record = Json::object().set("a", 0.5).set("b", Json::array_of(std::vector<double>{1, 2}));
  add_content_hash(record);
  const std::string text = record.text(-1);
  EXPECT_NO_THROW(check_content_hash(Json::parse(text, "a.json")));
  EXPECT_NO_THROW(check_content_hash(Json::parse(record.text(3) + "\r\n", "a.json")));
  // Any digit, and any member's name.
  for (std::size_t i = 0; i < text.size(); ++i) {
    std::string edited = text;
    if (text[i] >= '0' && text[i] <= '9')
      edited[i] = text[i] == '9' ? '8' : static_cast<char>(text[i] + 1);
    else if (text[i] == 'b' && text[i + 1] == '"')
      edited[i] = 'c';
    else
      continue;
    EXPECT_THAT(error_of([&] { check_content_hash(Json::parse(edited, "a.json")); }),
                HasSubstr("damaged or edited"))
        << edited;
  }
  EXPECT_THAT(error_of([&] { check_content_hash(Json::parse("{\"a\":1}", "a.json")); }),
              HasSubstr("content_hash"));
}

TEST(JsonTest, CopiesAreIndependent) {
  Json a = Json::object().set("x", 1);
  Json b = a;
  b.set("x", 2);
  EXPECT_EQ(a.at("x").integer(), 1);
  a = b;
  EXPECT_EQ(a.at("x").integer(), 2);
  EXPECT_TRUE(a.has("x"));
  EXPECT_FALSE(a.has("y"));
  EXPECT_FALSE(Json().has("y"));
}

// 200 MB of short numbers took 16 GB of memory.
TEST(Json, OfMoreValuesThanFitIntoMemoryIsRefusedWithTheLimit) {
  std::string text = "[0";
  for (int i = 0; i < 20'000'000; ++i) text += ",0";
  text += "]";
  try {
    Json::parse(text, "points.json");
    ADD_FAILURE() << "no error";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::Input);
    EXPECT_THAT(error.what(), HasSubstr("points.json: holds more than 20000000 values"));
  }
}

TEST(Json, TheLimitOfValuesIsTheCallersWhereOneIsGiven) {
  EXPECT_EQ(Json::parse("[1,{\"a\":2}]", "x", 4).size(), 2u);  // the list and the object count
  EXPECT_THROW(Json::parse("[1,{\"a\":2}]", "x", 3), Error);
}

}  // namespace
}  // namespace terracast::core
