#include <fmt/format.h>

#include <map>

#include "validate/checks/checker.h"
#include "validate/colmap/drift_error.h"
#include "validate/colmap/features.h"
#include "validate/colmap/similarity.h"
#include "validate/sampling.h"

/// COLMAP's incremental reconstruction, which knows the images and the intrinsics and no pose, held
/// against the exported poses after a similarity. The worst of several seeds counts.
namespace terracast::validate {

namespace fs = std::filesystem;

namespace {

/// An image that COLMAP placed.
struct Placed {
  const Shot* shot = nullptr;
  const ColmapImage* image = nullptr;
  Pose free_from_camera;
};

std::vector<Placed> placed_shots(const ColmapJob& job, const ColmapModel& model) {
  std::vector<Placed> placed;
  for (const Shot& shot : job.shots) {
    const auto image = model.images.find(shot.image_id);
    if (image == model.images.end() || image->second.name != shot.name) continue;
    placed.push_back({&shot, &image->second, image->second.camera_from_world.pose().inverse()});
  }
  return placed;
}

/// What an image shows of the ground, by its depth map.
struct Ground {
  bool has_depth = false;
  bool shows_ground = false;
  /// COLMAP's depths against the depth map's: metres a unit of the reconstruction.
  std::optional<double> scale;
};

Ground look_at(const ColmapJob& job, const ColmapModel& model, const Shot& shot) {
  const core::ImageF depth = job.depth(shot);
  Ground ground{.has_depth = !depth.empty(), .shows_ground = shows_ground(depth), .scale = {}};
  const auto image = model.images.find(shot.image_id);
  if (depth.empty() || image == model.images.end()) return ground;
  const Pose camera_from_free = image->second.camera_from_world.pose();
  std::vector<double> ratios;
  for (const ColmapObservation& seen : image->second.observations) {
    const auto point = model.points.find(seen.point_id);
    if (point == model.points.end()) continue;
    const auto& p = point->second.position;
    const double free_depth = (camera_from_free * Eigen::Vector3d(p[0], p[1], p[2])).z();
    const Eigen::Vector2d pixel(seen.x_px, seen.y_px);
    if (free_depth <= 0.0 || !shot.camera->intrinsics.contains(pixel)) continue;
    if (const auto sample = sample_inverse_depth(depth, pixel))
      ratios.push_back(1.0 / (sample->inverse_depth.value * free_depth));
  }
  constexpr std::size_t kLeastPoints = 20;
  if (ratios.size() >= kLeastPoints) ground.scale = median(ratios);
  return ground;
}

/// Relative poses of neighbouring frames of a camera, COLMAP's against the dataset's.
struct Steps {
  std::vector<double> moved_m;
  std::vector<double> turned_px;
};

Steps compare_steps(const std::vector<Placed>& placed, double scale) {
  std::map<std::pair<int, int>, const Placed*> by_camera_and_frame;
  for (const Placed& one : placed)
    by_camera_and_frame[{one.shot->camera_index, one.shot->frame}] = &one;
  Steps steps;
  for (const auto& [place, now] : by_camera_and_frame) {
    const auto next = by_camera_and_frame.find({place.first, place.second + 1});
    if (next == by_camera_and_frame.end()) continue;
    Pose found = now->free_from_camera.inverse() * next->second->free_from_camera;
    found.translation *= scale;
    const Pose wanted =
        now->shot->local_from_camera.inverse() * next->second->shot->local_from_camera;
    steps.moved_m.push_back((found.translation - wanted.translation).norm());
    steps.turned_px.push_back(rotation_angle_rad(found.rotation.transpose() * wanted.rotation) *
                              now->shot->camera->intrinsics.fx_px);
  }
  return steps;
}

/// Of a drift of scale: what is never asked for, how many standard errors are, and from where on the
/// images are taken to tell none (docs/validate.md).
constexpr double kLeastDrift = 1e-3;
constexpr double kAlikeErrors = 8.0;
constexpr double kLargestDrift = 1e-2;
/// Keypoints that err by more, the bound of `colmap_sparse_reprojection`, err by something else.
constexpr double kKeypointNoise_px = 0.3;

/// Scale of the first third of the frames against the last.
struct Drift {
  double relative = 0.0;
  std::optional<double> standard_error;  ///< of independent keypoints; nothing: not known

