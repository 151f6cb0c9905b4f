#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "validate/evaluate/task.h"

/// The true clouds of points.
namespace terracast::validate {

/// Whether `--truth` names a cloud, not a dataset.
bool is_cloud_file(const std::filesystem::path& truth);

/// A dataset whose only sequence is a cloud's file.
Dataset dataset_of_cloud(const std::filesystem::path& file);

struct TrueCloud {
  std::vector<Eigen::Vector3d> points;  ///< of a dataset in the sequence's local frame
  /// Where not all pixels are points: pixels drawn at random from all, 100 000 at most.
  std::vector<Eigen::Vector3d> left_out = {};
  std::vector<std::string> notes = {};
};
/// The file's points, or those that the pixels of a camera's depth images show: of every `n`-th row and
/// column, so that they are at most `most_pixels`.
/// max_depth_m  exclusive; 0: no limit
TrueCloud true_cloud(const Subject& subject, double max_depth_m,
                     std::int64_t most_pixels = 2'000'000);

}  // namespace terracast::validate
