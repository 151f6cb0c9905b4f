#include "tiler/gdal_support.h"

#include <cpl_error.h>
#include <cpl_vsi.h>

#include <mutex>
#include <vector>

#include "core/error.h"
#include "tiler/terrain_tiles_source.h"

namespace terracast::tiler {

using core::ErrorKind;
using core::fail;

GdalErrors::GdalErrors() { CPLPushErrorHandlerEx(&GdalErrors::collect, this); }
GdalErrors::~GdalErrors() { CPLPopErrorHandler(); }

std::string GdalErrors::text() const {
  return text_.empty() ? "GDAL gives no reason" : "GDAL: " + text_;
}

void CPL_STDCALL GdalErrors::collect(CPLErr level, CPLErrorNum, const char* message) {
  if (level < CE_Warning) return;
  auto* self = static_cast<GdalErrors*>(CPLGetErrorHandlerUserData());
  if (self->text_.size() < 400)
    self->text_ += (self->text_.empty() ? "" : "; ") + std::string(message);
}

namespace {

void register_drivers() {
  static std::once_flag once;
  std::call_once(once, [] { GDALAllRegister(); });
}

/// The one file of an archive, as GDAL finds it.
std::string only_member(const std::string& archive, const std::string& written) {
  const std::string folder = "/vsizip/" + archive;
  char** entries = VSIReadDir(folder.c_str());
  std::vector<std::string> files;
  for (int i = 0; entries != nullptr && entries[i] != nullptr; ++i) {
    VSIStatBufL status;
    const std::string member = folder + "/" + entries[i];
    if (VSIStatL(member.c_str(), &status) == 0 && VSI_ISDIR(status.st_mode) == 0)
      files.push_back(member);
  }
  CSLDestroy(entries);
  if (files.size() != 1)
    fail(ErrorKind::Input,
         "{}: holds {} files beside its folders; name one as /vsizip/{}/MEMBER (is it damaged, if "
         "there should be one?)",
         written, files.size(), written);
  return files.front();
}

}  // namespace

std::string gdal_path(const core::Path& file) {
  const std::string path = file.resolved.empty() ? file.written : file.resolved.string();
  VSIStatBufL status;
  const bool is_archive = path.ends_with(".zip") && !path.ends_with(".hgt.zip") &&
                          !path.starts_with("/vsi") && VSIStatL(path.c_str(), &status) == 0;
  return is_archive ? only_member(path, file.written) : path;
}

GdalDatasetPtr open_gdal_raster(const core::Path& file, const GdalErrors& errors) {
  register_drivers();
  const std::string path = gdal_path(file);
  VSIStatBufL status;
  if (VSIStatL(path.c_str(), &status) != 0)
    fail(ErrorKind::Io, "{}: there is no such raster; give the path of a file that GDAL opens",
         file.written);
  const bool is_folder = VSI_ISDIR(status.st_mode) != 0 && !path.starts_with("/vsi");
  const std::string what = is_folder ? vrt_of_terrain_tiles(path, file.written) : path;
  GdalDatasetPtr dataset(GDALDataset::Open(what.c_str(), GDAL_OF_RASTER | GDAL_OF_VERBOSE_ERROR));
  if (!dataset)
    fail(ErrorKind::Input, "{}: cannot be opened as a raster; is it damaged or truncated? ({})",
         file.written, errors.text());
  return dataset;
}

}  // namespace terracast::tiler
