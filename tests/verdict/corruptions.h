#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

/// Mistakes in exported datasets of any format and content, which their own files alone are enough to make.
namespace terracast::test {

struct Corruption {
  std::string name;
  /// Corrupts a dataset in place.
  /// returns  false where its files hold nothing of the kind, or nothing that it would change
  bool (*corrupt)(const std::filesystem::path& folder, std::uint64_t seed);
  /// Checks that are for it; where the dataset could not show it, one of them is unseen.
  std::vector<std::string> checks;
};

const std::vector<Corruption>& corruptions();

}  // namespace terracast::test