  double bound() const {
    return std::max(kLeastDrift, kAlikeErrors * standard_error.value_or(0.0));
  }
};

/// An image and what look_at found of its scale.
struct ScaledShot {
  const Shot* shot = nullptr;
  double scale = 1.0;
};

/// 1: in the first third of the frames, -1: in the last, 0: between.
int third_of(const Shot& shot, int num_frames) {
  if (3 * shot.frame < num_frames) return 1;
  return 3 * (num_frames - 1 - shot.frame) < num_frames ? -1 : 0;
}

/// The reconstruction as a bundle, with the images that tell a scale in the drift.
Bundle bundle_of(const ColmapModel& model, const std::vector<Placed>& placed,
                 const std::map<std::int64_t, double>& weights) {
  Bundle bundle;
  std::map<std::int64_t, std::size_t> index_of;
  for (const auto& [id, point] : model.points) {
    index_of[id] = bundle.points.size();
    bundle.points.emplace_back(point.position[0], point.position[1], point.position[2]);
  }
  for (const Placed& one : placed) {
    BundleView view{.camera = &one.shot->camera->intrinsics,
                    .camera_from_bundle = one.image->camera_from_world.pose(),
                    .observations = {},
                    .weight = 0.0};
    if (const auto weight = weights.find(one.shot->image_id); weight != weights.end())
      view.weight = weight->second;
    for (const ColmapObservation& seen : one.image->observations)
      if (const auto point = index_of.find(seen.point_id); point != index_of.end())
        view.observations.push_back({point->second, {seen.x_px, seen.y_px}});
    bundle.views.push_back(std::move(view));
  }
  return bundle;
}

std::optional<Drift> drift_of(const ColmapJob& job, const ColmapModel& model,
                              const std::vector<Placed>& placed,
                              const std::vector<ScaledShot>& scaled) {
  std::vector<double> first, last;
  for (const ScaledShot& one : scaled) {
    const int third = third_of(*one.shot, job.sequence.num_frames);
    if (third == 1) first.push_back(one.scale);
    if (third == -1) last.push_back(one.scale);
  }
  if (first.empty() || last.empty()) return std::nullopt;
  std::map<std::int64_t, double> weights;
  for (const ScaledShot& one : scaled) {
    const int third = third_of(*one.shot, job.sequence.num_frames);
    if (third == 1) weights[one.shot->image_id] = 1.0 / static_cast<double>(first.size());
    if (third == -1) weights[one.shot->image_id] = -1.0 / static_cast<double>(last.size());
  }
  Drift drift{.relative = std::abs(median(first) / median(last) - 1.0), .standard_error = {}};
  if (const auto error = drift_error(bundle_of(model, placed, weights)))
    drift.standard_error = error->per_px * std::min(error->noise_px, kKeypointNoise_px);
  return drift;
}

/// What one seed's reconstruction comes to.
struct Outcome {
  double ate_m = 0.0;
  double step_m = 0.0;
  double turn_px = 0.0;
  std::optional<Drift> drift;  ///< nothing where depth maps or frames are missing
  double registered_share = 0.0;
  std::string worst_position;
  std::string missing;
  std::size_t num_placed = 0;
  std::size_t num_expected = 0;
  std::size_t num_steps = 0;
  std::size_t num_points = 0;
  CheckResult::Plot positions;
};

Outcome judge(const ColmapJob& job, const ColmapModel& model) {
  Outcome outcome;
  const std::vector<Placed> placed = placed_shots(job, model);
  if (placed.size() < 3) throw ColmapFailure("COLMAP placed fewer than three images");
  std::vector<Eigen::Vector3d> found, wanted;
  for (const Placed& one : placed) {
    found.push_back(one.free_from_camera.translation);
    wanted.push_back(one.shot->local_from_camera.translation);
  }
  const Similarity local_from_free = best_similarity(found, wanted);
  std::vector<double> errors_m;
  for (std::size_t i = 0; i < placed.size(); ++i) {
    errors_m.push_back((local_from_free * found[i] - wanted[i]).norm());
    if (errors_m.back() >= *std::max_element(errors_m.begin(), errors_m.end()))
      outcome.worst_position = fmt::format("{}: {:.3f} m", placed[i].shot->name, errors_m.back());
    outcome.positions.x.push_back(placed[i].shot->frame);
    outcome.positions.y.push_back(errors_m.back());
  }
  outcome.ate_m = root_mean_square(errors_m);
  const Steps steps = compare_steps(placed, local_from_free.scale);
  outcome.num_steps = steps.moved_m.size();
  outcome.step_m = root_mean_square(steps.moved_m);
  outcome.turn_px = root_mean_square(steps.turned_px);

  std::vector<ScaledShot> scaled;
  std::size_t num_registered = 0;
  for (const Shot& shot : job.shots) {
    const Ground ground = look_at(job, model, shot);
    if (ground.scale) scaled.push_back({&shot, *ground.scale});
    if (ground.has_depth && !ground.shows_ground) continue;
    ++outcome.num_expected;
    if (model.images.contains(shot.image_id))
      ++num_registered;
    else if (outcome.missing.empty())
      outcome.missing = shot.name;
  }
  outcome.drift = drift_of(job, model, placed, scaled);
  outcome.registered_share = static_cast<double>(num_registered) /
                             static_cast<double>(std::max<std::size_t>(outcome.num_expected, 1));
  outcome.num_placed = placed.size();
  outcome.num_points = model.points.size();
  return outcome;
}

void describe_drift(CheckResult& result, const Drift& drift) {
  result.value = drift.relative;
  result.bound = drift.bound();
  result.summary = fmt::format(
      "COLMAP's depths against the depth maps: scale of the first third of the frames against the "
      "last. If keypoints erred each for itself, its standard error would be {}.",
      drift.standard_error ? fmt::format("{:.1e}", *drift.standard_error) : "not known");
  result.reason = fmt::format(
      "A drift of scale is what a wrong focal length or a slow error of the poses makes. Errors of "
      "keypoints on like ground are alike, so that a drift may be {} standard errors.",
      kAlikeErrors);
}

/// returns  empty where the images tell the drift
std::string why_drift_is_unseen(const Drift& drift) {
  if (drift.standard_error && drift.relative <= drift.bound() && drift.bound() > kLargestDrift)
    return fmt::format("these images tell scales to {:.1e} only", drift.bound());
  if (!drift.standard_error && drift.relative > kLeastDrift && drift.relative <= kLargestDrift)
    return fmt::format(
        "{:.1e}, and how well the images tell it is not known: they do not hang together, or are "
        "more than {}",
        drift.relative, kMostDriftViews);
  return {};
}

Outcome reconstruct(const ColmapJob& job, const MatchedDatabase& database, int seed) {
  const std::string name = fmt::format("free_{}", seed);
  const ColmapCommand mapper{
      "mapper",
      {"--random_seed", std::to_string(seed), "--Mapper.num_threads", "1",
       "--Mapper.multiple_models", "0",
       // The intrinsics are known; only poses and points are free.
       "--Mapper.ba_refine_focal_length", "0", "--Mapper.ba_refine_principal_point", "0",
       "--Mapper.ba_refine_extra_params", "0",
       // 16 degrees, the default, are never seen from high flights.
       "--Mapper.init_min_tri_angle", "4"}};
  const fs::path made =
      job.work.made(name, database.key + mapper.key(), [&](const fs::path& folder) {
        job.log.info("colmap: free reconstruction, seed {}", seed);
        job.program.run(mapper,
                        {"--database_path", database.file.string(), "--image_path",
                         job.images().string(), "--output_path", folder.string()},
                        name + ".log", 600.0 + 120.0 * static_cast<double>(job.shots.size()));
      });
  if (!fs::is_directory(made / "0"))
    throw ColmapFailure(fmt::format(
        "colmap mapper found no pair of images to begin with (seed {}); see {}.log", seed, name));
  return judge(job, read_made_model(made / "0"));
}

}  // namespace

std::vector<CheckResult> run_colmap_free(const ColmapJob& job) {
  const MatchedDatabase database = matched_database(job);
  const double pixel_m = job.ground_pixel_m();

  CheckResult ate = colmap_result("colmap_free_ate", 0.0, 0.5, "ground pixels");
  CheckResult step = colmap_result("colmap_free_rpe", 0.0, 0.5, "ground pixels");
  CheckResult turn = colmap_result("colmap_free_rpe_rotation", 0.0, 0.5, "px");
  CheckResult drift = colmap_result("colmap_free_scale_drift", 0.0, kLeastDrift, "relative");
  CheckResult registered = colmap_result("colmap_free_registered", 1.0, 0.99, "share (at least)");
  registered.is_lower_bound = true;
  std::string lines;
  Drift worst_drift;  // against its bound
  bool has_drift = true, has_steps = true, is_any_expected = true;
  for (int seed = 0; seed < job.num_seeds; ++seed) {
    const Outcome outcome = reconstruct(job, database, seed);
    const std::string where = fmt::format("seed {}", seed);
    if (outcome.ate_m / pixel_m >= ate.value) ate.plots = {outcome.positions};
    note_worst(ate, outcome.ate_m / pixel_m, where + ", " + outcome.worst_position);
    note_worst(step, outcome.step_m / pixel_m, where);
    note_worst(turn, outcome.turn_px, where);
    has_drift = has_drift && outcome.drift;
    has_steps = has_steps && outcome.num_steps > 0;
    is_any_expected = is_any_expected && outcome.num_expected > 0;
    if (outcome.drift && (drift.worst.empty() || outcome.drift->relative / outcome.drift->bound() >
                                                     worst_drift.relative / worst_drift.bound())) {
      worst_drift = *outcome.drift;
      drift.worst = where;
    }
    if (seed == 0 || outcome.registered_share < registered.value) {
      registered.value = outcome.registered_share;
      registered.worst = outcome.missing.empty() ? where : where + ", " + outcome.missing;
    }
    lines += fmt::format(" Seed {}: {} of {} images, {} points, {:.4f} m.", seed,
                         outcome.num_placed, job.shots.size(), outcome.num_points, outcome.ate_m);
  }
  for (CheckResult::Plot& plot : ate.plots) {
    plot.title = "Distance of the aligned cameras from their poses, worst seed";
    plot.x_label = "frame";
    plot.y_label = "m";
  }
  ate.summary = fmt::format(
      "Distance (rms) of COLMAP's camera centres from the poses after a similarity, worst of {} "
      "seeds; a ground pixel is {:.3f} m.{}",
      job.num_seeds, pixel_m, lines);
  ate.reason =
      "Images that show what the poses say place their cameras to a fraction of a pixel on the "
      "ground.";
  step.summary = "Relative positions (rms) of neighbouring frames of a camera.";
  turn.summary =
      "Relative rotations (rms) of neighbouring frames of a camera, as what they shift in the "
      "image.";
  step.reason = turn.reason = "As for the positions.";
  describe_drift(drift, worst_drift);
  registered.summary = "Share of the images with 30 % ground that COLMAP placed.";
  registered.reason = "Ground with texture is never lost.";
  ate.detects = "one camera of nine three ground pixels beside its place";
  step.detects = "the same";
  turn.detects = "one frame of three turned so that the image moves by 1 px";
  drift.detects = "0.2 % between the first and the last third, where keypoints tell as much";
  registered.detects = "one image of nine left out";
  std::vector<CheckResult> results{ate, step, turn, drift, registered};
  for (CheckResult& result : results) result.ok = result.is_within_bound();
  if (!has_steps)
    for (const std::size_t i : {1U, 2U})
      results[i] =
          unseen_result(results[i].name, "COLMAP placed no two neighbouring frames of a camera");
  if (!is_any_expected)
    results[4] = unseen_result("colmap_free_registered", "no image shows 30 % ground");
  if (!has_drift)
    results[3] = unseen_result("colmap_free_scale_drift",
                               "no depth maps, or too few points in the first or last third");
  else if (const std::string why = why_drift_is_unseen(worst_drift); !why.empty())
    results[3] = unseen_result("colmap_free_scale_drift", why);
  return results;
}

}  // namespace terracast::validate
