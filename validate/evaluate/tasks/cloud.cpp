#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "validate/evaluate/cloud_error.h"
#include "validate/evaluate/cloud_truth.h"
#include "validate/evaluate/measures.h"
#include "validate/evaluate/results/cloud_files.h"
#include "validate/evaluate/task.h"
#include "validate/evaluate/truth.h"
#include "validate/oracle/nearest_points.h"

/// Clouds of points: accuracy (from the result to the truth), completeness (from the truth to the result),
/// Chamfer distance, and precision, recall and their F-score at distances, as Knapitsch et al. (SIGGRAPH
/// 2017) define them. Points that cropping leaves out are counted and told.
namespace terracast::validate {

namespace {

enum CloudIndex {
  kAccuracy,
  kAccuracyRms,
  kCompleteness,
  kCompletenessRms,
  kChamfer,
  kChamferSquares,
  kNumFixed
};

double mean_of(const Sum& sum) { return sum.total / static_cast<double>(sum.count); }

class CloudTask : public Task {
 public:
  explicit CloudTask(const EvaluateOptions& options)
      : options_(options), max_depth_m_(options.max_depth_m.value_or(100.0)) {
    sort_and_unite(options_.cloud_distances_m);
  }

  std::vector<Measure> measures() const override {
    std::vector<Measure> list{{.name = "accuracy", .unit = "m"},
                              {.name = "accuracy RMS", .unit = "m", .is_root = true},
                              {.name = "completeness", .unit = "m"},
                              {.name = "completeness RMS", .unit = "m", .is_root = true},
                              {.name = "Chamfer", .unit = "m"},
                              {.name = "Chamfer squared", .unit = "m²"}};
    for (const double distance_m : options_.cloud_distances_m)
      for (const char* const name : {"precision", "recall", "F"})
        list.push_back({.name = fmt::format("{} {} m", name, distance_m),
                        .unit = "%",
                        .is_higher_better = true});
    return list;
  }

  std::vector<std::string> terms() const override {
    return {options_.crop == CloudCrop::None     ? "all points"
            : options_.crop == CloudCrop::Common ? "points within the common bounds"
                                                 : "the result's points within the truth's bounds",
            "no alignment",
            "Chamfer: mean of accuracy and completeness; squared: sum of both mean squares",
            fmt::format("right within {} m", fmt::join(options_.cloud_distances_m, ", ")),
            limit_text("depth", max_depth_m_, "m") + " where depth images are the truth"};
  }

  bool has_truth(const Subject& subject, int frame) const override {
    return is_cloud_file(subject.dataset.root) || has_depth_truth(subject, frame);
  }

  SubjectScore score(const Subject& subject, core::Progress& progress) const override {
    SubjectScore score{.sequence = subject.sequence.name, .camera = subject.camera().name};
    const auto file = result_file(subject);
    PointCloud result = read_point_cloud(file);
    TrueCloud truth = true_cloud(subject, max_depth_m_);
    score.notes = std::move(truth.notes);
    note_result(file, result, score);
    if (truth.points.empty())
      core::fail(core::ErrorKind::Input,
                 "{}: no depth of {} is within the limit ({}); --max-depth-m 0 lifts it",
                 subject.dataset.root.string(), score.camera,
                 limit_text("depth", max_depth_m_, "m"));
    note_floor(truth, score);
    const Eigen::AlignedBox3d true_box = box_of(truth.points), result_box = box_of(result.points);
    const CroppedClouds clouds = crop_clouds(std::move(truth.points), std::move(result.points),
                                             options_.crop, options_.cloud_distances_m.back());
    if (clouds.truth.empty() || clouds.result.empty())
      core::fail(
          core::ErrorKind::Input,
          "{}: no points within the bounds {}: the truth lies within {}, the result within {} "
          "(both must be in one frame; --crop none compares all)",
          file.string(), box_text(clouds.bounds), box_text(true_box), box_text(result_box));
    note_crop(clouds, score);
    score.frames.push_back(frame_of(clouds));
    progress.advance(subject.sequence.num_frames);
    return score;
  }

 private:
  std::filesystem::path result_file(const Subject& subject) const {
    std::error_code error;
    if (std::filesystem::is_regular_file(options_.result, error)) {
      if (subject.is_only_sequence && subject.is_only_camera) return options_.result;
      core::fail(core::ErrorKind::Usage,
                 "{}: one cloud for several; name one --sequence and --camera, or a folder with "
                 "{}/{}.ply",
                 options_.result.string(), subject.sequence.name, subject.camera().name);
    }
    std::vector<std::filesystem::path> stems{options_.result / subject.sequence.name /
                                             subject.camera().name};
    if (subject.is_only_camera) stems.push_back(options_.result / subject.sequence.name);
    if (subject.is_only_sequence) stems.push_back(options_.result / subject.camera().name);
    if (subject.is_only_camera && subject.is_only_sequence) stems.push_back(options_.result);
    std::vector<std::string> tried;
    for (const auto& stem : stems)
      for (const char* const end :
           {".ply", ".pcd", ".las", ".xyz", "/points3D.bin", "/points3D.txt"}) {
        const std::filesystem::path path = stem.string() + end;
        if (std::filesystem::is_regular_file(path, error)) return path;
        tried.push_back(path.string());
      }
    core::fail(core::ErrorKind::Input, "no cloud of sequence {}, camera {}: {} was looked for",
               subject.sequence.name, subject.camera().name, fmt::join(tried, ", "));
  }

