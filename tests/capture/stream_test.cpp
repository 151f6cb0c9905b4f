#include "capture/stream.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <string>

#include "capture/sink.h"
#include "core/random.h"
#include "tests/support/expect_error.h"

namespace terracast::test {
namespace {

using capture::Samples;
using capture::TickRange;

// Against all ticks of a sequence counted one by one: each is in the frame that its time is in, and in no other.
TEST(Streams, EachTickIsInOneFrame) {
  for (std::uint64_t draw = 0; draw < 300; ++draw) {
    const double rate_hz = 0.5 * std::pow(2000.0, core::random_unit(1, 1, draw));
    const double frame_rate_hz = 0.5 * std::pow(100.0, core::random_unit(1, 2, draw));
    const int num_frames = 1 + static_cast<int>(40.0 * core::random_unit(1, 3, draw));
    const double end_s = (num_frames - 1) / frame_rate_hz;
    std::int64_t next = 0;
    for (int frame = 0; frame < num_frames; ++frame) {
      const TickRange ticks = capture::ticks_of_frame(rate_hz, frame_rate_hz, frame, num_frames);
      EXPECT_EQ(ticks.first, next);
      for (const double time_s : capture::times_of(ticks, rate_hz)) {
        EXPECT_GE(time_s, frame / frame_rate_hz);
        EXPECT_LE(time_s, end_s);
        if (frame + 1 < num_frames) {
          EXPECT_LT(time_s, (frame + 1) / frame_rate_hz);
        }
      }
      next = ticks.end;
    }
    EXPECT_GT(static_cast<double>(next) / rate_hz, end_s) << rate_hz << " " << frame_rate_hz;
  }
}

TEST(Streams, AFrameOfTenHertzHoldsTenTicksOfHundredAndTheLastFrameOne) {
  EXPECT_EQ(capture::ticks_of_frame(100.0, 10.0, 0, 3).end, 10);
  EXPECT_EQ(capture::ticks_of_frame(100.0, 10.0, 2, 3).first, 20);
  EXPECT_EQ(capture::ticks_of_frame(100.0, 10.0, 2, 3).end, 21);
}

Samples some_samples() {
  return {.times_s = {0.0, 0.1, 0.2},
          .values = {1.0, -2.5, 0.1, std::numeric_limits<double>::infinity(), 1e-300, 1.0 / 3.0}};
}

// NumPy's format, version 1.0, written out: magic, version, length and text of the header, then little-endian doubles.
TEST(Streams, AreNumPyArrays) {
  const std::vector<std::byte> bytes = capture::encode_samples(some_samples(), 2);
  const std::string text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  EXPECT_EQ(text.substr(1, 5), "NUMPY");
  EXPECT_NE(text.find("'descr': '<f8'"), std::string::npos);
  EXPECT_NE(text.find("'fortran_order': False"), std::string::npos);
  EXPECT_NE(text.find("'shape': (3, 3)"), std::string::npos);
  double row[3];
  std::memcpy(row, bytes.data() + bytes.size() - sizeof row, sizeof row);
  EXPECT_EQ(row[0], 0.2);
  EXPECT_EQ(row[1], 1e-300);
  EXPECT_EQ(row[2], 1.0 / 3.0);
}

TEST(Streams, ComeBackToTheBit) {
  const Samples samples = some_samples();
  EXPECT_EQ(capture::decode_samples(capture::encode_samples(samples, 2), samples.times_s, 2, "a"),
            samples);
  const Samples none;
  EXPECT_EQ(capture::decode_samples(capture::encode_samples(none, 4), {}, 4, "a"), none);
}

TEST(Streams, OtherArraysAreRefused) {
  const Samples samples = some_samples();
  const std::vector<std::byte> whole = capture::encode_samples(samples, 2);
  const auto refuse = [&](std::span<const std::byte> bytes, const std::vector<double>& times_s,
                          std::size_t num_channels) {
    expect_error(core::ErrorKind::Input, {"a.npy", "NumPy array"},
                 [&] { capture::decode_samples(bytes, times_s, num_channels, "a.npy"); });
  };
  refuse(std::span(whole).first(whole.size() - 1), samples.times_s, 2);
  refuse({}, samples.times_s, 2);
  refuse(whole, {0.0, 0.1}, 2);
  refuse(whole, {0.0, 0.1, 0.3}, 2);
  refuse(whole, samples.times_s, 1);
  std::vector<std::byte> longer = whole;
  longer.push_back(std::byte{0});
  refuse(longer, samples.times_s, 2);
  for (const std::size_t at : {std::size_t{0}, std::size_t{20}, std::size_t{60}}) {
    std::vector<std::byte> changed = whole;
    changed[at] ^= std::byte{1};
    refuse(changed, samples.times_s, 2);
  }
}

TEST(MemorySink, KeepsWhatIsWritten) {
  const capture::MemorySink sink;
  sink.write_samples(3, 0, some_samples());
  capture::FrameRecord record;
  record.index = 3;
  record.key = "a";
  sink.finish_frame(record);
  EXPECT_EQ(sink.samples(3, 0), some_samples());
  EXPECT_EQ(sink.record(3).key, "a");
  EXPECT_EQ(sink.num_frames(), 1U);
  EXPECT_THROW(sink.samples(2, 0), std::out_of_range);
}

}  // namespace
}  // namespace terracast::test
