#include "tiler/raster_claims.h"

#include <cmath>

#include "tests/tiler/raster_files.h"

// What rasters declare of unit and vertical datum, and what configs state of them.
namespace terracast::test {
namespace {

using core::ErrorKind;

RasterSpec flat_spec(double stored) {
  RasterSpec spec = utm_spec(2048.0, 20.0);
  spec.value = [=](double, double) { return stored; };
  return spec;
}

tiler::WorldOptions world_over(const std::filesystem::path& file) {
  tiler::WorldOptions options = world_of_rasters({file}, 2048.0);
  options.detail_roughness = 0.0;
  return options;
}

double height_of(const tiler::WorldOptions& options) {
  return prepare(options)->measured_height_m(kOriginLat_deg, kOriginLon_deg).value();
}

TEST(HeightUnits, AreThoseThatFilesDeclare) {
  const ScratchFolder folder;
  struct Case {
    const char* unit;
    double metres;  ///< by the units' definitions
  };
  for (const auto& [unit, metres] :
       {Case{"m", 1.0}, Case{"metre", 1.0}, Case{"Meters", 1.0}, Case{"dm", 0.1},
        Case{"decimetre", 0.1}, Case{"cm", 0.01}, Case{"ft", 0.3048}, Case{"foot", 0.3048},
        Case{"US survey foot", 1200.0 / 3937.0}, Case{"ftUS", 1200.0 / 3937.0}}) {
    SCOPED_TRACE(unit);
    RasterSpec spec = flat_spec(500.0 / metres);
    spec.unit = unit;
    write_raster(folder / "unit.tif", spec);
    EXPECT_NEAR(height_of(world_over(folder / "unit.tif")), 500.0, 1e-6);
  }
}

TEST(HeightUnits, OfBandTypeScaleAndOffsetGoTogether) {
  const ScratchFolder folder;
  RasterSpec spec = flat_spec(200.0);
  spec.unit = "dm";
  spec.scale = 20.0;
  spec.offset = 1000.0;
  write_raster(folder / "scaled.tif", spec);
  EXPECT_NEAR(height_of(world_over(folder / "scaled.tif")), (200.0 * 20.0 + 1000.0) * 0.1, 1e-6);
}

TEST(HeightUnits, ContradictionsAreErrorsThatNameBoth) {
  const ScratchFolder folder;
  struct Case {
    const char* declared;
    const char* stated;
    double stated_m;
  };
  for (const auto& [declared, stated, stated_m] :
       {Case{"m", "ft", 0.3048}, Case{"ft", "us_ft", 1200.0 / 3937.0}, Case{"dm", "m", 1.0},
        Case{"US survey foot", "m", 1.0}}) {
    SCOPED_TRACE(declared);
    RasterSpec spec = flat_spec(1000.0);
    spec.unit = declared;
    write_raster(folder / "unit.tif", spec);
    tiler::WorldOptions options = world_over(folder / "unit.tif");
    options.elevation[0].unit = stated;
    expect_error(ErrorKind::Input,
                 {"unit.tif", std::string("\"") + declared + "\"",
                  std::string("unit = \"") + stated + "\"", "trust = \"config\""},
                 [&] { prepare(options); });
    options.elevation[0].trust = "config";
    EXPECT_NEAR(height_of(options), 1000.0 * stated_m, 1e-6);
  }
  // The same unit by another name is none.
  RasterSpec spec = flat_spec(1000.0);
  spec.unit = "Feet";
  write_raster(folder / "unit.tif", spec);
  tiler::WorldOptions options = world_over(folder / "unit.tif");
  options.elevation[0].unit = "ft";
  EXPECT_NEAR(height_of(options), 304.8, 1e-6);
}

TEST(HeightUnits, AreTakenFromVerticalSystems) {
  const ScratchFolder folder;
  // EPSG:6360 is NAVD88 height in US survey feet; GeoTIFF keeps it in keys of the vertical system.
  RasterSpec spec = flat_spec(1000.0);
  spec.crs = "EPSG:32631+6360";
  write_raster(folder / "feet.tif", spec);
  tiler::WorldOptions options = world_over(folder / "feet.tif");
  options.elevation[0].vertical_datum = "ellipsoid";
  expect_error(ErrorKind::Input, {"feet.tif", "NAVD88", "vertical_datum = \"ellipsoid\"", "trust"},
               [&] { prepare(options); });
  options.elevation[0].trust = "config";
  EXPECT_NEAR(height_of(options), 1000.0 * 1200.0 / 3937.0, 1e-6);
}

TEST(HeightDatums, ContradictionsAreErrorsThatNameBoth) {
  const ScratchFolder folder;
  struct Case {
    const char* crs;
    const char* declared;  ///< as the message has it
    const char* right;     ///< nullptr: its grid need not be on the machine
    const char* wrong;
  };
  for (const auto& [crs, declared, right, wrong] :
       {Case{"EPSG:32631+5773", "EGM96 height", "egm96", "ellipsoid"},
        Case{"EPSG:32631+3855", "EGM2008 height", nullptr, "egm96"},
        Case{"EPSG:4979", "ellipsoid", "ellipsoid", "egm96"},
        Case{"EPSG:32631+5714", "MSL height", "egm96", "ellipsoid"}}) {
    SCOPED_TRACE(std::string(crs) + " " + wrong);
    RasterSpec spec = flat_spec(1000.0);
    spec.crs = crs;
    if (spec.crs == "EPSG:4979") {
      spec.width = spec.height = 200;
      spec.geotransform = {1.45, 0.0005, 0.0, 42.55, 0.0, -0.0005};
    }
    write_raster(folder / "datum.tif", spec);
    tiler::WorldOptions options = world_over(folder / "datum.tif");
    if (right != nullptr) {
      options.elevation[0].vertical_datum = right;
      EXPECT_NO_THROW(prepare(options));
    }
    options.elevation[0].vertical_datum = wrong;
    expect_error(
        ErrorKind::Input,
        {"datum.tif", declared, std::string("vertical_datum = \"") + wrong + "\"", "trust"},
        [&] { prepare(options); });
    options.elevation[0].trust = "config";
    EXPECT_NO_THROW(prepare(options));
  }
}

tiler::HeightClaims of_datum(const std::string& datum) {
  tiler::HeightClaims claims;
  claims.datum = datum;
  return claims;
}

TEST(HeightDatums, NamesInTheWild) {
  tiler::ElevationOptions options;
  options.vertical_datum = "egm96";
  for (const char* name : {"EGM96 geoid (meters)", "EPSG:5773 EGM96 height", "E96", "egm_96", "MSL",
                           "unknown", "", "WGS84 EGM96 Geoid"})
    EXPECT_NO_THROW(tiler::check_vertical_datum(of_datum(name), options, "f")) << name;
  for (const char* name : {"EGM 2008 geoid", "EPSG:5703 NAVD88 height", "Ellipsoid (metre)",
                           "DHHN2016 height", "ODN height"})
    EXPECT_THROW(tiler::check_vertical_datum(of_datum(name), options, "f"), core::Error) << name;
  options.vertical_datum = "egm2008";
  EXPECT_NO_THROW(tiler::check_vertical_datum(of_datum("EPSG:3855 EGM2008 height"), options, "f"));
  EXPECT_THROW(tiler::check_vertical_datum(of_datum("EGM96 height"), options, "f"), core::Error);
  // A grid makes heights above any geoid ellipsoidal, and none that are so already.
  options.vertical_datum = "grid";
  EXPECT_NO_THROW(tiler::check_vertical_datum(of_datum("NAVD88 height"), options, "f"));
  tiler::HeightClaims ellipsoidal;
  ellipsoidal.is_ellipsoidal = true;
  EXPECT_THROW(tiler::check_vertical_datum(ellipsoidal, options, "f"), core::Error);
}

}  // namespace
}  // namespace terracast::test
