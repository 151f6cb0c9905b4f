#include "world/raster_info.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <functional>
#include <limits>
#include <span>

#include "core/atomic_file.h"
#include "core/hash.h"
#include "core/image_io.h"
#include "core/json.h"
#include "core/random.h"
#include "tests/support/expect_error.h"
#include "tests/support/test_data.h"
#include "tests/support/tiny_world.h"

namespace terracast::world {
namespace {

using core::ErrorKind;
using core::Json;

RasterInfo raster(const std::string& name, double turn) {
  return {.name = name,
          .horizontal_crs = "EPSG:32632 \"quoted\" é",
          .pipeline = turn == 0.0 ? "" : "+proj=pipeline +step +proj=utm +zone=32",
          .is_geographic = turn == 0.0,
          .geotransform = {1e6 / 3.0, 0.1 + turn, -turn, -1e-300, turn, -0.1},
          .width_px = 2147483647,
          .height_px = 1};
}

CoverRasterInfo cover(const std::string& name, int width_px, int height_px) {
  CoverRasterInfo cover{.raster = raster(name, 0.25),
                        .border_px = 0.35,
                        .first_column = 17,
                        .first_row = 2147483646,
                        .num_columns = width_px,
                        .num_rows = height_px,
                        .covers = core::Image8(width_px, height_px)};
  for (int y = 0; y < height_px; ++y)
    for (int x = 0; x < width_px; ++x)
      cover.covers(x, y) = static_cast<std::uint8_t>(
          core::random_bits(5, static_cast<std::uint64_t>(y), static_cast<std::uint64_t>(x)) % 256);
  return cover;
}

/// A world of two sources, two layers and imagery of two files, and what its rasters are.
class Rasters : public testing::Test {
 protected:
  Rasters() {
    const TileStore plain =
        test::make_tiny_world(folder_.path(), [](double, double) { return 5.0; });
    WorldManifest manifest = plain.manifest();
    manifest.input_hash = "0123456789abcdef";
    manifest.sources.resize(2, manifest.sources.at(0));
    manifest.layers.resize(3);
    manifest.imagery = {
        {.finest_level = 0, .coarsest_level = 0, .sources = {"a", "b"}, .tiles = {}}};
    write_manifest(folder_.path(), manifest);
    store_.emplace(TileStore::open(folder_.path()));
    rasters_.sources = {raster("dem.tif", 0.5), std::nullopt};
    CoverRasterInfo nothing = cover("nothing.tif", 1, 1);
    nothing.covers = {};
    nothing.num_columns = nothing.num_rows = 0;
    rasters_.land_cover = {{}, {cover("a.tif", 31, 20), nothing, cover("b.tif", 1, 7)}, {}};
    rasters_.imagery = {{raster("a.jp2", 0.0), raster("b.jp2", 1.0)}};
    write();
  }
  void write() const {
    write_rasters(folder_.path(), store_->manifest().input_hash, rasters_,
                  [&](std::size_t layer, std::size_t raster, int row, std::span<std::uint8_t> out) {
                    const core::Image8& covers = rasters_.land_cover[layer][raster].covers;
                    for (std::size_t i = 0; i < out.size(); ++i)
                      out[i] = covers(static_cast<int>(i), row);
                  });
  }

  std::filesystem::path file() const { return folder_ / "rasters.json"; }
  std::filesystem::path covers_file(int raster) const {
    return folder_ / "land_cover" / fmt::format("1_{}.png", raster);
  }
  std::string text() const { return core::read_text_file(file()); }
  /// Without waiting for the disk, for it is done thousands of times.
  void write_text(const std::string& text) const {
    std::ofstream(file(), std::ios::binary) << text;
  }
  /// The file with one text in the place of another, sealed anew: what the seal does not find.
  void rewrite(const std::string& before, const std::string& after) const {
    std::string changed = text();
    const std::size_t at = changed.find(before);
    ASSERT_NE(at, std::string::npos) << before;
    changed.replace(at, before.size(), after);
    const Json parsed = Json::parse(changed, "changed");
    Json sealed = Json::object();
    for (const auto& [member, value] : parsed.members())
      if (member != "content_hash") sealed.set(member, value);
    core::add_content_hash(sealed);
    sealed.write(file(), 1);
  }
  void expect_refusal(const std::vector<std::string>& words) const {
    expect_error(ErrorKind::Input, words, [&] { read_rasters(*store_); });
  }
  template <class Work>
  static void expect_error(ErrorKind kind, const std::vector<std::string>& words, Work&& work) {
    test::expect_error(kind, words, std::forward<Work>(work));
  }

