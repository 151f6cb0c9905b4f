#include "validate/evaluate/cloud_truth.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/parallel.h"
#include "core/random.h"
#include "validate/evaluate/results/cloud_files.h"
#include "validate/evaluate/truth.h"

namespace terracast::validate {

namespace {

constexpr const char* kCloudFormat = "a cloud";

TrueCloud cloud_of_file(const std::filesystem::path& file) {
  PointCloud read = read_point_cloud(file);
  TrueCloud cloud{.points = std::move(read.points)};
  cloud.notes.push_back(
      fmt::format("truth: {} points of {}, as {}", cloud.points.size(), file.string(), read.form));
  if (read.num_invalid > 0)
    cloud.notes.push_back(fmt::format("truth: {} points are NaN and left out", read.num_invalid));
  if (read.num_withheld > 0)
    cloud.notes.push_back(
        fmt::format("truth: {} points are marked as withheld and left out", read.num_withheld));
  for (const std::string& part : read.unused)
    cloud.notes.push_back(fmt::format("truth: {} are not used: its points alone count", part));
  return cloud;
}

}  // namespace

bool is_cloud_file(const std::filesystem::path& truth) {
  std::error_code error;
  return std::filesystem::is_regular_file(truth, error);
}

Dataset dataset_of_cloud(const std::filesystem::path& file) {
  Dataset dataset;
  dataset.root = file;
  dataset.format = kCloudFormat;
  dataset.world_name = file.filename().string();
  Camera camera;
  camera.name = "points";
  camera.files.resize(1);
  camera.local_from_camera.resize(1);
  Sequence sequence;
  sequence.name = file.stem().string();
  sequence.num_frames = 1;
  sequence.cameras.push_back(std::move(camera));
  dataset.sequences.push_back(std::move(sequence));
  return dataset;
}

TrueCloud true_cloud(const Subject& subject, double max_depth_m, std::int64_t most_pixels) {
  if (subject.dataset.format == kCloudFormat) return cloud_of_file(subject.dataset.root);
  const Intrinsics& k = sound_intrinsics(subject);
  const Camera& camera = subject.camera();
  std::vector<int> frames;
  for (int frame = 0; frame < subject.sequence.num_frames; ++frame)
    if (has_depth_truth(subject, frame) &&
        camera.local_from_camera[static_cast<std::size_t>(frame)])
      frames.push_back(frame);
  int stride = 1;
  const auto num_pixels = [&](int step) {
    return static_cast<std::int64_t>(frames.size()) * ((k.width_px + step - 1) / step) *
           ((k.height_px + step - 1) / step);
  };
  while (num_pixels(stride) > most_pixels && stride < std::max(k.width_px, k.height_px)) ++stride;
  constexpr std::int64_t kMostLeftOut = 100'000;
  const std::int64_t num_drawn =
      stride == 1 || frames.empty()
          ? 0
          : (kMostLeftOut + static_cast<std::int64_t>(frames.size()) - 1) /
                static_cast<std::int64_t>(frames.size());
  std::vector<std::vector<Eigen::Vector3d>> points_of(frames.size()), drawn_of(frames.size());
  core::parallel_for(static_cast<std::int64_t>(frames.size()), [&](std::int64_t index) {
    const auto i = static_cast<std::size_t>(index);
    const core::ImageF depth = depth_truth(subject, frames[i]);
    const Pose& pose = *camera.local_from_camera[static_cast<std::size_t>(frames[i])];
    const auto take = [&](int x, int y, std::vector<Eigen::Vector3d>& points) {
      const auto depth_m = static_cast<double>(depth(x, y));
      if (!std::isfinite(depth_m) || !is_within_limit(depth_m, max_depth_m)) return;
      const Eigen::Vector3d point = k.point_from_pixel({x + 0.5, y + 0.5}, depth_m);
      if (point.allFinite()) points.push_back(pose.rotation * point + pose.translation);
    };
    for (int y = stride / 2; y < k.height_px; y += stride)
      for (int x = stride / 2; x < k.width_px; x += stride) take(x, y, points_of[i]);
    constexpr std::uint64_t kSeed = 0;
    for (std::uint64_t n = 0; n < static_cast<std::uint64_t>(num_drawn); ++n)
      take(static_cast<int>(core::random_unit(kSeed, static_cast<std::uint64_t>(index), 2 * n) *
                            k.width_px),
           static_cast<int>(core::random_unit(kSeed, static_cast<std::uint64_t>(index), 2 * n + 1) *
                            k.height_px),
           drawn_of[i]);
  });
  TrueCloud cloud;
  for (const auto& points : points_of)
    cloud.points.insert(cloud.points.end(), points.begin(), points.end());
  for (const auto& points : drawn_of)
    cloud.left_out.insert(cloud.left_out.end(), points.begin(), points.end());
  cloud.notes.push_back(fmt::format(
      "{}, {}: truth: {} points of {} depth images, {} of each, in east, north, up from the "
      "sequence's "
      "origin",
      subject.sequence.name, camera.name, cloud.points.size(), frames.size(),
      stride == 1 ? std::string("all pixels") : fmt::format("every {}th row and column", stride)));
  return cloud;
}

}  // namespace terracast::validate
