#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "validate/readers/colmap_model.h"

namespace terracast::validate {

/// What COLMAP's database holds before any of its programs has worked with it.
struct ColmapDatabase {
  struct Image {
    std::string name;
    std::int64_t camera_id = 0;
    std::array<double, 3> prior{};  ///< prior_tx to prior_tz
    bool has_rotation = false;      ///< any of prior_qw to prior_qz
  };
  struct PosePrior {
    std::vector<double> position;
    std::int64_t coordinate_system = -1;  ///< 0: WGS84
    std::vector<double> covariance;
  };
  std::map<std::int64_t, ColmapCamera> cameras;
  std::map<std::int64_t, std::int64_t> prior_focal_lengths;  ///< by camera: 0 or 1
  std::map<std::int64_t, Image> images;
  std::map<std::int64_t, PosePrior> pose_priors;
  std::int64_t version = 0;  ///< user_version
  /// Tables with rows beside those, and the highest ids that were given, of cameras and images.
  std::vector<std::string> other_tables;
  std::map<std::string, std::int64_t> highest_ids;
};

/// Reads a database without changing it.
/// name     of the file, for messages
/// throws   Input: no database, or not with COLMAP's tables; Io
ColmapDatabase read_colmap_database(const std::filesystem::path& file, const std::string& name);

}  // namespace terracast::validate
