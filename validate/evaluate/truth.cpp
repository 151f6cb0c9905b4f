#include "validate/evaluate/truth.h"

#include <cmath>
#include <limits>

#include "core/error.h"
#include "validate/transfer.h"

namespace terracast::validate {

namespace {

using core::ErrorKind;
using core::fail;

/// RAFT-3D's limit.
constexpr double kMostDepth_m = 250.0;

constexpr float kNone = std::numeric_limits<float>::quiet_NaN();

const FrameFiles& files_of(const Subject& subject, int frame) {
  return subject.camera().files[static_cast<std::size_t>(frame)];
}

/// A frame's camera and the next frame's.
std::optional<ViewPair> now_and_next(const Subject& subject, int frame) {
  const auto now = view_at(subject.sequence, subject.camera_index, frame, nullptr);
  const auto next = view_at(subject.sequence, subject.camera_index, frame + 1, nullptr);
  if (!now || !next) return std::nullopt;
  return ViewPair{*now, *next};
}

Eigen::Vector2d centre_of(int x, int y) { return {x + 0.5, y + 0.5}; }

/// Leaves out what a mask says, by the format's own masks.
void apply_stored_masks(const FlowFields& fields, FlowMask mask, core::ImageF& flow) {
  if (mask == FlowMask::All) return;
  const core::Image8& kept =
      mask == FlowMask::InView ? fields.in_view_forward : fields.covisible_forward;
  for (std::size_t i = 0; i < flow.num_pixels(); ++i)
    if (kept.data()[i] == 0) flow.data()[2 * i] = flow.data()[2 * i + 1] = kNone;
}

/// Where the points of an image are in the next, what moves by its poses.
class NextPlaces {
 public:
  NextPlaces(const Subject& subject, int frame, const ViewPair& pair) : transfer_(pair.a, pair.b) {
    const std::string& file = files_of(subject, frame).moving;
    if (!file.empty())
      moving_ = read_png16(subject.dataset.root / file, file, 1, subject.camera().intrinsics);
  }
  std::optional<Transfer::Place> of(int x, int y, double depth_m) const {
    const int body = moving_.empty() ? 0 : moving_(x, y);
    return body == 0 ? transfer_.point(centre_of(x, y), depth_m)
                     : transfer_.point_of_body(body, centre_of(x, y), depth_m);
  }

