#include <fmt/format.h>

#include <cmath>
#include <map>

#include "core/stop.h"
#include "validate/checks/checker.h"
#include "validate/colmap/features.h"
#include "validate/colmap/matches.h"
#include "validate/colmap/model_bundle.h"
#include "validate/colmap/similarity.h"
#include "validate/sampling.h"

/// COLMAP's incremental reconstruction, which knows the images and the intrinsics and no pose, held
/// against the exported poses after a similarity, and against what its own keypoints leave open. The worst
/// of several seeds counts.
namespace terracast::validate {

namespace fs = std::filesystem;

namespace {

/// What a reconstruction is measured by.
enum Figure { kPosition, kStep, kTurn, kDrift, kNumFigures };

struct FigureKind {
  const char* name;
  const char* unit;
  double allowed;  ///< what is never asked for less
  double worth;    ///< what is worth finding: where the keypoints leave more open, it is unseen
};
constexpr std::array<FigureKind, kNumFigures> kFigures{
    FigureKind{"colmap_free_ate", "ground pixels", 0.5, 1.0},
    FigureKind{"colmap_free_rpe", "ground pixels", 0.5, 1.0},
    FigureKind{"colmap_free_rpe_rotation", "px", 0.5, 1.0},
    FigureKind{"colmap_free_scale_drift", "relative", 1e-3, 1e-2}};

struct Measured {
  double value = 0.0;
  std::optional<double> standard_error;  ///< of independent keypoints; nothing: not known

