#include "tests/fuzz/small_dataset.h"

#include "core/atomic_file.h"
#include "core/log.h"
#include "core/toml_reader.h"
#include "export/exporter.h"
#include "tests/fuzz/scratch.h"
#include "tests/support/tiny_capture.h"

namespace terracast::fuzz {

namespace fs = std::filesystem;

SmallDataset::SmallDataset(const std::string& format)
    : folder_(scratch_folder("dataset_" + format) / format) {
  const fs::path capture = scratch_folder("capture_" + format);
  test::write_tiny_capture(capture, {.num_frames = 2,
                                     .has_tartan2 = format == "tartanair",
                                     .has_mcs4 = !format.starts_with("tartanair"),
                                     .has_tartan_v1 = format == "tartanair_v1",
                                     .has_sensor = !format.starts_with("tartanair")});
  const core::Log log("fuzz", core::LogLevel::Off);
  exporters::ExportOptions options;
  core::TomlDocument::parse("format = \"" + format + "\"", "fuzz.toml").read(options);
  std::vector<capture::SequenceReader> sequences;
  for (const fs::path& one : capture::list_sequences(capture))
    sequences.push_back(capture::SequenceReader::open(one));
  exporters::run_export_stage(sequences, {options}, folder_.parent_path(),
                              {.log = log, .num_threads = 1, .events_file = {}});
  for (const auto& entry : fs::recursive_directory_iterator(folder_))
    if (entry.is_regular_file())
      files_[fs::relative(entry.path(), folder_).string()] =
          core::read_file(entry.path(), std::size_t{1} << 24);
}

}  // namespace terracast::fuzz
