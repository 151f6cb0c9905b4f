#include "tiler/text_grids.h"

#include <cpl_string.h>

#include <algorithm>
#include <string_view>
#include <vector>

#include "core/error.h"
#include "core/stop.h"
#include "tiler/gdal_support.h"

namespace terracast::tiler {
namespace {

const char* const kTextGrids[] = {"AAIGrid", "GRASSASCIIGrid", "ISG", "GSAG",
                                  "GXF",     "ZMap",           "XYZ", nullptr};
const char* const kTextGridsAndVrts[] = {
    "AAIGrid", "GRASSASCIIGrid", "ISG", "GSAG", "GXF", "ZMap", "XYZ", "VRT", nullptr};

bool is_text_grid(std::string_view format) {
  for (const char* const* name = kTextGrids; *name != nullptr; ++name)
    if (format == *name) return true;
  return false;
}

void read_rows(GDALDataset& dataset, const std::string& written) {
  GDALRasterBand& band = *dataset.GetRasterBand(1);
  int block_width = 0, block_height = 0;
  band.GetBlockSize(&block_width, &block_height);
  const int width = dataset.GetRasterXSize();
  const int num_rows = dataset.GetRasterYSize();
  // Surfer's begin in the south.
  const bool is_upwards = std::string_view(dataset.GetDriver()->GetDescription()) == "GSAG";
  std::vector<double> row(static_cast<std::size_t>(width));
  for (int done = 0; done < num_rows; done += std::max(block_height, 1)) {
    core::throw_if_stop_asked();
    const GdalErrors errors;
    const int at = is_upwards ? num_rows - 1 - done : done;
    if (band.RasterIO(GF_Read, 0, at, width, 1, row.data(), width, 1, GDT_Float64, 0, 0, nullptr) !=
        CE_None)
      core::fail(core::ErrorKind::Input,
                 "{}: its samples cannot be read from row {} of {} in the file on; is it "
                 "truncated? Fetch or write "
                 "it again ({})",
                 written, done + 1, num_rows, errors.text());
  }
}

void read_in_order(GDALDataset& dataset, const std::string& written, int depth) {
  if (dataset.GetDriver() == nullptr || dataset.GetRasterCount() == 0) return;
  const std::string_view format = dataset.GetDriver()->GetDescription();
  if (is_text_grid(format)) return read_rows(dataset, written);
  constexpr int kDeepest = 16;  // of VRTs in VRTs; GDAL refuses one that names itself
  if (format != "VRT" || depth == kDeepest) return;
  const auto list = [&] {
    const GdalErrors quiet;
    return dataset.GetFileList();
  };
  const CPLStringList files(list(), TRUE);
  for (int i = 0; i < files.Count(); ++i) {
    if (std::string_view(files[i]) == dataset.GetDescription()) continue;
    const GdalErrors quiet;
    const GdalDatasetPtr inner(GDALDataset::Open(files[i], GDAL_OF_RASTER, kTextGridsAndVrts));
    if (inner) read_in_order(*inner, written + ": " + files[i], depth + 1);
  }
}

}  // namespace

void read_text_grid_in_order(GDALDataset& dataset, const std::string& written) {
  if (dataset.GetDriver() == nullptr) return;
  const std::string_view format = dataset.GetDriver()->GetDescription();
  if (format != "VRT") return read_in_order(dataset, written, 0);
  const std::string name = dataset.GetDescription();
  if (name.starts_with('<')) return;  // of terrain tiles, which are no text
  // Listed by another one: GDAL says only once of a dataset why it could not open what that names.
  GdalDatasetPtr copy;
  {
    const GdalErrors quiet;
    copy.reset(GDALDataset::Open(name.c_str(), GDAL_OF_RASTER, kTextGridsAndVrts));
  }
  if (copy) read_in_order(*copy, written, 0);
}

}  // namespace terracast::tiler