  /// What is more is an error, as far as keypoints tell.
  double bound(const FigureKind& kind) const {
    return standard_error ? std::max(kind.allowed, kAlikeErrors * *standard_error) : kind.worth;
  }
};

/// What one seed's reconstruction comes to.
struct Outcome {
  std::array<std::optional<Measured>, kNumFigures> figures;
  /// Whether the known poses explain the keypoints as well as COLMAP's own, which differ from them: what these are off
  /// by is open.
  bool is_open = false;
  double ate_m = 0.0;
  double registered_share = 0.0;
  std::string worst_position;
  std::string missing;
  std::size_t num_placed = 0;
  std::size_t num_expected = 0;
  std::size_t num_points = 0;
  CheckResult::Plot positions;
};

/// COLMAP's depths in an image against the depth map's: metres a unit of the reconstruction.
/// returns  nothing of fewer than 20 points
std::optional<double> scale_of(const ColmapJob& job, const ColmapModel& model,
                               const Placed& placed) {
  const core::ImageF depth = job.depth(*placed.shot);
  if (depth.empty()) return std::nullopt;
  const Pose camera_from_model = placed.model_from_camera.inverse();
  std::vector<double> ratios;
  for (const ColmapObservation& seen : placed.image->observations) {
    const auto point = model.points.find(seen.point_id);
    if (point == model.points.end()) continue;
    const auto& p = point->second.position;
    const double found_depth = (camera_from_model * Eigen::Vector3d(p[0], p[1], p[2])).z();
    const Eigen::Vector2d pixel(seen.x_px, seen.y_px);
    if (found_depth <= 0.0 || !placed.shot->camera->intrinsics.contains(pixel)) continue;
    if (const auto sample = sample_inverse_depth(depth, pixel))
      ratios.push_back(1.0 / (sample->inverse_depth.value * found_depth));
  }
  constexpr std::size_t kLeastPoints = 20;
  return ratios.size() >= kLeastPoints ? std::optional(median(ratios)) : std::nullopt;
}

/// Relative poses of neighbouring frames of a camera, COLMAP's against the dataset's.
struct StepErrors {
  std::vector<double> moved_m;
  std::vector<double> turned_px;
};

StepErrors compare_steps(const std::vector<Placed>& placed, const Bundle& bundle, double scale) {
  StepErrors errors;
  for (const auto& [a, b] : bundle.steps) {
    const Placed &now = placed[a], &next = placed[b];
    Pose found = now.model_from_camera.inverse() * next.model_from_camera;
    found.translation *= scale;
    const Pose wanted = now.shot->local_from_camera.inverse() * next.shot->local_from_camera;
    errors.moved_m.push_back((found.translation - wanted.translation).norm());
    errors.turned_px.push_back(rotation_angle_rad(found.rotation.transpose() * wanted.rotation) *
                               now.shot->camera->intrinsics.fx_px);
  }
  return errors;
}

/// 1: in the first third of the frames, -1: in the last, 0: between.
int third_of(const Shot& shot, int num_frames) {
  if (3 * shot.frame < num_frames) return 1;
  return 3 * (num_frames - 1 - shot.frame) < num_frames ? -1 : 0;
}

/// Scale of the first third of the frames against the last; the views that tell it are weighed in the bundle.
/// returns  nothing where depth maps or frames are missing
std::optional<double> drift_of(const ColmapJob& job, const ColmapModel& model,
                               const std::vector<Placed>& placed, Bundle& bundle) {
  std::map<int, std::vector<double>> scales;
  std::vector<std::pair<std::size_t, int>> told;
  for (std::size_t i = 0; i < placed.size(); ++i) {
    const int third = third_of(*placed[i].shot, job.sequence.num_frames);
    if (third == 0) continue;
    const auto scale = scale_of(job, model, placed[i]);
    if (!scale) continue;
    scales[third].push_back(*scale);
    told.emplace_back(i, third);
  }
  if (scales.size() < 2) return std::nullopt;
  for (const auto& [view, third] : told)
    bundle.views[view].weight = third / static_cast<double>(scales[third].size());
  return std::abs(median(scales[1]) / median(scales[-1]) - 1.0);
}

/// Whether keypoints do not tell COLMAP's poses from the known ones: these leave no more of their distances than
/// as many free poses take away by chance, and a tenth, since COLMAP keeps those matches that suit its own.
bool explains_as_well(const Bundle& found, const Bundle& known,
                      const std::optional<BundleErrors>& errors) {
  const double noise_px =
      std::min(errors ? errors->noise_px : kMostKeypointNoise_px, kMostKeypointNoise_px);
  const double unknown_px2 = std::pow(kAlikeErrors * noise_px, 2);
  constexpr double kOwnMatches = 1.1;
  const std::vector<double> by_known_px2 = explain(known), by_found_px2 = explain(found);
  double more_px2 = 0.0;
  for (std::size_t view = 0; view < by_known_px2.size(); ++view) {
    const double more_of_view_px2 = by_known_px2[view] - kOwnMatches * by_found_px2[view];
    // One image of many that the known poses do not explain is none of a solution of COLMAP's own.
    constexpr double kNumOfPose = 6.0, kFarthestView = 10.0;
    if (more_of_view_px2 > kFarthestView * kNumOfPose * unknown_px2) return false;
    more_px2 += more_of_view_px2;
  }
  const auto num_free = 6.0 * static_cast<double>(found.views.size()) - 7.0;
  return more_px2 <= num_free * unknown_px2;
}

void measure(const ColmapJob& job, const ColmapModel& model, const std::vector<Placed>& placed,
             Outcome& outcome) {
  std::vector<Eigen::Vector3d> found, wanted;
  for (const Placed& one : placed) {
    found.push_back(one.model_from_camera.translation);
    wanted.push_back(one.shot->local_from_camera.translation);
  }
  const Similarity local_from_model = best_similarity(found, wanted);
  std::vector<double> errors_m;
  for (std::size_t i = 0; i < placed.size(); ++i) {
    errors_m.push_back((local_from_model * found[i] - wanted[i]).norm());
    if (errors_m.back() >= *std::max_element(errors_m.begin(), errors_m.end()))
      outcome.worst_position = fmt::format("{}: {:.3f} m", placed[i].shot->name, errors_m.back());
    outcome.positions.x.push_back(placed[i].shot->frame);
    outcome.positions.y.push_back(errors_m.back());
  }
  outcome.ate_m = root_mean_square(errors_m);

  Bundle bundle = found_bundle(model, placed);
  const StepErrors steps = compare_steps(placed, bundle, local_from_model.scale);
  const std::optional<double> drift = drift_of(job, model, placed, bundle);
  const std::optional<BundleErrors> errors = bundle_errors(bundle);
  const double noise_px = errors ? std::min(errors->noise_px, kMostKeypointNoise_px) : 0.0;
  const double pixel_m = job.ground_pixel_m();
  const auto set = [&](Figure figure, double value, std::optional<double> per_px, double unit) {
    outcome.figures[figure] = Measured{.value = value / unit, .standard_error = {}};
    if (per_px) outcome.figures[figure]->standard_error = noise_px * *per_px / unit;
  };
  const auto of = [&](double BundleErrors::*member, double scale) {
    return errors ? std::optional(scale * (*errors).*member) : std::nullopt;
  };
  set(kPosition, outcome.ate_m, of(&BundleErrors::position, local_from_model.scale), pixel_m);
  if (!bundle.steps.empty()) {
    set(kStep, root_mean_square(steps.moved_m), of(&BundleErrors::step, local_from_model.scale),
        pixel_m);
    set(kTurn, root_mean_square(steps.turned_px), of(&BundleErrors::turn_px, 1.0), 1.0);
  }
  if (drift) set(kDrift, *drift, errors ? errors->drift : std::nullopt, 1.0);
  // A drift from the depth maps while the poses agree is none of the poses'.
  const auto is_off = [&](Figure figure) {
    const std::optional<Measured>& measured = outcome.figures[figure];
    return measured && measured->value > measured->bound(kFigures[figure]);
  };
  outcome.is_open = (is_off(kPosition) || is_off(kStep) || is_off(kTurn)) &&
                    explains_as_well(bundle, known_bundle(model, placed), errors);
}

/// Counts the images that COLMAP placed, and those it left out though they see enough of its points.
void count_registered(const ColmapJob& job, const ColmapModel& model,
                      const VerifiedMatches& matches, Outcome& outcome) {
  // COLMAP asks for 30 of them that agree.
  constexpr std::size_t kEnoughPoints = 100;
  const std::map<std::int64_t, std::size_t> seen = count_seen_points(matches, model);
  std::size_t num_registered = 0;
  for (const Shot& shot : job.shots) {
    const bool is_placed = model.images.contains(shot.image_id);
    const auto points = seen.find(shot.image_id);
    if (!is_placed && (points == seen.end() || points->second < kEnoughPoints)) continue;
    ++outcome.num_expected;
    if (is_placed)
      ++num_registered;
    else if (outcome.missing.empty())
      outcome.missing = fmt::format("{}, which sees {} points", shot.name, points->second);
  }
  outcome.registered_share = static_cast<double>(num_registered) /
                             static_cast<double>(std::max<std::size_t>(outcome.num_expected, 1));
}

Outcome judge(const ColmapJob& job, const ColmapModel& model, const VerifiedMatches& matches) {
  Outcome outcome;
  const std::vector<Placed> placed = placed_shots(job, model);
  outcome.num_placed = placed.size();
  outcome.num_points = model.points.size();
  count_registered(job, model, matches, outcome);
  // Two can always be laid on two others.
  if (placed.size() >= 3) measure(job, model, placed, outcome);
  return outcome;
}

/// returns  nothing where COLMAP finds no two images to begin with, which says nothing of the dataset
std::optional<Outcome> reconstruct(const ColmapJob& job, const MatchedDatabase& database,
                                   const VerifiedMatches& matches, int seed) {
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
  if (!fs::is_directory(made / "0")) return std::nullopt;
  return judge(job, read_made_model(made / "0"), matches);
}

/// One figure of all seeds: the worst that is an error, or else the one that is nearest to being one.
class WorstOfSeeds {
 public:
  explicit WorstOfSeeds(const FigureKind& kind) : kind_(kind) {}

