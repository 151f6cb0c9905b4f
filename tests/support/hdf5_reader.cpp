#include "tests/support/hdf5_reader.h"

#include "core/error.h"
#include "tests/support/run_program.h"

namespace terracast::test {

core::Json read_hdf5(const std::filesystem::path& file) {
  const ProgramResult read = run_command(
      TERRACAST_BAG_NODE,
      {TERRACAST_SOURCE_DIR "/tests/hdf5/read_h5.mjs", TERRACAST_HDF5_PACKAGES, file.string()});
  if (read.status != 0)
    core::fail(core::ErrorKind::Input, "{}: {}", file.string(), read.output.substr(0, 2000));
  return core::Json::parse(read.output, file.string());
}

}  // namespace terracast::test
