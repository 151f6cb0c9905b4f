#include "validate/evaluate/results/result_files.h"

#include <gtest/gtest.h>

#include <random>

#include "core/error.h"
#include "core/image_io.h"
#include "tests/support/test_data.h"
#include "tests/validate/evaluate/wall_flight.h"
#include "validate/evaluate/results/result_images.h"

/// Files from outside: none that is damaged, forged or of another size does more than end the run
/// with an Input error.
namespace terracast::validate {
namespace {

namespace fs = std::filesystem;

constexpr ImageSize kSize{6, 4};

struct Sample {
  std::string name;
  std::string text;
  ParseImage* parse;
};

std::string png_text(const core::Image16& image) {
  const std::vector<std::byte> bytes = core::encode_png(image);
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// A sound file of each format and use.
std::vector<Sample> samples() {
  const std::vector<float> one(24, 2.0F), two(48, 2.0F), three(72, 2.0F);
  test::ByteWriter pfm;
  pfm.put_text("Pf\n6 4\n-1.0\n");
  for (const float value : one) pfm.put(value);
  return {{"flow.flo", test::flo_text(6, 4, two), &parse_flow},
          {"flow.npy", test::npy_text("4, 6, 2", two), &parse_flow},
          {"flow.png", png_text(core::Image16(6, 4, 3, 33000)), &parse_flow},
          {"depth.npy", test::npy_text("4, 6", one), &parse_depth},
          {"depth.pfm", pfm.text, &parse_depth},
          {"depth.png", png_text(core::Image16(6, 4, 1, 700)), &parse_depth},
          {"disparity.pfm", pfm.text, &parse_disparity},
          {"disparity.png", png_text(core::Image16(6, 4, 1, 700)), &parse_disparity},
          {"scene_flow.npy", test::npy_text("4, 6, 3", three), &parse_scene_flow}};
}

std::span<const std::byte> bytes_of(const std::string& text) {
  return std::as_bytes(std::span(text));
}

/// Whether the file is refused with an Input error that names it.
bool is_refused(const Sample& sample, const ImageSize& size = kSize) {
  try {
    sample.parse(bytes_of(sample.text), sample.name, size);
    return false;
  } catch (const core::Error& error) {
    EXPECT_EQ(error.kind(), core::ErrorKind::Input) << sample.name << ": " << error.what();
    EXPECT_NE(error.message().find(sample.name), std::string::npos) << error.what();
    return true;
  }
}

TEST(ResultImages, SoundFilesAreRead) {
  for (const Sample& sample : samples()) EXPECT_FALSE(is_refused(sample)) << sample.name;
}

TEST(ResultImages, AnotherSizeIsRefused) {
  for (const Sample& sample : samples())
    for (const ImageSize& size : {ImageSize{4, 6}, ImageSize{6, 5}, ImageSize{60, 40}})
      EXPECT_TRUE(is_refused(sample, size)) << sample.name;
}

TEST(ResultImages, EveryTruncationIsRefused) {
  for (Sample sample : samples())
    while (!sample.text.empty()) {
      sample.text.pop_back();
      EXPECT_TRUE(is_refused(sample)) << sample.name << " of " << sample.text.size() << " bytes";
    }
}

TEST(ResultImages, BytesTooManyAreRefused) {
  for (Sample sample : samples()) {
    if (sample.name.ends_with(".png")) continue;  // PNG ends by itself
    sample.text += '\0';
    EXPECT_TRUE(is_refused(sample)) << sample.name;
  }
}

TEST(ResultImages, OneFormatInPlaceOfAnotherIsRefused) {
  Sample flow = samples()[2];  // 3 channels
  flow.parse = &parse_depth;
  EXPECT_TRUE(is_refused(flow));
  flow.parse = &parse_disparity;
  EXPECT_TRUE(is_refused(flow));
  Sample depth = samples()[5];
  depth.parse = &parse_flow;
  EXPECT_TRUE(is_refused(depth));
  Sample npy = samples()[3];
  npy.parse = &parse_flow;
  EXPECT_TRUE(is_refused(npy));
  npy.parse = &parse_scene_flow;
  EXPECT_TRUE(is_refused(npy));
  Sample eight = samples()[5];
  const std::vector<std::byte> png = core::encode_png(core::Image8(6, 4, 1, 7));
  eight.text.assign(reinterpret_cast<const char*>(png.data()), png.size());
  EXPECT_TRUE(is_refused(eight));
}

/// Flipped, exchanged and repeated bytes: read or refused, never more. Sizes in forged headers are
/// held against the image's before memory is taken.
TEST(ResultImages, ForgedFilesAreReadOrRefused) {
  std::mt19937 random(11);
  int num_refused = 0, num_read = 0;
  for (const Sample& sound : samples())
    for (int turn = 0; turn < 1500; ++turn) {
      Sample forged = sound;
      const int num_changes = 1 + static_cast<int>(random() % 4);
      for (int i = 0; i < num_changes; ++i) {
        // Headers are what can hurt: most changes are there.
        const std::size_t end = random() % 4 == 0 ? forged.text.size() : 40;
        forged.text[random() % std::min(end, forged.text.size())] = static_cast<char>(random());
      }
      try {
        forged.parse(bytes_of(forged.text), forged.name, kSize);
        ++num_read;
      } catch (const core::Error& error) {
        EXPECT_EQ(error.kind(), core::ErrorKind::Input) << error.what();
        ++num_refused;
      }
    }
  EXPECT_GT(num_refused, 1000);
  EXPECT_GT(num_read, 100);
}

TEST(ResultImages, SizesThatOverflowAreRefused) {
  for (const std::int32_t extent : {-1, 0, 1 << 30, 2147483647}) {
    test::ByteWriter flo;
    flo.put_text("PIEH").put(extent).put(extent);
    EXPECT_TRUE(is_refused({"forged.flo", flo.text, &parse_flow}));
  }
  EXPECT_TRUE(is_refused(
      {"forged.npy", test::npy_text<float>("4611686018427387904, 4, 2", {}), &parse_flow}));
  EXPECT_TRUE(is_refused({"forged.pfm", "Pf\n99999999999 99999999999\n-1.0\n", &parse_depth}));
  EXPECT_TRUE(is_refused({"forged.pfm", "Pf\n6 4\nnan\n" + std::string(96, 'x'), &parse_depth}));
  EXPECT_TRUE(is_refused({"forged.pfm", "PF\n6 4\n-1\n" + std::string(288, 'x'), &parse_depth}));
}

TEST(NumberedFiles, TheFirstDigitsAreTheFrame) {
  const test::ScratchFolder scratch;
  for (const char* name : {"000000.flo", "frame_1.flo", "0000000002.flo", "000003_10.png",
                           "000004_000005_flow.npz", "000004_000005_mask.npy", "notes.txt"})
    core::write_file(scratch / name, std::string_view("x"));
  fs::create_directories(scratch / "000005.flo");  // a folder is no file
  const NumberedFiles files =
      find_numbered_files(scratch.path(), 6, flow_extensions(), {"_mask.npy"});
  ASSERT_EQ(files.by_frame.size(), 5U);
  for (int frame = 0; frame < 5; ++frame) EXPECT_TRUE(files.has(frame)) << frame;
  EXPECT_EQ(files.path(4).filename(), "000004_000005_flow.npz");
  EXPECT_TRUE(files.notes.empty());
}

TEST(NumberedFiles, NumbersOfManyDigitsAreNoFrames) {
  const test::ScratchFolder scratch;
  core::write_file(scratch / "000001.npy", std::string_view("x"));
  core::write_file(scratch / "99999999999999999999999.npy", std::string_view("x"));
  const NumberedFiles files = find_numbered_files(scratch.path(), 3, depth_extensions());
  EXPECT_EQ(files.by_frame.size(), 1U);
  EXPECT_EQ(files.notes.size(), 1U);
  fs::remove(scratch / "000001.npy");
  EXPECT_THROW(find_numbered_files(scratch.path(), 3, depth_extensions()), core::Error);
}

}  // namespace
}  // namespace terracast::validate
