#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "tests/support/expect_error.h"
#include "tests/support/tiny_capture.h"

/// What tests of captured sequences share.
namespace terracast::test {

/// Two frames of four small cameras.
inline const TinyCaptureOptions kSmall{.num_frames = 2, .has_tartan2 = false};

/// The content hash of each file below a folder, by relative path.
std::map<std::string, std::string> hashes(const std::filesystem::path& folder);

/// The first occurrence; the test fails where there is none.
void replace_in(const std::filesystem::path& file, const std::string& from, const std::string& to);

}  // namespace terracast::test
