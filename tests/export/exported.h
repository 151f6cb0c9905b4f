#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "core/context.h"
#include "core/error.h"
#include "core/hash.h"
#include "core/log.h"
#include "core/toml_reader.h"
#include "export/exporter.h"
#include "tests/support/test_data.h"
#include "tests/support/tiny_capture.h"

namespace terracast::test {

/// An `[[exports]]` as a config gives it.
inline exporters::ExportOptions export_options(const std::string& toml) {
  exporters::ExportOptions options;
  core::TomlDocument::parse(toml, "test.toml").read(options);
  return options;
}

/// All sequences of a capture, whatever their config.
inline std::vector<capture::SequenceReader> open_all(const std::filesystem::path& capture) {
  std::vector<capture::SequenceReader> sequences;
  for (const std::filesystem::path& folder : capture::list_sequences(capture))
    sequences.push_back(capture::SequenceReader::open(folder));
  return sequences;
}

inline void run_export(const std::filesystem::path& capture, const std::string& toml,
                       const std::filesystem::path& out, int num_threads = 0) {
  const core::Log log("export", core::LogLevel::Off);
  exporters::run_export_stage(open_all(capture), {export_options(toml)}, out,
                              {.log = log, .num_threads = num_threads});
}

/// Every file of a folder with the hash of its content.
inline std::map<std::string, std::string> file_hashes(const std::filesystem::path& folder) {
  std::map<std::string, std::string> hashes;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder))
    if (entry.is_regular_file())
      hashes[std::filesystem::relative(entry.path(), folder).string()] =
          core::content_hash_of_file(entry.path());
  return hashes;
}

template <class Work>
void expect_error(core::ErrorKind kind, const std::vector<std::string>& words, Work&& work) {
  try {
    work();
    ADD_FAILURE() << "no error";
  } catch (const core::Error& error) {
    EXPECT_EQ(error.kind(), kind) << error.what();
    for (const std::string& word : words) EXPECT_THAT(error.what(), testing::HasSubstr(word));
  }
}

}  // namespace terracast::test
