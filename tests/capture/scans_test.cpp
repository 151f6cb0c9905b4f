// Scans in files, as NumPy's structured arrays.

#include <gtest/gtest.h>

#include <cstring>
#include <limits>
#include <string>

#include "capture/stream.h"
#include "core/random.h"
#include "tests/support/expect_error.h"

namespace terracast::test {
namespace {

using capture::NumberType;
using capture::Samples;
using capture::StreamChannel;
using capture::TickRange;

const std::vector<StreamChannel> kChannels = {
    {.name = "a_m", .unit = "m", .type = NumberType::Float64},
    {.name = "b", .unit = "", .type = NumberType::Float32},
    {.name = "c", .unit = "", .type = NumberType::Count32},
    {.name = "d", .unit = "", .type = NumberType::Count16},
    {.name = "e", .unit = "", .type = NumberType::Count8}};
constexpr TickRange kTicks{.first = 20, .end = 22};
constexpr double kRate_hz = 10.0;

Samples drawn(int num_rows) {
  Samples scans;
  for (int i = 0; i < num_rows; ++i) {
    const auto at = static_cast<std::uint64_t>(i);
    scans.times_s.push_back(2.0 + 0.199 * i / std::max(1, num_rows - 1));
    scans.values.push_back(core::random_between(-1e6, 1e6, 1, 1, at));
    scans.values.push_back(static_cast<float>(core::random_between(-10.0, 10.0, 1, 2, at)));
    scans.values.push_back(static_cast<double>(core::random_bits(1, 3, at) >> 32));
    scans.values.push_back(static_cast<double>(core::random_bits(1, 4, at) >> 48));
    scans.values.push_back(static_cast<double>(core::random_bits(1, 5, at) >> 56));
  }
  return scans;
}

TEST(Scans, ComeBackToTheBit) {
  for (const int num_rows : {0, 1, 2, 1000}) {
    Samples scans = drawn(num_rows);
    if (num_rows == 2) scans.values[0] = std::numeric_limits<double>::infinity();
    const std::vector<std::byte> bytes = encode_scans(scans, kChannels);
    EXPECT_EQ(decode_scans(bytes, kTicks, kRate_hz, kChannels, "file"), scans);
  }
}

// By NumPy's format, NEP 1, written out by hand.
TEST(Scans, AreWhatNumpyReads) {
  Samples one{.times_s = {2.0}, .values = {1.5, -0.25, 4294967295.0, 65535.0, 255.0}};
  const std::vector<std::byte> bytes = encode_scans(one, kChannels);
  const std::string text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const std::string header =
      "{'descr': [('time_s', '<f8'), ('a_m', '<f8'), ('b', '<f4'), ('c', '<u4'), ('d', '<u2'), "
      "('e', '|u1')], 'fortran_order': False, 'shape': (1,), }";
  EXPECT_EQ(text.substr(0, 8), std::string("\x93NUMPY\x01\x00", 8));
  EXPECT_EQ(text.substr(10, header.size()), header);
  constexpr std::size_t kRowBytes = 8 + 8 + 4 + 4 + 2 + 1;
  EXPECT_EQ((text.size() - kRowBytes) % 64, 0U);
  const char* row = text.data() + text.size() - kRowBytes;
  double time_s = 0.0, a = 0.0;
  float b = 0.0F;
  std::memcpy(&time_s, row, 8);
  std::memcpy(&a, row + 8, 8);
  std::memcpy(&b, row + 16, 4);
  EXPECT_EQ(time_s, 2.0);
  EXPECT_EQ(a, 1.5);
  EXPECT_EQ(b, -0.25F);
  EXPECT_EQ(std::string(row + 20, 7), std::string(7, '\xff'));
}

TEST(Scans, OfOtherTimesOrColumnsAreRefused) {
  const Samples scans = drawn(50);
  const std::vector<std::byte> bytes = encode_scans(scans, kChannels);
  const auto refuse = [&](const std::vector<std::byte>& file, const TickRange& ticks,
                          const std::vector<StreamChannel>& channels) {
    expect_error(core::ErrorKind::Input, {"file", "scans"},
                 [&] { decode_scans(file, ticks, kRate_hz, channels, "file"); });
  };
  refuse(bytes, {.first = 19, .end = 21}, kChannels);
  refuse(bytes, {.first = 21, .end = 23}, kChannels);
  std::vector<StreamChannel> others = kChannels;
  others[1].name = "other";
  refuse(bytes, kTicks, others);
  others = kChannels;
  others[1].type = NumberType::Count32;
  refuse(bytes, kTicks, others);
  Samples unordered = scans;
  std::swap(unordered.times_s[3], unordered.times_s[4]);
  refuse(encode_scans(unordered, kChannels), kTicks, kChannels);
  for (std::size_t size = 0; size < bytes.size(); size += 7)
    refuse({bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size)}, kTicks, kChannels);
}

TEST(Scans, CountsThatTheirTypesCannotHoldAreInternalErrors) {
  for (const double wrong : {-1.0, 0.5, 256.0}) {
    const Samples one{.times_s = {2.0}, .values = {0.0, 0.0, 0.0, 0.0, wrong}};
    expect_error(core::ErrorKind::Internal, {"e of a scan"}, [&] { encode_scans(one, kChannels); });
  }
}

}  // namespace
}  // namespace terracast::test
