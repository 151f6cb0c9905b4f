#include "tiler/gdal_formats.h"

#include <cpl_conv.h>
#include <cpl_error.h>
#include <cpl_http.h>
#include <cpl_string.h>
#include <cpl_vsi.h>
#include <gdal_priv.h>
#include <ogr_srs_api.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <list>
#include <mutex>
#include <string>
#include <string_view>

#include "tiler/gdal_options.h"

namespace terracast::tiler {

const char* const kRasterFormats[] = {
    "GTiff",          "VRT",         "SRTMHGT", "HFA",   "ENVI", "EHdr", "AAIGrid", "AIG",
    "DTED",           "GSAG",        "GSBG",    "GS7BG", "BT",   "HF2",  "XYZ",     "USGSDEM",
    "GRASSASCIIGrid", "SAGA",        "RST",     "GTX",   "BYN",  "ISG",  "GXF",     "ZMap",
    "NGSGEOID",       "Terragen",    "SIGDEM",  "PNG",   "JPEG", "WEBP", "GIF",     "BMP",
    "GPKG",           "JP2OpenJPEG", "MBTiles", nullptr};

const char* const kVectorFormats[] = {
    "OSM", "GeoJSON",        "GeoJSONSeq", "TopoJSON",     "ESRIJSON", "GPKG",   "SQLite",
    "GML", "ESRI Shapefile", "FlatGeobuf", "MapInfo File", "KML",      "LIBKML", "GPX",
    "DXF", "OpenFileGDB",    nullptr};

// WebP too is what GeoPackages and MBTiles hold.
const char* const kTroddenRasters[] = {"GTiff", "VRT",  "SRTMHGT", "PNG",  "JPEG",
                                       "WEBP",  "GPKG", "MBTiles", nullptr};

const char* const kTroddenVectors[] = {
    "OSM", "GeoJSON", "GeoJSONSeq", "GPKG", "ESRI Shapefile", "FlatGeobuf", nullptr};

namespace {

/// What GDAL needs for its own use, in memory.
constexpr std::array<std::string_view, 2> kOwnFormats = {"MEM", "Memory"};
/// Archives whose sizes are looked at before, parts of files, and memory; the last is GDAL's own, of JPEG in TIFF.
constexpr std::array<std::string_view, 4> kOwnFolders = {"/vsizip/", "/vsisubfile/", "/vsimem/",
                                                         "/vsisparse/"};

bool is_listed(const char* const* formats, std::string_view name) {
  for (; *formats != nullptr; ++formats)
    if (name == *formats) return true;
  return false;
}

void take_drivers(const char* const* rasters, const char* const* vectors) {
  const auto is_wanted = [&](std::string_view name) {
    return is_listed(rasters, name) || is_listed(vectors, name) ||
           std::find(kOwnFormats.begin(), kOwnFormats.end(), name) != kOwnFormats.end();
  };
  GDALAllRegister();
  GDALDriverManager& drivers = *GetGDALDriverManager();
  std::string skipped = CPLGetConfigOption("GDAL_SKIP", "");
  for (int i = 0; i < drivers.GetDriverCount(); ++i) {
    const std::string name = drivers.GetDriver(i)->GetDescription();
    if (!is_wanted(name)) skipped += (skipped.empty() ? "" : ",") + name;
  }
  OSRSetPROJEnableNetwork(0);
  // Who registers all drivers again gets these only, too.
  CPLSetConfigOption("GDAL_SKIP", skipped.c_str());
  GDALAllRegister();
}

void refuse(const std::string& name) {
  CPLError(
      CE_Failure, CPLE_OpenFailed,
      "%s is no file: networks and streams are not read; fetch or unpack it, and name the file",
      name.c_str());
}

void* refuse_open(void* prefix, const char* name, const char*) {
  refuse(*static_cast<const std::string*>(prefix) + name);
  return nullptr;
}
int refuse_stat(void*, const char*, VSIStatBufL*, int) { return -1; }

void close_folders() {
  static std::list<std::string> prefixes;  // GDAL keeps pointers to them
  char** known = VSIGetFileSystemsPrefixes();
  for (int i = 0; known != nullptr && known[i] != nullptr; ++i) {
    const std::string_view name = known[i];
    if (std::find(kOwnFolders.begin(), kOwnFolders.end(), name) != kOwnFolders.end()) continue;
    // GDAL knows /vsicurl? beside /vsicurl/, and does not name it.
    for (const char end : {name.back(), '?'}) {
      prefixes.push_back(std::string(name.substr(0, name.size() - 1)) + end);
      VSIFilesystemPluginCallbacksStruct* calls = VSIAllocFilesystemPluginCallbacksStruct();
      calls->pUserData = &prefixes.back();
      calls->open = refuse_open;
      calls->stat = refuse_stat;
      VSIInstallPluginHandler(prefixes.back().c_str(), calls);
      VSIFreeFilesystemPluginCallbacksStruct(calls);
    }
  }
  CSLDestroy(known);
}

CPLHTTPResult* refuse_fetch(const char* address, CSLConstList, GDALProgressFunc, void*,
                            CPLHTTPFetchWriteFunc, void*, void*) {
  refuse(address == nullptr ? "" : address);
  auto* result = static_cast<CPLHTTPResult*>(CPLCalloc(1, sizeof(CPLHTTPResult)));
  result->nStatus = 1;
  result->pszErrBuf = CPLStrdup("nothing is fetched");
  return result;
}

std::atomic<bool> has_all = false;

void register_once(const char* const* rasters, const char* const* vectors) {
  static std::once_flag once;
  std::call_once(once, [&] {
    has_all = rasters == kRasterFormats;
    state_gdal_options();
    take_drivers(rasters, vectors);
    close_folders();
    CPLHTTPSetFetchCallback(refuse_fetch, nullptr);
  });
}

}  // namespace

void register_gdal() { register_once(kTroddenRasters, kTroddenVectors); }
void register_all_gdal() { register_once(kRasterFormats, kVectorFormats); }
bool has_all_gdal() { return has_all; }

}  // namespace terracast::tiler