  /// returns  whether it is the worst so far
  bool add(const Outcome& outcome, const std::optional<Measured>& measured,
           const std::string& where) {
    if (!measured) {
      is_missing_ = true;
      return false;
    }
    const double used = share_of_bound(measured->value, measured->bound(kind_), false);
    const bool is_error = used > 1.0 && !outcome.is_open;
    is_any_open_ |= used > 1.0 && !is_error;
    if (std::pair(is_error, used) <= std::pair(is_error_, used_)) return false;
    is_error_ = is_error;
    used_ = used;
    worst_ = *measured;
    where_ = where;
    return true;
  }

  CheckResult result(const char* why_missing) const {
    CheckResult result = colmap_result(kind_.name, worst_.value, worst_.bound(kind_), kind_.unit);
    result.worst = where_;
    if (is_error_) return result;
    if (is_missing_ || used_ < 0.0) return unseen_result(kind_.name, why_missing);
    if (is_any_open_)
      return unseen_result(
          kind_.name, fmt::format("COLMAP's poses are off by {:.2g} {}, but explain the keypoints "
                                  "no better than the known ones ({})",
                                  worst_.value, kind_.unit, where_));
    if (!worst_.standard_error && worst_.value > kind_.allowed)
      return unseen_result(
          kind_.name, fmt::format("{:.1e}, and how well the images tell it is not known: they do "
                                  "not hang together, or are more than {}",
                                  worst_.value, kMostBundleViews));
    if (worst_.standard_error && result.bound > kind_.worth)
      return unseen_result(kind_.name, fmt::format("these images tell it to {:.2g} {} only",
                                                   result.bound, kind_.unit));
    if (worst_.standard_error) result.smallest = result.bound + kFound * *worst_.standard_error;
    return result;
  }
  std::string standard_error() const {
    return worst_.standard_error ? fmt::format("{:.1e}", *worst_.standard_error) : "not known";
  }

 private:
  /// Standard errors beyond the bound from which on an error is found in 99 of 100 cases.
  static constexpr double kFound = 2.33;

