#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "core/error.h"
#include "core/image_io.h"
#include "core/random.h"

namespace terracast::core {
namespace {

using ::testing::HasSubstr;

constexpr int kWidth = 23;
constexpr int kHeight = 17;
constexpr std::size_t kPixels = std::size_t{kWidth} * kHeight;

struct Values {
  std::vector<float> range_m;
  std::vector<float> normal;
  std::vector<std::uint32_t> id;

  Values() {
    for (std::size_t i = 0; i < kPixels; ++i) {
      range_m.push_back(static_cast<float>(random_between(0.1, 1e5, 1, 0, i)));
      normal.push_back(static_cast<float>(random_between(-1.0, 1.0, 1, 1, i)));
      id.push_back(static_cast<std::uint32_t>(random_bits(1, 2, i)));
    }
    range_m[3] = std::numeric_limits<float>::infinity();
    range_m[4] = std::numeric_limits<float>::quiet_NaN();
    range_m[5] = -0.0F;
    range_m[6] = std::numeric_limits<float>::denorm_min();
    normal[0] = std::numeric_limits<float>::infinity();
    id[0] = 0xffffffffU;
  }
};

std::vector<ExrPart> parts_of(const Values& values, ExrPart::Compression compression) {
  ExrPart first{.name = "geometry", .width = kWidth, .height = kHeight};
  first.channels.push_back(
      {.name = "range_m", .type = ExrChannel::Type::Float, .values_float = values.range_m});
  first.channels.push_back(
      {.name = "normal.x", .type = ExrChannel::Type::Half, .values_float = values.normal});
  first.compression = compression;
  first.attributes = {{"note", "sky is +inf"}};
  ExrPart second{.name = "ids", .width = kWidth, .height = kHeight};
  second.channels.push_back(
      {.name = "instance", .type = ExrChannel::Type::Uint, .values_uint = values.id});
  second.compression = compression;
  return {first, second};
}

bool same_bits(std::span<const float> a, std::span<const float> b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size_bytes()) == 0;
}

TEST(ExrTest, EveryCompressionReadsBackBitForBit) {
  const Values values;
  for (const auto compression :
       {ExrPart::Compression::None, ExrPart::Compression::Rle, ExrPart::Compression::Zips}) {
    const std::vector<ExrPart> parts = parts_of(values, compression);
    const std::vector<std::byte> bytes = encode_exr(parts);
    EXPECT_TRUE(encode_exr(parts) == bytes);
    const std::vector<ExrImage> images = decode_exr(bytes, "x.exr");
    ASSERT_EQ(images.size(), 2U);
    EXPECT_EQ(images[0].name, "geometry");
    EXPECT_EQ(images[0].width, kWidth);
    EXPECT_EQ(images[0].height, kHeight);
    EXPECT_EQ(images[0].attributes.at("note"), "sky is +inf");
    EXPECT_EQ(images[0].attributes.size(), 1U);
    ASSERT_EQ(images[0].float_channels.size(), 2U);
    EXPECT_TRUE(same_bits(images[0].float_channels.at("range_m").data(), values.range_m));
    const ImageF& normal = images[0].float_channels.at("normal.x");
    EXPECT_TRUE(std::isinf(normal(0, 0)));
    // A half has 11 bits: rounding errs by 2^-11 of the value at most, and by 2^-25 next to 0.
    for (std::size_t i = 1; i < kPixels; ++i)
      ASSERT_NEAR(normal.data()[i], values.normal[i],
                  double{std::abs(values.normal[i])} * 0x1p-11 + 0x1p-25);
    ASSERT_EQ(images[1].uint_channels.size(), 1U);
    EXPECT_THAT(images[1].uint_channels.at("instance").data(),
                testing::ElementsAreArray(values.id));
  }
}

TEST(ExrTest, OnePartMakesASinglePartFile) {
  const Values values;
  const ExrPart part = parts_of(values, ExrPart::Compression::Rle)[0];
  const std::vector<std::byte> single = encode_exr({part});
  const std::vector<std::byte> multi = encode_exr(parts_of(values, ExrPart::Compression::Rle));
  // Bytes 4 to 7 are the version and its flags; 0x10 of the second says multi-part.
  EXPECT_EQ(single[4], std::byte{2});
  EXPECT_EQ(single[5], std::byte{0});
  EXPECT_EQ(multi[5], std::byte{0x10});
  EXPECT_TRUE(
      same_bits(decode_exr(single, "x")[0].float_channels.at("range_m").data(), values.range_m));
}

TEST(ExrTest, UnfitPartsAreRefused) {
  const Values values;
  const std::vector<ExrPart> good = parts_of(values, ExrPart::Compression::Rle);
  const auto refused = [](const std::vector<ExrPart>& parts) {
    EXPECT_THROW(encode_exr(parts), Error);
  };
  refused({});
  std::vector<ExrPart> parts = good;
  parts[0].width += 1;
  refused(parts);
  parts = good;
  parts[1].name = parts[0].name;
  refused(parts);
  parts = good;
  parts[0].channels.push_back(parts[0].channels[0]);
  refused(parts);
  parts = good;
  parts[0].attributes["compression"] = "x";
  refused(parts);
  std::vector<float> large = values.normal;
  large[9] = 70000.0F;  // a half would make it infinite
  parts = good;
  parts[0].channels[1].values_float = large;
  refused(parts);
}

/// Whether the bytes are refused; anything but an Input error fails the test.
bool is_refused(std::span<const std::byte> bytes, std::size_t max_pixels = 1U << 20) {
  try {
    decode_exr(bytes, "bad.exr", max_pixels);
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::Input) << error.what();
    EXPECT_THAT(error.what(), testing::StartsWith("bad.exr: "));
    return true;
  }
  return false;
}

