#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "core/error.h"
#include "tests/support/tiny_capture.h"

/// What tests of captured sequences share.
namespace terracast::test {

/// Two frames of four small cameras.
inline const TinyCaptureOptions kSmall{.num_frames = 2, .has_tartan2 = false};

/// The content hash of each file below a folder, by relative path.
std::map<std::string, std::string> hashes(const std::filesystem::path& folder);

/// `work` throws an error of a kind, whose text has some words in it.
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

/// The first occurrence; the test fails where there is none.
void replace_in(const std::filesystem::path& file, const std::string& from, const std::string& to);

}  // namespace terracast::test
