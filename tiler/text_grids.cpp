#include "tiler/text_grids.h"

#include <cpl_vsi.h>

#include <algorithm>
#include <cstdint>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "core/error.h"
#include "core/stop.h"
#include "tiler/file_memo.h"
#include "tiler/gdal_support.h"
#include "tiler/vrt_sources.h"

namespace terracast::tiler {
namespace {

const char* const kTextGrids[] = {"AAIGrid", "GRASSASCIIGrid", "ISG", "GSAG",
                                  "GXF",     "ZMap",           "XYZ", nullptr};

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
  // Each sample takes a digit and what parts it from the next.
  VSIStatBufL stat;
  if (VSIStatL(dataset.GetDescription(), &stat) == 0 &&
      static_cast<std::uint64_t>(width) > static_cast<std::uint64_t>(stat.st_size))
    core::fail(core::ErrorKind::Input,
               "{}: its head states {} samples a row, which its {} bytes cannot hold", written,
               width, stat.st_size);
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

/// A grid of text from its first row to its last; of another format nothing.
void read_named(const std::string& name, const std::string& written) {
  GdalDatasetPtr grid;
  {
    const GdalErrors quiet;
    if (GDALIdentifyDriverEx(name.c_str(), GDAL_OF_RASTER, kTextGrids, nullptr) != nullptr)
      grid.reset(GDALDataset::Open(name.c_str(), GDAL_OF_RASTER, kTextGrids));
  }
  if (grid && grid->GetRasterCount() > 0) read_rows(*grid, written);
}

/// seen  what was looked at already: a VRT may name itself, or another many times
void read_named_by(const std::string& vrt, const std::string& written, int depth,
                   std::set<std::string>& seen) {
  if (depth == kDeepestVrt) return;
  for (const std::string& name : files_named_by_vrt(vrt)) {
    core::throw_if_stop_asked();
    if (!seen.insert(name).second) continue;
    const std::string named = written + ": " + name;
    if (name.ends_with(".vrt")) {
      read_named_by(name, named, depth + 1, seen);
      continue;
    }
    static FileMemo<bool> whole_ones;
    whole_ones.of(name, [&] {
      read_named(name, named);
      return true;
    });
  }
}

}  // namespace

void read_text_grid_in_order(GDALDataset& dataset, const std::string& written) {
  if (dataset.GetDriver() == nullptr || dataset.GetRasterCount() == 0) return;
  const std::string_view format = dataset.GetDriver()->GetDescription();
  if (is_text_grid(format)) return read_rows(dataset, written);
  // One whose name is its own text is of terrain tiles, which are pictures.
  const std::string name = dataset.GetDescription();
  if (format != "VRT" || name.starts_with('<')) return;
  std::set<std::string> seen{name};
  read_named_by(name, written, 0, seen);
}

}  // namespace terracast::tiler
