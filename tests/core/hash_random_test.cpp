#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/hash.h"
#include "core/random.h"
#include "tests/support/test_data.h"

namespace terracast::core {
namespace {

std::span<const std::byte> bytes_of(std::string_view text) {
  return std::as_bytes(std::span(text));
}

TEST(HashTest, MatchesPublishedValues) {
  // XXH3 with seed 0 of the empty input, from the reference implementation's self-test.
  EXPECT_EQ(content_hash(""), "99aa06d3014798d86001c324468d497f");
  EXPECT_EQ(content_hash64({}), 0x2d06800538d394c2ULL);
}

TEST(HashTest, AllFormsAgree) {
  const test::ScratchFolder folder;
  for (const std::size_t size : {std::size_t{0}, std::size_t{1}, std::size_t{240},
                                 (std::size_t{1} << 20) + 1, (std::size_t{3} << 20) + 7}) {
    std::string text(size, '\0');
    for (std::size_t i = 0; i < size; ++i) text[i] = static_cast<char>(random_bits(1, 2, i / 7));
    write_file(folder / "f", text);
    EXPECT_EQ(content_hash(text), content_hash(bytes_of(text)));
    EXPECT_EQ(content_hash_of_file(folder / "f"), content_hash(text));
    EXPECT_EQ(content_hash(text).size(), 32U);
    if (size > 0) {
      std::string flipped = text;
      flipped[size / 2] = static_cast<char>(flipped[size / 2] ^ 1);
      EXPECT_NE(content_hash(flipped), content_hash(text));
      EXPECT_NE(content_hash64(bytes_of(flipped)), content_hash64(bytes_of(text)));
    }
  }
}

TEST(HashTest, UnreadableFilesAreIoErrors) {
  const test::ScratchFolder folder;
  for (const auto& file : {folder / "gone", folder.path()}) {
    try {
      content_hash_of_file(file);
      FAIL();
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::Io);
      EXPECT_NE(error.message().find(file.string()), std::string::npos);
    }
  }
}

TEST(RandomTest, MixingMatchesTheReferenceSequence) {
  // SplitMix64 from seed 1234567 (Vigna's reference program): its state grows by the golden gamma.
  constexpr std::uint64_t kGamma = 0x9e3779b97f4a7c15ULL;
  EXPECT_EQ(mix_bits(1234567), 6457827717110365317ULL);
  EXPECT_EQ(mix_bits(1234567 + kGamma), 3203168211198807973ULL);
  EXPECT_EQ(mix_bits(1234567 + 2 * kGamma), 9817491932198370423ULL);
}

TEST(RandomTest, UnitValuesAreUniform) {
  constexpr int kCount = 100000;
  constexpr int kBins = 100;
  std::vector<int> bins(kBins);
  double sum = 0.0;
  for (int i = 0; i < kCount; ++i) {
    const double value = random_unit(7, 3, static_cast<std::uint64_t>(i));
    ASSERT_GE(value, 0.0);
    ASSERT_LT(value, 1.0);
    sum += value;
    ++bins[static_cast<std::size_t>(value * kBins)];
  }
  // Five standard deviations of a mean of kCount uniform values.
  EXPECT_NEAR(sum / kCount, 0.5, 5.0 * std::sqrt(1.0 / 12.0 / kCount));
  double chi_squared = 0.0;
  for (const int n : bins) chi_squared += std::pow(n - kCount / kBins, 2) / (kCount / kBins);
  // 99 degrees of freedom: mean 99, standard deviation 14.
  EXPECT_NEAR(chi_squared, 99.0, 70.0);
  EXPECT_GE(random_between(-3.0, 5.0, 1, 2, 3), -3.0);
  EXPECT_LT(random_between(-3.0, 5.0, 1, 2, 3), 5.0);
}

TEST(RandomTest, SeedStreamAndIndexAllCount) {
  std::set<std::uint64_t> values;
  for (std::uint64_t seed = 0; seed < 20; ++seed)
    for (std::uint64_t stream = 0; stream < 20; ++stream)
      for (std::uint64_t index = 0; index < 20; ++index) {
        values.insert(random_bits(seed, stream, index));
        values.insert(stream_of(stream_of(seed, stream), index));
      }
  EXPECT_EQ(values.size(), 2U * 20 * 20 * 20);
}

}  // namespace
}  // namespace terracast::core
