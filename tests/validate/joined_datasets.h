#pragma once

#include <filesystem>

#include "core/json.h"
#include "tests/validate/analytic_dataset.h"

namespace terracast::test {

/// Moves the one sequence of `second` into `first`, under the name "other".
inline void join_datasets(const std::filesystem::path& first, const std::filesystem::path& second) {
  std::filesystem::rename(second / "flight", first / "other");
  core::Json json = core::Json::read(first / "dataset.json");
  core::Json other = core::Json::read(second / "dataset.json").at("sequences").at(0);
  other.set("name", "other").set("path", "other").set("georeference", "other/georeference.csv");
  core::Json sequences = json.at("sequences");
  json.set("sequences", sequences.push(other));
  json.write(first / "dataset.json");
  list_files_again(first);
}

}  // namespace terracast::test
