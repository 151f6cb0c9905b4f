#pragma once

#include <cpl_string.h>
#include <gdal_priv.h>

#include <string>

#include "tiler/apart/crs_form.h"

namespace terracast::tiler {

/// A dataset that a process of its own has read.
class GivenDataset : public GDALDataset {
 public:
  GivenDataset(const std::string& format, const FileNames& files) : files_(files) {
    poDriver = driver_named(format);
  }

  /// All of them, those that a VRT names at any depth too.
  char** GetFileList() override {
    char** list = nullptr;
    for (const std::string& file : files_) list = CSLAddString(list, file.c_str());
    return list;
  }

 private:
  FileNames files_;
};

}  // namespace terracast::tiler