  const FigureKind& kind_;
  Measured worst_;
  std::string where_;
  double used_ = -1.0;
  bool is_error_ = false, is_missing_ = false, is_any_open_ = false;
};

std::vector<CheckResult> all_unseen(const std::string& why) {
  std::vector<CheckResult> results;
  for (const FigureKind& kind : kFigures) results.push_back(unseen_result(kind.name, why));
  results.push_back(unseen_result("colmap_free_registered", why));
  return results;
}

void describe(std::vector<CheckResult>& results, const std::vector<WorstOfSeeds>& worst,
              const ColmapJob& job, const std::string& lines) {
  const std::string open = fmt::format(
      "Images that show what the poses say leave open what their keypoints' noise does, by the "
      "covariance of the adjustment; errors on like ground are alike, so that {} standard errors "
      "are "
      "allowed.",
      kAlikeErrors);
  const auto add_error = [&](Figure figure, const std::string& words) {
    results[figure].summary =
        fmt::format("{} Standard error, if keypoints err each for itself: {} {}.", words,
                    worst[figure].standard_error(), kFigures[figure].unit);
    results[figure].reason = open;
  };
  add_error(
      kPosition,
      fmt::format("Distance (rms) of COLMAP's camera centres from the poses after a similarity, "
                  "worst of {} seeds; a ground pixel is {:.3f} m.{}",
                  job.num_seeds, job.ground_pixel_m(), lines));
  add_error(kStep, "Relative positions (rms) of neighbouring frames of a camera.");
  add_error(
      kTurn,
      "Relative rotations (rms) of neighbouring frames of a camera, as what they shift in the "
      "image.");
  add_error(
      kDrift,
      "COLMAP's depths against the depth maps: scale of the first third of the frames against "
      "the last. A wrong focal length or a slow error of the poses makes it drift.");
  results[kPosition].detects = "one camera of nine three ground pixels beside its place";
  results[kStep].detects = "the same";
  results[kTurn].detects = "one frame of three turned so that the image moves by 2.4 px";
  results[kDrift].detects =
      "0.2 % between the first and the last third, where keypoints tell as much";
}

}  // namespace

std::vector<CheckResult> run_colmap_free(const ColmapJob& job) {
  if (covisible_pairs(job).empty()) return all_unseen(kNoPairs);
  const MatchedDatabase database = matched_database(job);
  const VerifiedMatches matches = read_matches(database.file);
  CheckResult registered = colmap_result("colmap_free_registered", 1.0, 0.99, "share (at least)");
  registered.is_lower_bound = true;
  std::vector<WorstOfSeeds> worst(kFigures.begin(), kFigures.end());
  CheckResult::Plot positions;
  std::string lines;
  for (int seed = 0; seed < job.num_seeds; ++seed) {
    std::optional<Outcome> made;
    try {
      made = reconstruct(job, database, matches, seed);
    } catch (const ColmapFailure&) {
      // The program ends with an error where it finds no two images to begin with.
      if (can_begin(job, matches)) throw;
      core::throw_if_stop_asked();
    }
    if (!made)
      return all_unseen(fmt::format("COLMAP found no two images to begin with (seed {})", seed));
    const Outcome& outcome = *made;
    const std::string where = fmt::format("seed {}", seed);
    for (std::size_t i = 0; i < kNumFigures; ++i)
      if (worst[i].add(outcome, outcome.figures[i],
                       i == kPosition ? where + ", " + outcome.worst_position : where) &&
          i == kPosition)
        positions = outcome.positions;
    if (seed == 0 || outcome.registered_share < registered.value) {
      registered.value = outcome.registered_share;
      registered.worst = outcome.missing.empty() ? where : where + ", " + outcome.missing;
    }
    lines += fmt::format(" Seed {}: {} of {} images, {} points, {:.4f} m.", seed,
                         outcome.num_placed, job.shots.size(), outcome.num_points, outcome.ate_m);
  }
  constexpr std::array<const char*, kNumFigures> kWhyMissing{
      "COLMAP placed fewer than three images",
      "COLMAP placed no two neighbouring frames of a camera",
      "COLMAP placed no two neighbouring frames of a camera",
      "no depth maps, or too few points in the first or last third"};
  std::vector<CheckResult> results;
  for (std::size_t i = 0; i < kNumFigures; ++i) results.push_back(worst[i].result(kWhyMissing[i]));
  describe(results, worst, job, lines);
  positions.title = "Distance of the aligned cameras from their poses, worst seed";
  positions.x_label = "frame";
  positions.y_label = "m";
  results[kPosition].plots = {positions};
  registered.ok = registered.is_within_bound();
  registered.summary =
      "Share of the images that COLMAP placed, of those and of what it left out though it sees 100 "
      "of "
      "its points.";
  registered.reason = "COLMAP asks for 30 points that agree with one pose.";
  registered.detects = "one image of nine left out";
  results.push_back(std::move(registered));
  return results;
}

}  // namespace terracast::validate
