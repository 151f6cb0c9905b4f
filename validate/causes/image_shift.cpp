#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "validate/causes/trial.h"
#include "validate/checks/checker.h"
#include "validate/sampling.h"
#include "validate/transfer.h"

/// Images that stand some part of a pixel beside depth and poses: what they show in common is then off by other vectors
/// in every other view.
namespace terracast::validate {

namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;

/// A patch's shift between two images: `slope` times the shift of all images of a group.
struct Sample {
  Vector2d seen_px;
  Matrix2d slope;
};

/// d pixel of b / d pixel of a, along the surface that a's depth shows.
std::optional<Matrix2d> jacobian_of(const ViewPair& pair, const Transfer& transfer, int x, int y) {
  const core::ImageF& depth = pair.a.image->depth;
  Matrix2d jacobian;
  for (int axis = 0; axis < 2; ++axis) {
    std::array<Vector2d, 2> ends;
    for (const int side : {0, 1}) {
      const int px = x + (axis == 0 ? 2 * side - 1 : 0), py = y + (axis == 1 ? 2 * side - 1 : 0);
      if (px < 0 || py < 0 || px >= depth.width() || py >= depth.height()) return std::nullopt;
      const auto depth_m = static_cast<double>(depth(px, py));
      if (!std::isfinite(depth_m)) return std::nullopt;
      const auto place = transfer.point({px + 0.5, py + 0.5}, depth_m);
      if (!place || !(place->distance_b_m > 0.0)) return std::nullopt;
      ends[static_cast<std::size_t>(side)] = place->pixel;
    }
    jacobian.col(axis) = 0.5 * (ends[1] - ends[0]);
  }
  return jacobian;
}

std::vector<Sample> samples_of(const Trial& trial, const std::vector<int>& cameras) {
  constexpr std::int64_t kPatches = 150;
  const auto is_shifted = [&](int camera) {
    return std::find(cameras.begin(), cameras.end(), camera) != cameras.end();
  };
  std::vector<Sample> samples;
  Findings ignored;
  FrameWindow window(*trial.dataset, trial.sequence, ignored, trial.images);
  while (window.advance()) {
    const std::vector<ViewPair> pairs = window.pairs();
    trial.spend(pairs.size());
    for (const ViewPair& pair : pairs) {
      const bool is_a = is_shifted(pair.a.camera_index), is_b = is_shifted(pair.b.camera_index);
      if (pair.a.image->depth.empty() || (!is_a && !is_b)) continue;
      const Transfer transfer(pair.a, pair.b);
      for (const Eigen::Vector2i& at :
           draw_pixels(pair.a.camera->intrinsics, kPatches, {}, pair.a, 14)) {
        const auto match = match_patch(pair.a, pair.b, at.x(), at.y());
        if (!match || !match->has_converged || !match->is_resolved || match->is_level) continue;
        const auto jacobian = jacobian_of(pair, transfer, at.x(), at.y());
        if (!jacobian) continue;
        samples.push_back({match->shift_px, (is_b ? 1.0 : 0.0) * Matrix2d::Identity() -
                                                (is_a ? 1.0 : 0.0) * *jacobian});
      }
    }
  }
  return samples;
}

/// The shift that explains most, by least squares without the samples that are farthest off; nothing where the views are
/// too alike to tell.
std::optional<Vector2d> shift_of(const std::vector<Sample>& samples) {
  constexpr std::size_t kEnough = 200;
  constexpr double kLeast_px = 0.1;
  if (samples.size() < kEnough) return std::nullopt;
  Vector2d shift = Vector2d::Zero();
  double cut_px = std::numeric_limits<double>::infinity();
  for (int turn = 0; turn < 4; ++turn) {
    Matrix2d normal = Matrix2d::Zero();
    Vector2d right = Vector2d::Zero();
    std::vector<double> left;
    for (const Sample& sample : samples) {
      const double off_px = (sample.seen_px - sample.slope * shift).norm();
      left.push_back(off_px);
      if (off_px > cut_px) continue;
      normal += sample.slope.transpose() * sample.slope;
      right += sample.slope.transpose() * sample.seen_px;
    }
    cut_px = 3.0 * median(left);
    const Eigen::LDLT<Matrix2d> factored(normal);
    // Views are told apart by slopes of a hundredth and more.
    if (normal.trace() < 1e-4 * static_cast<double>(samples.size()) || factored.rcond() < 1e-3)
      return std::nullopt;
    shift = factored.solve(right);
  }
  return shift.norm() > kLeast_px ? std::optional(shift) : std::nullopt;
}

/// Brings all pixels back by a shift, by the cubic of Catmull and Rom; border pixels stay.
void shift_back(LoadedImage& image, const Vector2d& shift_px) {
  const auto moved = [&](const core::ImageF& old, int x, int y) {
    const Vector2d from = Vector2d(x + 0.5, y + 0.5) + shift_px;
    return has_cubic_support(old, from) ? sample_cubic(old, from).value
                                        : static_cast<double>(old(x, y));
  };
  const core::Image8 color = image.color;
  for (int k = 0; k < color.channels(); ++k) {
    core::ImageF channel(color.width(), color.height());
    for (int y = 0; y < color.height(); ++y)
      for (int x = 0; x < color.width(); ++x) channel(x, y) = color(x, y, k);
    for (int y = 0; y < color.height(); ++y)
      for (int x = 0; x < color.width(); ++x)
        image.color(x, y, k) =
            static_cast<std::uint8_t>(std::lround(std::clamp(moved(channel, x, y), 0.0, 255.0)));
  }
  const core::ImageF grey = image.grey;
  for (int y = 0; y < grey.height(); ++y)
    for (int x = 0; x < grey.width(); ++x) image.grey(x, y) = static_cast<float>(moved(grey, x, y));
}

}  // namespace

void make_image_shift_causes(const Symptoms& symptoms, std::vector<Hypothesis>& hypotheses) {
  if (!symptoms.fails("photometric") && !symptoms.fails("stereo")) return;
  // What depth or flow contradict is no matter of images alone.
  if (symptoms.fails("reprojection") || symptoms.fails("flow")) return;
  const Trial& trial = symptoms.trial;
  std::vector<std::vector<int>> groups = groups_of_images(trial);
  for (const std::vector<int>& cameras : groups) {
    const std::optional<Vector2d> shift = shift_of(samples_of(trial, cameras));
    if (!shift) continue;
    Hypothesis h;
    h.checks = {"photometric", "stereo"};
    h.rank = 2 + (cameras.size() == groups[0].size() ? 0 : 1);
    h.undo = [cameras, shift = *shift](Trial& t, Cause& cause) {
      for (const int c : cameras)
        for (int f = 0; f < t.num_frames(); ++f)
          if (!t.image(c, f).color.empty()) shift_back(t.edit(c, f), shift);
      constexpr double kNear_px = 0.15;
      const bool is_half = (shift.cwiseAbs() - Vector2d(0.5, 0.5)).cwiseAbs().maxCoeff() < kNear_px;
      cause.name = "images_shifted";
      cause.camera = cameras.size() == 1 ? t.camera(cameras[0]).name : "";
      cause.size = shift.norm();
      cause.unit = "px";
      cause.words =
          fmt::format("images of {} are shifted by ({:.1f}, {:.1f}) px against depth and poses{}",
                      t.camera_names(cameras), shift.x(), shift.y(),
                      is_half ? ": half a pixel, as by the other rule of pixel centres" : "");
      return true;
    };
    hypotheses.push_back(std::move(h));
  }
}

}  // namespace terracast::validate
