#include "tiler/apart/trodden.h"

#include <cpl_conv.h>
#include <cpl_vsi.h>

#include <array>
#include <set>
#include <string_view>

#include "core/stop.h"
#include "tiler/gdal_formats.h"
#include "tiler/gdal_support.h"
#include "tiler/vrt_sources.h"

namespace terracast::tiler {
namespace {

GDALDriverH trodden_driver(const std::string& path, unsigned kind, const char* const* formats) {
  const GdalErrors quiet;
  return GDALIdentifyDriverEx(path.c_str(), kind, formats, nullptr);
}

bool is_there(const std::string& path) {
  VSIStatBufL status;
  return VSIStatL(path.c_str(), &status) == 0;
}

/// Whether it begins as Erdas' notes do, which GDAL reads beside rasters of other formats too.
bool is_of_erdas(const std::string& path) {
  constexpr std::string_view kBegin = "EHFA_HEADER_TAG";
  std::array<char, kBegin.size()> begin = {};
  VSILFILE* file = is_there(path) ? VSIFOpenL(path.c_str(), "rb") : nullptr;
  if (file == nullptr) return false;
  const std::size_t count = VSIFReadL(begin.data(), 1, begin.size(), file);
  VSIFCloseL(file);
  return std::string_view(begin.data(), count) == kBegin;
}

bool has_trodden_company(const std::string& path) {
  for (const char* end : {".msk", ".ovr"})
    if (is_there(path + end) &&
        trodden_driver(path + end, GDAL_OF_RASTER, kTroddenRasters) == nullptr)
      return false;
  return !is_of_erdas(path + ".aux") && !is_of_erdas(CPLResetExtension(path.c_str(), "aux"));
}

/// seen   what was looked at already: a VRT may name itself, or another many times
bool is_trodden(const std::string& path, int depth, std::set<std::string>& seen) {
  core::throw_if_stop_asked();
  if (!seen.insert(path).second) return true;
  GDALDriverH driver = trodden_driver(path, GDAL_OF_RASTER, kTroddenRasters);
  if (driver == nullptr || !has_trodden_company(path)) return false;
  if (std::string_view(GDALGetDescription(driver)) != "VRT") return true;
  if (depth == kDeepestVrt) return false;
  for (const std::string& name : files_named_by_vrt(path)) {
    // What is not there can do no harm; what has a colon is a part of a file.
    if (name.find(':') == std::string::npos && !is_there(name)) continue;
    if (!is_trodden(name, depth + 1, seen)) return false;
  }
  return true;
}

}  // namespace

bool is_trodden_raster(const std::string& path) {
  std::set<std::string> seen;
  return is_trodden(path, 0, seen);
}

bool is_trodden_vectors(const std::string& path) {
  return trodden_driver(path, GDAL_OF_VECTOR, kTroddenVectors) != nullptr;
}

}  // namespace terracast::tiler
