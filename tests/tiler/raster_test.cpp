#include <GeographicLib/Geocentric.hpp>
#include <cmath>
#include <fstream>

#include "core/atomic_file.h"
#include "tests/tiler/raster_files.h"

namespace terracast::test {
namespace {

using core::ErrorKind;
using tiler::WorldSurface;

/// A tilted plane of the projection: Catmull-Rom reproduces it, so that any shift shows as height.
double ramp_m(const Eigen::Vector2d& utm) {
  return 1200.0 + 0.31 * (utm.x() - 376000.0) - 0.17 * (utm.y() - 4706000.0);
}
RasterSpec ramp_spec(double size_m = 4096.0, double spacing_m = 30.0) {
  RasterSpec spec = utm_spec(size_m, spacing_m);
  spec.value = [](double u, double v) { return ramp_m({u, v}); };
  return spec;
}

/// Largest difference between the surface and a closed form of latitude and longitude; z too must
/// stand for that height.
double worst_error_m(const WorldSurface& surface, double size_m,
                     const std::function<double(double lat_deg, double lon_deg)>& truth_m) {
  double worst_m = 0.0;
  for (const Eigen::Vector2d& at : scattered_places(size_m)) {
    const auto sample = surface.sample(at.x(), at.y());
    const geo::Geodetic place =
        surface.frame().geodetic_from_world({at.x(), at.y(), sample.z_world});
    const double height_m = truth_m(place.lat_deg, place.lon_deg);
    worst_m = std::max(worst_m, std::abs(place.height_m - height_m));
    const auto measured_m = surface.measured_height_m(place.lat_deg, place.lon_deg);
    EXPECT_TRUE(measured_m.has_value());
    worst_m = std::max(worst_m, std::abs(measured_m.value_or(1e9) - height_m));
  }
  return worst_m;
}

tiler::WorldOptions without_detail(tiler::WorldOptions options) {
  options.detail_roughness = 0.0;
  return options;
}

// 1e-6 m is the fixed point's promise; PROJ and GeographicLib agree to some nanometres in UTM.
constexpr double kTolerance_m = 1e-6;

TEST(Raster, ProjectedRampIsReproducedWithoutAnyShift) {
  const ScratchFolder folder;
  write_raster(folder / "ramp.tif", ramp_spec());
  const auto surface = prepare(without_detail(world_of_rasters({folder / "ramp.tif"})));
  EXPECT_LT(worst_error_m(*surface, 4096.0,
                          [](double lat, double lon) { return ramp_m(utm31(lat, lon)); }),
            kTolerance_m);
  EXPECT_EQ(surface->measured_level(), 4);  // 30 m: level 4 has 16 m, level 5 would lose samples
  EXPECT_NEAR(surface->sources()[0].spacing_m, 30.0, 0.05);  // the scale of UTM is 0.9996 and more
  EXPECT_NE(surface->sources()[0].pipeline.find("utm"), std::string::npos);
  EXPECT_NE(surface->sources()[0].horizontal_crs.find("32631"), std::string::npos);
}

TEST(Raster, GeographicRampIsReproduced) {
  const ScratchFolder folder;
  RasterSpec spec;
  spec.crs = "EPSG:4326";
  spec.width = spec.height = 200;
  spec.geotransform = {1.45, 0.0005, 0.0, 42.55, 0.0, -0.0005};
  const auto ramp = [](double lat, double lon) {
    return 900.0 + 8000.0 * (lon - 1.5) + 5000.0 * (lat - 42.5);
  };
  spec.value = [&](double u, double v) { return ramp(v, u); };
  write_raster(folder / "ramp.tif", spec);
  const auto surface = prepare(without_detail(world_of_rasters({folder / "ramp.tif"})));
  EXPECT_LT(worst_error_m(*surface, 4096.0, ramp), kTolerance_m);
  EXPECT_EQ(surface->sources()[0].pipeline, "");
}

TEST(Raster, PixelIsPointFilesAreNotShiftedTwice) {
  const ScratchFolder folder;
  RasterSpec spec = ramp_spec();
  spec.is_point = true;
  write_raster(folder / "point.tif", spec);
  const auto surface = prepare(without_detail(world_of_rasters({folder / "point.tif"})));
  EXPECT_LT(worst_error_m(*surface, 4096.0,
                          [](double lat, double lon) { return ramp_m(utm31(lat, lon)); }),
            kTolerance_m);
}

TEST(Raster, RotatedAndShearedGridsAreFollowed) {
  const ScratchFolder folder;
  RasterSpec spec = ramp_spec();
  const Eigen::Vector2d middle = utm31(kOriginLat_deg, kOriginLon_deg);
  spec.width = 260;
  spec.height = 240;
  // Turned by 30 degrees, sheared, and of unlike steps.
  const double a = 26.0;
  const double b = 13.0;
  const double c = -11.0;
  const double d = -28.0;
  spec.geotransform = {middle.x() - 130 * a - 120 * b, a, b, middle.y() - 130 * c - 120 * d, c, d};
  write_raster(folder / "turned.tif", spec);
  const auto surface = prepare(without_detail(world_of_rasters({folder / "turned.tif"}, 2048.0)));
  EXPECT_LT(worst_error_m(*surface, 2048.0,
                          [](double lat, double lon) { return ramp_m(utm31(lat, lon)); }),
            kTolerance_m);
}

TEST(Raster, FeetScaleAndOffsetBecomeMetres) {
  const ScratchFolder folder;
  const auto truth = [](double lat, double lon) { return ramp_m(utm31(lat, lon)); };
  RasterSpec spec = ramp_spec();
  spec.value = [](double u, double v) { return ramp_m({u, v}) / 0.3048; };
  spec.unit = "ft";
  write_raster(folder / "feet.tif", spec);
  EXPECT_LT(worst_error_m(*prepare(without_detail(world_of_rasters({folder / "feet.tif"}))), 4096.0,
                          truth),
            kTolerance_m);

  spec.unit = "";
  spec.value = [](double u, double v) { return ramp_m({u, v}) * 3937.0 / 1200.0; };
  write_raster(folder / "us_feet.tif", spec);
  tiler::WorldOptions options = without_detail(world_of_rasters({folder / "us_feet.tif"}));
  options.elevation[0].unit = "us_ft";
  EXPECT_LT(worst_error_m(*prepare(options), 4096.0, truth), kTolerance_m);

  spec.value = [](double u, double v) { return (ramp_m({u, v}) - 500.0) / 0.25; };
  spec.scale = 0.25;
  spec.offset = 500.0;
  write_raster(folder / "scaled.tif", spec);
  EXPECT_LT(worst_error_m(*prepare(without_detail(world_of_rasters({folder / "scaled.tif"}))),
                          4096.0, truth),
            kTolerance_m);
}

TEST(Raster, IntegerSamplesAreHeights) {
  const ScratchFolder folder;
  for (const GDALDataType type : {GDT_Int16, GDT_UInt16, GDT_Int32, GDT_Float32}) {
    RasterSpec spec = ramp_spec();
    spec.type = type;
    spec.value = [](double, double) { return 1234.0; };
    write_raster(folder / "flat.tif", spec);
    EXPECT_LT(worst_error_m(*prepare(world_of_rasters({folder / "flat.tif"})), 4096.0,
                            [](double, double) { return 1234.0; }),
              kTolerance_m);
  }
}

TEST(Raster, Egm96IsAddedOnceAlsoWhenTheFileHasAVerticalCrs) {
  // EPSG:5773 is EGM96 height; PROJ would apply its geoid if it were let.
  const ScratchFolder folder;
  const auto geoid = geo::Geoid::egm96();
  // At a node of the geoid's grid its cubic jumps by a centimetre from cell to cell, which the
  // surface passes over smoothly; within a cell the undulation is interpolated between our nodes.
  struct Case {
    double offset_deg;
    double tolerance_m;
  };
  for (const auto& [offset_deg, tolerance_m] : {Case{0.0, 0.02}, Case{0.11, 1e-3}}) {
    RasterSpec spec = ramp_spec();
    spec.crs = "EPSG:32631+5773";
    const Eigen::Vector2d shift = utm31(kOriginLat_deg + offset_deg, kOriginLon_deg + offset_deg) -
                                  utm31(kOriginLat_deg, kOriginLon_deg);
    spec.geotransform[0] += shift.x();
    spec.geotransform[3] += shift.y();
    write_raster(folder / "compound.tif", spec);
    tiler::WorldOptions options = without_detail(world_of_rasters({folder / "compound.tif"}));
    options.origin_lat_deg += offset_deg;
    options.origin_lon_deg += offset_deg;
    options.elevation[0].vertical_datum = "egm96";
    const auto surface = prepare(options);
    EXPECT_LT(worst_error_m(*surface, 4096.0,
                            [&](double lat, double lon) {
                              return ramp_m(utm31(lat, lon)) + geoid->undulation_m(lat, lon);
                            }),
              tolerance_m);
    EXPECT_EQ(surface->sources()[0].pipeline.find("vgridshift"), std::string::npos);
  }
}

TEST(Raster, ProjAgreesWithGeographicLibToAMillimetre) {
  OGRCoordinateTransformationOptions to_ecef;
  to_ecef.SetCoordinateOperation(
      "+proj=pipeline +step +proj=unitconvert +xy_in=deg +xy_out=rad +step +proj=cart +ellps=WGS84",
      false);
  OGRCoordinateTransformationOptions to_utm;
  to_utm.SetCoordinateOperation(
      "+proj=pipeline +step +proj=unitconvert +xy_in=deg +xy_out=rad +step +proj=utm +zone=31 "
      "+ellps=WGS84",
      false);
  const std::unique_ptr<OGRCoordinateTransformation> ecef(
      OGRCreateCoordinateTransformation(nullptr, nullptr, to_ecef));
  const std::unique_ptr<OGRCoordinateTransformation> utm(
      OGRCreateCoordinateTransformation(nullptr, nullptr, to_utm));
  for (double lat = -79.5; lat < 80.0; lat += 12.25)
    for (double lon = 0.25; lon < 6.0; lon += 1.5) {
      double x = lon;
      double y = lat;
      double z = 1500.0;
      ASSERT_TRUE(ecef->Transform(1, &x, &y, &z));
      EXPECT_LT((geo::ecef_from_geodetic({lat, lon, 1500.0}) - Eigen::Vector3d(x, y, z)).norm(),
                1e-3);
      double east = lon;
      double north = lat;
      ASSERT_TRUE(utm->Transform(1, &east, &north));
      int zone = 0;
      bool is_north = false;
      Eigen::Vector2d truth;
      GeographicLib::UTMUPS::Forward(lat, lon, zone, is_north, truth.x(), truth.y(), 31);
      if (!is_north) truth.y() -= 10000000.0;  // PROJ counts on below the equator without +south
      EXPECT_LT((truth - Eigen::Vector2d(east, north)).norm(), 1e-3) << lat << " " << lon;
    }
}

/// Rough but smooth ground, of no closed form in the interpolation.
double hills_m(double u, double v) {
  return 1500.0 + 200.0 * std::sin(u / 170.0) * std::cos(v / 230.0) +
         90.0 * std::sin((u + v) / 61.0);
}

TEST(Raster, AGeoreferenceBesideTheFileIsPartOfItsHash) {
  // A corrected header once left the old tiles in place: only the samples' bytes were hashed.
  const ScratchFolder folder;
  const auto file = folder / "dem.bin";
  RasterSpec spec = utm_spec(4096.0, 30.0);
  spec.driver = "ENVI";
  spec.value = [](double, double) { return 500.0; };
  write_raster(file, spec);
  const std::string bytes = core::read_text_file(file);
  const auto before = prepare(world_of_rasters({file}));
  EXPECT_EQ(prepare(world_of_rasters({file}))->input_hash(), before->input_hash());
  spec.geotransform[0] += 1.0;
  write_raster(file, spec);
  EXPECT_EQ(core::read_text_file(file), bytes);
  const auto after = prepare(world_of_rasters({file}));
  EXPECT_NE(after->sources()[0].content_hash, before->sources()[0].content_hash);
  EXPECT_NE(after->input_hash(), before->input_hash());
}

TEST(Raster, ATinyNoDataValueIsANumber) {
  // Such values fall out of the range of std::stod.
  const ScratchFolder folder;
  write_raster(folder / "ramp.tif", ramp_spec());
  tiler::WorldOptions options = world_of_rasters({folder / "ramp.tif"});
  options.elevation[0].nodata = "1e-320";
  EXPECT_EQ(prepare(options)->sources()[0].num_voids, 0);
}

TEST(Mosaic, TwoHalvesOfARasterAreTheWholeRaster) {
  const ScratchFolder folder;
  RasterSpec whole = utm_spec(4096.0, 30.0);
  whole.value = hills_m;
  write_raster(folder / "whole.tif", whole);
  RasterSpec west = whole;
  west.width = whole.width / 2 + 3;
  RasterSpec east = whole;  // overlaps the west by three columns
  east.geotransform[0] += 30.0 * (whole.width / 2);
  east.width = whole.width - whole.width / 2;
  write_raster(folder / "west.tif", west);
  write_raster(folder / "east.tif", east);
  const auto one = prepare(world_of_rasters({folder / "whole.tif"}));
  const auto two = prepare(world_of_rasters({folder / "west.tif", folder / "east.tif"}));
  const auto turned = prepare(world_of_rasters({folder / "east.tif", folder / "west.tif"}));
  for (const Eigen::Vector2d& at : scattered_places(4096.0, 400)) {
    EXPECT_EQ(one->sample(at.x(), at.y()).z_world, two->sample(at.x(), at.y()).z_world);
    // The grid is counted from the other file here: the same samples, other roundings.
    EXPECT_NEAR(one->sample(at.x(), at.y()).z_world, turned->sample(at.x(), at.y()).z_world, 1e-6);
  }
}

TEST(Mosaic, RastersOfOtherGridsJoinWithoutASeam) {
  // The same plane in UTM at 30 m on the west, and in another projection at 20 m on the east.
  const ScratchFolder folder;
  RasterSpec west = ramp_spec();
  west.width /= 2;
  write_raster(folder / "west.tif", west);
  RasterSpec east = utm_spec(4096.0, 20.0);
  east.geotransform[0] += 7.3;
  east.geotransform[3] -= 11.1;
  east.value = [](double u, double v) { return ramp_m({u, v}); };
  write_raster(folder / "east.tif", east);
  const auto surface =
      prepare(without_detail(world_of_rasters({folder / "west.tif", folder / "east.tif"})));
  EXPECT_LT(worst_error_m(*surface, 4096.0,
                          [](double lat, double lon) { return ramp_m(utm31(lat, lon)); }),
            kTolerance_m);
  // Right across the seam, step by step.
  double worst_m = 0.0;
  for (double x = -150.0; x < 150.0; x += 1.0) {
    const auto sample = surface->sample(x, 100.0);
    const auto place = surface->frame().geodetic_from_world({x, 100.0, sample.z_world});
    worst_m =
        std::max(worst_m, std::abs(place.height_m - ramp_m(utm31(place.lat_deg, place.lon_deg))));
  }
  EXPECT_LT(worst_m, kTolerance_m);
}

TEST(Mosaic, TheFirstRasterWinsAndTheNextFillsItsVoids) {
  const ScratchFolder folder;
  RasterSpec first = utm_spec(4096.0, 30.0);
  const Eigen::Vector2d middle = utm31(kOriginLat_deg, kOriginLon_deg);
  first.nodata = -9999.0;
  first.value = [&](double u, double v) {
    return (Eigen::Vector2d(u, v) - middle).norm() < 600.0 ? -9999.0 : 100.0;
  };
  RasterSpec second = utm_spec(4096.0, 30.0);
  second.value = [](double, double) { return 300.0; };
  write_raster(folder / "first.tif", first);
  write_raster(folder / "second.tif", second);
  const auto surface =
      prepare(without_detail(world_of_rasters({folder / "first.tif", folder / "second.tif"})));
  EXPECT_NEAR(surface->measured_height_m(42.5, 1.5).value(), 300.0, kTolerance_m);
  EXPECT_NEAR(surface->measured_height_m(42.515, 1.5).value(), 100.0, kTolerance_m);
  EXPECT_EQ(surface->sample(0, 0).source, 1);
  EXPECT_EQ(surface->sample(1500, 0).source, 0);
  EXPECT_GT(surface->sources()[0].num_voids, 1000);
  EXPECT_EQ(surface->sources()[0].num_voids_filled, 0);
}

TEST(Voids, AreFilledWithinTheirRimSmoothlyAndCounted) {
  for (const double nodata : {-32768.0, std::numeric_limits<double>::quiet_NaN()}) {
    const ScratchFolder folder;
    RasterSpec spec = utm_spec(4096.0, 30.0);
    spec.nodata = nodata;
    const Eigen::Vector2d middle = utm31(kOriginLat_deg, kOriginLon_deg);
    int num_voids = 0;
    spec.value = [&](double u, double v) {
      const Eigen::Vector2d at = Eigen::Vector2d(u, v) - middle;
      const bool is_void = std::abs(at.x()) < 300.0 && std::abs(at.y()) < 200.0;
      num_voids += is_void ? 1 : 0;
      return is_void ? nodata : 800.0 + 0.5 * at.x();
    };
    write_raster(folder / "holed.tif", spec);
    const auto surface = prepare(without_detail(world_of_rasters({folder / "holed.tif"})));
    EXPECT_EQ(surface->sources()[0].num_voids, num_voids);
    EXPECT_EQ(surface->sources()[0].num_voids_filled, num_voids);
    const std::uint8_t source = surface->sample(0.0, 0.0).source;
    EXPECT_EQ(surface->sources()[source].kind, "void");
    double previous_m = surface->sample(-400.0, 0.0).z_world;
    for (double x = -395.0; x <= 400.0; x += 5.0) {
      const double z_world = surface->sample(x, 10.0).z_world;
      // The rim's range is 800 +- 165 m. A harmonic surface over a plane's rim is the plane; the
      // grid's corners and the lean of its axes leave some metres.
      EXPECT_NEAR(z_world, 800.0 + 0.5 * x, 12.0) << x;
      EXPECT_LT(std::abs(z_world - previous_m), 5.0 * 0.5 * 2.5) << x;
      previous_m = z_world;
    }
  }
}

TEST(Coverage, MissingGroundIsAnErrorThatNamesTheArea) {
  const ScratchFolder folder;
  RasterSpec spec = ramp_spec();
  spec.width /= 2;  // the east half is missing
  write_raster(folder / "half.tif", spec);
  tiler::WorldOptions options = world_of_rasters({folder / "half.tif"});
  expect_error(ErrorKind::Input,
               {"no raster covers", "km2", "latitude 42.48", "longitude 1.4997", "outside"},
               [&] { prepare(options); });
  options.outside = "extend";
  const auto extended = prepare(options);
  EXPECT_EQ(extended->sources()[extended->sample(1500.0, 0.0).source].kind, "extend");
  options.outside = "sea";
  options.size_m = 8192.0;
  RasterSpec wide = utm_spec(8192.0, 30.0);
  wide.width = wide.width / 2;
  wide.value = [](double, double) { return 500.0; };
  write_raster(folder / "half.tif", wide);
  const auto sea = prepare(options);
  const auto sample = sea->sample(3900.0, 0.0);
  EXPECT_EQ(sample.cover, world::Cover::Sea);
  const geo::Geodetic place = sea->frame().geodetic_from_world({3900.0, 0.0, sample.z_world});
  // The sea lies at the geoid, whose cubic jumps by a centimetre at this node of its grid.
  EXPECT_NEAR(place.height_m, geo::Geoid::egm96()->undulation_m(place.lat_deg, place.lon_deg),
              0.02);
  // No cliff at the shore: 500 m fall over 2 km.
  double steepest = 0.0;
  for (double x = -500.0; x < 3500.0; x += 10.0)
    steepest =
        std::max(steepest,
                 std::abs(sea->sample(x + 10.0, 0.0).z_world - sea->sample(x, 0.0).z_world) / 10.0);
  EXPECT_LT(steepest, 0.7);
}

// Cells so wide that no sample's centre lies in the square.
TEST(Coverage, MissingGroundIsFoundUnderWideCellsToo) {
  const ScratchFolder folder;
  RasterSpec spec = utm_spec(60000.0, 6000.0);
  spec.value = [](double, double) { return 500.0; };
  write_raster(folder / "wide.tif", spec);
  prepare(without_detail(world_of_rasters({folder / "wide.tif"}, 2048.0)));
  // Begins 4.5 km east of the middle: the nearest samples without a height lie 1.5 km off it.
  spec.geotransform[0] = std::round(utm31(kOriginLat_deg, kOriginLon_deg).x()) + 4500.0;
  write_raster(folder / "wide.tif", spec);
  expect_error(ErrorKind::Input, {"no raster covers", "km2", "latitude 42.4", "outside"},
               [&] { prepare(without_detail(world_of_rasters({folder / "wide.tif"}, 2048.0))); });
}

TEST(Coverage, ACollarWithoutDataIsNoVoid) {
  const ScratchFolder folder;
  RasterSpec spec = ramp_spec();
  spec.nodata = -9999.0;
  const double east = utm31(kOriginLat_deg, kOriginLon_deg).x() + 500.0;
  spec.value = [&](double u, double v) { return u > east ? -9999.0 : ramp_m({u, v}); };
  write_raster(folder / "collar.tif", spec);
  expect_error(ErrorKind::Input, {"no raster covers", "km2"},
               [&] { prepare(world_of_rasters({folder / "collar.tif"})); });
}

TEST(Coverage, CollarsAreNotCountedAmongTheVoids) {
  const ScratchFolder folder;
  RasterSpec spec = ramp_spec();
  spec.nodata = -9999.0;
  const Eigen::Vector2d middle = utm31(kOriginLat_deg, kOriginLon_deg);
  spec.value = [&](double u, double v) {
    const Eigen::Vector2d at = Eigen::Vector2d(u, v) - middle;
    const bool is_hole = at.norm() < 100.0;
    return at.x() > 500.0 || is_hole ? -9999.0 : ramp_m({u, v});
  };
  write_raster(folder / "collar.tif", spec);
  tiler::WorldOptions options = world_of_rasters({folder / "collar.tif"});
  options.outside = "extend";
  const core::Log log("tile", core::LogLevel::Info);
  testing::internal::CaptureStderr();
  WorldSurface::prepare(options, {.log = log, .num_threads = 0, .events_file = {}});
  EXPECT_NE(testing::internal::GetCapturedStderr().find(" 1 voids of "), std::string::npos);
}

struct BadRaster {
  std::string name;
  std::vector<std::string> words;
  std::function<void(RasterSpec&)> spoil;
};

TEST(BadRasters, EndWithOneMessageThatSaysWhatIsWrong) {
  const ScratchFolder folder;
  const std::vector<BadRaster> cases = {
      {"no_georeference",
       {"no georeference", "no_georeference.tif"},
       [](RasterSpec& s) { s.geotransform = {}; }},
      {"no_crs", {"no coordinate reference system", "a_srs"}, [](RasterSpec& s) { s.crs = ""; }},
      {"local_crs",
       {"neither geographic nor projected"},
       [](RasterSpec& s) { s.crs = "LOCAL_CS[\"site\",UNIT[\"metre\",1]]"; }},
      {"bands", {"3 bands", "gdal_translate -b"}, [](RasterSpec& s) { s.num_bands = 3; }},
      {"complex", {"complex"}, [](RasterSpec& s) { s.type = GDT_CFloat64; }},
      {"unit", {"\"furlong\"", "unit = \"m\""}, [](RasterSpec& s) { s.unit = "furlong"; }},
      {"absurd",
       {"pixel (", "1e+06 m", "-11435 to 9348.86"},
       [](RasterSpec& s) { s.value = [](double, double) { return 1e6; }; }},
      {"elsewhere",
       {"no height within the world's square"},
       [](RasterSpec& s) { s.geotransform[3] += 1e5; }},
  };
  for (const BadRaster& bad : cases) {
    SCOPED_TRACE(bad.name);
    RasterSpec spec = ramp_spec();
    bad.spoil(spec);
    const auto file = folder / (bad.name + ".tif");
    write_raster(file, spec);
    expect_error(ErrorKind::Input, bad.words, [&] { prepare(world_of_rasters({file})); });
  }
}

TEST(BadRasters, EmptyFilesAreCalledSo) {
  const ScratchFolder folder;
  for (const char* name : {"heights.tif", "N42E001.hgt", "heights.zip"}) {
    std::ofstream(folder / name).close();
    expect_error(ErrorKind::Input,
                 {std::string(name) + ": is empty, a file of 0 bytes", "fetch or write it again"},
                 [&] { prepare(world_of_rasters({folder / name})); });
  }
}

// Seen in November 2026: such rasters were said to state none.
TEST(BadRasters, ACrsThatIsNotKnownIsNotCalledMissing) {
  const ScratchFolder folder;
  std::ofstream(folder / "heights.vrt")
      << "<VRTDataset rasterXSize=\"20\" rasterYSize=\"20\"><SRS>EPSG:999999</SRS><GeoTransform>"
         "1.4, 0.01, 0, 42.6, 0, -0.01</GeoTransform><VRTRasterBand dataType=\"Float32\" "
         "band=\"1\"/></VRTDataset>";
  std::ofstream(folder / "heights.asc")
      << "ncols 2\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 1\n1 2\n3 4\n";
  std::ofstream(folder / "heights.prj") << "PROJCS[\"Town grid\",GEOGCS[\"town\"";
  for (const char* name : {"heights.vrt", "heights.asc"})
    expect_error(ErrorKind::Input,
                 {name, "its coordinate reference system is not known (GDAL: ",
                  "state the right one with gdal_edit.py -a_srs EPSG:…"},
                 [&] { prepare(world_of_rasters({folder / name})); });
}

TEST(BadRasters, MissingUnreadableAndTruncatedFilesAreTold) {
  const ScratchFolder folder;
  expect_error(ErrorKind::Io, {"none.tif", "no such raster"},
               [&] { prepare(world_of_rasters({folder / "none.tif"})); });
  std::ofstream(folder / "words.tif") << "this is no raster";
  expect_error(ErrorKind::Input, {"words.tif", "cannot be opened"},
               [&] { prepare(world_of_rasters({folder / "words.tif"})); });
  write_raster(folder / "cut.tif", ramp_spec());
  std::filesystem::resize_file(folder / "cut.tif",
                               std::filesystem::file_size(folder / "cut.tif") / 2);
  expect_error(ErrorKind::Input, {"cut.tif"},
               [&] { prepare(world_of_rasters({folder / "cut.tif"})); });
}

TEST(BadRasters, AnAbsentDatumIsRefusedBeforeAnythingIsRead) {
  tiler::WorldOptions options = world_of_rasters({"nowhere.tif"});
  options.elevation[0].vertical_datum = "";
  expect_error(ErrorKind::Config, {"vertical_datum", "nowhere.tif", "egm96"},
               [&] { options.validate(); });
  options.elevation[0].vertical_datum = "egm2010";
  expect_error(ErrorKind::Config, {"egm2010"}, [&] { options.validate(); });
  options.elevation[0].vertical_datum = "egm96";
  options.elevation[0].nodata = "dunno";
  expect_error(ErrorKind::Config, {"dunno"}, [&] { options.validate(); });
  options.elevation[0].nodata = "nan";
  EXPECT_NO_THROW(options.validate());
  options.elevation[0].files.clear();
  expect_error(ErrorKind::Config, {"files"}, [&] { options.validate(); });
  options.elevation[0].kind = "rastr";
  expect_error(ErrorKind::Config, {"rastr", "raster"}, [&] { options.validate(); });
  options.elevation.clear();
  expect_error(ErrorKind::Config, {"no source of heights"}, [&] { options.validate(); });
}

TEST(RealData, AndorraHasItsPeaksAndItsVoids) {
  TERRACAST_NEEDS_SHARED_DATA("andorra/andorra_dem_3s.tif");
  tiler::WorldOptions options = world_of_rasters(
      {shared_data() / "andorra/andorra_dem_3s.tif", shared_data() / "andorra/N42E001.hgt",
       shared_data() / "andorra/N41E001.hgt"},
      51200.0);
  options.origin_lat_deg = 42.5404;
  options.origin_lon_deg = 1.5796;
  options.elevation[0].vertical_datum = "egm96";
  const auto surface = prepare(options);
  const double undulation_m = geo::Geoid::egm96()->undulation_m(42.5917, 1.4442);
  // Coma Pedrosa, 2942 m; SRTM's samples stand 90 m apart and cut peaks.
  const double peak_m = surface->measured_height_m(42.5917, 1.4442).value() - undulation_m;
  EXPECT_GT(peak_m, 2842.0);
  EXPECT_LT(peak_m, 2960.0);
  // Andorra la Vella, about 1020 m.
  const double town_m = surface->measured_height_m(42.5063, 1.5218).value() - undulation_m;
  EXPECT_NEAR(town_m, 1020.0, 40.0);
  const world::SourceInfo& crop = surface->sources()[0];
  EXPECT_EQ(crop.num_voids, crop.num_voids_filled);
  // 0.46 % of the crop; the world's square takes most of it.
  const double num_samples = 51200.0 * 51200.0 / (68.4 * 92.6);
  EXPECT_NEAR(100.0 * static_cast<double>(crop.num_voids) / num_samples, 0.46, 0.03);
  EXPECT_EQ(surface->measured_level(), 6);
  EXPECT_EQ(surface->base_level(), 6);
}

TEST(RealData, UnsignedSamplesAndOtherContinentsAreRead) {
  TERRACAST_NEEDS_SHARED_DATA("zion/zion_srtm_3s.tif");
  tiler::WorldOptions options =
      world_of_rasters({shared_data() / "zion/zion_srtm_3s.tif"}, 25600.0);
  options.origin_lat_deg = 37.32;
  options.origin_lon_deg = -113.05;
  options.elevation[0].vertical_datum = "egm96";
  const auto surface = prepare(options);
  EXPECT_GT(surface->lowest_m(), 950.0);
  EXPECT_LT(surface->highest_m(), 2900.0);
  EXPECT_EQ(surface->sources()[0].num_voids, 0);
}

}  // namespace
}  // namespace terracast::test
