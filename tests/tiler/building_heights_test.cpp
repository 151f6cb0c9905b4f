#include <gtest/gtest.h>

#include <string>

#include "tests/tiler/building_layers.h"
#include "tests/tiler/raster_files.h"
#include "tests/tiler/vector_files.h"

/// Rasters of buildings' heights that are not what they should be, under one building without a height of its own.
namespace terracast::test {
namespace {

using core::ErrorKind;

class BuildingHeights : public testing::Test {
 protected:
  BuildingHeights() {
    const Eigen::Vector2d at = utm31(kOriginLat_deg, kOriginLon_deg);
    write_vectors(
        folder_ / "a.gpkg", "GPKG",
        {{fmt::format(
              "POLYGON(({0:.3f} {1:.3f},{2:.3f} {1:.3f},{2:.3f} {3:.3f},{0:.3f} {3:.3f},{0:.3f} "
              "{1:.3f}))",
              at.x(), at.y(), at.x() + 24.0, at.y() + 16.0),
          {{"building", "yes"}}}},
        "EPSG:32631");
    spec_ = utm_spec(100.0, 2.0);
    spec_.value = [](double, double) { return 12.0; };
  }

  Built built(const std::string& key = "heights", const std::string& more = "") const {
    const std::string value = " = \"" + file().string() + "\"\n";
    return Built(files_key(folder_ / "a.gpkg") + key + value +
                 (key == "surface" ? "terrain" + value : "") + more);
  }
  std::filesystem::path file() const { return folder_ / name_; }
  void refuses(ErrorKind kind, const std::vector<std::string>& words) const {
    for (const char* key : {"heights", "surface"}) {
      SCOPED_TRACE(key);
      expect_error(kind, words, [&] { built(key); });
    }
  }
  /// An ESRI grid of 20 x 20 samples of one text over the building.
  void write_grid(const std::string& sample) {
    name_ = "heights.asc";
    const Eigen::Vector2d at = utm31(kOriginLat_deg, kOriginLon_deg);
    std::string text =
        fmt::format("ncols 20\nnrows 20\nxllcorner {:.3f}\nyllcorner {:.3f}\ncellsize 5\n",
                    at.x() - 50.0, at.y() - 50.0);
    // GDAL tells the file by a first sample that is a number.
    for (int i = 0; i < 400; ++i) text += (i % 20 == 0 ? "\n" : " ") + (i == 0 ? "12.5" : sample);
    write_text(file(), text + "\n");
    write_text(folder_ / "heights.prj",
               "PROJCS[\"WGS_1984_UTM_Zone_31N\",GEOGCS[\"GCS_WGS_1984\",DATUM[\"D_WGS_1984\","
               "SPHEROID[\"WGS_1984\",6378137,298.257223563]],PRIMEM[\"Greenwich\",0],"
               "UNIT[\"Degree\",0.017453292519943295]],PROJECTION[\"Transverse_Mercator\"],"
               "PARAMETER[\"latitude_of_origin\",0],PARAMETER[\"central_meridian\",3],"
               "PARAMETER[\"scale_factor\",0.9996],PARAMETER[\"false_easting\",500000],"
               "PARAMETER[\"false_northing\",0],UNIT[\"Meter\",1]]\n");
  }
  static void expect_from_raster(const Built& built, bool is_taken) {
    EXPECT_EQ(built.count("buildings"), 1);
    EXPECT_EQ(built.count("heights from the raster"), is_taken ? 1 : 0);
    EXPECT_EQ(built.count("heights guessed"), is_taken ? 0 : 1);
  }

  const ScratchFolder folder_;
  std::string name_ = "heights.tif";
  RasterSpec spec_;
};

TEST_F(BuildingHeights, SoundOnesAreTaken) {
  write_raster(file(), spec_);
  expect_from_raster(built(), true);
  write_grid("12.0");
  expect_from_raster(built(), true);
}

// Until November 2026 outlines from rasters carried their heights in this tag, which any file may
// hold.
TEST_F(BuildingHeights, AreNotBelievedOfTagsThatOnlyOutlinesOfRastersHad) {
  const auto count = [&](const std::string& file, const char* name) {
    return Built(files_key(folder_ / file)).count(name);
  };
  for (const char* value : {"800", "nan", "-5"}) {
    SCOPED_TRACE(value);
    const std::string file = std::string("b") + value + ".gpkg";
    write_vectors(folder_ / file, "GPKG",
                  {{wkt(0, 0, 24, 16), {{"building", "yes"}, {"terracast:median_height", value}}}},
                  "EPSG:32631");
    EXPECT_EQ(count(file, "buildings"), 1);
    EXPECT_EQ(count(file, "heights from the raster"), 0);
    EXPECT_EQ(count(file, "heights guessed"), 1);
  }
}

TEST_F(BuildingHeights, RastersElsewhereAreRefusedAskingForTheirCrs) {
  spec_.geotransform[0] += 100e3;
  write_raster(file(), spec_);
  refuses(ErrorKind::Input, {"heights.tif", "beside the world's square", "32631", "right CRS"});
  // Of another zone, and metres taken for degrees.
  spec_.geotransform[0] -= 100e3;
  for (const char* crs : {"EPSG:32633", "EPSG:4326"}) {
    SCOPED_TRACE(crs);
    spec_.crs = crs;
    write_raster(file(), spec_);
    refuses(ErrorKind::Input, {"heights.tif", "beside the world's square", crs, "right CRS"});
  }
}

TEST_F(BuildingHeights, RastersWithoutPlaceOrFileAreRefused) {
  refuses(ErrorKind::Io, {"heights.tif", "no such raster"});
  spec_.crs = "";
  write_raster(file(), spec_);
  refuses(ErrorKind::Input, {"heights.tif", "gdal_edit.py -a_srs"});
  write_text(file(), "no raster");
  refuses(ErrorKind::Input, {"heights.tif", "cannot be opened as a raster"});
}

TEST_F(BuildingHeights, SamplesThatAreNoHeightsAreRefusedOrSaidToBeVoids) {
  write_grid("nan");
  expect_from_raster(built(), false);
  expect_from_raster(built("heights", "heights_nodata = \"nan\"\n"), false);
  write_grid("-9999");
  refuses(ErrorKind::Input,
          {"heights.asc", "exactly -9999", "heights_nodata = \"declared, -9999\""});
  expect_from_raster(built("heights", "heights_nodata = \"declared, -9999\"\n"), false);
  write_grid("1e20");
  refuses(ErrorKind::Input, {"heights.asc", "outside", "heights_nodata"});
  name_ = "heights.tif";
  spec_.nodata = 12.0;
  write_raster(file(), spec_);
  expect_from_raster(built(), false);
}

/// A building is not below the ground: its height is guessed as if there were no raster.
TEST_F(BuildingHeights, NegativeHeightsAreNotTaken) {
  for (const double height_m : {-5.0, 0.0}) {
    SCOPED_TRACE(height_m);
    spec_.value = [=](double, double) { return height_m; };
    write_raster(file(), spec_);
    expect_from_raster(built(), false);
  }
  write_grid("-3");
  expect_from_raster(built(), false);
}

}  // namespace
}  // namespace terracast::test
