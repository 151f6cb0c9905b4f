#include "scene/objects/texture_library.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <tuple>
#include <utility>

#include "core/error.h"
#include "core/random.h"
#include "core/srgb.h"
#include "tests/support/expect_error.h"
#include "tests/support/test_data.h"
#include "world/texture.h"

namespace terracast::scene {
namespace {

core::Image8 noise_image(int width, int height, int channels) {
  core::Image8 image(width, height, channels);
  std::uint64_t at = 0;
  for (std::uint8_t& code : image.data())
    code = static_cast<std::uint8_t>(core::random_bits(7, 3, at++) >> 56);
  return image;
}

/// By the formula of IEC 61966-2-1, in double.
double linear_of(std::uint8_t code) {
  const double value = code / 255.0;
  return value <= 0.04045 ? value / 12.92 : std::pow((value + 0.055) / 1.055, 2.4);
}

/// Mean of a channel, in linear light, by alpha.
double mean_of(const core::Image8& image, int channel) {
  double sum = 0.0;
  double weight = 0.0;
  for (int y = 0; y < image.height(); ++y)
    for (int x = 0; x < image.width(); ++x) {
      const double alpha = image.channels() == 4 ? image(x, y, 3) / 255.0 : 1.0;
      sum += alpha * linear_of(image(x, y, channel));
      weight += alpha;
    }
  return sum / weight;
}

world::Finish finish_of(std::uint16_t texture) {
  world::Finish finish;
  finish.material = world::Material::Textured;
  finish.pattern = texture;
  finish.color_srgb = {10, 200, 90};
  return finish;
}
/// What its finish does to a texture's linear colour.
double tint(int channel) {
  return linear_of(finish_of(0).color_srgb[static_cast<std::size_t>(channel)]);
}

TEST(Srgb, EachCodeIsTheNearestOfItsLinearValueAndOfAllBetween) {
  for (int code = 0; code < 256; ++code) {
    const auto own = static_cast<std::uint8_t>(code);
    EXPECT_NEAR(core::linear_from_srgb8(own), linear_of(own), 1e-7);
    EXPECT_EQ(core::srgb8_from_linear(core::linear_from_srgb8(own)), own);
  }
  for (int i = 0; i <= 100000; ++i) {
    const double linear = i / 100000.0;
    const double encoded =
        linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
    // The two branches of the standard meet within 1e-5 of a code, and floats are 6e-8 apart.
    EXPECT_NEAR(core::srgb8_from_linear(static_cast<float>(linear)), encoded * 255.0, 0.501) << i;
  }
  EXPECT_EQ(core::srgb8_from_linear(std::numeric_limits<float>::quiet_NaN()), 0);
  EXPECT_EQ(core::srgb8_from_linear(7.0f), 255);
}

TEST(TextureLevels, KeepTheMeanOfTheImageInLinearLight) {
  for (const auto& [width, height] : {std::pair(256, 128), std::pair(255, 77), std::pair(3, 1),
                                      std::pair(1, 9), std::pair(301, 1)}) {
    for (const int channels : {3, 4}) {
      const auto levels = world::mip_levels(noise_image(width, height, channels));
      std::size_t bytes = 0;
      for (const core::Image8& level : levels) {
        bytes += level.data().size();
        // Each level rounds each pixel by half a code, which is 0.009 of linear light at the brightest;
        // those errors add up over the levels, and average out over the pixels.
        const double tolerance =
            0.009 * static_cast<double>(levels.size()) / std::sqrt(level.num_pixels()) + 1e-6;
        for (int k = 0; k < 3; ++k)
          EXPECT_NEAR(mean_of(level, k), mean_of(levels.front(), k), tolerance)
              << width << " x " << height << ", level of " << level.width();
      }
      EXPECT_EQ(levels.back().num_pixels(), 1u);
      EXPECT_EQ(bytes, world::mip_bytes(width, height, channels));
    }
  }
}

TEST(TexturedAlbedo, IsThePixelAtItsCentreAndRepeats) {
  const core::Image8 image = noise_image(8, 5, 3);
  const TextureLibrary library(
      std::vector<world::Texture>{{"plain", noise_image(2, 2, 3)}, {"noise", image}});
  for (int y = 0; y < 5; ++y)
    for (int x = 0; x < 8; ++x)
      for (const float whole : {0.0f, -3.0f, 17.0f}) {
        const Eigen::Vector2f uv((x + 0.5f) / 8.0f + whole, 1.0f - (y + 0.5f) / 5.0f - whole);
        const Color seen = textured_albedo(library, finish_of(1), uv, 0.0f);
        // 17 lengths away a float of uv is spaced 2e-6: 1e-5 of a pixel.
        for (int k = 0; k < 3; ++k) EXPECT_NEAR(seen[k], tint(k) * linear_of(image(x, y, k)), 3e-5);
      }
  // Halfway between the last column and the first.
  const Color border = textured_albedo(library, finish_of(1), {0.0f, 1.0f - 0.5f / 5.0f}, 0.0f);
  for (int k = 0; k < 3; ++k)
    EXPECT_NEAR(border[k], 0.5 * tint(k) * (linear_of(image(0, 0, k)) + linear_of(image(7, 0, k))),
                1e-5);
}

TEST(TexturedAlbedo, OfAFootprintAsWideAsTheTextureIsItsMean) {
  const core::Image8 image = noise_image(64, 64, 3);
  const TextureLibrary library(std::vector<world::Texture>{{"noise", image}});
  for (const float footprint : {1.0f, 50.0f, std::numeric_limits<float>::infinity(),
                                std::numeric_limits<float>::quiet_NaN()}) {
    const Color seen = textured_albedo(library, finish_of(0), {0.3f, 0.8f}, footprint);
    // The single pixel of the last level, which is rounded to a code.
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(seen[k], tint(k) * mean_of(image, k), 0.005);
  }
  // From level to level nothing jumps.
  Color before = textured_albedo(library, finish_of(0), {0.37f, 0.81f}, 0.9f / 64.0f);
  for (float footprint = 0.9f; footprint < 80.0f; footprint *= 1.002f) {
    const Color seen = textured_albedo(library, finish_of(0), {0.37f, 0.81f}, footprint / 64.0f);
    EXPECT_LT((seen - before).abs().maxCoeff(), 0.005f) << footprint;
    before = seen;
  }
}

TEST(TexturedAlbedo, IsTheFinishsTimesTheTextureWhichIsWhiteWhereItIsTransparent) {
  core::Image8 image(2, 1, 4);
  const std::uint8_t codes[8] = {250, 10, 30, 255, 77, 88, 99, 0};
  std::copy(std::begin(codes), std::end(codes), image.data().begin());
  const TextureLibrary library(std::vector<world::Texture>{{"window", image}});
  const world::Finish finish = finish_of(0);
  for (int k = 0; k < 3; ++k) {
    const auto at = static_cast<std::size_t>(k);
    EXPECT_NEAR(textured_albedo(library, finish, {0.25f, 0.5f}, 0.0f)[k],
                tint(k) * linear_of(codes[at]), 1e-6);
    EXPECT_NEAR(textured_albedo(library, finish, {0.75f, 0.5f}, 0.0f)[k],
                linear_of(finish.color_srgb[at]), 1e-6);
    EXPECT_NEAR(textured_albedo(library, finish, {0.75f, 0.5f}, 2.0f)[k],
                0.5 * tint(k) * (linear_of(codes[at]) + 1.0), 0.005);
  }
}

TEST(TexturedAlbedo, OfWhatIsNotThereIsAnErrorAndOfNoPlaceAColour) {
  const TextureLibrary library(std::vector<world::Texture>{{"noise", noise_image(4, 4, 3)}});
  EXPECT_THROW(textured_albedo(library, finish_of(1), {0.0f, 0.0f}, 0.0f), core::Error);
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(),
                          std::numeric_limits<float>::infinity(), -1e30f, 1e-30f, -1e-30f})
    EXPECT_TRUE(textured_albedo(library, finish_of(0), {bad, bad}, 0.01f).isFinite().all()) << bad;
}

