#include "batch/dataset/splits.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "core/error.h"
#include "core/random.h"
#include "tests/batch/random_grounds.h"

namespace terracast::batch {
namespace {

using testing::HasSubstr;

/// Sequences of runs of 20 cells, so many cells apart along a parallel.
struct Places {
  std::vector<GroundSeen> grounds;
  std::vector<SplitSequence> sequences;

  Places(const std::vector<std::int64_t>& frames, int cells_apart) {
    grounds.reserve(frames.size());
    for (std::size_t i = 0; i < frames.size(); ++i) {
      grounds.push_back({.ground = "earth",
                         .within_m = 2000.0,
                         .runs = {{140000, static_cast<std::int32_t>(i) * cells_apart, 20}}});
      sequences.push_back({fmt::format("run/{:03}", i), frames[i], &grounds.back()});
    }
  }
};

TEST(Splits, NeverShowGroundOfAnotherWithinTheMargin) {
  for (std::uint64_t seed = 0; seed < 3; ++seed) {
    const std::vector<GroundSeen> grounds =
        random_grounds(seed, {.lat_deg = 47.0, .lon_deg = 179.99}, 24, 30000.0);
    std::vector<SplitSequence> sequences;
    for (std::size_t i = 0; i < grounds.size(); ++i)
      sequences.push_back({fmt::format("run{}/seq", i),
                           10 + static_cast<std::int64_t>(core::random_bits(seed, 7, i) % 90),
                           &grounds[i]});
    const SplitOptions options{.train = 0.6, .val = 0.2, .test = 0.2, .margin_m = 900.0};
    const SplitAssignment assignment = assign_splits(sequences, options);
    std::array<std::int64_t, 3> frames{};
    for (std::size_t i = 0; i < sequences.size(); ++i) {
      frames[static_cast<std::size_t>(assignment.splits[i])] += sequences[i].num_frames;
      for (std::size_t k = 0; k < i; ++k)
        if (assignment.splits[i] != assignment.splits[k]) {
          ASSERT_GE(distance_m(grounds[i], grounds[k]), options.margin_m);
          ASSERT_NE(assignment.groups[i], assignment.groups[k]);
        }
    }
    EXPECT_EQ(frames, assignment.num_frames);
    EXPECT_THAT(assignment.num_sequences, testing::Each(testing::Gt(0)));
  }
}

TEST(Splits, DoNotDependOnTheOrderOfTheSequences) {
  const std::vector<GroundSeen> grounds =
      random_grounds(3, {.lat_deg = 47.0, .lon_deg = 8.0}, 40, 60000.0);
  std::vector<SplitSequence> sequences;
  for (std::size_t i = 0; i < grounds.size(); ++i)
    sequences.push_back({fmt::format("run{}/seq", i), 50, &grounds[i]});
  const SplitAssignment before = assign_splits(sequences, {});
  std::vector<std::size_t> order(sequences.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  for (std::uint64_t turn = 0; turn < 5; ++turn) {
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
      return core::random_bits(turn, 0, a) < core::random_bits(turn, 0, b);
    });
    std::vector<SplitSequence> shuffled;
    for (const std::size_t i : order) shuffled.push_back(sequences[i]);
    const SplitAssignment after = assign_splits(shuffled, {});
    EXPECT_EQ(after.words, before.words);
    for (std::size_t i = 0; i < order.size(); ++i) {
      ASSERT_EQ(after.splits[i], before.splits[order[i]]);
      ASSERT_EQ(after.groups[i], before.groups[order[i]]);
    }
  }
}

TEST(Splits, OfEquallyLargeGroupsFollowTheSeed) {
  const Places places(std::vector<std::int64_t>(20, 100), 60);
  const auto splits_of = [&](std::int64_t seed) {
    return assign_splits(places.sequences, {.seed = seed}).splits;
  };
  EXPECT_EQ(splits_of(1), splits_of(1));
  int num_different = 0;
  for (std::int64_t seed = 2; seed < 12; ++seed) num_different += splits_of(seed) != splits_of(1);
  EXPECT_GE(num_different, 9);  // two of 20 * 19 * 18 * 17 / 4 deals are rarely the same
  EXPECT_THAT(assign_splits(places.sequences, {}).num_frames, testing::ElementsAre(1600, 200, 200));
}

TEST(Splits, OfSequencesThatHangTogetherAreOneAndSayWhy) {
  const Places places({100, 200, 300, 50}, 15);  // each overlaps the next
  const SplitAssignment assignment = assign_splits(places.sequences, {.margin_m = 500.0});
  EXPECT_THAT(assignment.splits, testing::Each(Split::Train));
  EXPECT_EQ(assignment.num_groups, 1);
  EXPECT_THAT(assignment.num_frames, testing::ElementsAre(650, 0, 0));
  EXPECT_THAT(assignment.words, HasSubstr("All 4 sequences hang together and are for training"));
  EXPECT_THAT(assignment.words, HasSubstr("run/000 and run/001 show the same ground"));
  EXPECT_THAT(assignment.words, HasSubstr("within_m, now 2000 m"));
  EXPECT_THAT(assignment.words, HasSubstr("margin_m (now 500 m)"));
}

TEST(Splits, ThatGetNothingAreNamed) {
  Places places({1000, 1000, 10}, 15);
  places.grounds[2].runs = {{150000, 0, 5}};
  const SplitAssignment assignment = assign_splits(places.sequences, {});
  EXPECT_THAT(assignment.num_frames, testing::ElementsAre(2000, 10, 0));
  EXPECT_THAT(assignment.words, HasSubstr("Nothing is left for test: 2 sequences hang together: "
                                          "run/000 and run/001 show the same ground"));
}

TEST(Splits, OfOneSequenceOrNoneAreSaidInWords) {
  const Places one({40}, 10);
  EXPECT_THAT(assign_splits(one.sequences, {}).words, HasSubstr("one sequence, run/000"));
  EXPECT_EQ(assign_splits({}, {}).words, "There are no sequences.");
}

TEST(Splits, RefuseWhatCannotBe) {
  const Places places({40, 40}, 30);
  const auto kind_of = [&](const std::vector<SplitSequence>& sequences,
                           const SplitOptions& options) {
    try {
      assign_splits(sequences, options);
    } catch (const core::Error& error) {
      return error.kind();
    }
    return core::ErrorKind::Internal;
  };
  EXPECT_EQ(kind_of(places.sequences, {.train = 0.5}), core::ErrorKind::Config);
  EXPECT_EQ(kind_of(places.sequences, {.train = 1.2, .val = -0.2, .test = 0.0}),
            core::ErrorKind::Config);
  EXPECT_EQ(kind_of(places.sequences, {.margin_m = -1.0}), core::ErrorKind::Config);
  EXPECT_EQ(kind_of({places.sequences[0], places.sequences[0]}, {}), core::ErrorKind::Input);
}

}  // namespace
}  // namespace terracast::batch
