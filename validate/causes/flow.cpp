#include <fmt/format.h>

#include <algorithm>

#include "validate/causes/trial.h"
#include "validate/sampling.h"
#include "validate/transfer.h"

/// Flow of another sign, order, direction or pair of frames; masks; disparity.
namespace terracast::validate {

namespace {

using Eigen::Vector2d;

/// Every so many pixels both ways are enough to know a flow again.
constexpr int kStep = 12;
constexpr double kSame_px = 0.01;

/// Where a pixel of one frame stands in another, by depth, poses and intrinsics; sky by rotation.
std::optional<Vector2d> target_of(const Trial& trial, int camera, int from, int to, int x, int y) {
  const auto view_from = view_at(trial.sequence, camera, from, &trial.image(camera, from));
  const auto view_to = view_at(trial.sequence, camera, to, &trial.image(camera, to));
  // An earlier cause may have left a frame without pose or depth.
  if (!view_from || !view_to || view_from->image->depth.empty()) return std::nullopt;
  const Transfer transfer(*view_from, *view_to);
  const auto depth_m = static_cast<double>(view_from->image->depth(x, y));
  const auto place = std::isfinite(depth_m) ? transfer.point({x + 0.5, y + 0.5}, depth_m)
                                            : transfer.direction({x + 0.5, y + 0.5});
  if (!place || !(place->distance_b_m > 0.0)) return std::nullopt;
  return place->pixel;
}

using Transform = Vector2d (*)(const Vector2d&);

/// Median difference between a stored field, undone, and the flow from one frame to another; large
/// where there is nothing to compare.
double difference(const Trial& trial, int camera, const core::ImageF& field, int from, int to,
                  Transform undo) {
  if (from < 0 || to < 0 || from >= trial.num_frames() || to >= trial.num_frames() ||
      field.empty() || trial.image(camera, from).depth.empty())
    return 1e9;
  std::vector<double> sizes;
  for (int y = kStep / 2; y < field.height(); y += kStep)
    for (int x = kStep / 2; x < field.width(); x += kStep) {
      // The sky stands still in straight flight, between any frames.
      if (!std::isfinite(trial.image(camera, from).depth(x, y))) continue;
      const auto target = target_of(trial, camera, from, to, x, y);
      if (!target) continue;
      const Vector2d stored =
          undo({static_cast<double>(field(x, y, 0)), static_cast<double>(field(x, y, 1))});
      sizes.push_back((stored - (*target - Vector2d(x + 0.5, y + 0.5))).norm());
    }
  constexpr std::size_t kEnough = 50;
  return sizes.size() < kEnough ? 1e9 : median(sizes);
}

/// The flow of a pair as it should be, with its masks.
void fill(const Trial& trial, int camera, int from, int to, core::ImageF& flow,
          core::Image8& in_view, core::Image8& covisible) {
  const core::ImageF& other = trial.image(camera, to).depth;
  for (int y = 0; y < flow.height(); ++y)
    for (int x = 0; x < flow.width(); ++x) {
      const auto target = target_of(trial, camera, from, to, x, y);
      in_view(x, y) = covisible(x, y) = 0;
      if (!target) continue;
      flow(x, y, 0) = static_cast<float>(target->x() - x - 0.5);
      flow(x, y, 1) = static_cast<float>(target->y() - y - 0.5);
      in_view(x, y) = trial.camera(camera).intrinsics.contains(*target) ? 1 : 0;
      const bool has_depth = std::isfinite(trial.image(camera, from).depth(x, y));
      covisible(x, y) = in_view(x, y) != 0 && has_depth && !other.empty() ? 1 : 0;
    }
}

struct Field {
  int camera;
  int frame;
};
std::vector<Field> fields_of(const Trial& trial) {
  std::vector<Field> fields;
  for (int c = 0; c < trial.num_cameras(); ++c)
    for (int f = 0; f + 1 < trial.num_frames(); ++f)
      if (trial.image(c, f).flow) fields.push_back({c, f});
  return fields;
}

/// What is stored where flow to the next frame is meant.
struct Kind {
  const char* name;
  const char* words;
  Transform undo;
  int from, to;  ///< frames after the field's, of the forward flow
};
constexpr Transform kSame = [](const Vector2d& v) { return v; };

const Kind kKinds[] = {
    {"flow_sign", "flow has the opposite sign", [](const Vector2d& v) { return Vector2d(-v); }, 0,
     1},
    {"flow_order", "flow has u and v swapped",
     [](const Vector2d& v) { return Vector2d(v.y(), v.x()); }, 0, 1},
    {"flow_sign", "flow has the opposite sign in u",
     [](const Vector2d& v) { return Vector2d(-v.x(), v.y()); }, 0, 1},
    {"flow_sign", "flow has the opposite sign in v (up where down is meant)",
     [](const Vector2d& v) { return Vector2d(v.x(), -v.y()); }, 0, 1},
    {"flow_direction", "flow is of the wrong direction: backward flow is stored as forward flow",
     kSame, 1, 0},
    {"flow_frame", "flow is of the wrong frame: to frame + 2 where frame + 1 is meant", kSame, 0,
     2},
    {"flow_frame", "flow is of the wrong frame: to frame - 1 where frame + 1 is meant", kSame, 0,
     -1},
    {"flow_frame", "flow is of the wrong frame: that of the next pair of frames", kSame, 1, 2},
    {"flow_frame", "flow is of the wrong frame: that of the pair of frames before", kSame, -1, 0},
};

void add_kinds(const Symptoms& symptoms, std::vector<Hypothesis>& hypotheses) {
  for (const Kind& kind : kKinds) {
    // Of the pairs that there are frames for.
    std::size_t num_same = 0, num_other = 0;
    for (const Field& field : fields_of(symptoms.trial)) {
      const double off_px =
          difference(symptoms.trial, field.camera,
                     symptoms.trial.image(field.camera, field.frame).flow->forward,
                     field.frame + kind.from, field.frame + kind.to, kind.undo);
      if (off_px < kSame_px)
        ++num_same;
      else if (off_px < 1e9)
        ++num_other;
    }
    if (num_same == 0 || num_other > 0) continue;
    Hypothesis h;
    h.checks = {"flow"};
    h.rank = 1;
    h.undo = [kind](Trial& trial, Cause& cause) {
      const bool is_other_pair = kind.from != 0 || kind.to != 1;
      for (const Field& field : fields_of(trial)) {
        FlowFields& flow = trial.edit_flow(field.camera, field.frame);
        if (is_other_pair) {
          // It was known again as that pair's: what the right pair's is follows from the rest.
          fill(trial, field.camera, field.frame, field.frame + 1, flow.forward,
               flow.in_view_forward, flow.covisible_forward);
          if (!flow.backward.empty())
            fill(trial, field.camera, field.frame + 1, field.frame, flow.backward,
                 flow.in_view_backward, flow.covisible_backward);
          continue;
        }
        for (core::ImageF* image : {&flow.forward, &flow.backward})
          for (int y = 0; y < image->height(); ++y)
            for (int x = 0; x < image->width(); ++x) {
              const Vector2d right = kind.undo(
                  {static_cast<double>((*image)(x, y, 0)), static_cast<double>((*image)(x, y, 1))});
              (*image)(x, y, 0) = static_cast<float>(right.x());
              (*image)(x, y, 1) = static_cast<float>(right.y());
            }
      }
      cause.name = kind.name;
      cause.words = kind.words;
      return true;
    };
    hypotheses.push_back(std::move(h));
  }
}

/// A factor on all flow, by the median of its sizes.
void add_scale(const Symptoms& symptoms, std::vector<Hypothesis>& hypotheses) {
  std::vector<double> factors;
  const Trial& trial = symptoms.trial;
  for (const Field& field : fields_of(trial)) {
    const core::ImageF& flow = trial.image(field.camera, field.frame).flow->forward;
    for (int y = kStep / 2; y < flow.height(); y += kStep)
      for (int x = kStep / 2; x < flow.width(); x += kStep) {
        const auto target = target_of(trial, field.camera, field.frame, field.frame + 1, x, y);
        if (!target) continue;
        const Vector2d right = *target - Vector2d(x + 0.5, y + 0.5);
        const Vector2d stored(static_cast<double>(flow(x, y, 0)),
                              static_cast<double>(flow(x, y, 1)));
        if (right.norm() > 0.1) factors.push_back(stored.dot(right) / right.squaredNorm());
      }
  }
  if (factors.size() < 50) return;
  const double factor = median(factors);
  if (!(std::abs(factor) > 1e-6) || std::abs(factor - 1.0) < 1e-4) return;
  Hypothesis h;
  h.checks = {"flow"};
  h.rank = 3;
  h.undo = [factor](Trial& t, Cause& cause) {
    for (const Field& field : fields_of(t)) {
      FlowFields& flow = t.edit_flow(field.camera, field.frame);
      for (core::ImageF* image : {&flow.forward, &flow.backward})
        for (float& value : image->data())
          value = static_cast<float>(static_cast<double>(value) / factor);
    }
    cause.name = "flow_scale";
    cause.size = factor;
    cause.unit = "times";
    cause.words = fmt::format("flow is scaled by {:.6g}", factor);
    return true;
  };
  hypotheses.push_back(std::move(h));
}

void add_masks(std::vector<Hypothesis>& hypotheses) {
  struct Mask {
    const char* words;
    bool in_view, covisible, is_swap;
  };
  for (const Mask& mask :
       {Mask{"masks of flow are inverted", true, true, false},
        Mask{"co-visible masks of flow are inverted", false, true, false},
        Mask{"field-of-view masks of flow are inverted", true, false, false},
        Mask{"masks of forward and backward flow are swapped", false, false, true}}) {
    Hypothesis h;
    h.checks = {"flow"};
    h.rank = 2;
    h.undo = [mask](Trial& trial, Cause& cause) {
      const auto invert = [](core::Image8& image) {
        for (std::uint8_t& value : image.data()) value = value == 0 ? 1 : 0;
      };
      for (const Field& field : fields_of(trial)) {
        FlowFields& flow = trial.edit_flow(field.camera, field.frame);
        if (mask.is_swap) {
          if (flow.backward.empty()) return false;
          std::swap(flow.in_view_forward, flow.in_view_backward);
          std::swap(flow.covisible_forward, flow.covisible_backward);
        }
        if (mask.in_view) invert(flow.in_view_forward), invert(flow.in_view_backward);
        if (mask.covisible) invert(flow.covisible_forward), invert(flow.covisible_backward);
      }
      cause.name = "mask_inverted";
      if (mask.is_swap) cause.name = "masks_swapped";
      cause.words = mask.words;
      return true;
    };
    hypotheses.push_back(std::move(h));
  }
}

void add_disparity(const Symptoms& symptoms, std::vector<Hypothesis>& hypotheses) {
  const Trial& trial = symptoms.trial;
  if (!trial.sequence.stereo) return;
  const int left = trial.sequence.stereo->left;
  const Intrinsics& k = trial.camera(left).intrinsics;
  const double product = k.fx_px * trial.sequence.stereo->baseline_m;
  std::vector<double> factors;
  for (int f = 0; f < trial.num_frames(); ++f) {
    const LoadedImage& image = trial.image(left, f);
    if (image.disparity.empty() || image.depth.empty()) return;
    for (std::size_t i = 0; i < image.disparity.data().size(); i += 7) {
      const double factor = static_cast<double>(image.disparity.data()[i]) *
                            static_cast<double>(image.depth.data()[i]) / product;
      if (std::isfinite(factor)) factors.push_back(factor);
    }
  }
  if (factors.size() < 50) return;
  // By what the file rounds to: half a step of what is stored, before it is divided.
  const auto fits = [&](double factor) {
    const double tolerance_px = 0.52 / 256.0 / std::abs(factor) + 1e-3;
    std::size_t num_near = 0, num_compared = 0;
    for (int f = 0; f < trial.num_frames(); ++f) {
      const LoadedImage& image = trial.image(left, f);
      for (std::size_t i = 0; i < image.disparity.data().size(); i += 7) {
        const double right = product / static_cast<double>(image.depth.data()[i]);
        const double undone = static_cast<double>(image.disparity.data()[i]) / factor;
        if (!std::isfinite(right) || !std::isfinite(undone)) continue;
        ++num_compared;
        if (std::abs(undone - right) < tolerance_px + 2e-4 * right) ++num_near;
      }
    }
    return num_compared >= 50 && 10 * num_near >= 9 * num_compared;
  };
  double factor = median(factors);
  // Common mistakes are whole powers; the rounding of the file hides that they are.
  for (const double known : {1.0 / 256.0, 256.0, 0.5, 2.0, 1.0 / 16.0, 16.0})
    if (factor > 0.5 * known && factor < 2.0 * known && fits(known)) {
      factor = known;
      break;
    }
  if (std::abs(factor - 1.0) < 2e-4 || !fits(factor)) return;
  Hypothesis h;
  h.checks = {"stereo"};
  h.rank = 2;
  h.undo = [=](Trial& t, Cause& cause) {
    for (int f = 0; f < t.num_frames(); ++f) {
      LoadedImage& image = t.edit(left, f);
      for (std::size_t i = 0; i < image.disparity.data().size(); ++i) {
        const double right = product / static_cast<double>(image.depth.data()[i]);
        image.disparity.data()[i] = static_cast<float>(std::round(256.0 * right) / 256.0);
      }
    }
    cause.name = "disparity_scale";
    cause.size = factor;
    cause.unit = "times";
    cause.words = fmt::format(
        "disparity is scaled by {:.6g}{}", factor,
        factor == 1.0 / 256.0 ? ": whole pixels are stored where 1/256 px are meant" : "");
    return true;
  };
  hypotheses.push_back(std::move(h));
}

}  // namespace

void make_flow_causes(const Symptoms& symptoms, std::vector<Hypothesis>& hypotheses) {
  if (symptoms.fails("flow")) {
    add_kinds(symptoms, hypotheses);
    add_scale(symptoms, hypotheses);
    add_masks(hypotheses);
  }
  if (symptoms.fails("stereo")) add_disparity(symptoms, hypotheses);
}

}  // namespace terracast::validate
