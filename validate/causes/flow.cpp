#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "validate/causes/trial.h"
#include "validate/sampling.h"
#include "validate/transfer.h"

/// Flow of another sign, order, direction or pair of frames, off by a constant or a pixel; masks.
namespace terracast::validate {

namespace {

using Eigen::Vector2d;

/// Sampling step, px: 12, and less in small images, so that about 400 pixels are compared.
int step_of(const core::ImageF& flow) {
  constexpr int kMost = 12;
  constexpr double kPixels = 400.0;
  return std::clamp(static_cast<int>(std::sqrt(flow.width() * flow.height() / kPixels)), 1, kMost);
}
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
  const int step = step_of(field);
  for (int y = step / 2; y < field.height(); y += step)
    for (int x = step / 2; x < field.width(); x += step) {
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

/// Whether the other frame has the depth there that a pixel's point has in it.
bool is_seen(const Trial& trial, int camera, int from, int to, int x, int y) {
  const auto view_from = view_at(trial.sequence, camera, from, &trial.image(camera, from));
  const auto view_to = view_at(trial.sequence, camera, to, &trial.image(camera, to));
  const auto depth_m = static_cast<double>(trial.image(camera, from).depth(x, y));
  if (!view_from || !view_to || view_to->image->depth.empty() || !std::isfinite(depth_m))
    return false;
  const auto place = Transfer(*view_from, *view_to).point({x + 0.5, y + 0.5}, depth_m);
  if (!place || !(place->distance_b_m > 0.0)) return false;
  const auto seen = sample_inverse_depth(view_to->image->depth, place->pixel);
  constexpr double kSame = 0.01;
  return !seen || std::abs(seen->inverse_depth.value * place->distance_b_m - 1.0) < kSame;
}

/// The flow of a pair as it should be, with its masks.
void fill(const Trial& trial, int camera, int from, int to, core::ImageF& flow,
          core::Image8& in_view, core::Image8& covisible) {
  for (int y = 0; y < flow.height(); ++y)
    for (int x = 0; x < flow.width(); ++x) {
      const auto target = target_of(trial, camera, from, to, x, y);
      in_view(x, y) = covisible(x, y) = 0;
      if (!target) continue;
      flow(x, y, 0) = static_cast<float>(target->x() - x - 0.5);
      flow(x, y, 1) = static_cast<float>(target->y() - y - 0.5);
      in_view(x, y) = trial.camera(camera).intrinsics.contains(*target) ? 1 : 0;
      covisible(x, y) = in_view(x, y) != 0 && is_seen(trial, camera, from, to, x, y) ? 1 : 0;
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

/// A field of one direction, of the pair of a frame and the next one.
struct Side {
  int camera;
  int frame;
  bool is_forward;

  int from() const { return frame + (is_forward ? 0 : 1); }
  int to() const { return frame + (is_forward ? 1 : 0); }
  const core::ImageF& of(const Trial& trial) const {
    const FlowFields& flow = *trial.image(camera, frame).flow;
    return is_forward ? flow.forward : flow.backward;
  }
  core::ImageF& edit(Trial& trial) const {
    FlowFields& flow = trial.edit_flow(camera, frame);
    return is_forward ? flow.forward : flow.backward;
  }
};

/// The flow that may have one fault: all, that of a camera, that of a direction, or of both.
struct Part {
  int camera = -1;  ///< -1: all
  bool has_forward = true, has_backward = true;
  std::string words = "flow";
};
std::vector<Part> parts_of(const Trial& trial) {
  std::vector<Part> parts = {
      {}, {-1, true, false, "forward flow"}, {-1, false, true, "backward flow"}};
  std::vector<int> cameras;
  for (const Field& field : fields_of(trial))
    if (std::find(cameras.begin(), cameras.end(), field.camera) == cameras.end())
      cameras.push_back(field.camera);
  if (cameras.size() < 2) return parts;
  for (const int camera : cameras)
    for (const Part& direction : {parts[0], parts[1], parts[2]})
      parts.push_back({camera, direction.has_forward, direction.has_backward,
                       fmt::format("{} of {}", direction.words, trial.camera_names({camera}))});
  return parts;
}
std::vector<Side> sides_of(const Trial& trial, const Part& part) {
  std::vector<Side> sides;
  for (const Field& field : fields_of(trial)) {
    if (part.camera >= 0 && field.camera != part.camera) continue;
    if (part.has_forward) sides.push_back({field.camera, field.frame, true});
    if (part.has_backward && !trial.image(field.camera, field.frame).flow->backward.empty())
      sides.push_back({field.camera, field.frame, false});
  }
  return sides;
}

/// What is stored where flow to the next frame is meant.
struct Kind {
  const char* name;
  const char* words;  ///< after those of the part
  Transform undo;
  int from, to;  ///< frames after the field's, of the forward flow
};
constexpr Transform kSame = [](const Vector2d& v) { return v; };

const Kind kKinds[] = {
    {"flow_sign", "has the opposite sign", [](const Vector2d& v) { return Vector2d(-v); }, 0, 1},
    {"flow_order", "has u and v swapped", [](const Vector2d& v) { return Vector2d(v.y(), v.x()); },
     0, 1},
    {"flow_sign", "has the opposite sign in u",
     [](const Vector2d& v) { return Vector2d(-v.x(), v.y()); }, 0, 1},
    {"flow_sign", "has the opposite sign in v (up where down is meant)",
     [](const Vector2d& v) { return Vector2d(v.x(), -v.y()); }, 0, 1},
    {"flow_direction", "is of the wrong direction: backward flow is stored as forward flow", kSame,
     1, 0},
    {"flow_frame", "is of the wrong frame: to frame + 2 where frame + 1 is meant", kSame, 0, 2},
    {"flow_frame", "is of the wrong frame: to frame - 1 where frame + 1 is meant", kSame, 0, -1},
    {"flow_frame", "is of the wrong frame: that of the next pair of frames", kSame, 1, 2},
    {"flow_frame", "is of the wrong frame: that of the pair of frames before", kSame, -1, 0},
};

/// By how many pixels the fields of a part are off a kind at most.
/// returns   nothing where one of them is of another kind, or all are as they should be
std::optional<double> distance_from_kind(const Trial& trial, const Part& part, const Kind& kind) {
  std::optional<double> most_px;
  bool is_any_wrong = false;
  for (const Side& side : sides_of(trial, part)) {
    // Backward flow starts at the later frame. Pairs whose frames are not at hand are skipped.
    const int way = side.is_forward ? 1 : -1;
    const double off_px =
        difference(trial, side.camera, side.of(trial), side.from() + way * kind.from,
                   side.from() + way * kind.to, kind.undo);
    if (off_px >= 1e9) continue;
    if (off_px >= kSame_px) return std::nullopt;
    most_px = std::max(most_px.value_or(0.0), off_px);
    is_any_wrong = is_any_wrong || difference(trial, side.camera, side.of(trial), side.from(),
                                              side.to(), kSame) >= kSame_px;
  }
  return is_any_wrong ? most_px : std::nullopt;
}

/// Flow of another pair of frames was known again as that pair's: what the right pair's is follows from the rest.
void fill_all(Trial& trial) {
  for (const Field& field : fields_of(trial)) {
    FlowFields& flow = trial.edit_flow(field.camera, field.frame);
    fill(trial, field.camera, field.frame, field.frame + 1, flow.forward, flow.in_view_forward,
         flow.covisible_forward);
    if (!flow.backward.empty())
      fill(trial, field.camera, field.frame + 1, field.frame, flow.backward, flow.in_view_backward,
           flow.covisible_backward);
  }
}

void add_kind(const Part& part, const Kind& kind, std::vector<Hypothesis>& hypotheses) {
  Hypothesis h;
  h.checks = {"flow"};
  h.rank = 1;
  h.undo = [part, kind](Trial& trial, Cause& cause) {
    const bool is_of_other_pair = kind.from != 0 || kind.to != 1;
    if (is_of_other_pair) fill_all(trial);
    if (!is_of_other_pair)
      for (const Side& side : sides_of(trial, part)) {
        core::ImageF& image = side.edit(trial);
        for (int y = 0; y < image.height(); ++y)
          for (int x = 0; x < image.width(); ++x) {
            const Vector2d right = kind.undo(
                {static_cast<double>(image(x, y, 0)), static_cast<double>(image(x, y, 1))});
            image(x, y, 0) = static_cast<float>(right.x());
            image(x, y, 1) = static_cast<float>(right.y());
          }
      }
    cause.name = kind.name;
    cause.camera = part.camera < 0 ? "" : trial.camera(part.camera).name;
    cause.words = part.words + " " + kind.words;
    return true;
  };
  hypotheses.push_back(std::move(h));
}

void add_kinds(const Symptoms& symptoms, std::vector<Hypothesis>& hypotheses) {
  const std::vector<Part> parts = parts_of(symptoms.trial);
  double least_px = kSame_px;  // of kinds of the right pair
  for (const Kind& kind : kKinds) {
    // Flow of another pair is recognised by the forward fields; backward ones may belong to no pair at all. In steady
    // flight that to the frame before is nearly the opposite of that to the next one: the nearer of both it is.
    if (kind.from != 0 || kind.to != 1) {
      const std::optional<double> off_px =
          distance_from_kind(symptoms.trial, parts[1], kind);
      if (off_px && *off_px < least_px) add_kind(parts[0], kind, hypotheses);
      continue;
    }
    for (const Part& part : parts) {
      const std::optional<double> off_px = distance_from_kind(symptoms.trial, part, kind);
      if (!off_px) continue;
      least_px = std::min(least_px, *off_px);
      add_kind(part, kind, hypotheses);
      break;
    }
  }
}

/// A factor on all flow, by the median of its sizes.
void add_scale(const Symptoms& symptoms, std::vector<Hypothesis>& hypotheses) {
  struct Vectors {
    Vector2d stored, right;
    double rounding_px;
  };
  std::vector<Vectors> all;
  std::vector<double> factors;
  const Trial& trial = symptoms.trial;
  for (const Field& field : fields_of(trial)) {
    const core::ImageF& flow = trial.image(field.camera, field.frame).flow->forward;
    const int step = step_of(flow);
    for (int y = step / 2; y < flow.height(); y += step)
      for (int x = step / 2; x < flow.width(); x += step) {
        const auto target = target_of(trial, field.camera, field.frame, field.frame + 1, x, y);
        if (!target) continue;
        const Vector2d right = *target - Vector2d(x + 0.5, y + 0.5);
        const Vector2d stored(static_cast<double>(flow(x, y, 0)),
                              static_cast<double>(flow(x, y, 1)));
        if (!(right.norm() > 0.1) || !stored.allFinite()) continue;
        all.push_back({stored, right, trial.camera(field.camera).flow_rounding_px()});
        factors.push_back(stored.dot(right) / right.squaredNorm());
      }
  }
  if (factors.size() < 50) return;
  const double factor = median(factors);
  if (!(std::abs(factor) > 1e-6) || std::abs(factor - 1.0) < 1e-4) return;
  // One factor makes nine of ten vectors right; what is wrong in another way it makes a little less wrong.
  const auto num_righted = std::count_if(all.begin(), all.end(), [&](const Vectors& each) {
    return (each.stored / factor - each.right).norm() <=
           0.2 * (each.stored - each.right).norm() + each.rounding_px / std::abs(factor);
  });
  if (10 * num_righted < 9 * static_cast<std::ptrdiff_t>(all.size())) return;
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

/// The vector by which nine of ten pixels of a part are off; nothing where there is none, or it is nothing.
std::optional<Vector2d> offset_of(const Trial& trial, const Part& part) {
  std::vector<double> off_x, off_y;
  for (const Side& side : sides_of(trial, part)) {
    const core::ImageF& flow = side.of(trial);
    const int step = step_of(flow);
    for (int y = step / 2; y < flow.height(); y += step)
      for (int x = step / 2; x < flow.width(); x += step) {
        const auto target = target_of(trial, side.camera, side.from(), side.to(), x, y);
        if (!target) continue;
        off_x.push_back(static_cast<double>(flow(x, y, 0)) - (target->x() - x - 0.5));
        off_y.push_back(static_cast<double>(flow(x, y, 1)) - (target->y() - y - 0.5));
      }
  }
  const std::vector<double> x = off_x, y = off_y;
  const Vector2d offset(median(off_x), median(off_y));
  std::size_t num_same = 0;
  for (std::size_t i = 0; i < x.size(); ++i)
    if ((Vector2d(x[i], y[i]) - offset).norm() < kSame_px) ++num_same;
  constexpr std::size_t kEnough = 50;
  if (num_same < kEnough || 10 * num_same < 9 * x.size() || offset.norm() < kSame_px)
    return std::nullopt;
  return offset;
}

/// The same vector on all flow, or on that of a camera or a direction.
void add_offset(const Symptoms& symptoms, std::vector<Hypothesis>& hypotheses) {
  for (const Part& part : parts_of(symptoms.trial)) {
    const std::optional<Vector2d> offset = offset_of(symptoms.trial, part);
    if (!offset) continue;
    Hypothesis h;
    h.checks = {"flow"};
    h.rank = 2;
    h.undo = [part, offset = *offset](Trial& t, Cause& cause) {
      for (const Side& side : sides_of(t, part)) {
        core::ImageF& image = side.edit(t);
        for (int y = 0; y < image.height(); ++y)
          for (int x = 0; x < image.width(); ++x)
            for (int axis = 0; axis < 2; ++axis)
              image(x, y, axis) -= static_cast<float>(offset[axis]);
      }
      cause.name = "flow_offset";
      cause.size = offset.norm();
      cause.unit = "px";
      cause.camera = part.camera < 0 ? "" : t.camera(part.camera).name;
      cause.words = fmt::format("{} is off by ({:.3g}, {:.3g}) px everywhere", part.words,
                                offset.x(), offset.y());
      return true;
    };
    hypotheses.push_back(std::move(h));
    return;
  }
}

/// "1 pixel to the right", "1 pixel to the left and 1 pixel below".
std::string words_of_step(int right, int down) {
  std::string words;
  if (right != 0) words = fmt::format("1 pixel to the {}", right > 0 ? "right" : "left");
  if (down != 0)
    words +=
        fmt::format("{}1 pixel {}", words.empty() ? "" : " and ", down > 0 ? "below" : "above");
  return words;
}

/// Flow that stands in the pixel beside.
void add_steps(const Symptoms& symptoms, std::vector<Hypothesis>& hypotheses) {
  for (int right = -1; right <= 1; ++right)
    for (int down = -1; down <= 1; ++down) {
      if (right == 0 && down == 0) continue;
      const auto moved_back = [=](const core::ImageF& flow) {
        core::ImageF result = flow;
        for (int y = 0; y < flow.height(); ++y)
          for (int x = 0; x < flow.width(); ++x)
            for (int axis = 0; axis < 2; ++axis)
              result(x, y, axis) = flow(std::clamp(x + right, 0, flow.width() - 1),
                                        std::clamp(y + down, 0, flow.height() - 1), axis);
        return result;
      };
      const std::vector<Field> fields = fields_of(symptoms.trial);
      const bool is_so =
          !fields.empty() && std::all_of(fields.begin(), fields.end(), [&](const Field& field) {
            return difference(
                       symptoms.trial, field.camera,
                       moved_back(symptoms.trial.image(field.camera, field.frame).flow->forward),
                       field.frame, field.frame + 1, kSame) < kSame_px / 10.0;
          });
      if (!is_so) continue;
      Hypothesis h;
      h.checks = {"flow"};
      h.rank = 2;
      h.undo = [=](Trial& trial, Cause& cause) {
        for (const Field& field : fields_of(trial)) {
          FlowFields& flow = trial.edit_flow(field.camera, field.frame);
          for (const bool is_forward : {true, false}) {
            core::ImageF& image = is_forward ? flow.forward : flow.backward;
            image = moved_back(image);
            // What was pushed over the border is lost: it follows from the rest.
            const int from = field.frame + (is_forward ? 0 : 1),
                      to = field.frame + 1 - (from - field.frame);
            for (int y = 0; y < image.height(); ++y)
              for (int x = 0; x < image.width(); ++x) {
                const bool is_lost = x + right < 0 || x + right >= image.width() || y + down < 0 ||
                                     y + down >= image.height();
                const auto target =
                    is_lost ? target_of(trial, field.camera, from, to, x, y) : std::nullopt;
                if (!target) continue;
                image(x, y, 0) = static_cast<float>(target->x() - x - 0.5);
                image(x, y, 1) = static_cast<float>(target->y() - y - 0.5);
              }
          }
        }
        cause.name = "flow_shifted";
        cause.size = std::hypot(right, down);
        cause.unit = "px";
        cause.words = fmt::format("flow stands {} of where it belongs", words_of_step(right, down));
        return true;
      };
      hypotheses.push_back(std::move(h));
    }
}

/// Backward flow that was not computed: the forward flow with the other sign.
void add_negated(const Symptoms& symptoms, std::vector<Hypothesis>& hypotheses) {
  const std::vector<Field> fields = fields_of(symptoms.trial);
  const bool is_so =
      !fields.empty() && std::all_of(fields.begin(), fields.end(), [&](const Field& field) {
        const FlowFields& flow = *symptoms.trial.image(field.camera, field.frame).flow;
        return !flow.backward.empty() &&
               std::equal(flow.forward.data().begin(), flow.forward.data().end(),
                          flow.backward.data().begin(), flow.backward.data().end(),
                          [](float forward, float backward) {
                            return forward == -backward ||
                                   (std::isnan(forward) && std::isnan(backward));
                          });
      });
  if (!is_so) return;
  Hypothesis h;
  h.checks = {"flow"};
  h.rank = 1;
  h.undo = [](Trial& trial, Cause& cause) {
    for (const Field& field : fields_of(trial)) {
      FlowFields& flow = trial.edit_flow(field.camera, field.frame);
      fill(trial, field.camera, field.frame + 1, field.frame, flow.backward, flow.in_view_backward,
           flow.covisible_backward);
    }
    cause.name = "flow_negated";
    cause.words = "backward flow is minus the forward flow of the same pixels";
    return true;
  };
  hypotheses.push_back(std::move(h));
}

/// Masks that mark all pixels alike.
void add_plain_masks(const Symptoms& symptoms, std::vector<Hypothesis>& hypotheses) {
  const std::vector<Field> fields = fields_of(symptoms.trial);
  if (fields.empty()) return;
  const auto is_all = [&](core::Image8 FlowFields::*mask, std::uint8_t value) {
    return std::all_of(fields.begin(), fields.end(), [&](const Field& field) {
      const auto data = ((*symptoms.trial.image(field.camera, field.frame).flow).*mask).data();
      return std::all_of(data.begin(), data.end(), [&](std::uint8_t one) { return one == value; });
    });
  };
  for (const std::uint8_t value : {std::uint8_t{1}, std::uint8_t{0}}) {
    if (!is_all(&FlowFields::covisible_forward, value) ||
        !is_all(&FlowFields::covisible_backward, value))
      continue;
    const bool is_of_view =
        is_all(&FlowFields::in_view_forward, value) && is_all(&FlowFields::in_view_backward, value);
    Hypothesis h;
    h.checks = {"flow"};
    h.rank = 1;
    h.undo = [=](Trial& trial, Cause& cause) {
      for (const Field& field : fields_of(trial)) {
        FlowFields& flow = trial.edit_flow(field.camera, field.frame);
        core::ImageF ignored = flow.forward;
        fill(trial, field.camera, field.frame, field.frame + 1, ignored, flow.in_view_forward,
             flow.covisible_forward);
        if (flow.backward.empty()) continue;
        fill(trial, field.camera, field.frame + 1, field.frame, ignored, flow.in_view_backward,
             flow.covisible_backward);
      }
      cause.name = "masks_plain";
      cause.words = fmt::format("{}masks of flow are all {}", is_of_view ? "" : "co-visible ",
                                value == 0 ? "zero" : "one");
      return true;
    };
    hypotheses.push_back(std::move(h));
    return;
  }
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

}  // namespace

void make_flow_causes(const Symptoms& symptoms, std::vector<Hypothesis>& hypotheses) {
  if (!symptoms.fails("flow")) return;
  add_kinds(symptoms, hypotheses);
  add_scale(symptoms, hypotheses);
  add_offset(symptoms, hypotheses);
  add_steps(symptoms, hypotheses);
  add_negated(symptoms, hypotheses);
  add_plain_masks(symptoms, hypotheses);
  add_masks(hypotheses);
}

}  // namespace terracast::validate
