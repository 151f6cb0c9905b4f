#pragma once

#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "tests/tiler/raster_files.h"

namespace terracast::test {

/// Samples at points with a vertical system in one projection, and decimals behind many whole numbers in another.
inline void write_inputs(const std::filesystem::path& folder) {
  RasterSpec point = utm_spec(1024.0, 20.0);
  point.crs = "EPSG:32631+5773";
  point.is_point = true;
  point.value = [](double u, double v) {
    return 700.0 + 30.0 * std::sin(u / 90.0) + 0.01 * (v - 4.7e6);
  };
  write_raster(folder / "point.tif", point);
  std::ofstream grid(folder / "grid.asc");
  grid << "ncols 240\nnrows 240\nxllcorner 1.44\nyllcorner 42.44\ncellsize 0.0005\n";
  for (int row = 0; row < 240; ++row)
    for (int column = 0; column < 240; ++column)
      grid << 600 + (7 * row + 5 * column) % 90 << (row < 200 ? "" : ".25")
           << (column == 239 ? "\n" : " ");
  std::ofstream(folder / "grid.prj")
      << "GEOGCS[\"WGS 84\",DATUM[\"WGS_1984\",SPHEROID[\"WGS 84\",6378137,298.257223563]],"
         "PRIMEM[\"Greenwich\",0],UNIT[\"degree\",0.0174532925199433]]";
}

/// Variables of manuals that change what GDAL, PROJ and others read, and files of options in a home.
inline std::vector<std::string> hostile_variables(const std::filesystem::path& home) {
  const std::string nowhere = (home / "nowhere").string();
  std::filesystem::create_directories(home / ".gdal");
  std::ofstream(home / ".gdal" / "gdalrc")
      << "[configoptions]\nGTIFF_POINT_GEO_IGNORE=TRUE\nAAIGRID_DATATYPE=Int32\nGDAL_SKIP=GTiff\n";
  std::filesystem::create_directories(home / "data" / "proj");
  std::ofstream(home / "data" / "proj" / "egm96_15.gtx") << "no grid";
  return {"HOME=" + home.string(),
          "XDG_DATA_HOME=" + (home / "data").string(),
          "PROJ_USER_WRITABLE_DIRECTORY=" + (home / "data" / "proj").string(),
          "PROJ_DATA=" + (home / "data" / "proj").string(),
          "PROJ_LIB=" + nowhere,
          "PROJ_AUX_DB=" + nowhere,
          "PROJ_NETWORK=ON",
          "PROJ_USE_PROJ4_INIT_RULES=YES",
          "PROJ_DEBUG=3",
          "GDAL_DATA=" + nowhere,
          "GDAL_DRIVER_PATH=" + nowhere,
          "GDAL_CONFIG_FILE=" + (home / ".gdal" / "gdalrc").string(),
          "GDAL_SKIP=GTiff,AAIGrid",
          "GDAL_PAM_ENABLED=NO",
          "GDAL_PAM_PROXY_DIR=" + nowhere,
          "GDAL_GEOREF_SOURCES=NONE",
          "GDAL_DISABLE_READDIR_ON_OPEN=EMPTY_DIR",
          "GDAL_CACHEMAX=1",
          "GDAL_NUM_THREADS=ALL_CPUS",
          "GDAL_FORCE_CACHING=YES",
          "GDAL_BAND_BLOCK_CACHE=HASHSET",
          "GDAL_MAX_DATASET_POOL_SIZE=2",
          "GDAL_FILENAME_IS_UTF8=NO",
          "GTIFF_POINT_GEO_IGNORE=TRUE",
          "GTIFF_REPORT_COMPD_CS=NO",
          "GTIFF_HONOUR_NEGATIVE_SCALEY=YES",
          "GTIFF_IGNORE_READ_ERRORS=YES",
          "GTIFF_LINEAR_UNITS=BROKEN",
          "GTIFF_SRS_SOURCE=EPSG",
          "GTIFF_IMPORT_FROM_EPSG=NO",
          "GTIFF_DIRECT_IO=YES",
          "GTIFF_VIRTUAL_MEM_IO=YES",
          "GTIFF_USE_MMAP=YES",
          "GEOTIFF_CSV=" + nowhere,
          "AAIGRID_DATATYPE=Int32",
          "REPORT_COMPD_CS=YES",
          "USE_RRD=YES",
          "TIFF_USE_OVR=YES",
          "CONVERT_YCBCR_TO_RGB=NO",
          "VRT_SHARED_SOURCE=0",
          "CENTER_LONG=90",
          "CHECK_WITH_INVERT_PROJ=YES",
          "THRESHOLD=1000",
          "OGR_CT_FORCE_TRADITIONAL_GIS_ORDER=YES",
          "OGR_ENABLE_PARTIAL_REPROJECTION=YES",
          "OGR_CT_OP_SELECTION=FIRST_MATCHING",
          "OGR_CT_PREFER_OFFICIAL_SRS_DEF=NO",
          "OGR_CT_USE_SRS_COORDINATE_EPOCH=NO",
          "OSR_DEFAULT_AXIS_MAPPING_STRATEGY=TRADITIONAL_GIS_ORDER",
          "OSR_USE_APPROX_TMERC=YES",
          "OSR_USE_NON_DEPRECATED=NO",
          "OSR_STRIP_TOWGS84=NO",
          "OSR_ADD_TOWGS84_ON_IMPORT_FROM_EPSG=YES",
          "OSR_WKT_FORMAT=WKT1",
          "CPL_DEBUG=ON",
          "CPL_TIMESTAMP=ON",
          "CPL_LOG_ERRORS=ON",
          "LC_ALL=de_DE.UTF-8",
          "LC_NUMERIC=de_DE.UTF-8",
          "LANG=de_DE.UTF-8"};
}

}  // namespace terracast::test
