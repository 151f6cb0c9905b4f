#include "core/environment.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <clocale>
#include <cstdlib>
#include <cstring>
#include <string>

namespace terracast::core {
namespace {

TEST(Environment, WhatChangesFilesIsNotHeeded) {
  // Of the manuals of GDAL, PROJ, SQLite and OpenImageIO.
  for (const char* name :
       {"GTIFF_POINT_GEO_IGNORE", "GTIFF_REPORT_COMPD_CS", "GDAL_GEOREF_SOURCES",
        "AAIGRID_DATATYPE", "OGR_CT_FORCE_TRADITIONAL_GIS_ORDER",
        "OSR_DEFAULT_AXIS_MAPPING_STRATEGY", "CENTER_LONG", "PROJ_NETWORK", "OSM_CONFIG_FILE",
        "SHAPE_ENCODING", "CPL_DEBUG", "VRT_SHARED_SOURCE", "PROJ_AUX_DB", "GDAL_CONFIG_FILE",
        "REPORT_COMPD_CS", "OPENIMAGEIO_OPTIONS", "DXF_ENCODING"})
    EXPECT_TRUE(is_unheeded_variable(name)) << name;
  for (const char* name :
       {"PATH", "HOME", "TMPDIR", "TERRACAST_PLUGIN_PATH", "SLURM_JOB_ID", "TERM",
        "LD_LIBRARY_PATH", "MALLOC_ARENA_MAX", "XDG_CACHE_HOME", "GDA", "PROJECT"})
    EXPECT_FALSE(is_unheeded_variable(name)) << name;
}

/// 0: as it should be. Of the process itself, which therefore ends.
int settled() {
  setenv("GTIFF_POINT_GEO_IGNORE", "TRUE", 1);
  setenv("OGR_ENABLE_PARTIAL_REPROJECTION", "TRUE", 1);
  setenv("GDAL_CONFIG_FILE", "/tmp/other", 1);
  setenv("TERRACAST_PLUGIN_PATH", "/p", 1);
  setenv("LC_NUMERIC", "de_DE.UTF-8", 1);
  settle_environment();
  if (std::getenv("GTIFF_POINT_GEO_IGNORE") != nullptr) return 1;
  if (std::getenv("OGR_ENABLE_PARTIAL_REPROJECTION") != nullptr) return 2;
  if (std::strcmp(std::getenv("TERRACAST_PLUGIN_PATH"), "/p") != 0) return 3;
  if (std::strcmp(std::getenv("GDAL_CONFIG_FILE"), "/dev/null") != 0) return 4;
  if (std::strcmp(std::setlocale(LC_NUMERIC, nullptr), "C") != 0) return 5;
  const auto& names = unheeded_variables();
  const auto is_told = [&](const char* name) {
    return std::find(names.begin(), names.end(), name) != names.end();
  };
  if (!is_told("GTIFF_POINT_GEO_IGNORE") || !is_told("GDAL_CONFIG_FILE")) return 6;
  // A process of ours that starts another of ours: nothing is left to be told.
  const std::size_t before = names.size();
  settle_environment();
  return names.size() == before ? 0 : 7;
}

TEST(Environment, IsSettledOnceAndForAll) {
  EXPECT_EXIT(std::exit(settled()), testing::ExitedWithCode(0), "");
}

}  // namespace
}  // namespace terracast::core