  static Eigen::AlignedBox3d box_of(const std::vector<Eigen::Vector3d>& points) {
    Eigen::AlignedBox3d box;
    for (const Eigen::Vector3d& point : points) box.extend(point);
    return box;
  }
  static std::string box_text(const Eigen::AlignedBox3d& box) {
    if (box.isEmpty()) return "(empty)";
    return fmt::format("({:.6g}, {:.6g}, {:.6g}) to ({:.6g}, {:.6g}, {:.6g}) m", box.min().x(),
                       box.min().y(), box.min().z(), box.max().x(), box.max().y(), box.max().z());
  }

  static void note_result(const std::filesystem::path& file, const PointCloud& result,
                          SubjectScore& score) {
    score.notes.push_back(fmt::format("{}, {}: result: {} points of {}, as {}", score.sequence,
                                      score.camera, result.points.size(), file.string(),
                                      result.form));
    if (result.num_invalid > 0)
      score.notes.push_back(
          fmt::format("{}: {} points are NaN and left out", file.string(), result.num_invalid));
    if (result.num_withheld > 0)
      score.notes.push_back(fmt::format("{}: {} points are marked as withheld and left out",
                                        file.string(), result.num_withheld));
    for (const std::string& part : result.unused)
      score.notes.push_back(
          fmt::format("{}: {} are not used: its points alone count", file.string(), part));
  }

  /// What a result without any error would score, as not all true pixels are in the true cloud.
  void note_floor(const TrueCloud& truth, SubjectScore& score) const {
    if (truth.left_out.empty()) return;
    const std::vector<double> distances_m = nearest_distances_m(truth.points, truth.left_out);
    Sum mean, squares;
    for (const double distance_m : distances_m) {
      add(mean, distance_m);
      add(squares, distance_m * distance_m);
    }
    score.found.emplace_back("accuracy of the truth", mean_of(mean));
    score.found.emplace_back("accuracy RMS of the truth", std::sqrt(mean_of(squares)));
    std::vector<std::string> shares;
    for (const double most_m : options_.cloud_distances_m) {
      const double percent = share_within(distances_m, most_m);
      score.found.emplace_back(fmt::format("precision {} m of the truth", most_m), percent);
      shares.push_back(fmt::format("{:.2f} % within {} m", percent, most_m));
    }
    score.notes.push_back(fmt::format(
        "{}, {}: {} pixels drawn from the same depth images are {:.4g} m from the true cloud on "
        "average (RMS {:.4g} m), {}: as far as a result without error would be",
        score.sequence, score.camera, distances_m.size(), mean_of(mean),
        std::sqrt(mean_of(squares)), fmt::join(shares, ", ")));
  }

  static void note_crop(const CroppedClouds& clouds, SubjectScore& score) {
    if (clouds.bounds.isEmpty()) return;
    score.notes.push_back(fmt::format(
        "{}, {}: bounds {}: {} points of the result and {} of the truth are outside and left out",
        score.sequence, score.camera, box_text(clouds.bounds), clouds.num_result_outside,
        clouds.num_truth_outside));
  }

  FrameScore frame_of(const CroppedClouds& clouds) const {
    const CloudErrors errors = cloud_errors(clouds.truth, clouds.result);
    FrameScore frame{.frame = 0,
                     .is_answered = true,
                     .num_truth = static_cast<std::int64_t>(clouds.truth.size()),
                     .num_answered = static_cast<std::int64_t>(clouds.truth.size())};
    frame.sums.resize(kNumFixed);
    const auto add_all = [&](const std::vector<double>& distances_m, CloudIndex mean,
                             CloudIndex root) {
      for (const double distance_m : distances_m) {
        add(frame.sums[mean], distance_m);
        add(frame.sums[root], distance_m * distance_m);
      }
    };
    add_all(errors.accuracy_m, kAccuracy, kAccuracyRms);
    add_all(errors.completeness_m, kCompleteness, kCompletenessRms);
    add(frame.sums[kChamfer],
        0.5 * (mean_of(frame.sums[kAccuracy]) + mean_of(frame.sums[kCompleteness])));
    add(frame.sums[kChamferSquares],
        mean_of(frame.sums[kAccuracyRms]) + mean_of(frame.sums[kCompletenessRms]));
    for (const double distance_m : options_.cloud_distances_m) {
      const double precision = share_within(errors.accuracy_m, distance_m);
      const double recall = share_within(errors.completeness_m, distance_m);
      for (const double share :
           {precision, recall,
            precision + recall > 0.0 ? 2.0 * precision * recall / (precision + recall) : 0.0}) {
        frame.sums.emplace_back();
        add(frame.sums.back(), share);
      }
    }
    return frame;
  }

  EvaluateOptions options_;
  double max_depth_m_;
};

}  // namespace

std::unique_ptr<Task> make_cloud_task(const EvaluateOptions& options) {
  return std::make_unique<CloudTask>(options);
}

}  // namespace terracast::validate
