#include <fmt/format.h>

#include <map>

#include "validate/checks/checker.h"
#include "validate/colmap/features.h"
#include "validate/sampling.h"

/// SIFT points of covisible images, triangulated by COLMAP at the exported poses with the exported
/// intrinsics: where poses, intrinsics or the time of an image are wrong, rays of one place do not
/// meet, or meet beside the surface.
namespace terracast::validate {

namespace fs = std::filesystem;

namespace {

struct Triangulated {
  std::vector<double> errors_px;                      ///< of all observations
  std::map<std::int64_t, std::vector<double>> off_m;  ///< by point: from the surface of each image
  double worst_image_px = 0.0;
  std::string worst_image;
  std::size_t fewest_points = 0;  ///< in an image that shows ground
  std::string fewest_image;
  bool has_depth = false;  ///< of any image
};

/// Distance of a point from the surface that a depth map shows where it projects, m; beyond it
/// positive. The surface is the plane through the depths there: inverse depth is linear on it.
/// returns  nothing where the depth map shows none
std::optional<double> distance_from_surface(const Intrinsics& camera, const core::ImageF& depth,
                                            const Eigen::Vector3d& point_camera) {
  const Eigen::Vector2d pixel = camera.pixel_from_point(point_camera);
  if (!camera.contains(pixel)) return std::nullopt;
  const auto sample = sample_inverse_depth(depth, pixel);
  if (!sample) return std::nullopt;
  const CubicSample& inverse = sample->inverse_depth;
  const Eigen::Vector2d from_centre = pixel - Eigen::Vector2d(camera.cx_px, camera.cy_px);
  // normal . x = 1 on the plane
  const Eigen::Vector3d normal(inverse.gradient.x() * camera.fx_px,
                               inverse.gradient.y() * camera.fy_px,
                               inverse.value - inverse.gradient.dot(from_centre));
  return (normal.dot(point_camera) - 1.0) / normal.norm();
}

void look_at(const ColmapJob& job, const ColmapModel& model, const Shot& shot,
             const ColmapImage& image, Triangulated& found) {
  const Intrinsics& camera = shot.camera->intrinsics;
  const Pose camera_from_local = shot.local_from_camera.inverse();
  const core::ImageF depth = job.depth(shot);
  found.has_depth |= !depth.empty();
  std::vector<double> errors_px;
  for (const ColmapObservation& seen : image.observations) {
    const auto point = model.points.find(seen.point_id);
    if (point == model.points.end()) continue;
    const auto& p = point->second.position;
    const Eigen::Vector3d point_camera = camera_from_local * Eigen::Vector3d(p[0], p[1], p[2]);
    if (point_camera.z() <= 0.0) {
      errors_px.push_back(1e9);
      continue;
    }
    errors_px.push_back(
        (camera.pixel_from_point(point_camera) - Eigen::Vector2d(seen.x_px, seen.y_px)).norm());
    if (depth.empty()) continue;
    if (const auto off_m = distance_from_surface(camera, depth, point_camera))
      found.off_m[seen.point_id].push_back(*off_m);
  }
  if (shows_ground(depth) &&
      (found.fewest_image.empty() || errors_px.size() < found.fewest_points)) {
    found.fewest_points = errors_px.size();
    found.fewest_image = shot.name;
  }
  if (errors_px.empty()) return;
  found.errors_px.insert(found.errors_px.end(), errors_px.begin(), errors_px.end());
  const double middle_px = median(errors_px);
  if (middle_px <= found.worst_image_px) return;
  found.worst_image_px = middle_px;
  found.worst_image = shot.name;
}

double mean(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) sum += value;
  return values.empty() ? 1e9 : sum / static_cast<double>(values.size());
}

}  // namespace

