#include "cli/apart_readers.h"

#include <array>

#include "tiler/apart/apart_readers.h"
#include "world/vdb/vdb_file.h"

namespace terracast::cli {

std::span<const core::ApartReader> apart_readers() {
  static constexpr std::array kReaders = {
      core::ApartReader{"features", &tiler::read_features_request},
      core::ApartReader{"raster", &tiler::read_raster_request},
      core::ApartReader{"vdb", &world::read_vdb_request}};
  return kReaders;
}

}  // namespace terracast::cli
