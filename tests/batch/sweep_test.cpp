#include "batch/sweep.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <map>
#include <set>

#include "batch/description.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/schema_writer.h"
#include "tests/support/test_data.h"

namespace terracast::batch {
namespace {

Sweep sweep_of(const std::string& text) {
  SweepOptions options;
  core::TomlDocument::parse(text, "test.toml").read_section("sweep", options);
  return Sweep(options);
}

std::string refusal_of(const std::string& text) {
  try {
    sweep_of(text);
  } catch (const core::Error& error) {
    EXPECT_EQ(error.kind(), core::ErrorKind::Config);
    return error.what();
  }
  return "";
}

std::vector<std::string> texts_of(const Sweep& sweep) {
  std::vector<std::string> texts;
  for (std::int64_t i = 0; i < sweep.num_runs(); ++i) texts.push_back(sweep.run(i).text());
  return texts;
}

TEST(Sweep, WithoutEntriesThereIsOneRunThatChangesNothing) {
  EXPECT_THAT(texts_of(sweep_of("")), testing::ElementsAre(""));
}

TEST(Sweep, RowsVaryTogetherAndProductsWithEachOther) {
  const Sweep sweep = sweep_of(R"(
[[sweep.list]]
keys = ["a", "b.c"]
rows = [[1, "x"], [2, "y"]]
[[sweep.product]]
key = "d"
values = [0.5, 1.5]
[[sweep.product]]
key = "e.0"
values = [true, {f = 1}]
)");
  EXPECT_THAT(texts_of(sweep),
              testing::ElementsAre("a = 1, b.c = \"x\", d = 0.5, e.0 = true",
                                   "a = 1, b.c = \"x\", d = 0.5, e.0 = {\"f\" = 1}",
                                   "a = 1, b.c = \"x\", d = 1.5, e.0 = true",
                                   "a = 1, b.c = \"x\", d = 1.5, e.0 = {\"f\" = 1}",
                                   "a = 2, b.c = \"y\", d = 0.5, e.0 = true",
                                   "a = 2, b.c = \"y\", d = 0.5, e.0 = {\"f\" = 1}",
                                   "a = 2, b.c = \"y\", d = 1.5, e.0 = true",
                                   "a = 2, b.c = \"y\", d = 1.5, e.0 = {\"f\" = 1}"));
}

TEST(Sweep, DrawsStayInTheirRangesAndFillThem) {
  const Sweep sweep = sweep_of(R"(
[sweep]
repeat = 4000
[[sweep.draw]]
key = "even"
between = [-1.0, 3.0]
[[sweep.draw]]
key = "log"
between = [0.01, 100.0]
spread = "log"
[[sweep.draw]]
key = "whole"
between = [1, 6]
whole = true
[[sweep.draw]]
key = "among"
among = ["a", "b"]
)");
  double even_sum = 0.0;
  double log_sum = 0.0;
  std::map<std::string, int> whole;
  std::map<std::string, int> among;
  for (std::int64_t i = 0; i < sweep.num_runs(); ++i) {
    const auto changes = sweep.run(i).changes;
    const double even = std::stod(changes[0].value.toml());
    const double log = std::stod(changes[1].value.toml());
    ASSERT_TRUE(even >= -1.0 && even <= 3.0) << even;
    ASSERT_TRUE(log >= 0.01 && log <= 100.0) << log;
    even_sum += even;
    log_sum += std::log10(log);
    ++whole[changes[2].value.toml()];
    ++among[changes[3].value.toml()];
  }
  // Means of 4000 draws; five standard deviations of the mean of a uniform spread of 4 are 0.091.
  EXPECT_NEAR(even_sum / 4000.0, 1.0, 0.091);
  EXPECT_NEAR(log_sum / 4000.0, 0.0, 0.091);
  EXPECT_EQ(whole.size(), 6U);
  // Five standard deviations of counts of 4000/6 and 4000/2.
  for (const auto& [value, count] : whole) EXPECT_NEAR(count, 4000.0 / 6.0, 118.0) << value;
  for (const auto& [value, count] : among) EXPECT_NEAR(count, 2000.0, 158.0) << value;
}

TEST(Sweep, WhatIsAddedChangesNoDrawOfWhatWasThere) {
  const auto draws_of = [](const std::string& values) {
    const Sweep sweep = sweep_of(fmt::format(R"(
[sweep]
seed = 7
repeat = 2
[[sweep.product]]
key = "a"
values = [{}]
[[sweep.draw]]
key = "b"
between = [0.0, 1.0]
)",
                                             values));
    std::map<std::string, std::string> runs;
    for (std::int64_t i = 0; i < sweep.num_runs(); ++i)
      runs.emplace(sweep.run(i).identity, sweep.run(i).text());
    return runs;
  };
  const auto few = draws_of("1, 2");
  const auto many = draws_of("5, 2, 1");
  ASSERT_EQ(few.size(), 4U);
  ASSERT_EQ(many.size(), 6U);
  for (const auto& [identity, text] : few) EXPECT_EQ(many.at(identity), text);
  std::set<std::string> texts;
  for (const auto& [identity, text] : many) texts.insert(text);
  EXPECT_EQ(texts.size(), 6U) << "every run draws for itself";
}

TEST(Sweep, WhatCannotBeSweptIsRefusedWithItsPlace) {
  using testing::HasSubstr;
  EXPECT_THAT(refusal_of("[[sweep.list]]\nkeys = [\"a\", \"b\"]\nrows = [[1, 2], [3]]\n"),
              testing::AllOf(HasSubstr("test.toml:3"), HasSubstr("2 values")));
  EXPECT_THAT(refusal_of("[[sweep.product]]\nkey = \"a\"\nvalues = []\n"), HasSubstr("values"));
  EXPECT_THAT(refusal_of("[[sweep.product]]\nkey = \"a\"\nvalues = [1]\n"
                         "[[sweep.draw]]\nkey = \"a\"\nbetween = [0, 1]\n"),
              HasSubstr("a is swept twice"));
  EXPECT_THAT(refusal_of("[[sweep.draw]]\nkey = \"a\"\n"), HasSubstr("between"));
  EXPECT_THAT(refusal_of("[[sweep.draw]]\nkey = \"a\"\nbetween = [2, 1]\n"),
              HasSubstr("the lower value comes first"));
  EXPECT_THAT(refusal_of("[[sweep.draw]]\nkey = \"a\"\nbetween = [0, 1]\nspread = \"log\"\n"),
              HasSubstr("above 0"));
  EXPECT_THAT(refusal_of("[[sweep.draws]]\nkey = \"a\"\n"), HasSubstr("draw"));
  std::string many;
  for (int i = 0; i < 10; ++i)
    many += fmt::format("[[sweep.product]]\nkey = \"k{}\"\nvalues = [1,2,3,4,5,6]\n", i);
  EXPECT_THAT(refusal_of(many), HasSubstr("more than 10000000 runs"));
}

TEST(Description, ARunReadsAsItsConfigWithTheChangesDoes) {
  const auto file = std::filesystem::path(TERRACAST_SOURCE_DIR) / "configs/batch/demo.toml";
  const Description description = Description::load(file, {"tracks.num_points=3000"});
  ASSERT_EQ(description.num_runs(), 8);
  const job::RunConfig config = description.run_config(3);
  EXPECT_EQ(config.conditions.sun_azimuth_deg, 150.0);
  EXPECT_EQ(config.conditions.sun_elevation_deg, 55.0);
  EXPECT_EQ(config.trajectories.at(0).num_frames, 12);
  EXPECT_EQ(config.tracks.num_points, 3000);
  EXPECT_EQ(config.exports.size(), 2U);
}

TEST(Description, ItReadsAgainAfterItsFilesAreGone) {
  namespace fs = std::filesystem;
  const test::ScratchFolder folder;
  for (const char* name : {"worlds", "rigs", "trajectories", "batch", "climb.toml"})
    fs::copy(fs::path(TERRACAST_SOURCE_DIR) / "configs" / name, folder / name,
             fs::copy_options::recursive);
  const Description first = Description::load(folder / "batch/demo.toml", {});
  std::vector<std::string> configs;
  for (std::int64_t i = 0; i < first.num_runs(); ++i)
    configs.push_back(core::toml_text(first.run_config(i)));
  const std::string inputs = first.inputs().json().text();
  for (const char* name : {"worlds", "rigs", "trajectories", "batch", "climb.toml"})
    fs::remove_all(folder / name);
  const Description again = Description::load(
      core::ConfigInputs::from_json(core::Json::parse(inputs, "config.json"), "config.json"));
  ASSERT_EQ(again.num_runs(), first.num_runs());
  for (std::int64_t i = 0; i < first.num_runs(); ++i)
    EXPECT_EQ(core::toml_text(again.run_config(i)), configs[static_cast<std::size_t>(i)]);
}

TEST(Description, ErrorsOfARunNameWhatTheSweepSet) {
  const auto refusal = [](const std::string& sweep) -> std::string {
    const test::ScratchFolder folder;
    core::write_file(folder / "c.toml", fmt::format("extends = \"{}/configs/climb.toml\"\n{}",
                                                    TERRACAST_SOURCE_DIR, sweep));
    try {
      Description::load(folder / "c.toml", {}).run_config(0);
    } catch (const core::Error& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_THAT(refusal("[[sweep.product]]\nkey = \"conditions.exposure\"\nvalues = [-1.0]\n"),
              testing::AllOf(testing::HasSubstr("c.toml:4:11"), testing::HasSubstr("exposure")));
  EXPECT_THAT(refusal("[[sweep.draw]]\nkey = \"conditions.expossure\"\nbetween = [1.0, 2.0]\n"),
              testing::AllOf(testing::HasSubstr("the sweep's draw of conditions.expossure"),
                             testing::HasSubstr("nearest: \"exposure\"")));
}

}  // namespace
}  // namespace terracast::batch
