#include "core/environment.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <clocale>
#include <cstdlib>
#include <filesystem>
#include <locale>
#include <string>

namespace terracast::core {
namespace {

/// Prefixes of the options of GDAL, its drivers and the other libraries. GDAL takes any variable of
/// the environment for the option of that name. Names by which only networks are reached are not among them: nothing
/// is fetched.
constexpr std::array kPrefixes = {
    "GDAL_",        "OGR_",        "OSR_",         "CPL_",        "VSI_",      "PROJ_",
    "GEOTIFF_",     "GTIFF_",      "TIFF_",        "ESRI_",       "VRT_",      "OSM_",
    "SHAPE_",       "DBF_",        "GML_",         "GMLAS_",      "DXF_",      "KML_",
    "LIBKML_",      "GPX_",        "MITAB_",       "HFA_",        "DTED_",     "AAIGRID_",
    "AIG_",         "ENVI_",       "EHDR_",        "GRASSASCII",  "USGSDEM_",  "SRTMHGT_",
    "XYZ_",         "GXF_",        "ZMAP_",        "ISG_",        "SAGA_",     "GPKG_",
    "SQLITE_",      "SPATIALITE_", "MBTILES_",     "JPEG_",       "PNG_",      "WEBP_",
    "GIF_",         "BMP_",        "JP2OPENJPEG_", "OPJ_",        "OPENJPEG_", "GEOJSON_",
    "OGRJSON_",     "ESRIJSON_",   "TOPOJSON_",    "FLATGEOBUF_", "FGB_",      "FILEGDB_",
    "OPENFILEGDB_", "SRS_",        "GEOS_",        "RPC_",        "EXIF_",     "OIIO_",
    "OPENIMAGEIO_", "OPENEXR_",    "ASSIMP_",      "LIBXML_",
};

/// Options of GDAL, and variables of libraries that it is built on, with names of their own.
constexpr std::array kNames = {
    "ALLOW_ELLIPSOIDAL_HEIGHT_AS_VERTICAL_CRS",
    "CENTER_LONG",
    "CHECK_WITH_INVERT_PROJ",
    "CONVERT_YCBCR_TO_RGB",
    "GEOREF_SOURCES",
    "GRIB_PDS_ALL_BANDS",
    "IGNORE_COORDINATE_EPOCH",
    "JPEGMEM",
    "MEM_ENABLE_OPEN",
    "OCIO",
    "OAMS_TRADITIONAL_GIS_ORDER",
    "REPORT_COMPD_CS",
    "SGML_CATALOG_FILES",
    "THRESHOLD",
    "TOWGS84",
    "USE_RRD",
    "XML_CATALOG_FILES",
};

/// The usual places of what PROJ and GDAL read for themselves.
constexpr std::array kProjFiles = {"/usr/share/proj/proj.db", "/usr/local/share/proj/proj.db"};
constexpr std::array kGdalFiles = {"/usr/share/gdal/gdalvrt.xsd",
                                   "/usr/local/share/gdal/gdalvrt.xsd"};

bool has_any(std::span<const char* const> files) {
  return std::any_of(files.begin(), files.end(), [](const char* file) {
    std::error_code ignored;
    return std::filesystem::exists(file, ignored);
  });
}

std::vector<std::string>& unheeded() {
  static std::vector<std::string> names;
  return names;
}

std::vector<std::string> names_of_environment() {
  std::vector<std::string> names;
  for (char** entry = environ; entry != nullptr && *entry != nullptr; ++entry) {
    const std::string_view text = *entry;
    names.emplace_back(text.substr(0, text.find('=')));
  }
  return names;
}

/// Options that settle_environment() sets for the libraries.
struct Stated {
  const char* name;
  const char* value;
};
/// GDAL would read ~/.gdal/gdalrc and /etc/gdal/gdalrc; PROJ would find grids in ~/.local/share/proj.
constexpr std::array kStated = {
    Stated{"GDAL_CONFIG_FILE", "/dev/null"},
    Stated{"PROJ_SKIP_READ_USER_WRITABLE_DIRECTORY", "YES"},
    Stated{"PROJ_NETWORK", "OFF"},
};

bool is_stated(const std::string& name) {
  return std::any_of(kStated.begin(), kStated.end(), [&](const Stated& one) {
    const char* value = std::getenv(one.name);
    return name == one.name && value != nullptr && std::string_view(value) == one.value;
  });
}

}  // namespace

bool is_unheeded_variable(std::string_view name) {
  if (name == "PROJ_DATA" || name == "PROJ_LIB") return has_any(kProjFiles);
  if (name == "GDAL_DATA") return has_any(kGdalFiles);
  return std::find(kNames.begin(), kNames.end(), name) != kNames.end() ||
         std::any_of(kPrefixes.begin(), kPrefixes.end(),
                     [&](const char* prefix) { return name.starts_with(prefix); });
}

const std::vector<std::string>& unheeded_variables() { return unheeded(); }

void settle_environment() {
  for (const std::string& name : names_of_environment()) {
    if (!is_unheeded_variable(name) || is_stated(name)) continue;
    unheeded().push_back(name);
    unsetenv(name.c_str());
  }
  std::sort(unheeded().begin(), unheeded().end());
  for (const Stated& one : kStated) setenv(one.name, one.value, 1);
  // Nothing of ours takes up LC_ALL and the like; a library's initialisation might have.
  std::setlocale(LC_ALL, "C");
  std::locale::global(std::locale::classic());
}

}  // namespace terracast::core
