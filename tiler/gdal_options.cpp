#include "tiler/gdal_options.h"

#include <cpl_conv.h>
#include <fmt/format.h>
#include <gdal.h>
#include <proj.h>

#include <array>

namespace terracast::tiler {
namespace {

struct Option {
  const char* name;
  const char* value;
};

constexpr std::array kOptions = {
    // Numbers of text grids as they are written: by default their type is that of the first hundred kilobytes, and
    // what comes behind is rounded to it.
    Option{"AAIGRID_DATATYPE", "Float64"},
    Option{"GRASSASCIIGRID_DATATYPE", "Float64"},
    // What lies beside a raster (.aux.xml, .ovr, world files) is looked for.
    Option{"GDAL_PAM_ENABLED", "YES"},
    Option{"GDAL_DISABLE_READDIR_ON_OPEN", "NO"},
    Option{"USE_RRD", "NO"},
    // Vertical systems of GeoTIFF 1.0 and 1.1, where GDAL gives those of 1.1 alone.
    Option{"GTIFF_REPORT_COMPD_CS", "YES"},
    Option{"GTIFF_POINT_GEO_IGNORE", "NO"},
    Option{"GTIFF_HONOUR_NEGATIVE_SCALEY", "NO"},
    Option{"GTIFF_IGNORE_READ_ERRORS", "NO"},
    Option{"GTIFF_LINEAR_UNITS", "DEFAULT"},
    Option{"GTIFF_ESRI_CITATION", "YES"},
    Option{"CONVERT_YCBCR_TO_RGB", "YES"},
    Option{"REPORT_COMPD_CS",
           "NO"},  // formats that take a vertical system for granted do not declare it
    Option{"ALLOW_ELLIPSOIDAL_HEIGHT_AS_VERTICAL_CRS", "NO"},
    Option{"DTED_VERIFY_CHECKSUM", "NO"},
    Option{"OGR_CT_FORCE_TRADITIONAL_GIS_ORDER", "NO"},
    Option{"OGR_ENABLE_PARTIAL_REPROJECTION", "NO"},
    Option{"OSR_DEFAULT_AXIS_MAPPING_STRATEGY", "AUTHORITY_COMPLIANT"},
    Option{"CHECK_WITH_INVERT_PROJ", "NO"},
    Option{"SHAPE_RESTORE_SHX", "NO"},
    Option{"CPL_DEBUG", "OFF"},
    // Neither the user's gdalrc nor the machine's.
    Option{"GDAL_CONFIG_FILE", "/dev/null"},
};

}  // namespace

void state_gdal_options() {
  for (const Option& option : kOptions) CPLSetConfigOption(option.name, option.value);
}

const std::string& gdal_identity() {
  static const std::string identity = [] {
    std::string text =
        fmt::format("GDAL {} PROJ {}", GDALVersionInfo("RELEASE_NAME"), proj_info().release);
    for (const Option& option : kOptions) text += fmt::format(" {}={}", option.name, option.value);
    return text;
  }();
  return identity;
}

}  // namespace terracast::tiler