TEST(Textures, OfHostileSizesAreRefused) {
  EXPECT_NO_THROW(world::check_texture("t", 16384, 4096, 4));
  for (const auto& [width, height, channels] :
       {std::tuple(0, 4, 3), std::tuple(4, 4, 1), std::tuple(4, 4, 2), std::tuple(16385, 1, 3),
        std::tuple(16384, 8192, 3)})
    EXPECT_THROW(world::check_texture("t", width, height, channels), core::Error);
}

TEST(Textures, OfAStoreAreThoseThatWereWrittenOrRefused) {
  const test::ScratchFolder folder;
  const world::Texture texture{"noise", noise_image(13, 7, 4)};
  world::WorldManifest manifest;
  manifest.textures.push_back(world::write_texture(folder.path(), 0, texture));
  manifest.coarsest_level = 1;
  world::write_manifest(folder.path(), manifest);
  const world::TileStore store = world::TileStore::open(folder.path());
  EXPECT_EQ(store.load_texture(0), texture);
  EXPECT_EQ(world::num_bytes_of(store.manifest().textures), world::mip_bytes(13, 7, 4));
  // Another image of the same size is none that the manifest lists.
  world::write_texture(folder.path(), 0, {"noise", noise_image(13, 8, 4)});
  EXPECT_THROW(store.load_texture(0), core::Error);
}

}  // namespace
}  // namespace terracast::scene
