#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <utility>
#include <vector>

#include "validate/colmap/job.h"

/// What COLMAP's own database says that images share, before any reconstruction: what can be asked of one.
namespace terracast::validate {

/// Keypoints of images, and those pairs of them that agree with some geometry of two views.
struct VerifiedMatches {
  struct Pair {
    std::int64_t a = 0, b = 0;  ///< ids of images
    std::vector<std::pair<std::uint32_t, std::uint32_t>> keypoints;
  };
  std::map<std::int64_t, std::vector<Eigen::Vector2d>> keypoints_px;
  std::vector<Pair> pairs;
};

/// throws  Input: no database, or not with COLMAP's tables; ColmapFailure: one that contradicts itself
VerifiedMatches read_matches(const std::filesystem::path& file);

/// Of each image of the job the keypoints that a triangulation at the known poses makes points of, if poses and
/// cameras are right: those with matches in two other images or more, of which one sees the place under an angle of
/// kLeastAngle_deg or more. COLMAP asks for 1.5 degrees, and takes no tracks of two views.
std::map<std::int64_t, std::size_t> count_triangulable(const ColmapJob& job,
                                                       const VerifiedMatches& matches);
inline constexpr double kLeastAngle_deg = 3.0;

/// Whether two images are such that a reconstruction can begin with them: 100 matches that are seen under 4 degrees or
/// more in the median, and not along the way between the cameras, as COLMAP asks for.
bool can_begin(const ColmapJob& job, const VerifiedMatches& matches);

/// Of each image the keypoints with a match that has a point in a model: what a pose of it can be had from.
std::map<std::int64_t, std::size_t> count_seen_points(const VerifiedMatches& matches,
                                                      const ColmapModel& model);

}  // namespace terracast::validate
