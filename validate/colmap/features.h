#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "validate/colmap/job.h"

namespace terracast::validate {

/// Pairs of images (indices into the job's shots) that see the same ground: by the tracks of the
/// exported points. Of each image those partners with which it shares most, those with which it
/// shares most under an angle that triangulates well, and of its own camera those with which it shares most.
std::vector<std::pair<std::size_t, std::size_t>> covisible_pairs(const ColmapJob& job);

/// Why a job without such pairs shows nothing.
inline constexpr const char* kNoPairs = "no two images of the model see the same ten points";

/// A database with SIFT features and verified matches of the covisible pairs, grown from the
/// exported database.db.
struct MatchedDatabase {
  std::filesystem::path file;
  std::string key;  ///< of all that it was made from
  std::size_t num_pairs = 0;
};
/// throws  ColmapFailure; Io
MatchedDatabase matched_database(const ColmapJob& job);

/// Content hash of some files.
std::string files_key(const std::vector<std::filesystem::path>& files);

/// A sparse model that COLMAP wrote: cameras, images and points, whatever else there is.
/// throws  ColmapFailure: damaged, or empty where it may not be
enum class MayBeEmpty { No, Yes };
ColmapModel read_made_model(const std::filesystem::path& folder,
                            MayBeEmpty may_be_empty = MayBeEmpty::No);

/// Keypoints of SIFT that err by more in a coordinate err by something else.
inline constexpr double kMostKeypointNoise_px = 0.3;

}  // namespace terracast::validate
