#pragma once

#include <gdal_priv.h>

#include <string>

namespace terracast::tiler {

/// Reads the rows of a grid of text from the first to the last, once. Such a file has no places of rows: GDAL's
/// drivers look for a row by reading those before it, and for one behind the file's end again and again, twice as
/// often for each row that is missing. In order, each row is found at once.
/// dataset   of a VRT those grids of text that it names are read; one of another format is not
/// written   the file, for messages
/// cost      of reading the file once; of those that a VRT names, once in a process for as long as they stay as they are
/// threads   safe for datasets of their own
/// throws    Input: the file ends before its last row, or a row cannot be read; Interrupted: a stop was asked for
void read_text_grid_in_order(GDALDataset& dataset, const std::string& written);

}  // namespace terracast::tiler