TEST(ExrTest, EveryTruncationIsRefused) {
  const Values values;
  for (const auto compression : {ExrPart::Compression::None, ExrPart::Compression::Zips}) {
    const std::vector<std::byte> bytes = encode_exr(parts_of(values, compression));
    for (std::size_t size = 0; size < bytes.size(); size += size < 2000 ? 1 : 13)
      ASSERT_TRUE(is_refused(std::span(bytes).first(size))) << size;
  }
}

TEST(ExrTest, DamageNeverCrashes) {
  const Values values;
  for (const auto compression :
       {ExrPart::Compression::None, ExrPart::Compression::Rle, ExrPart::Compression::Zips}) {
    const std::vector<std::byte> good = encode_exr(parts_of(values, compression));
    for (std::uint64_t round = 0; round < 2000; ++round) {
      std::vector<std::byte> bytes = good;
      // Mostly in the headers, where the sizes stand.
      const std::size_t range =
          round % 3 == 0 ? bytes.size() : std::min<std::size_t>(900, bytes.size());
      for (std::uint64_t i = 0; i <= round % 4; ++i)
        bytes[4 + random_bits(round, 1, i) % (range - 4)] =
            static_cast<std::byte>(random_bits(round, 2, i));
      is_refused(bytes);
    }
  }
}

TEST(ExrTest, LargeClaimsAreRefused) {
  const Values values;
  EXPECT_TRUE(is_refused(encode_exr(parts_of(values, ExrPart::Compression::Rle)), kPixels - 1));
  EXPECT_FALSE(is_refused(encode_exr(parts_of(values, ExrPart::Compression::Rle)), kPixels));
  // The data window's corner, wherever it stands, set to the largest numbers.
  const std::vector<std::byte> good = encode_exr({parts_of(values, ExrPart::Compression::None)[1]});
  const std::string text(reinterpret_cast<const char*>(good.data()), good.size());
  const std::string attribute("dataWindow\0box2i\0\x10\0\0\0", 21);
  const std::size_t at = text.find(attribute);
  ASSERT_NE(at, std::string::npos);
  for (const std::uint32_t corner : {0x7fffffffU, 0x7ffffffeU, 0x00ffffffU, 0x3fffU}) {
    std::vector<std::byte> bytes = good;
    std::memcpy(bytes.data() + at + attribute.size() + 8, &corner, 4);
    EXPECT_TRUE(is_refused(bytes, std::size_t{1} << 40)) << corner;
    std::memcpy(bytes.data() + at + attribute.size() + 12, &corner, 4);
    EXPECT_TRUE(is_refused(bytes, std::size_t{1} << 40)) << corner;
  }
  // An attribute that says it has 2 GB: refused by what is there, not by asking for memory.
  std::vector<std::byte> bytes = good;
  bytes[at + attribute.size() - 1] = std::byte{0x7f};
  EXPECT_TRUE(is_refused(bytes));
  EXPECT_TRUE(is_refused(std::span(good).first(3)));
  EXPECT_TRUE(is_refused(std::span(good).subspan(1)));
}

}  // namespace
}  // namespace terracast::core