std::vector<CheckResult> run_colmap_sparse(const ColmapJob& job) {
  const MatchedDatabase database = matched_database(job);
  const fs::path exported = job.folder() / "sparse/0";
  const ColmapCommand triangulator{
      "point_triangulator",
      {"--clear_points", "1", "--Mapper.num_threads", "1", "--Mapper.ba_refine_focal_length", "0",
       "--Mapper.ba_refine_principal_point", "0", "--Mapper.ba_refine_extra_params", "0"}};
  const std::string key =
      database.key + triangulator.key() +
      files_key({exported / "cameras.bin", exported / "images.bin", exported / "points3D.bin"});
  const fs::path made = job.work.made("sparse", key, [&](const fs::path& folder) {
    job.log.info("colmap: triangulating at the known poses");
    job.program.run(
        triangulator,
        {"--database_path", database.file.string(), "--image_path", job.images().string(),
         "--input_path", exported.string(), "--output_path", folder.string()},
        "sparse.log", 600.0 + 30.0 * static_cast<double>(job.shots.size()));
  });
  const ColmapModel model = read_made_model(made);

  Triangulated found;
  for (const Shot& shot : job.shots) {
    const auto image = model.images.find(shot.image_id);
    if (image != model.images.end() && image->second.name == shot.name)
      look_at(job, model, shot, image->second, found);
  }
  std::vector<double> off_m, distances_m;
  for (auto& [id, distances] : found.off_m) {
    off_m.push_back(median(distances));
    distances_m.push_back(std::abs(off_m.back()));
  }
  const double pixel_m = job.ground_pixel_m();
  const std::string what =
      fmt::format("{} points, {} observations of {} images, {} pairs matched", model.points.size(),
                  found.errors_px.size(), job.shots.size(), database.num_pairs);

  CheckResult reprojection =
      colmap_result("colmap_sparse_reprojection", mean(found.errors_px), 0.3, "px");
  reprojection.worst = fmt::format("{}: median {:.3f} px", found.worst_image, found.worst_image_px);
  reprojection.summary =
      "Mean distance of SIFT keypoints from the projection of their triangulated point: " + what +
      ".";
  reprojection.reason = "SIFT finds a place within 0.2 px; poses and cameras add nothing to it.";
  reprojection.detects = "a frame of time; rays of one place that do not meet";

  CheckResult coverage;
  coverage.name = "colmap_sparse_points";
  coverage.is_lower_bound = true;
  coverage.value = static_cast<double>(found.fewest_points);
  coverage.bound = 50.0;
  coverage.unit = "points (at least)";
  coverage.ok = coverage.is_within_bound();
  coverage.worst = found.fewest_image;
  coverage.summary = "Fewest triangulated points in an image with 30 % ground.";
  coverage.reason = "An image with fewer says nothing about its pose.";
  coverage.detects = "an image whose pose lets no rays meet";
  if (found.fewest_image.empty())
    coverage =
        unseen_result("colmap_sparse_points", found.has_depth ? "no image shows 30 % ground"
                                                              : "the dataset holds no depth maps");
  if (distances_m.empty()) {
    const char* why = found.has_depth ? "no point lies where a depth map shows ground"
                                      : "the dataset holds no depth maps";
    return {reprojection, unseen_result("colmap_sparse_distance", why),
            unseen_result("colmap_sparse_offset", why), coverage};
  }

  CheckResult distance =
      colmap_result("colmap_sparse_distance", median(distances_m) / pixel_m, 1.0, "ground pixels");
  distance.summary = fmt::format(
      "Median distance of {} triangulated points from the surface of the depth maps; a ground "
      "pixel is {:.3f} m.",
      distances_m.size(), pixel_m);
  CheckResult offset = colmap_result("colmap_sparse_offset", std::abs(median(off_m)) / pixel_m, 0.1,
                                     "ground pixels");
  offset.summary =
      fmt::format("Median of the same with its sign: the points lie {:.4f} m {} the surface.",
                  std::abs(median(off_m)), median(off_m) > 0.0 ? "behind" : "before");
  distance.reason =
      "Rays that meet under 10 degrees carry 0.2 px to about half a ground pixel of depth.";
  distance.detects = "poses that put the points beside the ground";
  offset.reason =
      "SIFT errs to both sides alike; what moves all points at once is an error of cameras or "
      "poses.";
  offset.detects = "a focal length off by 0.2 %";
  return {reprojection, distance, offset, coverage};
}

}  // namespace terracast::validate
