#include "validate/causes/trial.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <limits>

#include "core/plugin_rows.h"
#include "validate/checks/checker.h"
#include "validate/sampling.h"
#include "validate/sequence_part.h"
#include "validate/transfer.h"

namespace terracast::validate {

namespace {

constexpr std::int64_t kSamples = 500;
constexpr int kMostFrames = 6;
constexpr int kMostCameras = 8;

ValidateOptions trial_options() {
  ValidateOptions options;
  options.samples_per_image = kSamples;
  options.is_trial = true;
  return options;
}

/// Camera and frame of the trial that an image of COLMAP's model is, by its name; nothing: none.
std::optional<std::pair<int, int>> place_in(const Trial& trial, const ColmapImage& image) {
  constexpr std::size_t kDigits = 6;
  const std::size_t slash = image.name.rfind('/');
  if (slash == std::string::npos || image.name.size() < slash + 1 + kDigits) return std::nullopt;
  const int camera = trial.sequence.camera_index(image.name.substr(0, slash));
  const int frame = std::atoi(image.name.c_str() + slash + 1) - trial.first_frame;
  if (camera < 0 || frame < 0 || frame >= trial.num_frames()) return std::nullopt;
  return std::pair(camera, frame);
}

/// Reprojection of COLMAP's observations by the trial's poses and intrinsics: 0.99 quantile of the
/// errors, against the bound of `colmap_reprojection`.
void measure_observations(const Trial& trial, Shares& shares) {
  if (!trial.model) return;
  std::vector<double> errors;
  for (const auto& [id, image] : trial.model->images) {
    const auto place = place_in(trial, image);
    if (!place) continue;
    const auto [camera_index, frame] = *place;
    const auto view =
        view_at(trial.sequence, camera_index, frame, &trial.image(camera_index, frame));
    if (!view) continue;
    const std::size_t step = std::max<std::size_t>(1, image.observations.size() / 200);
    for (std::size_t i = 0; i < image.observations.size(); i += step) {
      const ColmapObservation& seen = image.observations[i];
      const auto point = trial.model->points.find(seen.point_id);
      if (point == trial.model->points.end()) continue;
      const auto& p = point->second.position;
      const auto at = Transfer::of_local_point(*view, {p[0], p[1], p[2]});
      const double error = at ? (at->pixel - Eigen::Vector2d(seen.x_px, seen.y_px)).norm() : 1e9;
      errors.push_back(at && at->distance_b_m > 0.0 && std::isfinite(error) ? error : 1e9);
    }
  }
  constexpr double kBound_px = 1e-6;
  if (!errors.empty()) shares["colmap_reprojection"] = quantile(errors, 0.99) / kBound_px;
}

/// Depths of COLMAP's points against the depth maps, as `colmap_depth` and `colmap_depth_residual`
/// have them.
void measure_point_depths(const Trial& trial, Shares& shares) {
  if (!trial.model) return;
  constexpr double kClear = 0.01;
  std::vector<double> residuals;
  std::size_t num_hidden = 0;
  for (const auto& [id, image] : trial.model->images) {
    const auto place = place_in(trial, image);
    if (!place) continue;
    const auto [camera, frame] = *place;
    const core::ImageF& depth = trial.image(camera, frame).depth;
    const auto view = view_at(trial.sequence, camera, frame, &trial.image(camera, frame));
    if (depth.empty() || !view) continue;
    for (const ColmapObservation& seen : image.observations) {
      const auto point = trial.model->points.find(seen.point_id);
      if (point == trial.model->points.end()) continue;
      const auto found = sample_inverse_depth(depth, {seen.x_px, seen.y_px});
      if (!found) continue;
      const auto& p = point->second.position;
      const double expected_m = (pose_of_line(*view, {seen.x_px, seen.y_px}).inverse() *
                                 Eigen::Vector3d(p[0], p[1], p[2]))
                                    .z();
      if (expected_m > found->farthest_m * (1.0 + kClear) ||
          expected_m < found->nearest_m * (1.0 - kClear))
        ++num_hidden;
      residuals.push_back(std::abs(expected_m * found->inverse_depth.value - 1.0));
    }
  }
  if (residuals.empty()) return;
  constexpr double kHiddenBound = 1e-3, kResidualBound = 2e-3;
  shares["colmap_depth"] =
      static_cast<double>(num_hidden) / static_cast<double>(residuals.size()) / kHiddenBound;
  shares["colmap_depth_residual"] = median(residuals) / kResidualBound;
}

/// Colours of COLMAP's points against the most similar of their images, as `colmap_color` has it.
void measure_point_colors(const Trial& trial, Shares& shares) {
  if (!trial.model) return;
  std::map<std::int64_t, double> least;
  for (const auto& [id, image] : trial.model->images) {
    const auto place = place_in(trial, image);
    if (!place) continue;
    const auto [camera, frame] = *place;
    const core::Image8& color = trial.image(camera, frame).color;
    if (color.empty()) continue;
    for (const ColmapObservation& seen : image.observations) {
      const auto point = trial.model->points.find(seen.point_id);
      const auto x = static_cast<int>(std::floor(seen.x_px));
      const auto y = static_cast<int>(std::floor(seen.y_px));
      if (point == trial.model->points.end() || x < 0 || y < 0 || x >= color.width() ||
          y >= color.height())
        continue;
      double difference = 0.0;
      for (int k = 0; k < 3; ++k)
        difference +=
            std::abs(color(x, y, k) - point->second.color[static_cast<std::size_t>(k)]) / 3.0;
      const auto [entry, is_new] = least.emplace(seen.point_id, difference);
      if (!is_new) entry->second = std::min(entry->second, difference);
    }
  }
  std::vector<double> differences;
  for (const auto& [id, difference] : least) differences.push_back(difference);
  constexpr double kBound_levels = 16.0;
  if (!differences.empty()) shares["colmap_color"] = median(differences) / kBound_levels;
}

/// The frame that most failed results name.
int frame_to_look_at(const Sequence& sequence, const std::vector<CheckResult>& failed) {
  std::map<int, int> votes;
  for (const CheckResult& result : failed)
    for (const auto& [camera, frame] : places_in(result.worst, sequence)) ++votes[frame];
  int best = 0, most = 0;
  for (const auto& [frame, count] : votes)
    if (count > most) {
      best = frame;
      most = count;
    }
  return best;
}

/// Whether a text names a camera, whole: not "cam1" in "cam10", nor "a/c" in "a/c/d".
bool is_named(const std::string& text, const std::string& camera) {
  const auto is_of_word = [&](std::size_t at) {
    constexpr std::string_view kSigns = "_-./";
    const auto c = static_cast<unsigned char>(text[at]);
    return std::isalnum(c) != 0 || kSigns.find(text[at]) != std::string_view::npos;
  };
  if (camera.empty()) return false;
  for (std::size_t at = text.find(camera); at != std::string::npos;
       at = text.find(camera, at + 1)) {
    const std::size_t end = at + camera.size();
    if ((at == 0 || !is_of_word(at - 1)) && (end == text.size() || !is_of_word(end))) return true;
  }
  return false;
}

/// Whether a finding begins with one of a camera's files.
bool is_of_file(const std::string& finding, const Camera& camera) {
  return std::any_of(camera.files.begin(), camera.files.end(), [&](const FrameFiles& files) {
    const auto& [color, depth, segmentation, flow, disparity, moving, normals, instances] = files;
    for (const std::string* path :
         {&color, &depth, &segmentation, &flow, &disparity, &moving, &normals, &instances})
      if (!path->empty() && finding.starts_with(*path)) return true;
    return false;
  });
}

/// All cameras, or of many those that failed results name, the rectified pair, and those that stand beside them in the
/// list, which are their rig's: pairs of images, and pairs of cameras in which something may be swapped, grow with the
/// square each.
std::vector<int> cameras_to_look_at(const Sequence& sequence,
                                    const std::vector<CheckResult>& failed) {
  const int count = static_cast<int>(sequence.cameras.size());
  std::vector<int> chosen;
  const auto choose = [&](int camera) {
    if (static_cast<int>(chosen.size()) < kMostCameras &&
        std::find(chosen.begin(), chosen.end(), camera) == chosen.end())
      chosen.push_back(camera);
  };
  if (count <= kMostCameras) {
    for (int c = 0; c < count; ++c) choose(c);
    return chosen;
  }
  for (const CheckResult& result : failed)
    for (int c = 0; c < count; ++c) {
      const Camera& camera = sequence.cameras[static_cast<std::size_t>(c)];
      if (is_named(result.worst, camera.name) || is_of_file(result.worst, camera)) choose(c);
    }
  if (sequence.stereo)
    for (const int c : {sequence.stereo->left, sequence.stereo->right}) choose(c);
  if (chosen.empty()) choose(0);
  const std::vector<int> named = chosen;
  for (int away = 1; away < count; ++away)
    for (const int c : named)
      for (const int near : {c + away, c - away})
        if (near >= 0 && near < count) choose(near);
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

/// Trial::begins_at_origin. KITTI's poses are placed by georeference.csv, and say nothing of the origin.
bool does_begin_at_origin(const Dataset& dataset, const Sequence& sequence) {
  if (dataset.format.starts_with("kitti")) return false;
  for (const Camera& camera : sequence.cameras) {
    const auto& poses = camera.local_from_camera;
    if (!camera.body_from_camera || poses.size() < 2 || !poses[0] || !poses[1]) continue;
    const auto distance_m = [&](const Pose& pose) {
      return (pose * camera.body_from_camera->inverse()).translation.norm();
    };
    return distance_m(*poses[0]) <= kOriginBound_m && distance_m(*poses[1]) > 2.0 * kOriginBound_m;
  }
  return false;
}

/// What a user of the format is shown although its rules are broken.
FrameImages load_all_the_same(const Dataset& dataset, const Sequence& sequence, int frame) {
  Findings ignored;
  FrameImages images = load_frame(dataset, sequence, frame, ignored);
  if (ignored.count() == 0) return images;
  Dataset lenient;
  lenient.root = dataset.root;
  lenient.format = dataset.format;
  lenient.sky_depth_m = std::numeric_limits<float>::max();
  FrameImages again = load_frame(lenient, sequence, frame, ignored);
  for (std::size_t c = 0; c < images.size(); ++c) {
    if (!images[c]->depth.empty() || again[c]->depth.empty()) continue;
    auto repaired = std::make_shared<LoadedImage>(*again[c]);
    for (float& value : repaired->depth.data())
      if (value == dataset.sky_depth_m) value = std::numeric_limits<float>::quiet_NaN();
    images[c] = repaired;
  }
  return images;
}

/// Pairs that tell most for their cost: neighbours in time, and cameras of one frame.
std::vector<ViewPair> near_pairs(const FrameWindow& window) {
  std::vector<ViewPair> pairs = window.pairs();
  std::erase_if(pairs,
                [](const ViewPair& pair) { return std::abs(pair.a.frame - pair.b.frame) > 1; });
  return pairs;
}

template <class PairCost>
double mean_of_pairs(const Trial& trial, const PairCost& cost) {
  Findings ignored;
  FrameWindow window(*trial.dataset, trial.sequence, ignored, trial.images);
  double sum = 0.0;
  std::size_t count = 0;
  while (window.advance()) {
    const std::vector<ViewPair> pairs = near_pairs(window);
    trial.spend(pairs.size());
    for (const ViewPair& pair : pairs) {
      const std::optional<double> value = cost(pair);
      if (!value) continue;
      sum += *value;
      ++count;
    }
  }
  return count == 0 ? 1.0 : sum / static_cast<double>(count);
}

}  // namespace

void Effort::spend(std::int64_t comparisons) {
  if (spent_ + comparisons > bound_) throw EffortSpent{};
  spent_ += comparisons;
  if (progress_ != nullptr) progress_->advance(comparisons);
}

void Trial::spend(std::size_t comparisons) const {
  if (effort != nullptr) effort->spend(static_cast<std::int64_t>(comparisons));
}

LoadedImage& Trial::edit(int camera, int frame) {
  auto& slot = images[static_cast<std::size_t>(frame)][static_cast<std::size_t>(camera)];
  auto copy = std::make_shared<LoadedImage>(*slot);
  LoadedImage& reference = *copy;
  slot = std::move(copy);
  return reference;
}

FlowFields& Trial::edit_flow(int camera, int frame) {
  LoadedImage& image = edit(camera, frame);
  auto copy = std::make_shared<FlowFields>(*image.flow);
  FlowFields& reference = *copy;
  image.flow = std::move(copy);
  return reference;
}

std::string Trial::camera_names(const std::vector<int>& cameras) const {
  if (cameras.size() > 1 && static_cast<int>(cameras.size()) == num_cameras())
    return num_cameras_left_out == 0
               ? "all cameras"
               : fmt::format("all {} cameras that were looked at", cameras.size());
  std::string names;
  for (std::size_t i = 0; i < cameras.size(); ++i)
    names += (i == 0 ? "" : i + 1 == cameras.size() ? " and " : ", ") + camera(cameras[i]).name;
  return names;
}

std::string_view check_of(std::string_view result) {
  if (result == "colmap_reprojection") return "colmap_observations";
  if (result == "colmap_color") return "colmap_point_colors";
  if (result.starts_with("colmap_depth")) return "colmap_point_depths";
  // What is held against the origin is wrong for other reasons than what is held against poses.
  if (result == "georeference_origin") return "georeference_origin";
  std::string_view best;
  for (const CheckInfo& info : checks())
    if (result.starts_with(info.name) && info.name.size() > best.size()) best = info.name;
  return best;
}

Shares measure(const Trial& trial, const std::vector<std::string_view>& names) {
  Shares shares;
  const auto is_wanted = [&](std::string_view name) {
    return std::find(names.begin(), names.end(), name) != names.end();
  };
  const ValidateOptions options = trial_options();
  std::vector<std::unique_ptr<Checker>> checkers;
  bool needs_frames = false;
  for (const CheckInfo& info : checks()) {
    const bool is_of_origin = info.name == "georeference" && is_wanted("georeference_origin");
    if ((!is_wanted(info.name) && !is_of_origin) || info.name == "structure") continue;
    checkers.push_back(core::made(info.make(options), "check", info.name));
    needs_frames = needs_frames || (info.name != "georeference" && info.name != "georegistration" &&
                                    info.name != "calibration" && info.name != "trajectory" &&
                                    info.name != "oxts" && info.name != "motion");
  }
  if (needs_frames) {
    Findings ignored;
    FrameWindow window(*trial.dataset, trial.sequence, ignored, trial.images);
    while (window.advance()) {
      const std::vector<ViewPair> pairs = window.pairs();
      trial.spend(pairs.size() * checkers.size());
      for (const auto& checker : checkers) checker->frame(window, pairs);
    }
  }
  for (const auto& checker : checkers)
    for (const CheckResult& result : checker->finish(*trial.dataset, trial.sequence)) {
      if (result.skipped) continue;
      const double share = share_of_bound(result.value, result.bound, result.is_lower_bound);
      shares[result.name] = result.ok ? std::min(share, 1.0) : std::max(share, 1.0 + 1e-9);
    }
  if (is_wanted("colmap_observations")) measure_observations(trial, shares);
  if (is_wanted("colmap_point_depths")) measure_point_depths(trial, shares);
  if (is_wanted("colmap_point_colors")) measure_point_colors(trial, shares);
  return shares;
}

std::vector<std::pair<int, int>> places_in(const std::string& text, const Sequence& sequence) {
  std::vector<std::pair<int, int>> places;
  static constexpr std::string_view kMark = ", frame ";
  for (std::size_t at = text.find(kMark); at != std::string::npos; at = text.find(kMark, at + 1)) {
    const int frame = std::atoi(text.c_str() + at + kMark.size());
    if (frame < 0 || frame >= sequence.num_frames) continue;
    for (std::size_t c = 0; c < sequence.cameras.size(); ++c) {
      const std::string& name = sequence.cameras[c].name;
      if (at >= name.size() && text.compare(at - name.size(), name.size(), name) == 0)
        places.emplace_back(static_cast<int>(c), frame);
    }
  }
  return places;
}

Trial make_trial(const Dataset& dataset, const Sequence& sequence,
                 const std::vector<CheckResult>& failed) {
  Trial trial;
  trial.dataset = &dataset;
  // Of large images fewer frames, so that they stay a few hundred megabytes.
  constexpr double kMostPixels = 64e6;
  const std::vector<int> cameras = cameras_to_look_at(sequence, failed);
  double pixels = 1.0;
  for (const int c : cameras) {
    const Intrinsics& size = sequence.cameras[static_cast<std::size_t>(c)].intrinsics;
    pixels += 1.0 * size.width_px * size.height_px;
  }
  const int affordable = static_cast<int>(std::clamp(kMostPixels / pixels, 3.0, 1.0 * kMostFrames));
  const int count = std::min(affordable, sequence.num_frames);
  trial.first_frame =
      std::clamp(frame_to_look_at(sequence, failed) - count / 2, 0, sequence.num_frames - count);
  trial.sequence = part_of(sequence, trial.first_frame, count, cameras);
  trial.num_cameras_left_out = static_cast<int>(sequence.cameras.size() - cameras.size());
  for (Camera& camera : trial.sequence.cameras) {
    // Of the format's size and dataset.json's the one that images have.
    Findings ignored;
    if (camera.stated && !camera.files.empty() && !camera.files[0].color.empty())
      ignored.attempt("", [&] {
        const core::Image8 image = read_png8(dataset.root / camera.files[0].color, "", 0, {});
        camera.intrinsics.width_px = image.width();
        camera.intrinsics.height_px = image.height();
      });
  }
  trial.local_from_first = sequence.local_from_first;
  trial.begins_at_origin = does_begin_at_origin(dataset, sequence);
  if (sequence.binary_model)
    trial.model =
        std::shared_ptr<const ColmapModel>(std::shared_ptr<void>(), &*sequence.binary_model);
  for (int frame = 0; frame < count; ++frame)
    trial.images.push_back(load_all_the_same(dataset, trial.sequence, frame));
  return trial;
}

double depth_disagreement(const Trial& trial) {
  ValidateOptions options = trial_options();
  constexpr std::int64_t kPixels = 120;
  constexpr std::size_t kEnough = 25;
  return mean_of_pairs(trial, [&](const ViewPair& pair) -> std::optional<double> {
    if (pair.b.image->depth.empty()) return std::nullopt;
    const Transfer transfer(pair.a, pair.b);
    std::vector<double> sizes;
    for (const Eigen::Vector2i& at :
         draw_pixels(pair.a.camera->intrinsics, kPixels, options, pair.a, 7)) {
      const auto depth_m = static_cast<double>(pair.a.image->depth(at.x(), at.y()));
      if (!std::isfinite(depth_m)) continue;
      const auto place = transfer.point({at.x() + 0.5, at.y() + 0.5}, depth_m);
      if (!place || !(place->distance_b_m > 0.0)) continue;
      const auto seen = sample_inverse_depth(pair.b.image->depth, place->pixel);
      if (seen)
        sizes.push_back(
            std::min(1.0, std::abs(seen->inverse_depth.value * place->distance_b_m - 1.0)));
    }
    return sizes.size() < kEnough ? 1.0 : median(sizes);
  });
}

double color_disagreement(const Trial& trial) {
  ValidateOptions options = trial_options();
  constexpr std::int64_t kPatches = 16;
  constexpr std::size_t kEnough = 5;
  return mean_of_pairs(trial, [&](const ViewPair& pair) -> std::optional<double> {
    if (pair.a.image->color.empty() || pair.b.image->color.empty()) return std::nullopt;
    std::vector<double> correlations;
    for (const Eigen::Vector2i& at :
         draw_pixels(pair.a.camera->intrinsics, kPatches, options, pair.a, 8))
      if (const auto match = match_patch(pair.a, pair.b, at.x(), at.y()))
        correlations.push_back(match->correlation);
    return correlations.size() < kEnough ? 1.0 : 1.0 - median(correlations);
  });
}

std::vector<int> colored_cameras(const Trial& trial) {
  std::vector<int> colored;
  for (int c = 0; c < trial.num_cameras(); ++c) {
    const core::Image8& color = trial.image(c, 0).color;
    for (std::size_t i = 0; i + 2 < color.data().size(); i += 3)
      if (color.data()[i] != color.data()[i + 2]) {
        colored.push_back(c);
        break;
      }
  }
  return colored;
}

std::vector<std::vector<int>> groups_of_images(const Trial& trial) {
  std::vector<int> all(static_cast<std::size_t>(trial.num_cameras()));
  for (int c = 0; c < trial.num_cameras(); ++c) all[static_cast<std::size_t>(c)] = c;
  std::vector<std::vector<int>> groups = {all};
  if (const std::vector<int> colored = colored_cameras(trial);
      colored.size() > 1 && colored.size() < all.size())
    groups.push_back(colored);
  if (all.size() > 1)
    for (const int c : all) groups.push_back({c});
  return groups;
}

bool Symptoms::fails(std::string_view check) const {
  return std::any_of(shares.begin(), shares.end(), [&](const auto& entry) {
    return entry.second > 1.0 && check_of(entry.first) == check;
  });
}

double Symptoms::color_disagreement() const {
  if (!known_color_disagreement) known_color_disagreement = validate::color_disagreement(trial);
  return *known_color_disagreement;
}

double Symptoms::depth_disagreement() const {
  if (!known_depth_disagreement) known_depth_disagreement = validate::depth_disagreement(trial);
  return *known_depth_disagreement;
}

bool Symptoms::fails_result(std::string_view name) const {
  return std::any_of(failed.begin(), failed.end(),
                     [&](const CheckResult& result) { return result.name == name; });
}

}  // namespace terracast::validate
