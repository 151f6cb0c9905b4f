#pragma once

#include <gdal_priv.h>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "core/schema.h"

namespace terracast::tiler {

/// Keeps GDAL quiet on this thread, and what it says for our messages.
class GdalErrors {
 public:
  GdalErrors();
  ~GdalErrors();
  GdalErrors(const GdalErrors&) = delete;
  GdalErrors& operator=(const GdalErrors&) = delete;

  std::string text() const;
  /// Its words alone; "": none.
  const std::string& said() const { return text_; }
  /// Whether it said that something failed, and not only warned.
  bool has_failure() const { return has_failure_; }
  bool has_lacked_memory() const { return has_lacked_memory_; }

 private:
  static void CPL_STDCALL collect(CPLErr level, CPLErrorNum number, const char* message);
  std::string text_;
  bool has_failure_ = false;
  bool has_lacked_memory_ = false;
};

struct GdalDatasetCloser {
  void operator()(GDALDataset* dataset) const { GDALClose(dataset); }
};
using GdalDatasetPtr = std::unique_ptr<GDALDataset, GdalDatasetCloser>;

/// Where GDAL finds a file: a member of an archive when it is the only one. (GDAL's own driver
/// opens .hgt.zip.)
/// throws   Input: an archive of none or several, or of 0 bytes
std::string gdal_path(const core::Path& file);

/// Opens what gdal_path() gives, or a folder of terrain tiles, by the formats of gdal_formats.h; of those that are not
/// trodden it is a process of its own that reads the file (tiler/apart). An archive that unpacks to
/// over a hundred times its size is not opened, nor what is no file, such as /vsicurl/ and /vsigzip/, neither here nor where
/// a VRT names it (whose files that cannot be opened fail here, or when they are read).
/// throws   Io: no such file; Input: an empty file, a pipe or a device, no raster, one of those, a grid of text that ends
///          too early; as core::read_apart()
GdalDatasetPtr open_gdal_raster(const core::Path& file, const GdalErrors& errors);

/// Opens what gdal_path() gives as features. Formats that only lead to other files or to servers (VRT,
/// WFS, …) are not opened, nor what open_gdal_raster() does not open.
/// throws   Io: no such file; Input: an empty file, a pipe or a device, no features, or one of those; as core::read_apart()
GdalDatasetPtr open_gdal_vectors(const core::Path& file, const GdalErrors& errors);

/// The same by all formats, in this process: for one that reads apart (register_all_gdal()).
GdalDatasetPtr open_raster_here(const core::Path& file, const GdalErrors& errors);
GdalDatasetPtr open_vectors_here(const core::Path& file, const GdalErrors& errors);

/// Files that an opened dataset is read from, whatever their folder: the file, an archive, those beside it that belong to
/// it (.dbf, .prj, .msk, …), the tiles of a folder, and what a VRT names, VRTs in it too. What other programs note beside
/// a raster (.aux.xml) is not among them: what it says of places and values is for the caller to take up. Sorted.
std::vector<std::string> files_of(GDALDataset& dataset, const core::Path& file);

/// The file of a path that GDAL knows, or the archive that holds it; of one that is not there the nearest folder.
std::filesystem::path plain_file(const std::string& gdal_path);

/// Of the bytes of files_of(), and of gdal_identity().
/// cost     reads them once
/// throws   Io: a file that cannot be read
std::string content_hash_of(GDALDataset& dataset, const core::Path& file);

}  // namespace terracast::tiler
