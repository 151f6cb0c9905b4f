#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "rigs/rig_file.h"

namespace terracast::rigs {

/// The rig files that come with terracast.
inline std::vector<std::filesystem::path> shipped_rigs() {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(
           std::filesystem::path(TERRACAST_SOURCE_DIR) / "configs/rigs"))
    if (entry.path().extension() == ".toml") files.push_back(entry.path());  // not tables of rays
  std::sort(files.begin(), files.end());
  return files;
}

inline rigs::RigOptions shipped_rig(const std::string& name) {
  return read_rig(std::filesystem::path(TERRACAST_SOURCE_DIR) / "configs/rigs" / (name + ".toml"));
}

/// A folder of a test's own, empty.
inline std::filesystem::path test_folder(const std::string& name) {
  const std::filesystem::path folder = std::filesystem::path(testing::TempDir()) / ("rigs_" + name);
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  return folder;
}

}  // namespace terracast::rigs
