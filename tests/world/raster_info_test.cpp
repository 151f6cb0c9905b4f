#include "world/raster_info.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "core/json.h"
#include "core/random.h"
#include "tests/support/test_data.h"
#include "tests/support/tiny_world.h"

namespace terracast::world {
namespace {

using testing::HasSubstr;

std::uint8_t said(std::size_t raster, int column, int row) {
  const auto place = static_cast<std::uint64_t>(row) << 32 | static_cast<std::uint64_t>(column);
  return static_cast<std::uint8_t>(core::random_bits(raster, 1, place) % 5 == 0
                                       ? CoverRasterInfo::kSilent
                                       : 3 + core::random_bits(raster, 2, place) % 8);
}

void tell(std::size_t layer, std::size_t raster, int row, std::span<std::uint8_t> covers) {
  EXPECT_EQ(layer, 0U);
  for (std::size_t i = 0; i < covers.size(); ++i)
    covers[i] = said(raster, static_cast<int>(i), row);
}

CoverRasterInfo cover_raster(const std::string& name, int num_columns, int num_rows) {
  CoverRasterInfo info;
  info.raster.name = name;
  info.raster.geotransform = {500000.0, 10.0, 0.0, 4700000.0, 0.0, -10.0};
  info.raster.width_px = info.raster.height_px = 2'000'000'000;
  info.border_px = 0.9;
  info.first_column = 17;
  info.first_row = 4;
  info.num_columns = num_columns;
  info.num_rows = num_rows;
  return info;
}

/// A world of one layer, whose rasters are yet to be written.
class RasterInfoTest : public testing::Test {
 protected:
  RasterInfoTest()
      : store_(test::make_tiny_world(folder_.path(), [](double, double) { return 0.0; })) {
    WorldManifest manifest = store_.manifest();
    manifest.layers.emplace_back();
    manifest.layers.back().name = "cover";
    manifest.layers.back().kind = "land_cover";
    write_manifest(folder_.path(), manifest);
    store_ = TileStore::open(folder_.path());
    rasters_.sources.resize(store_.manifest().sources.size());
  }
  void write(const std::vector<CoverRasterInfo>& covers) {
    rasters_.land_cover = {covers};
    write_rasters(folder_.path(), store_.manifest().input_hash, rasters_, tell);
  }

  test::ScratchFolder folder_;
  TileStore store_;
  WorldRasters rasters_;
};

TEST_F(RasterInfoTest, WhatIsToldRowByRowIsReadBack) {
  write({cover_raster("fine.tif", 231, 57), cover_raster("elsewhere.tif", 0, 0),
         cover_raster("coarse.tif", 3, 1)});
  auto read = read_rasters(store_);
  ASSERT_TRUE(read);
  ASSERT_EQ(read->land_cover.size(), 1U);
  ASSERT_EQ(read->land_cover[0].size(), 3U);
  for (std::size_t k = 0; k < 3; ++k) {
    CoverRasterInfo& info = read->land_cover[0][k];
    const CoverRasterInfo& written = rasters_.land_cover[0][k];
    EXPECT_EQ(info.raster, written.raster);
    EXPECT_EQ(info.first_column, 17);
    EXPECT_EQ(info.first_row, 4);
    EXPECT_TRUE(info.covers.empty());
    read_covers(store_, 0, k, *read);
    ASSERT_EQ(info.covers.width(), written.num_columns);
    ASSERT_EQ(info.covers.height(), written.num_rows);
    for (int row = 0; row < info.covers.height(); ++row)
      for (int column = 0; column < info.covers.width(); ++column)
        ASSERT_EQ(info.covers(column, row), said(k, column, row)) << k;
  }
}

// Memory is taken for no more than a world may hold, whatever a file says.
TEST_F(RasterInfoTest, MorePixelsThanAWorldTakesAreRefused) {
  write({cover_raster("fine.tif", 32, 32)});
  const std::filesystem::path file = folder_ / "rasters.json";
  const std::string whole = core::Json::read(file).text(1);
  const auto with_size = [&](const std::string& columns, const std::string& rows) {
    std::string text = whole;
    text.replace(text.find("\"num_columns\": 32") + 15, 2, columns);
    text.replace(text.find("\"num_rows\": 32") + 12, 2, rows);
    core::Json json = core::Json::object();
    const core::Json edited = core::Json::parse(text, "rasters.json");
    for (const auto& [name, value] : edited.members())
      if (name != "content_hash") json.set(name, value);
    core::add_content_hash(json);
    json.write(file, 1);
  };
  with_size("32768", "32768");  // 2^30
  EXPECT_TRUE(read_rasters(store_));
  with_size("32769", "32768");
  try {
    read_rasters(store_);
    FAIL() << "it was read";
  } catch (const core::Error& error) {
    EXPECT_EQ(error.kind(), core::ErrorKind::Input);
    EXPECT_THAT(error.what(), HasSubstr("32769 x 32768"));
    EXPECT_THAT(error.what(), HasSubstr("1073741824"));
  }
}

}  // namespace
}  // namespace terracast::world
