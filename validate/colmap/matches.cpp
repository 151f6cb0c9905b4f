#include "validate/colmap/matches.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "validate/readers/sqlite.h"
#include "validate/sampling.h"

namespace terracast::validate {

namespace {

[[noreturn]] void refuse(const std::string& what) {
  throw ColmapFailure("COLMAP's database cannot be read: " + what);
}

/// Calls with each row of a table of blobs: its key, and rows of numbers of 4 bytes, of which the first two count.
template <class Number, class Use>
void each_table(const SqliteDatabase& database, const std::string& sql, Use use) {
  database.each_row(sql, [&](const SqliteRow& row) {
    const std::int64_t rows = row.integer(1), columns = row.integer(2);
    const std::vector<Number> numbers = row.numbers<Number>(3);
    if (rows < 0 || columns < 2 || rows > (std::int64_t{1} << 32) / columns ||
        static_cast<std::size_t>(rows * columns) * sizeof(Number) != row.num_bytes(3))
      refuse(fmt::format("{} x {} numbers are not {} bytes", rows, columns, row.num_bytes(3)));
    use(row.integer(0), static_cast<std::size_t>(columns), numbers);
  });
}

Eigen::Vector3d ray_local(const Shot& shot, const Eigen::Vector2d& pixel) {
  return shot.local_from_camera.rotation * shot.camera->intrinsics.ray_from_pixel(pixel);
}

double angle_rad(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

/// Calls with each match of a pair whose images belong to the job: both keypoints, and the angle of their rays.
template <class Use>
void each_match(const ColmapJob& job, const VerifiedMatches& matches,
                const VerifiedMatches::Pair& pair, Use use) {
  const Shot* const a = job.find(pair.a);
  const Shot* const b = job.find(pair.b);
  if (a == nullptr || b == nullptr) return;
  const auto& keypoints_a = matches.keypoints_px.at(pair.a);
  const auto& keypoints_b = matches.keypoints_px.at(pair.b);
  for (const auto& [i, k] : pair.keypoints)
    use(i, k, angle_rad(ray_local(*a, keypoints_a[i]), ray_local(*b, keypoints_b[k])));
}

}  // namespace

VerifiedMatches read_matches(const std::filesystem::path& file) {
  const auto database = SqliteDatabase::of_file(file, "COLMAP's database");
  VerifiedMatches matches;
  each_table<float>(
      database, "SELECT image_id, rows, cols, data FROM keypoints",
      [&](std::int64_t image, std::size_t columns, const std::vector<float>& numbers) {
        auto& keypoints = matches.keypoints_px[image];
        for (std::size_t at = 0; at < numbers.size(); at += columns)
          keypoints.emplace_back(numbers[at], numbers[at + 1]);
      });
  // COLMAP's number of a pair: the smaller id times so much, and the greater.
  constexpr std::int64_t kPairs = 2147483647;
  each_table<std::uint32_t>(
      database, "SELECT pair_id, rows, cols, data FROM two_view_geometries WHERE rows > 0",
      [&](std::int64_t id, std::size_t columns, const std::vector<std::uint32_t>& numbers) {
        VerifiedMatches::Pair pair{.a = id / kPairs, .b = id % kPairs, .keypoints = {}};
        const std::size_t num_a = matches.keypoints_px[pair.a].size();
        const std::size_t num_b = matches.keypoints_px[pair.b].size();
        for (std::size_t at = 0; at < numbers.size(); at += columns) {
          if (numbers[at] >= num_a || numbers[at + 1] >= num_b)
            refuse("a match is of a keypoint that is none");
          pair.keypoints.emplace_back(numbers[at], numbers[at + 1]);
        }
        matches.pairs.push_back(std::move(pair));
      });
  return matches;
}

std::map<std::int64_t, std::size_t> count_triangulable(const ColmapJob& job,
                                                       const VerifiedMatches& matches) {
  struct Keypoint {
    std::set<std::int64_t> partners;
    bool is_wide = false;
  };
  std::map<std::pair<std::int64_t, std::uint32_t>, Keypoint> keypoints;
  for (const VerifiedMatches::Pair& pair : matches.pairs)
    each_match(job, matches, pair, [&](std::uint32_t i, std::uint32_t k, double angle) {
      const bool is_wide = angle >= radians_from_degrees(kLeastAngle_deg);
      Keypoint& of_a = keypoints[{pair.a, i}];
      Keypoint& of_b = keypoints[{pair.b, k}];
      of_a.partners.insert(pair.b);
      of_b.partners.insert(pair.a);
      of_a.is_wide |= is_wide;
      of_b.is_wide |= is_wide;
    });
  std::map<std::int64_t, std::size_t> counts;
  for (const Shot& shot : job.shots) counts[shot.image_id] = 0;
  for (const auto& [key, keypoint] : keypoints)
    if (keypoint.is_wide && keypoint.partners.size() >= 2) ++counts[key.first];
  return counts;
}

bool can_begin(const ColmapJob& job, const VerifiedMatches& matches) {
  constexpr std::size_t kLeastMatches = 100;
  constexpr double kLeastMedian_deg = 4.0, kMostForward = 0.95;
  for (const VerifiedMatches::Pair& pair : matches.pairs) {
    std::vector<double> angles_rad;
    each_match(job, matches, pair,
               [&](std::uint32_t, std::uint32_t, double angle) { angles_rad.push_back(angle); });
    if (angles_rad.size() < kLeastMatches ||
        median(angles_rad) < radians_from_degrees(kLeastMedian_deg))
      continue;
    const Pose a_from_b =
        job.find(pair.a)->local_from_camera.inverse() * job.find(pair.b)->local_from_camera;
    if (std::abs(a_from_b.translation.normalized().z()) < kMostForward) return true;
  }
  return false;
}

std::map<std::int64_t, std::size_t> count_seen_points(const VerifiedMatches& matches,
                                                      const ColmapModel& model) {
  std::map<std::int64_t, std::set<std::uint32_t>> seen;
  // Of an image of the model its keypoints in their order, each with its point or none.
  const auto has_point = [&](std::int64_t id, std::uint32_t keypoint) {
    const auto image = model.images.find(id);
    return image != model.images.end() && keypoint < image->second.observations.size() &&
           model.points.contains(image->second.observations[keypoint].point_id);
  };
  for (const VerifiedMatches::Pair& pair : matches.pairs)
    for (const auto& [i, k] : pair.keypoints) {
      if (has_point(pair.b, k)) seen[pair.a].insert(i);
      if (has_point(pair.a, i)) seen[pair.b].insert(k);
    }
  std::map<std::int64_t, std::size_t> counts;
  for (const auto& [image, keypoints] : seen) counts[image] = keypoints.size();
  return counts;
}

}  // namespace terracast::validate
