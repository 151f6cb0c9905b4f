#include <fmt/format.h>

#include <array>
#include <cmath>
#include <map>
#include <numbers>

#include "validate/checks/checker.h"
#include "validate/colmap/features.h"
#include "validate/colmap/matches.h"
#include "validate/colmap/model_bundle.h"
#include "validate/null_distribution.h"
#include "validate/sampling.h"

/// SIFT points of covisible images, triangulated by COLMAP at the exported poses with the exported
/// intrinsics: where poses, intrinsics or the time of an image are wrong, rays of one place do not
/// meet, or meet beside the surface. How far a right dataset's may be off follows from what the known
/// geometry makes of the keypoints' own noise.
namespace terracast::validate {

namespace fs = std::filesystem;

namespace {

/// A triangulated point that depth maps show.
struct OnSurface {
  std::vector<double> off_m;     ///< from the surface of each image; beyond it positive
  std::vector<double> relative;  ///< the same along the ray, of the depth
  double depth_m = 0.0;          ///< of the surface along its normal, in the first of them
  Eigen::Vector3d normal_local;  ///< of the surface in the first of them
};

struct Surface {
  double off_m = 0.0;
  double relative = 0.0;
  double depth_m = 0.0;
  Eigen::Vector3d normal_camera;
};

/// Distance of a point from the surface that a depth map shows where it projects: the plane through the depths there,
/// on which inverse depth is linear.
/// returns  nothing where the depth map shows none
std::optional<Surface> surface_at(const Intrinsics& camera, const core::ImageF& depth,
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
  const double relative = normal.dot(point_camera) - 1.0;
  return Surface{.off_m = relative / normal.norm(),
                 .relative = relative,
                 .depth_m = 1.0 / normal.norm(),
                 .normal_camera = normal.normalized()};
}

struct Surfaces {
  std::map<std::int64_t, OnSurface> by_point;
  bool has_depth = false;  ///< of any image
};

void look_at(const ColmapJob& job, const ColmapModel& model, const Placed& placed,
             Surfaces& surfaces) {
  const Shot& shot = *placed.shot;
  const core::ImageF depth = job.depth(shot);
  surfaces.has_depth |= !depth.empty();
  if (depth.empty()) return;
  const Intrinsics& camera = shot.camera->intrinsics;
  const Pose camera_from_local = shot.local_from_camera.inverse();
  for (const ColmapObservation& seen : placed.image->observations) {
    const auto point = model.points.find(seen.point_id);
    if (point == model.points.end()) continue;
    const auto& p = point->second.position;
    const Eigen::Vector3d point_camera = camera_from_local * Eigen::Vector3d(p[0], p[1], p[2]);
    if (point_camera.z() <= 0.0) continue;
    const auto surface = surface_at(camera, depth, point_camera);
    if (!surface) continue;
    OnSurface& on = surfaces.by_point[seen.point_id];
    if (on.off_m.empty()) {
      on.normal_local = shot.local_from_camera.rotation * surface->normal_camera;
      on.depth_m = surface->depth_m;
    }
    on.relative.push_back(surface->relative);
    on.off_m.push_back(surface->off_m);
  }
}

/// Keypoints of an image that have to be triangulable, for it to be judged.
constexpr std::size_t kLeastKeypoints = 50;

/// By image, the keypoints that can be triangulated.
using Triangulable = std::map<std::int64_t, std::size_t>;

std::size_t num_told(const Triangulable& triangulable) {
  return static_cast<std::size_t>(
      std::count_if(triangulable.begin(), triangulable.end(),
                    [](const auto& one) { return one.second >= kLeastKeypoints; }));
}

/// Of each image, what could be triangulated and what was.
CheckResult points_result(const ColmapJob& job, const Triangulable& triangulable,
                          const ColmapModel& model) {
  // Verified matches agree with some geometry of their two images; of wrong ones, along the epipolar lines, some few are
  // left; at right poses nearly all become points. Half is asked for.
  constexpr double kShare = 0.5;
  CheckResult result = colmap_result("colmap_sparse_points", 1.0, kShare, "share (at least)");
  result.is_lower_bound = true;
  double least_used = std::numeric_limits<double>::infinity();
  for (const auto& [id, num_keypoints] : triangulable) {
    if (num_keypoints < kLeastKeypoints) continue;
    const auto image = model.images.find(id);
    const auto num_points =
        image == model.images.end()
            ? 0
            : std::count_if(image->second.observations.begin(), image->second.observations.end(),
                            [&](const auto& seen) { return model.points.contains(seen.point_id); });
    const auto total = static_cast<std::int64_t>(num_keypoints);
    const double bound =
        static_cast<double>(
            total - binomial_quantile(kFalseVerdict / static_cast<double>(num_told(triangulable)),
                                      total, kShare)) /
        static_cast<double>(total);
    const double share =
        std::min(1.0, static_cast<double>(num_points) / static_cast<double>(total));
    if (share / bound >= least_used) continue;
    least_used = share / bound;
    result.value = share;
    result.bound = bound;
    result.worst =
        fmt::format("{}: {} points of {} keypoints", job.find(id)->name, num_points, total);
  }
  result.ok = result.is_within_bound();
  result.summary = fmt::format(
      "Least share of an image's keypoints with matches in two other images or more, seen under {} "
      "degrees or more, that were triangulated; {} of {} images have {} of them.",
      kLeastAngle_deg, num_told(triangulable), job.shots.size(), kLeastKeypoints);
  result.reason =
      "Their matches agree with some geometry of two images; with the right one, nearly all become "
      "points. The bound is what a half leaves with a probability of 1e-9.";
  result.detects = "an image whose pose lets no rays meet";
  return result;
}

CheckResult reprojection_result(const Bundle& bundle, const std::string& what) {
  constexpr double kWorth_px = 0.3, kAllowed_px = 0.03;
  const std::string name = "colmap_sparse_reprojection";
  const auto found = improvement(bundle);
  if (!found)
    return unseen_result(
        name, fmt::format("the images do not hang together by points, or are more than {}",
                          kMostBundleViews));
  const double noise_px = std::min(found->noise_px, kMostKeypointNoise_px);
  const double bound =
      kAllowed_px + kAlikeErrors * found->unsure_px * noise_px / std::max(found->noise_px, 1e-12);
  CheckResult result = colmap_result(name, found->moved_px, bound, "px");
  result.smallest = 2.0 * bound;
  if (result.ok && bound > kWorth_px)
    return unseen_result(name,
                         fmt::format("keypoints scatter so much, or are so few, that {:.2f} px "
                                     "could be told at least",
                                     bound));
  result.summary = fmt::format(
      "By how much (rms) the distances of SIFT keypoints from their triangulated points would fall "
      "if "
      "the poses were adjusted: {}. {:.3f} px a coordinate remain.",
      what, found->noise_px);
  result.reason =
      "In a right dataset the poses have no part in what keypoints err by; what an adjustment "
      "takes "
      "up of that is known from their number.";
  result.detects = "an image turned or moved by what shifts its ground by a pixel";
  return result;
}

/// How far points stand behind the surface, of their depth, and where on the ground they are.
struct Offsets {
  using Cell = std::array<std::int64_t, 3>;
  std::vector<double> relative;
  std::vector<double> per_px;  ///< what a keypoint that is off by 1 px makes of it
  std::vector<Cell> cell;
};

/// The cube of 32 ground pixels that a point lies in: what lies nearer shares texture and relief, and so its errors.
Offsets::Cell cell_of(const Eigen::Vector3d& point, double pixel_m) {
  constexpr double kCell_px = 32.0;
  Offsets::Cell cell{};
  for (std::size_t k = 0; k < 3; ++k)
    cell[k] = std::llround(point[static_cast<Eigen::Index>(k)] / (kCell_px * pixel_m));
  return cell;
}

/// A median and by how much it scatters between cells of the ground: the root of the sum over them of squared sums of
/// signs, by the slope that a normal distribution of the values' own width has there.
Estimate median_of_cells(const Offsets& offsets) {
  std::vector<double> values = offsets.relative;
  Estimate estimate;
  estimate.value = median(values);
  std::vector<double> deviations;
  std::map<Offsets::Cell, double> signs, sizes;
  for (std::size_t i = 0; i < offsets.relative.size(); ++i) {
    const double off = offsets.relative[i] - estimate.value;
    deviations.push_back(std::abs(off));
    signs[offsets.cell[i]] += off > 0.0 ? 1.0 : off < 0.0 ? -1.0 : 0.0;
    sizes[offsets.cell[i]] += 1.0;
  }
  const double deviation = median(deviations);
  double squares = 0.0, counts = 0.0;
  for (const auto& [cell, sum] : signs) squares += sum * sum;
  for (const auto& [cell, count] : sizes) counts += count * count;
  constexpr double kNormalDeviation = 1.4826;
  const double slope =
      std::sqrt(2.0 / std::numbers::pi) / (kNormalDeviation * std::max(deviation, 1e-12));
  const auto num = static_cast<double>(offsets.relative.size());
  estimate.standard_error = std::sqrt(squares) / (slope * num);
  // As many cells of one size as scatter alike.
  estimate.degrees = num * num / counts - 1.0;
  // What lies finer than pixels, and keypoints' pull to them, shift all alike by a part of what they scatter by.
  constexpr double kAllowed_px = 0.02, kAllowedShare = 0.25;
  std::vector<double> per_px = offsets.per_px;
  estimate.allowance = kAllowed_px * median(per_px) + kAllowedShare * deviation;
  estimate.where = "all points";
  return estimate;
}

std::vector<CheckResult> surface_results(const ColmapModel& model, const Bundle& bundle,
                                         const Surfaces& surfaces, double pixel_m) {
  if (surfaces.by_point.empty()) {
    const char* why = surfaces.has_depth ? "no point lies where a depth map shows ground"
                                         : "the dataset holds no depth maps";
    return {unseen_result("colmap_sparse_distance", why),
            unseen_result("colmap_sparse_offset", why)};
  }
  std::vector<Eigen::Vector3d> normals;
  for (const auto& [id, point] : model.points) {
    const auto on = surfaces.by_point.find(id);
    normals.push_back(on == surfaces.by_point.end() ? Eigen::Vector3d::UnitZ()
                                                    : on->second.normal_local);
  }
  const std::vector<double> errors_m = point_errors(bundle, normals);
  std::vector<double> distances_m, unsure_m, signed_m;
  Offsets offsets;
  std::size_t index = 0;
  for (const auto& [id, point] : model.points) {
    const double error_m = errors_m[index++];
    const auto on = surfaces.by_point.find(id);
    if (on == surfaces.by_point.end() || !std::isfinite(error_m)) continue;
    std::vector<double> off_m = on->second.off_m;
    signed_m.push_back(median(off_m));
    distances_m.push_back(std::abs(signed_m.back()));
    unsure_m.push_back(error_m);
    std::vector<double> relative = on->second.relative;
    offsets.relative.push_back(median(relative));
    offsets.per_px.push_back(error_m / on->second.depth_m);
    offsets.cell.push_back(
        cell_of({point.position[0], point.position[1], point.position[2]}, pixel_m));
  }
  const auto improved = improvement(bundle);
  const double noise_px =
      std::min(improved ? improved->noise_px : kMostKeypointNoise_px, kMostKeypointNoise_px);

  constexpr double kWorth_pixels = 3.0, kTimes = 3.0;
  const double bound = std::max(1.0, kTimes * noise_px * median(unsure_m) / pixel_m);
  CheckResult distance = colmap_result("colmap_sparse_distance", median(distances_m) / pixel_m,
                                       bound, "ground pixels");
  distance.summary = fmt::format(
      "Median distance of {} triangulated points from the surface of the depth maps; a ground "
      "pixel is {:.3f} m.",
      distances_m.size(), pixel_m);
  distance.reason =
      "Rays that meet under 10 degrees carry 0.2 px to about half a ground pixel of depth. Where "
      "these "
      "meet under less, three times what the keypoints' noise leaves in the median is allowed.";
  distance.detects = "poses that put the points beside the ground";
  if (distance.ok && bound > kWorth_pixels)
    distance = unseen_result(
        distance.name, fmt::format("rays meet under so small angles that {:.1f} ground pixels "
                                   "could be told at least",
                                   bound));

  CheckResult offset;
  offset.name = "colmap_sparse_offset";
  offset.unit = "of the depth";
  constexpr double kWorth = 0.01;
  Estimates estimates(kWorth);
  const Estimate estimate = median_of_cells(offsets);
  const double middle_m = median(signed_m);
  estimates.add(estimate);
  estimates.judge(offset);
  offset.summary = fmt::format(
      "How far the points stand behind the surface or before it, of their depth, median: {:.4f} m "
      "{} "
      "it.",
      std::abs(middle_m), middle_m > 0.0 ? "behind" : "before");
  offset.reason =
      "SIFT errs to both sides alike; what moves all points at once is an error of cameras or "
      "poses. What keypoints off by 0.02 px make of it and a quarter of the median deviation are "
      "allowed.";
  offset.detects = "a focal length off by 0.5 %";
  if (offset.is_unseen) offset.worst = "too few points, or they scatter too much: " + offset.worst;
  return {distance, offset};
}

std::vector<CheckResult> all_unseen(const std::string& why) {
  std::vector<CheckResult> results;
  for (const char* name : {"colmap_sparse_reprojection", "colmap_sparse_distance",
                           "colmap_sparse_offset", "colmap_sparse_points"})
    results.push_back(unseen_result(name, why));
  return results;
}

}  // namespace

std::vector<CheckResult> run_colmap_sparse(const ColmapJob& job) {
  if (covisible_pairs(job).empty()) return all_unseen(kNoPairs);
  const MatchedDatabase database = matched_database(job);
  const Triangulable triangulable = count_triangulable(job, read_matches(database.file));
  if (num_told(triangulable) == 0)
    return all_unseen(fmt::format(
        "no image has {} keypoints with matches in two others that are seen under {} degrees",
        kLeastKeypoints, kLeastAngle_deg));
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
  const ColmapModel model = read_made_model(made, MayBeEmpty::Yes);
  const std::vector<Placed> placed = placed_shots(job, model);
  Surfaces surfaces;
  for (const Placed& one : placed) look_at(job, model, one, surfaces);
  Bundle bundle = known_bundle(model, placed);
  const std::size_t num_lonely = drop_lonely_views(bundle);
  std::vector<CheckResult> results{reprojection_result(
      bundle, fmt::format("{} points of {} images, {} pairs matched, {} images share no points",
                          model.points.size(), job.shots.size(), database.num_pairs, num_lonely))};
  for (CheckResult& result : surface_results(model, bundle, surfaces, job.ground_pixel_m()))
    results.push_back(std::move(result));
  results.push_back(points_result(job, triangulable, model));
  return results;
}

}  // namespace terracast::validate
