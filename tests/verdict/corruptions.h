#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "tests/jobs/draws.h"

/// Mistakes in exported datasets of any format and content, which their own files alone are enough to make.
namespace terracast::test {

struct Corruption {
  std::string name;
  std::string unit;  ///< of its size; empty: it has none
  double least = 0.0, most = 0.0;
  /// Corrupts a dataset in place.
  /// size     in the unit
  /// returns  false where its files hold nothing of the kind, or nothing that it would change
  bool (*corrupt)(const std::filesystem::path& folder, Draws& draws, double size);
  /// Results in the unit, which say from what size on they see it; of a mistake without a size none.
  std::vector<std::string> measures;
  /// Checks that are for it; where the dataset could not show it, one of them is unseen.
  std::vector<std::string> checks;
  std::vector<std::string> causes;  ///< names of what it may be called
};

const std::vector<Corruption>& corruptions();

}  // namespace terracast::test
