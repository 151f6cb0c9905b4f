#include "core/png_rows.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <stdexcept>
#include <variant>

#include "core/error.h"
#include "core/image_io.h"
#include "core/random.h"

namespace terracast::core {
namespace {

/// Noise, or flat patches as land cover has them.
Image8 drawn_image(int width, int height, bool is_noise) {
  Image8 image(width, height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      image(x, y) = static_cast<std::uint8_t>(
          is_noise ? random_bits(3, static_cast<std::uint64_t>(x), static_cast<std::uint64_t>(y))
                   : static_cast<std::uint64_t>((x / 37) ^ (y / 23)) % 9);
  return image;
}

TEST(PngRows, ReadBackAsTheImageThatTheyAreOf) {
  // libpng's own bound on either side is a million.
  for (const auto& [width, height] :
       {std::pair(1, 1), {1, 700}, {700, 1}, {641, 333}, {1'000'001, 1}, {1, 1'000'001}})
    for (const bool is_noise : {false, true})
      for (const int level : {1, 7}) {
        const Image8 image = drawn_image(width, height, is_noise);
        int next = 0;
        const std::vector<std::byte> bytes = encode_png_rows(
            width, height,
            [&](int y, std::span<std::uint8_t> row) {
              EXPECT_EQ(y, next++);
              std::ranges::copy(image.row(y), row.begin());
            },
            level);
        const auto decoded = decode_png(bytes, "rows.png");
        ASSERT_TRUE(std::holds_alternative<Image8>(decoded));
        EXPECT_TRUE(std::get<Image8>(decoded) == image) << width << "x" << height;
        if (!is_noise) {
          EXPECT_LT(bytes.size(), image.data().size() / 20 + 200);
        }
      }
}

TEST(PngRows, WhatARowThrowsIsPassedOn) {
  const auto fill = [](int y, std::span<std::uint8_t> row) {
    if (y == 40) throw std::runtime_error("row 40");
    std::ranges::fill(row, std::uint8_t{1});
  };
  EXPECT_THROW(encode_png_rows(100, 100, fill), std::runtime_error);
  EXPECT_EQ(std::get<Image8>(decode_png(encode_png_rows(100, 40, fill), "x.png")),
            Image8(100, 40, 1, 1));
  EXPECT_THROW(encode_png_rows(100, 40, fill, 0), Error);
  EXPECT_THROW(encode_png_rows(100, 40, fill, 10), Error);
  EXPECT_THROW(encode_png_rows(0, 40, fill), Error);
}

}  // namespace
}  // namespace terracast::core
