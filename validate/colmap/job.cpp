#include "validate/colmap/job.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "core/cpu_quota.h"
#include "core/error.h"
#include "core/stop.h"
#include "validate/checks/checker.h"
#include "validate/sampling.h"

// One line a mode, alphabetical; the file is colmap/<name>.cpp and defines run_colmap_<name>().
#define TERRACAST_COLMAP_MODES(X)                                                                 \
  X(free, "--colmap free: COLMAP's own reconstruction: positions, drift, scale, images left out") \
  X(georegister,                                                                                  \
    "--colmap georegister: model_aligner brings the model back to its places by "                 \
    "georegistration.txt")                                                                        \
  X(sparse,                                                                                       \
    "--colmap sparse: SIFT points at the known poses: reprojection, distance to the "             \
    "ground")

namespace terracast::validate {

namespace fs = std::filesystem;

#define TERRACAST_DECLARE(name, summary) \
  std::vector<CheckResult> run_colmap_##name(const ColmapJob&);
TERRACAST_COLMAP_MODES(TERRACAST_DECLARE)
#undef TERRACAST_DECLARE

std::span<const ColmapMode> colmap_modes() {
#define TERRACAST_ROW(name, summary) {#name, "colmap_" #name, summary, &run_colmap_##name},
  static constexpr ColmapMode kTable[] = {TERRACAST_COLMAP_MODES(TERRACAST_ROW)};
#undef TERRACAST_ROW
  return kTable;
}

std::vector<std::string> colmap_mode_names() {
  std::vector<std::string> names;
  for (const ColmapMode& mode : colmap_modes()) names.emplace_back(mode.name);
  return names;
}

namespace {

/// Images of the model that belong to a camera and frame of the sequence, under names that COLMAP's
/// lists can hold.
std::vector<Shot> shots_of(const Sequence& sequence) {
  const ColmapModel& model = *sequence.binary_model;
  std::map<std::string, std::pair<int, int>> by_name;
  for (int c = 0; c < static_cast<int>(sequence.cameras.size()); ++c)
    for (int f = 0; f < sequence.num_frames; ++f)
      by_name[fmt::format("{}/{}.png", sequence.cameras[static_cast<std::size_t>(c)].name,
                          frame_digits(f))] = {c, f};
  std::vector<Shot> shots;
  for (const auto& [id, image] : model.images) {
    const auto found = by_name.find(image.name);
    if (found == by_name.end()) continue;
    const auto [camera_index, frame] = found->second;
    const Camera& camera = sequence.cameras[static_cast<std::size_t>(camera_index)];
    const std::optional<Pose>& pose = camera.local_from_camera[static_cast<std::size_t>(frame)];
    const auto is_plain = [](unsigned char c) { return c > ' ' && c != 127; };
    if (!pose || !camera.intrinsics.is_sound() ||
        !std::all_of(image.name.begin(), image.name.end(), is_plain))
      continue;
    shots.push_back({.image_id = id,
                     .name = image.name,
                     .camera_index = camera_index,
                     .frame = frame,
                     .camera = &camera,
                     .local_from_camera = *pose,
                     .model_image = &image});
  }
  return shots;
}

CheckResult program_result(std::string_view mode, const std::string& failure,
                           const std::string& version) {
  CheckResult result = colmap_result(fmt::format("colmap_{}_program", mode),
                                     failure.empty() ? 0.0 : 1.0, 0.0, "failures");
  result.worst = failure;
  result.summary = version.empty() ? "COLMAP's commands did their work."
                                   : fmt::format("The commands of {} did their work.", version);
  result.reason = "What was not measured is not right.";
  result.detects = "a program that is missing, is ended, runs out of time or gives no result";
  return result;
}

}  // namespace

CheckResult colmap_result(std::string name, double value, double bound, std::string unit) {
  CheckResult result;
  result.name = std::move(name);
  result.value = std::isfinite(value) ? value : 1e9;
  result.bound = bound;
  result.unit = std::move(unit);
  result.ok = result.is_within_bound();
  return result;
}

bool shows_ground(const core::ImageF& depth) {
  constexpr double kLeastShare = 0.3;
  std::size_t num_ground = 0;
  for (const float value : depth.data()) num_ground += std::isnan(value) ? 0 : 1;
  return !depth.empty() &&
         static_cast<double>(num_ground) >= kLeastShare * static_cast<double>(depth.data().size());
}

fs::path ColmapJob::folder() const { return fs::absolute(dataset.root / sequence.path); }
fs::path ColmapJob::images() const { return folder() / "images"; }

const Shot* ColmapJob::find(std::int64_t image_id) const {
  const auto found =
      std::lower_bound(shots.begin(), shots.end(), image_id,
                       [](const Shot& shot, std::int64_t id) { return shot.image_id < id; });
  return found == shots.end() || found->image_id != image_id ? nullptr : &*found;
}

core::ImageF ColmapJob::depth(const Shot& shot) const {
  if (shot.camera->files[static_cast<std::size_t>(shot.frame)].depth.empty()) return {};
  core::ImageF depth;
  Findings damage;  // the check `structure` has met it already
  damage.attempt(shot.name, [&] {
    depth = find_reader(dataset.format).depth(dataset, *shot.camera, shot.frame);
  });
  return depth;
}

double ColmapJob::ground_pixel_m() const {
  std::vector<double> sizes_m;
  for (const Shot& shot : shots) {
    const Pose camera_from_local = shot.local_from_camera.inverse();
    for (const ColmapObservation& seen : shot.model_image->observations) {
      const auto point = sequence.binary_model->points.find(seen.point_id);
      if (point == sequence.binary_model->points.end()) continue;
      const auto& p = point->second.position;
      const double depth_m = (camera_from_local * Eigen::Vector3d(p[0], p[1], p[2])).z();
      if (depth_m > 0.0) sizes_m.push_back(depth_m / shot.camera->intrinsics.fx_px);
    }
  }
  return median(sizes_m);
}

std::vector<CheckResult> run_colmap_modes(const Dataset& dataset, const Sequence& sequence,
                                          const ValidateOptions& options, const fs::path& work,
                                          const core::Context& context) {
  std::vector<CheckResult> results;
  for (const ColmapMode& mode : colmap_modes()) {
    if (std::find(options.colmap.begin(), options.colmap.end(), mode.name) == options.colmap.end())
      continue;
    if (sequence.has_rolling_shutters()) {
      results.push_back(skipped_result(fmt::format("colmap_{}_program", mode.name),
                                       "COLMAP knows one pose an image; of rolling shutters it "
                                       "would measure what the shutter moves"));
      continue;
    }
    if (sequence.states_belief) {
      results.push_back(skipped_result(
          fmt::format("colmap_{}_program", mode.name),
          "the model states a calibration that is believed and not true; export with calibration = "
          "\"true\" to have COLMAP check the images"));
      continue;
    }
    std::string failure, version;
    try {
      if (!sequence.binary_model)
        throw ColmapFailure("not a COLMAP dataset: there is nothing to give to COLMAP");
      ColmapJob job{
          .dataset = dataset,
          .sequence = sequence,
          .shots = shots_of(sequence),
          .program = ColmapProgram(work / "logs"),
          .work = WorkFolder(fs::absolute(work)),
          .num_threads = context.num_threads > 0 ? context.num_threads : core::cpus_to_use(),
          .num_seeds = static_cast<int>(options.colmap_seeds),
          .log = context.log};
      version = job.program.version();
      constexpr std::size_t kLeastImages = 3;
      if (job.shots.size() < kLeastImages)
        throw ColmapFailure(
            fmt::format("sparse/0 has {} images with a pose and a plain name; it "
                        "takes {}",
                        job.shots.size(), kLeastImages));
      context.log.info("colmap {}: {} images; steps and logs in {}", mode.name, job.shots.size(),
                       work.string());
      for (CheckResult& result : mode.run(job)) results.push_back(std::move(result));
    } catch (const ColmapFailure& thrown) {
      core::throw_if_stop_asked();  // the same signal may have ended COLMAP
      failure = thrown.what();
    } catch (const core::Error& thrown) {
      if (thrown.kind() != core::ErrorKind::Input) throw;
      failure = thrown.message();
    }
    results.push_back(program_result(mode.name, failure, version));
  }
  return results;
}

}  // namespace terracast::validate
