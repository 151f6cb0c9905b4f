#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <libdeflate.h>
#include <png.h>

#include <cstring>
#include <fstream>

#include "core/error.h"
#include "core/image_io.h"
#include "core/random.h"
#include "tests/support/peak_memory.h"

namespace terracast::core {
namespace {

using ::testing::HasSubstr;

/// Values of one of several natures: smooth, noise, flat, rows alike, the extremes.
template <class T>
Image<T> test_image(int width, int height, int channels, int nature) {
  Image<T> image(width, height, channels);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      for (int c = 0; c < channels; ++c) {
        const std::uint64_t noise = random_bits(1, static_cast<std::uint64_t>(y),
                                                static_cast<std::uint64_t>(x * channels + c));
        const std::uint64_t values[] = {static_cast<std::uint64_t>(300 * x + 77 * y + 1000 * c),
                                        noise, static_cast<std::uint64_t>(42 + c),
                                        static_cast<std::uint64_t>(x * x * 31 + c),
                                        noise % 2 == 0 ? 0 : ~std::uint64_t{0}};
        image(x, y, c) = static_cast<T>(values[nature]);
      }
  return image;
}

template <class T>
void expect_round_trip(const Image<T>& image, int level) {
  const std::vector<std::byte> bytes = encode_png(image, level);
  const auto decoded = decode_png(bytes, "x.png");
  ASSERT_TRUE(std::holds_alternative<Image<T>>(decoded));
  EXPECT_TRUE(std::get<Image<T>>(decoded) == image);
  EXPECT_TRUE(encode_png(image, level) == bytes);
}

TEST(PngTest, LibpngReadsBackEveryLayout) {
  for (int nature = 0; nature < 5; ++nature)
    for (int channels = 1; channels <= 4; ++channels)
      for (const auto& [width, height] :
           std::vector<std::pair<int, int>>{{1, 1}, {1, 7}, {7, 1}, {16, 16}, {33, 20}, {641, 5}}) {
        expect_round_trip(test_image<std::uint8_t>(width, height, channels, nature), 1);
        expect_round_trip(test_image<std::uint16_t>(width, height, channels, nature), 1);
      }
}

TEST(PngTest, EveryLevelReadsBack) {
  for (int level = 1; level <= 12; ++level)
    expect_round_trip(test_image<std::uint8_t>(100, 60, 3, 0), level);
  const Image8 image = test_image<std::uint8_t>(8, 8, 1, 0);
  EXPECT_THROW(encode_png(image, 0), Error);
  EXPECT_THROW(encode_png(image, 13), Error);
  EXPECT_THROW(encode_png(Image8(0, 4)), Error);
  EXPECT_THROW(encode_png(Image8(4, 4, 5)), Error);
}

TEST(PngTest, HoldsNothingButHeaderPixelsAndEnd) {
  const std::vector<std::byte> bytes = encode_png(test_image<std::uint16_t>(5, 4, 1, 1));
  const std::string text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  EXPECT_EQ(text.substr(0, 33), std::string("\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\0\5\0\0\0\4\x10\0"
                                            "\0\0\0",
                                            29) +
                                    text.substr(29, 4));
  EXPECT_EQ(text.substr(37, 4), "IDAT");
  EXPECT_EQ(text.substr(text.size() - 12), std::string("\0\0\0\0IEND\xae\x42\x60\x82", 12));
}

TEST(PngTest, SixteenBitsAreBigEndianInTheFile) {
  Image16 image(1, 1);
  image(0, 0) = 0x1234;
  const std::vector<std::byte> bytes = encode_png(image);
  const std::size_t size = bytes.size() - 12 - 4 - 41;  // the data of the one IDAT
  unsigned char row[3] = {};
  libdeflate_decompressor* decompressor = libdeflate_alloc_decompressor();
  EXPECT_EQ(
      libdeflate_zlib_decompress(decompressor, bytes.data() + 41, size, row, sizeof row, nullptr),
      LIBDEFLATE_SUCCESS);
  libdeflate_free_decompressor(decompressor);
  EXPECT_EQ(row[1], 0x12);
  EXPECT_EQ(row[2], 0x34);
}

/// A PNG that libpng writes: other colour types, depths and orders than ours.
std::vector<std::byte> libpng_image(int width, int height, int depth, int type, bool interlaced,
                                    const std::vector<std::uint8_t>& packed_rows,
                                    const std::vector<png_color>& palette = {}) {
  std::vector<std::byte> out;
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  png_set_write_fn(
      png, &out,
      [](png_structp p, png_bytep data, std::size_t size) {
        auto* bytes = static_cast<std::vector<std::byte>*>(png_get_io_ptr(p));
        const auto* begin = reinterpret_cast<const std::byte*>(data);
        bytes->insert(bytes->end(), begin, begin + size);
      },
      nullptr);
  png_set_IHDR(png, info, static_cast<png_uint_32>(width), static_cast<png_uint_32>(height), depth,
               type, interlaced ? PNG_INTERLACE_ADAM7 : PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  if (!palette.empty()) png_set_PLTE(png, info, palette.data(), static_cast<int>(palette.size()));
  png_write_info(png, info);
  std::vector<png_bytep> rows;
  const std::size_t row_bytes = png_get_rowbytes(png, info);
  std::vector<std::uint8_t> copy = packed_rows;
  for (int y = 0; y < height; ++y)
    rows.push_back(copy.data() + static_cast<std::size_t>(y) * row_bytes);
  png_write_image(png, rows.data());
  png_write_end(png, nullptr);
  png_destroy_write_struct(&png, &info);
  return out;
}

TEST(PngTest, DecodesPalettesSmallDepthsAndInterlacing) {
  const auto palette = decode_png(
      libpng_image(2, 1, 8, PNG_COLOR_TYPE_PALETTE, false, {1, 0}, {{1, 2, 3}, {4, 5, 6}}), "p");
  EXPECT_THAT(std::get<Image8>(palette).data(), testing::ElementsAre(4, 5, 6, 1, 2, 3));
  const auto bits = decode_png(libpng_image(3, 1, 1, PNG_COLOR_TYPE_GRAY, false, {0xa0}), "b");
  EXPECT_THAT(std::get<Image8>(bits).data(), testing::ElementsAre(255, 0, 255));

  const Image8 image = test_image<std::uint8_t>(21, 13, 3, 1);
  const std::vector<std::uint8_t> rows(image.data().begin(), image.data().end());
  for (const bool interlaced : {false, true}) {
    const auto decoded =
        decode_png(libpng_image(21, 13, 8, PNG_COLOR_TYPE_RGB, interlaced, rows), "x");
    EXPECT_TRUE(std::get<Image8>(decoded) == image);
  }
}

std::string input_error(std::span<const std::byte> bytes, std::size_t max_pixels = 1U << 20) {
  try {
    decode_png(bytes, "bad.png", max_pixels);
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::Input) << error.what();
    EXPECT_THAT(error.what(), testing::StartsWith("bad.png: "));
    return error.what();
  }
  return {};
}

TEST(PngTest, EveryTruncationIsRefused) {
  const std::vector<std::byte> bytes = encode_png(test_image<std::uint8_t>(40, 30, 3, 1));
  for (std::size_t size = 0; size < bytes.size(); ++size)
    ASSERT_NE(input_error(std::span(bytes).first(size)), "") << size;
}

TEST(PngTest, EveryFlippedBitIsRefused) {
  // The signature, the lengths, the checksums and zlib's own leave no bit unguarded.
  std::vector<std::byte> bytes = encode_png(test_image<std::uint16_t>(9, 8, 1, 1));
  for (std::size_t i = 0; i < bytes.size(); ++i)
    for (int bit = 0; bit < 8; ++bit) {
      const std::byte before = bytes[i];
      bytes[i] ^= static_cast<std::byte>(1 << bit);
      ASSERT_NE(input_error(bytes), "") << i << " " << bit;
      bytes[i] = before;
    }
}

TEST(PngTest, GarbageIsRefused) {
  const std::vector<std::byte> good = encode_png(test_image<std::uint8_t>(10, 10, 3, 1));
  for (std::uint64_t round = 0; round < 3000; ++round) {
    std::vector<std::byte> bytes = good;
    for (std::size_t i = round % 2 == 0 ? 0 : 8; i < bytes.size(); ++i)
      if (random_bits(round, 0, i) % 3 == 0)
        bytes[i] = static_cast<std::byte>(random_bits(round, 1, i));
    ASSERT_NE(input_error(bytes), "");
  }
}

TEST(PngTest, ClaimsThatTheFileCannotHoldTakeNoMemory) {
  EXPECT_THAT(input_error(encode_png(Image8(1025, 1024, 1))), HasSubstr("more than the 1048576"));
  EXPECT_EQ(input_error(encode_png(Image8(1024, 1024, 1))), "");
  // 2^31 - 1 pixels a side, said in a header with the right checksum.
  std::vector<std::byte> bytes = encode_png(Image8(4, 4, 4));
  for (const std::size_t at : {16, 20}) {
    bytes[at] = std::byte{0x7f};
    for (std::size_t i = 1; i < 4; ++i) bytes[at + i] = std::byte{0xff};
  }
  const auto fix_header = [&bytes] {
    const std::uint32_t crc = libdeflate_crc32(0, bytes.data() + 12, 17);
    for (std::size_t i = 0; i < 4; ++i)
      bytes[29 + i] = static_cast<std::byte>((crc >> (24 - 8 * i)) & 0xffU);
  };
  fix_header();
  EXPECT_THAT(input_error(bytes), HasSubstr("pixels"));
  bytes[16] = bytes[20] = std::byte{0};  // 16777215 x 255, within a wide limit
  bytes[21] = bytes[22] = std::byte{0};
  fix_header();
  EXPECT_THAT(input_error(bytes, std::size_t{1} << 40), HasSubstr("cannot hold"));
}

std::string zipped(const std::string& bytes) {
  libdeflate_compressor* compressor = libdeflate_alloc_compressor(12);
  std::string out(libdeflate_zlib_compress_bound(compressor, bytes.size()), '\0');
  out.resize(
      libdeflate_zlib_compress(compressor, bytes.data(), bytes.size(), out.data(), out.size()));
  libdeflate_free_compressor(compressor);
  return out;
}

/// Four bytes, the highest first.
std::string number(std::size_t value) {
  std::string text;
  for (int shift = 24; shift >= 0; shift -= 8) text += static_cast<char>(value >> shift & 255U);
  return text;
}

std::string chunk(const std::string& type, const std::string& data) {
  const std::string checked = type + data;
  return number(data.size()) + checked +
         number(libdeflate_crc32(0, checked.data(), checked.size()));
}

std::span<const std::byte> bytes_of(const std::string& text) {
  return std::as_bytes(std::span(text));
}

/// By its defaults libpng unpacks and keeps up to a thousand texts of 8 MB, each of which takes 8 kB of the file, and a profile.
TEST(PngTest, WhatStandsBesideThePixelsTakesNoMemory) {
  const Image8 image = test_image<std::uint8_t>(20, 10, 3, 0);
  const std::vector<std::byte> plain = encode_png(image);
  const std::string png(reinterpret_cast<const char*>(plain.data()), plain.size());
  const std::string head = png.substr(0, 33);  // signature and IHDR
  const std::string pixels = png.substr(33, png.size() - 33 - 12);
  const std::string tail = png.substr(png.size() - 12);
  const std::string packed = zipped(std::string(7'900'000, 'x'));
  ASSERT_LT(packed.size(), 10'000U);
  const auto text = [](const char* begin, std::size_t size) { return std::string(begin, size); };
  // A profile's header: how long it is, a screen's, RGB to XYZ, and one tag beyond it.
  std::string profile(7'900'000, '\0');
  profile.replace(0, 4, number(profile.size()));
  profile.replace(12, 12, "mntrRGB XYZ ");
  profile.replace(36, 4, "acsp");
  profile.replace(128, 4, number(1));
  profile = zipped(profile);
  const std::vector<std::pair<std::string, std::string>> chunks = {
      {"zTXt", text("k\0\0", 3) + packed},
      {"iTXt", text("k\0\1\0\0\0", 6) + packed},
      {"iCCP", text("n\0\0", 3) + profile}};
  for (const auto& [type, data] : chunks)
    for (const bool is_before : {true, false}) {
      SCOPED_TRACE(fmt::format("{} {}", type, is_before ? "before" : "after"));
      std::string bombs;
      for (int i = 0; i < 200; ++i) bombs += chunk(type, data);
      const std::string whole =
          is_before ? head + bombs + pixels + tail : head + pixels + bombs + tail;
      const test::PeakMemory peak;
      EXPECT_TRUE(std::get<Image8>(decode_png(bytes_of(whole), "x.png")) == image);
      EXPECT_LT(peak.more_mb(), 4.0);
      // Damage is found there, too.
      std::string damaged = whole;
      damaged[(is_before ? head : head + pixels).size() + 100] ^= 1;
      EXPECT_THAT(input_error(bytes_of(damaged)), HasSubstr("CRC"));
    }
  // Pixels beyond the image: 200 MB of them.
  std::string rows;
  for (int y = 0; y < 10; ++y) {
    rows += '\0';
    rows.append(reinterpret_cast<const char*>(image.row(y).data()), image.row(y).size());
  }
  const std::string more =
      head + chunk("IDAT", zipped(rows + std::string(200'000'000, '\0'))) + tail;
  const test::PeakMemory peak;
  EXPECT_TRUE(std::get<Image8>(decode_png(bytes_of(more), "x.png")) == image);
  EXPECT_LT(peak.more_mb(), 4.0);
}

/// A transparent colour and a palette's alpha are of the pixels, and are read.
TEST(PngTest, TransparencyIsRead) {
  const std::vector<std::byte> plain = encode_png(Image8(2, 1, 3, 7));
  const std::string png(reinterpret_cast<const char*>(plain.data()), plain.size());
  const std::string clear =
      png.substr(0, 33) + chunk("tRNS", std::string("\0\7\0\7\0\7", 6)) + png.substr(33);
  EXPECT_THAT(std::get<Image8>(decode_png(bytes_of(clear), "x.png")).data(),
              testing::ElementsAre(7, 7, 7, 0, 7, 7, 7, 0));
}

}  // namespace
}  // namespace terracast::core
