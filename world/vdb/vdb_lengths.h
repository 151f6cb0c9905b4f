#pragma once

#include <filesystem>

namespace terracast::world {

/// Looks at what a file of OpenVDB states of its texts and metadata before anything is read by it: OpenVDB makes room
/// for as much as is stated. Of files whose grids follow each other without offsets the first grid's alone is seen
/// here; of others 4 GiB may be made room for, until its end is met.
/// throws   Io: a file that cannot be opened; Input: a text or a value longer than the rest of the file; more grids
///          than bytes; written before 2013 (format 222); no OpenVDB file
void check_vdb_lengths(const std::filesystem::path& file);

}  // namespace terracast::world