  const test::ScratchFolder folder_;
  std::optional<TileStore> store_;
  WorldRasters rasters_;
};

TEST_F(Rasters, ComeBackAsTheyWere) {
  std::optional<WorldRasters> back = read_rasters(*store_);
  ASSERT_TRUE(back);
  EXPECT_EQ(back->sources, rasters_.sources);
  EXPECT_EQ(back->imagery, rasters_.imagery);
  ASSERT_EQ(back->land_cover.size(), 3U);
  EXPECT_TRUE(back->land_cover[0].empty());
  ASSERT_EQ(back->land_cover[1].size(), 3U);
  for (std::size_t i = 0; i < 3; ++i) {
    CoverRasterInfo& one = back->land_cover[1][i];
    const CoverRasterInfo& expected = rasters_.land_cover[1][i];
    EXPECT_EQ(one.raster, expected.raster);
    EXPECT_EQ(one.border_px, expected.border_px);
    EXPECT_EQ(one.first_column, expected.first_column);
    EXPECT_EQ(one.first_row, expected.first_row);
    EXPECT_TRUE(one.covers.empty()) << "they are read where they are asked for";
    read_covers(*store_, 1, i, *back);
    EXPECT_TRUE(one.covers == expected.covers);
    read_covers(*store_, 1, i, *back);  // once more: nothing is read, nothing changes
    EXPECT_TRUE(one.covers == expected.covers);
  }
  // The same again is the same bytes.
  const std::string before = text();
  const std::vector<std::byte> covers = core::read_file(covers_file(0));
  write();
  EXPECT_EQ(text(), before);
  EXPECT_EQ(core::read_file(covers_file(0)), covers);
  EXPECT_FALSE(std::filesystem::exists(covers_file(1)));
}

TEST_F(Rasters, OfOlderVersionsAreNone) {
  std::filesystem::remove(file());
  EXPECT_FALSE(read_rasters(*store_));
}

TEST_F(Rasters, AnyByteThatDiffersIsFoundOrChangesNothing) {
  const std::string good = text();
  int num_refused = 0;
  int num_alike = 0;
  for (std::size_t at = 0; at < good.size(); ++at) {
    std::string damaged = good;
    damaged[at] =
        static_cast<char>(static_cast<unsigned char>(good[at]) ^
                          static_cast<unsigned char>(1U << core::random_bits(3, 0, at) % 8));
    write_text(damaged);
    try {
      const std::optional<WorldRasters> back = read_rasters(*store_);
      // A blank for a tab between members.
      ASSERT_TRUE(back);
      ASSERT_EQ(back->sources, rasters_.sources) << at;
      ASSERT_EQ(back->imagery, rasters_.imagery) << at;
      for (std::size_t i = 0; i < 3; ++i) {
        const CoverRasterInfo& one = back->land_cover.at(1).at(i);
        const CoverRasterInfo& expected = rasters_.land_cover[1][i];
        ASSERT_EQ(one.raster, expected.raster) << at;
        ASSERT_EQ(one.border_px, expected.border_px) << at;
        ASSERT_EQ(one.first_column, expected.first_column) << at;
        ASSERT_EQ(one.first_row, expected.first_row) << at;
        ASSERT_EQ(one.num_columns, expected.num_columns) << at;
        ASSERT_EQ(one.num_rows, expected.num_rows) << at;
      }
      ++num_alike;
    } catch (const core::Error& error) {
      ASSERT_EQ(error.kind(), ErrorKind::Input) << error.what();
      ASSERT_NE(std::string(error.what()).find("rasters.json"), std::string::npos) << error.what();
      ++num_refused;
    }
  }
  EXPECT_GT(num_refused, num_alike);
  for (std::size_t size = 0; size + 2 < good.size(); size += 7) {
    SCOPED_TRACE(size);
    write_text(good.substr(0, size));
    expect_refusal({"rasters.json"});
  }
}

TEST_F(Rasters, WhatIsWellSealedButCannotBeIsRefused) {
  const auto refused = [&](const std::string& before, const std::string& after,
                           const std::vector<std::string>& words) {
    SCOPED_TRACE(after);
    write();
    rewrite(before, after);
    expect_refusal(words);
  };
  refused("\"terracast rasters\"", "\"other\"", {"not the rasters of a terracast world"});
  refused("\"version\": 1", "\"version\": 2", {"version 2", "reads 1"});
  refused("0123456789abcdef", "fedcba9876543210", {"another world", "fedcba9876543210"});
  refused("2147483647", "2147483648", {"width_px = 2147483648", "1 to 2147483647"});
  refused("2147483647", "0", {"width_px = 0"});
  refused("\"height_px\": 1", "\"height_px\": -1", {"height_px = -1"});
  refused("\"height_px\": 1", "\"height_px\": 1.5", {"rasters.json"});
  refused("\"is_geographic\": false", "\"is_geographic\": 0", {"rasters.json"});
  refused("\"first_row\": 2147483646", "\"first_row\": -1", {"first_row = -1"});
  refused("\"border_px\": 0.35", "\"border_px\": 8.5", {"border_px = 8.5", "0 to 8"});
  refused("\"border_px\": 0.35", "\"border_px\": -1e-9", {"border_px"});
  refused("-1e-300", "-1e-300, 1", {"7 numbers", "six"});
  refused("\"name\"", "\"nome\"", {"name"});
  // Rows that the manifest does not have.
  refused("\"land_cover\": [", "\"land_cover\": [[], ", {"land_cover of 4 rows", "manifest has 3"});
  refused("\"sources\": [", "\"sources\": [null, ", {"sources of 3 rows"});
  refused("\"imagery\": [", "\"imagery\": [[], ", {"imagery of 2 rows"});
}

// Memory is taken for no more than a world may hold, whatever a file says.
TEST_F(Rasters, MorePixelsThanAWorldTakesAreRefused) {
  rewrite("\"num_columns\": 31", "\"num_columns\": 32768");
  rewrite("\"num_rows\": 20", "\"num_rows\": 32768");  // 2^30
  EXPECT_TRUE(read_rasters(*store_));
  rewrite("\"num_columns\": 32768", "\"num_columns\": 32769");
  expect_refusal({"32769 x 32768", "1073741824"});
}

TEST_F(Rasters, PlacesThatCannotBeFoundAgainAreRefused) {
  const auto refused = [&](const std::array<double, 6>& geotransform) {
    rasters_.sources[0]->geotransform = geotransform;
    write();
    expect_refusal({"dem.tif", "cannot be inverted"});
  };
  refused({0.0, 0.0, 0.0, 0.0, 0.0, 0.0});
  refused({0.0, 2.0, 4.0, 0.0, 1.0, 2.0});
  refused({1e308, 1.0, 0.0, 1e308, 0.0, 1.0});  // whose sum is no number
  refused({0.0, 1e200, 0.0, 0.0, 0.0, 1e200});  // whose determinant is none
  refused({0.0, 1e-200, 0.0, 0.0, 0.0, 1e-200});
}

TEST_F(Rasters, CoversOtherThanListedAreRefused) {
  const auto refused = [&](const std::vector<std::string>& words) {
    WorldRasters back = *read_rasters(*store_);
    expect_error(ErrorKind::Input, words, [&] { read_covers(*store_, 1, 0, back); });
    EXPECT_TRUE(back.land_cover[1][0].covers.empty());
  };
  const std::vector<std::byte> good = core::read_file(covers_file(0));
  for (std::size_t at = 0; at < good.size(); at += 5) {
    std::vector<std::byte> damaged = good;
    damaged[at] ^= std::byte{0x10};
    core::write_file(covers_file(0), damaged);
    refused({"1_0.png", "damaged"});
  }
  core::write_file(covers_file(0), core::read_file(covers_file(2)));
  refused({"1_0.png", "not the one that rasters.json lists"});
  // Listed by its hash, and yet of another size or kind.
  const auto listed = [&](const std::vector<std::byte>& bytes) {
    write();
    core::write_file(covers_file(0), bytes);
    rewrite(core::content_hash(good), core::content_hash(bytes));
  };
  listed(core::encode_png(core::Image8(31, 21)));
  refused({"1_0.png", "not of the size"});
  listed(core::encode_png(core::Image8(31, 20, 3)));
  refused({"1_0.png", "not of the size"});
  listed(core::encode_png(core::Image16(31, 20)));
  refused({"1_0.png", "not of the size"});
  listed(std::vector<std::byte>(100, std::byte{7}));
  refused({"1_0.png", "not a PNG"});
  write();
  std::filesystem::remove(covers_file(0));
  WorldRasters back = *read_rasters(*store_);
  expect_error(ErrorKind::Io, {"1_0.png"}, [&] { read_covers(*store_, 1, 0, back); });
}

}  // namespace
}  // namespace terracast::world
