#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "core/error.h"
#include "export/exporter.h"
#include "tests/support/expect_error.h"
#include "tests/support/test_data.h"
#include "tests/support/tiny_capture.h"

namespace terracast::test {

/// An `[[exports]]` as a config gives it.
exporters::ExportOptions export_options(const std::string& toml);

/// All sequences of a capture, whatever their config.
std::vector<capture::SequenceReader> open_all(const std::filesystem::path& capture);

void run_export(const std::filesystem::path& capture, const std::string& toml,
                const std::filesystem::path& out, int num_threads = 0);

/// Every file of a folder with the hash of its content.
std::map<std::string, std::string> file_hashes(const std::filesystem::path& folder);

}  // namespace terracast::test
