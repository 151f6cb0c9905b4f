#include "tiler/raster_ledger.h"

#include "tests/tiler/land_cover_worlds.h"
#include "tests/tiler/raster_files.h"
#include "tiler/layer_stack.h"
#include "tiler/raster_source.h"

namespace terracast::test {
namespace {

core::Ledger ledger_of_world(const std::filesystem::path& file) {
  return prepare(world_of_rasters({file}, 2048.0))->sources()[0].ledger;
}

RasterSpec hill_spec() {
  RasterSpec spec = utm_spec(2048.0, 20.0);
  spec.type = GDT_Float32;
  spec.unit = "m";
  spec.nodata = -9999.0;
  spec.value = [](double, double) { return 500.0; };
  return spec;
}

void state(const std::filesystem::path& file, const char* item, const char* value,
           const char* domain = nullptr) {
  GDALDataset* dataset = GDALDataset::Open(file.c_str(), GDAL_OF_UPDATE);
  ASSERT_NE(dataset, nullptr);
  ASSERT_EQ(dataset->SetMetadataItem(item, value, domain), CE_None);
  GDALClose(dataset);
}

// The law of a reader's ledger: one statement more than is known is shown as unknown.
TEST(RasterLedger, WhatIsNotKnownIsShown) {
  const ScratchFolder folder;
  const auto file = folder / "hill.tif";
  write_raster(file, hill_spec());
  const core::Ledger before = ledger_of_world(file);
  EXPECT_TRUE(before.warnings().empty()) << before.table();
  state(file, "Z_EXAGGERATION", "2");
  state(file, "VOXEL", "7", "SURVEY");
  const core::Ledger after = ledger_of_world(file);
  ASSERT_EQ(after.entries().count("Z_EXAGGERATION"), 1U) << after.table();
  EXPECT_EQ(after.entries().at("Z_EXAGGERATION").num_unknown, 1);
  EXPECT_EQ(after.entries().at("SURVEY:VOXEL").num_unknown, 1);
  EXPECT_EQ(after.warnings().size(), 2U);
}

TEST(RasterLedger, WhatIsUsedAndWhatIsNotIsSaid) {
  const ScratchFolder folder;
  const auto file = folder / "hill.tif";
  write_raster(file, hill_spec());
  state(file, "TIFFTAG_SOFTWARE", "a program");
  {
    GDALDataset* dataset = GDALDataset::Open(file.c_str(), GDAL_OF_UPDATE);
    dataset->GetRasterBand(1)->SetDescription("elevation");
    dataset->GetRasterBand(1)->SetMetadataItem("STATISTICS_MEAN", "500");
    GDALClose(dataset);
  }
  const core::Ledger ledger = ledger_of_world(file);
  const auto& entries = ledger.entries();
  for (const char* name :
       {"AREA_OR_POINT", "horizontal system", "band unit", "band no-data value"}) {
    ASSERT_EQ(entries.count(name), 1U) << name;
    EXPECT_EQ(entries.at(name).num_used, 1) << name;
  }
  for (const char* name : {"TIFFTAG_SOFTWARE", "band description", "STATISTICS_MEAN"}) {
    ASSERT_EQ(entries.count(name), 1U) << name;
    EXPECT_EQ(entries.at(name).num_ignored, 1) << name;
    EXPECT_FALSE(entries.at(name).why.empty()) << name;
  }
}

TEST(RasterLedger, MasksScalesAndOverviewsAreSaid) {
  const ScratchFolder folder;
  const auto file = folder / "hill.tif";
  RasterSpec spec = hill_spec();
  spec.nodata.reset();
  spec.scale = 2.0;
  spec.offset = 1.0;
  spec.crs = "EPSG:32631+5773";
  write_raster(file, spec);
  {
    GDALDataset* dataset = GDALDataset::Open(file.c_str(), GDAL_OF_UPDATE);
    const int factor = 2;
    ASSERT_EQ(dataset->BuildOverviews("NEAREST", 1, &factor, 0, nullptr, nullptr, nullptr),
              CE_None);
    ASSERT_EQ(dataset->CreateMaskBand(GMF_PER_DATASET), CE_None);
    ASSERT_EQ(dataset->GetRasterBand(1)->GetMaskBand()->Fill(255), CE_None);
    GDALClose(dataset);
  }
  tiler::WorldOptions options = world_of_rasters({file}, 2048.0);
  options.elevation[0].vertical_datum = "egm96";
  core::Ledger ledger = prepare(options)->sources()[0].ledger;
  for (const char* name : {"band scale", "band offset", "band mask", "vertical system"}) {
    ASSERT_EQ(ledger.entries().count(name), 1U) << name << "\n" << ledger.table();
    EXPECT_EQ(ledger.entries().at(name).num_used, 1) << name;
  }
  EXPECT_EQ(ledger.entries().at("overviews").num_ignored, 1);
  options.elevation[0].nodata = "none";
  ledger = prepare(options)->sources()[0].ledger;
  EXPECT_EQ(ledger.entries().at("band mask").num_ignored, 1);
}

// All that the reader counts as used is in its tables as used.
TEST(RasterLedger, TablesHoldWhatIsUsed) {
  const ScratchFolder folder;
  write_raster(folder / "hill.tif", hill_spec());
  const core::Ledger ledger = ledger_of_world(folder / "hill.tif");
  for (const auto& [name, entry] : ledger.entries()) {
    if (entry.num_used == 0) continue;
    const core::KnownName* found = nullptr;
    for (const core::KnownTable& table : tiler::raster_tables())
      if (found == nullptr) found = core::find_known(table.names, name);
    ASSERT_NE(found, nullptr) << name;
    EXPECT_TRUE(found->is_used) << name;
  }
}

TEST(RasterLedger, LandCoverTellsWhatItsRastersSayToo) {
  const ScratchFolder folder;
  const auto file = folder / "classes.tif";
  RasterSpec spec = utm_spec(4096.0, 20.0);
  spec.type = GDT_Byte;
  spec.scale = 2.0;  // codes are not scaled
  spec.value = [](double, double) { return 10.0; };
  write_raster(file, spec);
  state(file, "CLASS_EDITION", "2021");
  tiler::WorldOptions options = world_of("plane");
  options.layers.push_back(
      land_cover_layer("files = [\"" + file.string() + "\"]\nlegend = \"worldcover\""));
  const core::Ledger ledger = prepare(options)->layers().infos().at(0).ledger;
  ASSERT_EQ(ledger.entries().count("CLASS_EDITION"), 1U) << ledger.table();
  EXPECT_EQ(ledger.entries().at("CLASS_EDITION").num_unknown, 1);
  EXPECT_EQ(ledger.entries().at("band scale").num_ignored, 1);
  EXPECT_EQ(ledger.entries().at("horizontal system").num_used, 1);
}

}  // namespace
}  // namespace terracast::test