 private:
  Transfer transfer_;
  core::Image16 moving_;  ///< empty: all stands still
};

}  // namespace

bool is_judged(const FlowTruth& truth, int x, int y, const EvaluateOptions& options) {
  const double length_px = vector_at(truth.flow, x, y).norm();
  return std::isfinite(length_px) &&
         is_within_limit(static_cast<double>(truth.depth(x, y)),
                         options.max_depth_m.value_or(kMostDepth_m)) &&
         is_within_limit(length_px, options.max_flow_px);
}

std::vector<std::string> flow_terms(const EvaluateOptions& options) {
  return {limit_text("depth", options.max_depth_m.value_or(kMostDepth_m), "m"),
          limit_text("flow", options.max_flow_px, "px"),
          options.mask == FlowMask::All      ? "hidden and leaving points count too"
          : options.mask == FlowMask::InView ? "points within the next image"
                                             : "points that the next frame sees"};
}

double focal_times_baseline(const Subject& subject) {
  const std::optional<StereoPair>& pair = subject.sequence.stereo;
  if (!pair || pair->left != subject.camera_index || !(pair->baseline_m > 0.0))
    fail(ErrorKind::Input,
         "{}: {} is not the left camera of a rectified pair, of which disparity would be",
         subject.dataset.root.string(), subject.camera().name);
  return sound_intrinsics(subject).fx_px * pair->baseline_m;
}

const Intrinsics& sound_intrinsics(const Subject& subject) {
  const Intrinsics& k = subject.camera().intrinsics;
  if (!k.is_sound())
    fail(ErrorKind::Input,
         "{}: the truth has no sound intrinsics of {}; `terracast validate` says why",
         subject.dataset.root.string(), subject.camera().name);
  return k;
}

bool has_depth_truth(const Subject& subject, int frame) {
  return !files_of(subject, frame).depth.empty();
}

bool has_flow_truth(const Subject& subject, int frame) {
  return frame + 1 < subject.sequence.num_frames && has_depth_truth(subject, frame) &&
         (!files_of(subject, frame).flow.empty() || now_and_next(subject, frame));
}

bool has_scene_flow_truth(const Subject& subject, int frame) {
  return has_flow_truth(subject, frame) && now_and_next(subject, frame);
}

core::ImageF depth_truth(const Subject& subject, int frame) {
  return subject.reader().depth(subject.dataset, subject.camera(), frame);
}

FlowTruth flow_truth(const Subject& subject, int frame, FlowMask mask) {
  const Intrinsics& k = sound_intrinsics(subject);
  FlowTruth truth;
  truth.depth = depth_truth(subject, frame);
  const bool is_stored = !files_of(subject, frame).flow.empty();
  if (is_stored) {
    FlowFields fields = subject.reader().flow(subject.dataset, subject.camera(), frame);
    truth.flow = std::move(fields.forward);
    apply_stored_masks(fields, mask, truth.flow);
    for (std::size_t i = 0; i < truth.flow.num_pixels(); ++i)
      if (!std::isfinite(truth.depth.data()[i]))
        truth.flow.data()[2 * i] = truth.flow.data()[2 * i + 1] = kNone;
    return truth;
  }
  if (mask == FlowMask::Covisible)
    fail(ErrorKind::Input,
         "{}: {} stores no mask of what the next frame sees of {}; --mask all or in-view is right",
         subject.dataset.root.string(), subject.dataset.format, subject.camera().name);
  truth.flow = core::ImageF(k.width_px, k.height_px, 2, kNone);
  const ViewPair pair = now_and_next(subject, frame).value();
  const NextPlaces places(subject, frame, pair);
  for (int y = 0; y < k.height_px; ++y)
    for (int x = 0; x < k.width_px; ++x) {
      const auto depth_m = static_cast<double>(truth.depth(x, y));
      if (!std::isfinite(depth_m)) continue;
      const Eigen::Vector2d pixel = centre_of(x, y);
      const auto place = places.of(x, y, depth_m);
      if (!place || !(place->distance_b_m > 0.0)) continue;
      const Eigen::Vector2d& there = place->pixel;
      if (mask == FlowMask::InView && !k.contains(there)) continue;
      for (int c = 0; c < 2; ++c) truth.flow(x, y, c) = static_cast<float>(there[c] - pixel[c]);
    }
  return truth;
}

SceneFlowTruth scene_flow_truth(const Subject& subject, int frame, FlowMask mask) {
  const Intrinsics& k = sound_intrinsics(subject);
  SceneFlowTruth truth;
  truth.image = flow_truth(subject, frame, mask);
  const bool is_stored = !files_of(subject, frame).flow.empty();
  const ViewPair pair = now_and_next(subject, frame).value();
  const NextPlaces places(subject, frame, pair);
  constexpr double kNoPoint = std::numeric_limits<double>::quiet_NaN();
  truth.points = core::Image<double>(k.width_px, k.height_px, 3, kNoPoint);
  truth.points_next = truth.points;
  for (int y = 0; y < k.height_px; ++y)
    for (int x = 0; x < k.width_px; ++x) {
      core::ImageF& flow = truth.image.flow;
      if (!std::isfinite(flow(x, y))) continue;
      const auto place = places.of(x, y, static_cast<double>(truth.image.depth(x, y)));
      // What a right dataset stores agrees to 0.005 px (the check `flow`): more is motion.
      constexpr double kStill_px = 0.1;
      if (is_stored) {
        const Eigen::Vector2d stored = centre_of(x, y) + vector_at(flow, x, y);
        if (!place || !(place->distance_b_m > 0.0) || (place->pixel - stored).norm() > kStill_px) {
          ++truth.num_moving;
          flow(x, y, 0) = flow(x, y, 1) = kNone;
          continue;
        }
      }
      if (!place) continue;
      for (int c = 0; c < 3; ++c) {
        truth.points(x, y, c) = place->point_a[c];
        truth.points_next(x, y, c) = place->point_b[c];
      }
    }
  return truth;
}

}  // namespace terracast::validate
