#include "tiler/no_data.h"

#include <cmath>
#include <limits>

#include "tests/tiler/raster_files.h"

// Which samples have no value, and which values no ground has.
namespace terracast::test {
namespace {

using core::ErrorKind;
using tiler::NoData;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

tiler::WorldOptions smooth_world(const std::filesystem::path& file, double size_m = 2048.0) {
  tiler::WorldOptions options = world_of_rasters({file}, size_m);
  options.detail_roughness = 0.0;
  return options;
}

/// Ground of 400 m with a disc of `one` in the middle and one of `other` 500 m east of it, of 100 m each.
RasterSpec holes(double one, double other, GDALDataType type = GDT_Float64) {
  RasterSpec spec = utm_spec(4096.0, 20.0);
  spec.type = type;
  const Eigen::Vector2d middle = utm31(kOriginLat_deg, kOriginLon_deg);
  spec.value = [=](double u, double v) {
    if (std::hypot(u - middle.x(), v - middle.y()) < 100.0) return one;
    if (std::hypot(u - middle.x() - 500.0, v - middle.y()) < 100.0) return other;
    return 400.0;
  };
  return spec;
}

TEST(NoDataWords, AreReadAndWrittenAgain) {
  EXPECT_FALSE(NoData::from_text("").has_value());
  EXPECT_FALSE(NoData::from_text("-9999,").has_value());
  EXPECT_FALSE(NoData::from_text("none, 1").has_value());
  EXPECT_FALSE(NoData::from_text("-9999 -32768").has_value());
  const NoData two = NoData::of("-9999, -32768");
  EXPECT_TRUE(two.holds(-9999.0, GDT_Float64));
  EXPECT_TRUE(two.holds(-32768.0, GDT_Int16));
  EXPECT_TRUE(two.holds(kNan, GDT_Float32));
  EXPECT_FALSE(two.holds(0.0, GDT_Float32));
  EXPECT_EQ(two.text(), "-9999, -32768");
  EXPECT_EQ(two.text_with(65535.0), "-9999, -32768, 65535");
  EXPECT_EQ(NoData::of("none").text_with(-9999.0), "-9999");
  EXPECT_TRUE(NoData::of("none").holds(kNan, GDT_Float32));
  EXPECT_FALSE(NoData::of("none").takes_masks());
  EXPECT_EQ(NoData::of("declared").text_with(-9999.0), "declared, -9999");
  // A float holds fewer digits than such a value is declared with.
  EXPECT_TRUE(NoData::of("-3.4028234663852886e+38")
                  .holds(static_cast<double>(-3.4028234e38F), GDT_Float32));
}

TEST(NoDataValues, NanIsAVoidWhateverIsStated) {
  const ScratchFolder folder;
  // 79 samples lie within 100 m of a sample's corner (a disc of 5 samples' radius about (0.5, 0.5) or so): the same
  // for any statement.
  RasterSpec spec = holes(kNan, 400.0);
  spec.nodata = -32768.0;
  write_raster(folder / "nan.tif", spec);
  std::int64_t num_voids = 0;
  for (const char* nodata : {"declared", "none", "-1", "nan"}) {
    tiler::WorldOptions options = smooth_world(folder / "nan.tif");
    options.elevation[0].nodata = nodata;
    const auto surface = prepare(options);
    EXPECT_GT(surface->sources()[0].num_voids, 60) << nodata;
    if (num_voids != 0) {
      EXPECT_EQ(surface->sources()[0].num_voids, num_voids) << nodata;
    }
    num_voids = surface->sources()[0].num_voids;
    EXPECT_NEAR(surface->measured_height_m(kOriginLat_deg, kOriginLon_deg).value(), 400.0, 1e-6);
  }
}

TEST(NoDataValues, SeveralValuesAreVoidsBesideNan) {
  const ScratchFolder folder;
  write_raster(folder / "two.tif", holes(-9999.0, kNan));
  tiler::WorldOptions options = smooth_world(folder / "two.tif");
  for (const char* nodata : {"declared", "nan", "-32768", "none"}) {
    options.elevation[0].nodata = nodata;
    expect_error(ErrorKind::Input, {"two.tif", "exactly -9999", "-9999\""},
                 [&] { prepare(options); });
  }
  for (const char* nodata : {"-9999", "declared, -9999", "nan, -9999"}) {
    options.elevation[0].nodata = nodata;
    const auto surface = prepare(options);
    EXPECT_NEAR(surface->measured_height_m(kOriginLat_deg, kOriginLon_deg).value(), 400.0, 1e-6);
    const auto sample = surface->sample(500.0, 0.0);
    EXPECT_EQ(surface->sources()[sample.source].kind, "void") << nodata;
  }
  options.elevation[0].nodata = "-9999;-1";
  expect_error(ErrorKind::Config, {"-9999;-1", "declared, none, or numbers"},
               [&] { options.validate(); });
}

/// What the message tells to state, between the quotes behind "nodata = ".
std::string stated_by(const std::string& message) {
  const std::string key = "nodata = \"";
  const std::size_t begin = message.find(key);
  if (begin == std::string::npos) return "";
  return message.substr(begin + key.size(),
                        message.find('"', begin + key.size()) - begin - key.size());
}

TEST(NoDataValues, CustomaryFillsAreRefusedAndTheWayOutWorks) {
  const ScratchFolder folder;
  struct Case {
    double fill;
    GDALDataType type;
  };
  for (const auto& [fill, type] :
       {Case{-9999.0, GDT_Int16}, Case{-32768.0, GDT_Int16}, Case{-32767.0, GDT_Int16},
        Case{65535.0, GDT_UInt16}, Case{3.4028234663852886e38, GDT_Float32},
        Case{-3.4028234663852886e38, GDT_Float32}, Case{1e20, GDT_Float32},
        Case{1.70141e38, GDT_Float64}, Case{-99999.0, GDT_Float32},
        Case{-2147483648.0, GDT_Int32}}) {
    SCOPED_TRACE(fill);
    const auto file = folder / "fill.tif";
    write_raster(file, holes(fill, 400.0, type));
    for (const char* nodata : {"declared", "none", "-1, -2"}) {
      tiler::WorldOptions options = smooth_world(file);
      options.elevation[0].nodata = nodata;
      std::string message;
      try {
        prepare(options);
        ADD_FAILURE() << "no error, nodata = " << nodata;
      } catch (const core::Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::Input);
        message = error.what();
      }
      EXPECT_NE(message.find("fill.tif"), std::string::npos) << message;
      options.elevation[0].nodata = stated_by(message);
      const auto surface = prepare(options);
      EXPECT_NEAR(surface->measured_height_m(kOriginLat_deg, kOriginLon_deg).value(), 400.0, 1e-6)
          << message;
    }
  }
}

TEST(NoDataValues, AFillInFeetOrScaledIsOneToo) {
  const ScratchFolder folder;
  RasterSpec spec = holes(-9999.0, 400.0);
  spec.unit = "ft";
  write_raster(folder / "feet.tif", spec);
  expect_error(ErrorKind::Input, {"exactly -9999"},
               [&] { prepare(smooth_world(folder / "feet.tif")); });
  spec.unit = "";
  spec.scale = 0.5;
  write_raster(folder / "scaled.tif", spec);
  expect_error(ErrorKind::Input, {"exactly -9999"},
               [&] { prepare(smooth_world(folder / "scaled.tif")); });
}

TEST(NoDataValues, MasksStayWhereNumbersAreStated) {
  const ScratchFolder folder;
  const auto file = folder / "masked.tif";
  write_raster(file, holes(-9999.0, 400.0));
  GDALDataset* dataset = GDALDataset::Open(file.c_str(), GDAL_OF_UPDATE);
  ASSERT_EQ(dataset->CreateMaskBand(GMF_PER_DATASET), CE_None);
  std::vector<std::uint8_t> mask(static_cast<std::size_t>(dataset->GetRasterXSize()), 255);
  for (int j = 0; j < dataset->GetRasterYSize(); ++j) {
    const bool is_hidden = j < 10;
    std::fill(mask.begin(), mask.end(), is_hidden ? 0 : 255);
    ASSERT_EQ(dataset->GetRasterBand(1)->GetMaskBand()->RasterIO(
                  GF_Write, 0, j, static_cast<int>(mask.size()), 1, mask.data(),
                  static_cast<int>(mask.size()), 1, GDT_Byte, 0, 0, nullptr),
              CE_None);
  }
  GDALClose(dataset);
  tiler::WorldOptions options = smooth_world(file, 4600.0);
  options.outside = "extend";
  options.elevation[0].nodata = "-9999";
  const std::int64_t with_mask = prepare(options)->sources()[0].num_voids;
  EXPECT_GT(with_mask, 10 * 200);  // ten rows of more than 200 samples, and the hole
}

TEST(EarthHeights, GroundBeyondTheEarthsIsRefused) {
  const ScratchFolder folder;
  struct Case {
    double height_m;
    const char* sea;
    bool is_right;
  };
  // Margins of 500 m beyond the Dead Sea's shore, Everest and the Challenger Deep.
  for (const auto& [height_m, sea, is_right] :
       {Case{-430.0, "auto", true}, Case{-900.0, "auto", true}, Case{-940.0, "auto", false},
        Case{-940.0, "none", true}, Case{-10935.0, "none", true}, Case{-11400.0, "none", true},
        Case{-11500.0, "none", false}, Case{8849.0, "auto", true}, Case{9300.0, "auto", true},
        Case{9400.0, "auto", false}, Case{-5000.0, "auto", false}}) {
    SCOPED_TRACE(height_m);
    // One sample of all.
    RasterSpec spec = utm_spec(4096.0, 20.0);
    const double left = spec.geotransform[0] + 20.0 * (spec.width / 2);
    const double top = spec.geotransform[3] - 20.0 * (spec.height / 2);
    spec.value = [=, height_m = height_m](double u, double v) {
      const bool is_it = u > left && u < left + 20.0 && v < top && v > top - 20.0;
      const double slope_m = 0.01 * (u - left);  // ground of one exact height is a collar's
      return is_it ? height_m : slope_m + (height_m < 0.0 ? -420.0 : 4000.0);
    };
    write_raster(folder / "one.tif", spec);
    tiler::WorldOptions options = smooth_world(folder / "one.tif");
    options.elevation[0].sea = sea;
    if (is_right)
      EXPECT_NO_THROW(prepare(options));
    else
      expect_error(ErrorKind::Input, {"one.tif", "pixel (", "Earth", "nodata"},
                   [&] { prepare(options); });
  }
}

TEST(EarthHeights, TrenchesHoldMinus9999WhereItIsStated) {
  const ScratchFolder folder;
  RasterSpec spec = utm_spec(4096.0, 20.0);
  const double middle = spec.geotransform[0] + 10.0 * spec.width;
  spec.value = [=](double u, double) { return -9999.0 + std::floor((u - middle) / 20.0); };
  write_raster(folder / "trench.tif", spec);
  tiler::WorldOptions options = smooth_world(folder / "trench.tif");
  options.elevation[0].sea = "none";
  expect_error(ErrorKind::Input, {"or \"none\" if they are heights"}, [&] { prepare(options); });
  options.elevation[0].nodata = "none";
  EXPECT_EQ(prepare(options)->sources()[0].num_voids, 0);
}

}  // namespace
}  // namespace terracast::test
