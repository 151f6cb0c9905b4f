#pragma once

#include <cpl_conv.h>
#include <gdal_priv.h>
#include <gtest/gtest.h>
#include <ogr_spatialref.h>

#include <GeographicLib/UTMUPS.hpp>
#include <array>
#include <filesystem>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/log.h"
#include "tests/support/test_data.h"
#include "tiler/surface.h"

namespace terracast::test {

/// A raster to be written by GDAL.
struct RasterSpec {
  std::string driver = "GTiff";
  int width = 120;
  int height = 120;
  std::array<double, 6> geotransform = {};
  std::string crs = "EPSG:32631";
  GDALDataType type = GDT_Float64;
  std::optional<double> nodata;
  std::string unit;
  double scale = 1.0;
  double offset = 0.0;
  int num_bands = 1;
  bool is_point = false;
  bool is_tiled = false;
  /// Stored value of a pixel whose centre has these CRS coordinates.
  std::function<double(double u, double v)> value;
};

/// Has all of GDAL's drivers in this process, to write files by: those too whose files another process reads.
inline void register_all_drivers() {
  CPLSetConfigOption("GDAL_SKIP", "");
  GDALAllRegister();
}

inline void write_raster(const std::filesystem::path& file, const RasterSpec& spec) {
  register_all_drivers();
  GDALDriver* driver = GetGDALDriverManager()->GetDriverByName(spec.driver.c_str());
  const char* options[] = {spec.is_tiled ? "TILED=YES" : nullptr, nullptr};
  GDALDataset* dataset = driver->Create(file.c_str(), spec.width, spec.height, spec.num_bands,
                                        spec.type, const_cast<char**>(options));
  ASSERT_NE(dataset, nullptr);
  if (!spec.crs.empty()) {
    OGRSpatialReference crs;
    ASSERT_EQ(crs.SetFromUserInput(spec.crs.c_str()), OGRERR_NONE);
    dataset->SetSpatialRef(&crs);
  }
  // GDAL takes and gives corners, whatever the file says of its pixels.
  std::array<double, 6> gt = spec.geotransform;
  if (gt[1] != 0.0 || gt[2] != 0.0) dataset->SetGeoTransform(gt.data());
  if (spec.is_point) dataset->SetMetadataItem("AREA_OR_POINT", "Point");
  GDALRasterBand* band = dataset->GetRasterBand(1);
  if (spec.nodata) band->SetNoDataValue(*spec.nodata);
  if (!spec.unit.empty()) band->SetUnitType(spec.unit.c_str());
  if (spec.scale != 1.0) band->SetScale(spec.scale);
  if (spec.offset != 0.0) band->SetOffset(spec.offset);
  std::vector<double> row(static_cast<std::size_t>(spec.width));
  for (int j = 0; j < spec.height; ++j) {
    for (int i = 0; i < spec.width; ++i) {
      const double x = i + 0.5;
      const double y = j + 0.5;
      row[static_cast<std::size_t>(i)] =
          spec.value(gt[0] + x * gt[1] + y * gt[2], gt[3] + x * gt[4] + y * gt[5]);
    }
    ASSERT_EQ(band->RasterIO(GF_Write, 0, j, spec.width, 1, row.data(), spec.width, 1, GDT_Float64,
                             0, 0, nullptr),
              CE_None);
  }
  GDALClose(dataset);
}

/// Easting and northing in zone 31 by GeographicLib: a truth that shares no code with PROJ.
inline Eigen::Vector2d utm31(double lat_deg, double lon_deg) {
  int zone = 0;
  bool north = false;
  Eigen::Vector2d at;
  GeographicLib::UTMUPS::Forward(lat_deg, lon_deg, zone, north, at.x(), at.y(), 31);
  return at;
}

inline constexpr double kOriginLat_deg = 42.5;
inline constexpr double kOriginLon_deg = 1.5;

/// A grid of `spacing_m` in zone 31 that covers a square about the origin with a margin.
inline RasterSpec utm_spec(double size_m, double spacing_m) {
  RasterSpec spec;
  const Eigen::Vector2d middle = utm31(kOriginLat_deg, kOriginLon_deg);
  const double half_m = 0.5 * size_m + 20.0 * spacing_m;
  spec.width = spec.height = static_cast<int>(2.0 * half_m / spacing_m);
  spec.geotransform = {std::round(middle.x() - half_m), spacing_m, 0.0,
                       std::round(middle.y() + half_m), 0.0,       -spacing_m};
  return spec;
}

inline tiler::WorldOptions world_of(const std::string& kind, double size_m = 4096.0) {
  tiler::WorldOptions options;
  options.origin_lat_deg = kOriginLat_deg;
  options.origin_lon_deg = kOriginLon_deg;
  options.size_m = size_m;
  tiler::ElevationOptions entry;
  entry.kind = kind;
  entry.vertical_datum = "ellipsoid";
  options.elevation.push_back(entry);
  return options;
}

inline tiler::WorldOptions world_of_rasters(const std::vector<std::filesystem::path>& files,
                                            double size_m = 4096.0) {
  tiler::WorldOptions options = world_of("raster", size_m);
  for (const auto& file : files)
    options.elevation[0].files.push_back({.written = file.string(), .resolved = file});
  return options;
}

inline std::shared_ptr<const tiler::WorldSurface> prepare(const tiler::WorldOptions& options,
                                                          int num_threads = 0) {
  const core::Log log("tile", core::LogLevel::Off);
  return tiler::WorldSurface::prepare(options,
                                      {.log = log, .num_threads = num_threads, .events_file = {}});
}

/// The log of preparing a world.
inline std::string log_of(const tiler::WorldOptions& options) {
  const core::Log log("tile", core::LogLevel::Info);
  testing::internal::CaptureStderr();
  tiler::WorldSurface::prepare(options, {.log = log, .num_threads = 0, .events_file = {}});
  return testing::internal::GetCapturedStderr();
}

/// Runs `work`, which must fail with this kind and a message that holds all the words.
inline void expect_error(core::ErrorKind kind, const std::vector<std::string>& words,
                         const std::function<void()>& work) {
  try {
    work();
    ADD_FAILURE() << "no error";
  } catch (const core::Error& error) {
    EXPECT_EQ(static_cast<int>(error.kind()), static_cast<int>(kind)) << error.what();
    for (const std::string& word : words)
      EXPECT_NE(std::string(error.what()).find(word), std::string::npos)
          << "\"" << word << "\" is missing in: " << error.what();
  }
}

/// Places over the inner part of a square.
inline std::vector<Eigen::Vector2d> scattered_places(double size_m, int count = 60) {
  std::vector<Eigen::Vector2d> places;
  for (int i = 0; i < count; ++i)  // R2 low-discrepancy sequence (Roberts 2018)
    places.emplace_back(size_m * (std::fmod(0.5 + 0.7548776662 * i, 1.0) - 0.5) * 0.98,
                        size_m * (std::fmod(0.5 + 0.5698402910 * i, 1.0) - 0.5) * 0.98);
  return places;
}

}  // namespace terracast::test
