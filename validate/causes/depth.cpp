#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <limits>

#include "core/atomic_file.h"
#include "core/image_io.h"
#include "validate/causes/trial.h"
#include "validate/checks/checker.h"
#include "validate/depth_marks.h"
#include "validate/npy.h"
#include "validate/sampling.h"

/// Depth: range along the ray, other units, limits, steps, bytes, frames and places.
namespace terracast::validate {

namespace {

constexpr float kNone = std::numeric_limits<float>::quiet_NaN();

const std::vector<std::string_view> kJudges = {"reprojection", "depth",     "depth_unit",
                                               "flow",         "stereo",    "photometric",
                                               "segmentation", "structure", "colmap_point_depths"};

/// A change of all depths of a camera, in place.
using Change = std::function<void(const Camera&, core::ImageF&)>;

std::vector<int> cameras_with_depth(const Trial& trial) {
  std::vector<int> cameras;
  for (int c = 0; c < trial.num_cameras(); ++c)
    if (!trial.image(c, 0).depth.empty()) cameras.push_back(c);
  return cameras;
}

void change_depths(Trial& trial, const Change& change) {
  for (const int c : cameras_with_depth(trial))
    for (int f = 0; f < trial.num_frames(); ++f) {
      LoadedImage& image = trial.edit(c, f);
      if (!image.depth.empty()) change(trial.camera(c), image.depth);
    }
}

Change scaled(double factor, float sky_m) {
  return [factor, sky_m](const Camera&, core::ImageF& depth) {
    for (float& value : depth.data()) {
      value = static_cast<float>(factor * static_cast<double>(value));
      // The sky may have been scaled with the rest.
      if (sky_m > 0.0F && std::abs(value / sky_m - 1.0F) < 1e-5F) value = kNone;
    }
  };
}

/// Right depths disagree by less than 2e-3, those that share no places by 1.
constexpr double kAgree = 0.05;
bool do_depths_agree(const Trial& trial) { return depth_disagreement(trial) < kAgree; }

void add(const Symptoms& symptoms, std::vector<Hypothesis>& hypotheses, const char* name,
         std::string words, int rank, const Change& change, double size = 0.0,
         const char* unit = "") {
  // Depths that agree with each other are judged by the rest.
  if (symptoms.fails("reprojection") || symptoms.depth_disagreement() >= kAgree) {
    Trial tried = symptoms.trial;
    change_depths(tried, change);
    if (depth_disagreement(tried) > 0.5 * symptoms.depth_disagreement()) return;
  }
  Hypothesis h;
  h.checks = kJudges;
  h.rank = rank;
  h.undo = [=](Trial& trial, Cause& cause) {
    change_depths(trial, change);
    cause.name = name;
    cause.words = words;
    cause.size = size;
    cause.unit = unit;
    cause.explains = kUnfitDepth;
    return true;
  };
  hypotheses.push_back(std::move(h));
}

void add_units(const Symptoms& symptoms, std::vector<Hypothesis>& hypotheses) {
  const float sky_m = symptoms.trial.dataset->format.starts_with("tartanair")
                          ? symptoms.trial.dataset->sky_depth_m
                          : 0.0F;
  add(symptoms, hypotheses, "depth_range",
      "depth is range along the ray where depth along the optical axis is meant", 1,
      [](const Camera& camera, core::ImageF& depth) {
        for (int y = 0; y < depth.height(); ++y)
          for (int x = 0; x < depth.width(); ++x)
            depth(x, y) =
                static_cast<float>(static_cast<double>(depth(x, y)) /
                                   camera.intrinsics.ray_from_pixel({x + 0.5, y + 0.5}).norm());
      });
  struct Unit {
    double factor;
    const char* words;
    const char* unit;
  };
  for (const Unit& unit : {Unit{1e-3, "depth is in millimetres where metres are meant", "mm"},
                           Unit{1e-2, "depth is in centimetres where metres are meant", "cm"},
                           Unit{1e3, "depth is in kilometres where metres are meant", "km"},
                           Unit{0.3048, "depth is in feet where metres are meant", "ft"}})
    add(symptoms, hypotheses, "depth_unit", unit.words, 1, scaled(unit.factor, sky_m),
        1.0 / unit.factor, unit.unit);
  add(symptoms, hypotheses, "depth_inverse", "depth is inverse depth (1/m) where metres are meant",
      2, [](const Camera&, core::ImageF& depth) {
        for (float& value : depth.data()) value = 1.0F / value;
      });
}

/// A factor that is no unit's, as `depth_unit` measured it: too coarsely for other checks to hold with
/// it undone.
void add_any_factor(const Symptoms& symptoms, std::vector<Hypothesis>& hypotheses) {
  for (const CheckResult& result : symptoms.failed) {
    const std::size_t at = result.worst.find(kDepthFactor);
    if (result.name != "depth_unit" || at == std::string::npos) continue;
    const double factor = std::atof(result.worst.c_str() + at + kDepthFactor.size());
    if (!(factor > 0.0)) continue;
    Hypothesis h;
    h.checks = {"depth_unit"};
    h.rank = 9;
    h.marks = {"depth_unit"};
    h.undo = [=](Trial&, Cause& cause) {
      cause.name = "depth_unit";
      cause.size = 1.0 / factor;
      cause.unit = "times";
      cause.words = fmt::format(
          "depth has another unit than poses: colours agree where it is about {:.3g} times as "
          "large",
          factor);
      return true;
    };
    hypotheses.push_back(std::move(h));
  }
}

/// Depth that ends at one value, or has few of them.
void add_limits(const Symptoms& symptoms, std::vector<Hypothesis>& hypotheses) {
  const Trial& trial = symptoms.trial;
  // The greatest depth that an image and others have in common.
  std::vector<float> greatest, next;
  double share = 0.0;
  std::size_t num_images = 0;
  for (const int c : cameras_with_depth(trial))
    for (int f = 0; f < trial.num_frames(); ++f) {
      float most = 0.0F, below = 0.0F;
      std::size_t count = 0, num_finite = 0;
      for (const float value : trial.image(c, f).depth.data()) {
        if (!std::isfinite(value)) continue;
        ++num_finite;
        if (value > most) {
          below = most;
          most = value;
          count = 0;
        } else if (value < most && value > below) {
          below = value;
        }
        if (value == most) ++count;
      }
      if (num_finite == 0) continue;
      greatest.push_back(most);
      next.push_back(below);
      share += static_cast<double>(count) / static_cast<double>(num_finite);
      ++num_images;
    }
  if (num_images == 0) return;
  share /= static_cast<double>(num_images);
  const float limit_m = *std::max_element(greatest.begin(), greatest.end());
  const float below_m = *std::max_element(next.begin(), next.end());
  if (symptoms.shares.contains("depth_limit") && symptoms.shares.at("depth_limit") > 1.0) {
    // Ground comes up to a limit; from sky it stands apart.
    const bool is_sky = below_m < 0.98F * limit_m;
    Hypothesis h;
    h.checks = {"depth", "reprojection", "flow", "photometric"};
    h.rank = is_sky ? 0 : 1;
    // What lies beyond a limit is lost; what is nearer must agree.
    if (!is_sky)
      h.marks = {"depth", "reprojection", "flow", "stereo", "photometric", "segmentation"};
    h.undo = [=](Trial& t, Cause& cause) {
      change_depths(t, [limit_m](const Camera&, core::ImageF& depth) {
        for (float& value : depth.data())
          if (value >= limit_m) value = kNone;
      });
      if (!is_sky)
        for (const auto& [name, after] : measure(t, {"reprojection"}))
          if (after > 1.0) return false;
      cause.name = is_sky ? "depth_sky" : "depth_clipped";
      cause.size = static_cast<double>(limit_m);
      cause.unit = "m";
      cause.words =
          is_sky ? fmt::format("sky is written as a depth of {:.6g} m ({:.0f} % of the depths)",
                               limit_m, 100.0 * share)
                 : fmt::format("depth is clipped at {:.6g} m ({:.0f} % of the depths)", limit_m,
                               100.0 * share);
      if (is_sky) cause.explains = kUnfitDepth;
      return true;
    };
    hypotheses.push_back(std::move(h));
  }
  if (symptoms.shares.contains("depth_levels") && symptoms.shares.at("depth_levels") > 1.0) {
    std::vector<float> values;
    const core::ImageF& depth = trial.image(cameras_with_depth(trial)[0], 0).depth;
    for (const float value : depth.data())
      if (std::isfinite(value)) values.push_back(value);
    std::sort(values.begin(), values.end());
    values.erase(std::unique(values.begin(), values.end()), values.end());
    std::vector<double> steps;
    for (std::size_t i = 1; i < values.size(); ++i)
      steps.push_back(static_cast<double>(values[i]) - static_cast<double>(values[i - 1]));
    if (steps.empty()) return;
    const double step_m = median(steps);
    // Whole steps lie between all of them.
    const bool is_even = std::all_of(steps.begin(), steps.end(), [&](double step) {
      return std::abs(step / step_m - std::round(step / step_m)) < 0.02;
    });
    const std::size_t num_values = values.size();
    if (!is_even) return;
    Hypothesis h;
    h.checks = {"depth"};
    h.rank = 0;
    h.marks = {"depth", "reprojection", "flow", "stereo"};
    h.undo = [=](Trial&, Cause& cause) {
      cause.name = "depth_levels";
      cause.size = step_m;
      cause.unit = "m";
      cause.words = fmt::format("depth is quantised{}: {} values only, in steps of {:.4g} m",
                                num_values <= 256 ? " to 8 bits" : "", num_values, step_m);
      return true;
    };
    hypotheses.push_back(std::move(h));
  }
}

const std::vector<std::string_view> kLost = {"depth",     "reprojection",       "flow",
                                             "stereo",    "photometric",        "segmentation",
                                             "structure", "colmap_point_depths"};

/// Depth that was rounded more coarsely than float32 does.
void add_steps(const Symptoms& symptoms, std::vector<Hypothesis>& hypotheses) {
  const Trial& trial = symptoms.trial;
  const std::optional<DepthSteps> steps =
      find_steps(trial.image(cameras_with_depth(trial)[0], 0).depth);
  constexpr double kNearlyAll = 0.9;
  if (!steps || steps->share < kNearlyAll) return;
  Hypothesis h;
  h.checks = {"depth"};
  h.rank = 0;
  h.marks = {"depth", "reprojection", "flow", "stereo"};
  h.undo = [steps = *steps](Trial&, Cause& cause) {
    const bool is_float = steps.step_m == 0.0;
    cause.name = is_float ? "depth_float16" : "depth_levels";
    cause.size = is_float ? steps.num_bits : steps.step_m;
    cause.unit = is_float ? "bits" : "m";
    cause.words =
        is_float ? fmt::format("depth is rounded to 16-bit floats{}, of {} significant bits",
                               steps.num_bits == 8 ? " (bfloat16)" : "", steps.num_bits)
                 : fmt::format("depth is quantised: it stands in steps of {:.4g} m", steps.step_m);
    return true;
  };
  hypotheses.push_back(std::move(h));
}

/// Bytes in another order.
core::ImageF with_other_bytes(const Trial& trial, const Camera& camera, int frame) {
  const std::string& path = camera.files[static_cast<std::size_t>(frame)].depth;
  if (path.empty()) return {};
  const bool is_png = path.ends_with(".png");
  const auto width = camera.intrinsics.width_px, height = camera.intrinsics.height_px;
  core::ImageF depth(width, height);
  std::vector<std::uint32_t> words(depth.data().size());
  if (is_png) {
    // Natural order (red is the least byte) where OpenCV's is meant.
    const core::Image8 rgba = read_png8(trial.dataset->root / path, path, 4, camera.intrinsics);
    for (std::size_t i = 0; i < words.size(); ++i) {
      const std::uint8_t* p = &rgba.data()[4 * i];
      words[i] = static_cast<std::uint32_t>(p[0]) | static_cast<std::uint32_t>(p[1]) << 8 |
                 static_cast<std::uint32_t>(p[2]) << 16 | static_cast<std::uint32_t>(p[3]) << 24;
    }
  } else {
    constexpr std::size_t kMostBytes = std::size_t{1} << 31;
    const NpyArray array = parse_npy(core::read_file(trial.dataset->root / path, kMostBytes), path);
    const std::vector<float> values = array.floats(path);
    if (values.size() != words.size()) return {};
    for (std::size_t i = 0; i < words.size(); ++i)
      words[i] = __builtin_bswap32(std::bit_cast<std::uint32_t>(values[i]));
  }
  for (std::size_t i = 0; i < words.size(); ++i) {
    const float value = std::bit_cast<float>(words[i]);
    const bool is_depth = value > 0.0F && value < 1e7F;
    depth.data()[i] = is_depth && value != trial.dataset->sky_depth_m ? value : kNone;
  }
  return depth;
}

void add_bytes(const Symptoms& symptoms, std::vector<Hypothesis>& hypotheses) {
  Trial tried = symptoms.trial;
  Findings ignored;
  bool is_read = false;
  for (int c = 0; c < tried.num_cameras(); ++c)
    for (int f = 0; f < tried.num_frames(); ++f)
      ignored.attempt("", [&] {
        core::ImageF depth = with_other_bytes(tried, tried.camera(c), f);
        if (depth.empty()) return;
        tried.edit(c, f).depth = std::move(depth);
        is_read = true;
      });
  if (!is_read || depth_disagreement(tried) > 0.02) return;
  Hypothesis h;
  h.checks = kJudges;
  h.rank = 1;
  h.undo = [images = tried.images](Trial& trial, Cause& cause) {
    trial.images = images;
    cause.name = "byte_order";
    cause.words = trial.camera(0).files[0].depth.ends_with(".png")
                      ? "depth has the byte order of R G B A where B G R A is meant"
                      : "depth has big-endian byte order where little-endian is meant";
    cause.explains = kUnfitDepth;
    return true;
  };
  hypotheses.push_back(std::move(h));
}

void add_mirrors(const Symptoms& symptoms, std::vector<Hypothesis>& hypotheses) {
  for (const bool is_left_right : {true, false})
    add(symptoms, hypotheses, "depth_flipped",
        is_left_right ? "depth is mirrored left to right" : "depth stands upside down", 2,
        [is_left_right](const Camera&, core::ImageF& depth) {
          const core::ImageF old = depth;
          for (int y = 0; y < depth.height(); ++y)
            for (int x = 0; x < depth.width(); ++x)
              depth(x, y) =
                  is_left_right ? old(depth.width() - 1 - x, y) : old(x, depth.height() - 1 - y);
        });
}

void add_places(const Symptoms& symptoms, std::vector<Hypothesis>& hypotheses) {
  add_mirrors(symptoms, hypotheses);
  for (const int shift : {1, -1}) {
    const auto undo = [shift](Trial& trial, Cause& cause) {
      const auto old = trial.images;
      for (const int c : cameras_with_depth(trial))
        for (int f = 0; f < trial.num_frames(); ++f) {
          const int from = f - shift;
          LoadedImage& image = trial.edit(c, f);
          if (from < 0 || from >= trial.num_frames())
            image.depth = {};
          else
            image.depth = old[static_cast<std::size_t>(from)][static_cast<std::size_t>(c)]->depth;
        }
      cause.name = "depth_shifted";
      cause.explains = kUnfitDepth;
      cause.size = shift;
      cause.unit = "frames";
      cause.words = fmt::format("depths are shifted by 1 frame: each is that of the frame {}",
                                shift > 0 ? "after" : "before");
      return true;
    };
    Trial tried = symptoms.trial;
    Cause ignored;
    undo(tried, ignored);
    if (depth_disagreement(tried) > 0.5 * symptoms.depth_disagreement()) continue;
    hypotheses.push_back({{"reprojection", "flow", "stereo", "photometric"}, 2, undo});
  }
}

/// One image whose depth is another's, or nobody's.
void add_single(const Symptoms& symptoms, std::vector<Hypothesis>& hypotheses) {
  const Trial& trial = symptoms.trial;
  for (const int c : cameras_with_depth(trial))
    for (int f = 0; f < trial.num_frames(); ++f) {
      if (trial.image(c, f).depth.empty()) continue;
      Trial tried = trial;
      tried.edit(c, f).depth = {};
      if (depth_disagreement(tried) > 0.5 * symptoms.depth_disagreement()) continue;
      Hypothesis h;
      h.checks = {"reprojection", "depth_unit",  "flow",
                  "stereo",       "photometric", "colmap_point_depths"};
      h.rank = 8;
      h.undo = [c, f](Trial& t, Cause& cause) {
        int twin = -1;
        for (int other = 0; other < t.num_frames(); ++other)
          if (other != f &&
              t.image(c, other).depth.data().size() == t.image(c, f).depth.data().size() &&
              std::memcmp(t.image(c, other).depth.data().data(), t.image(c, f).depth.data().data(),
                          t.image(c, f).depth.data().size_bytes()) == 0)
            twin = other;
        LoadedImage& image = t.edit(c, f);
        image.depth = {};
        const FrameFiles& files = t.camera(c).files[static_cast<std::size_t>(f)];
        cause.explains = {files.depth + kUnfitDepth[0], files.segmentation + kUnfitClass[0]};
        cause.name = twin >= 0 ? "frame_duplicated" : "frame_foreign";
        cause.camera = t.camera(c).name;
        cause.frame = t.first_frame + f;
        cause.words =
            twin >= 0 ? fmt::format("depth of {}, frame {} is duplicated: it is that of frame {}",
                                    cause.camera, cause.frame, t.first_frame + twin)
                      : fmt::format(
                            "depth of {}, frame {} does not belong there: it agrees with no other",
                            cause.camera, cause.frame);
        return true;
      };
      hypotheses.push_back(std::move(h));
    }
}

}  // namespace

void make_depth_causes(const Symptoms& symptoms, std::vector<Hypothesis>& hypotheses) {
  if (!symptoms.fails("reprojection") && !symptoms.fails("depth") &&
      !symptoms.fails("depth_unit") && !symptoms.fails_result("structure") &&
      !symptoms.fails("photometric") && !symptoms.fails("stereo") && !symptoms.fails("flow") &&
      !symptoms.fails("colmap_point_depths"))
    return;
  if (symptoms.fails_result("structure")) add_bytes(symptoms, hypotheses);
  if (cameras_with_depth(symptoms.trial).empty()) return;
  if (symptoms.fails("depth")) {
    add_steps(symptoms, hypotheses);
    add_limits(symptoms, hypotheses);
  }
  // Depths that are wrong by far share no places, so that reprojection shows nothing. What is
  // mirrored agrees with itself where the camera moves in the mirror's plane.
  if (!symptoms.fails("reprojection") && do_depths_agree(symptoms.trial)) {
    if (symptoms.fails("photometric") || symptoms.fails("stereo"))
      add_mirrors(symptoms, hypotheses);
    return;
  }
  if (!symptoms.fails_result("structure")) add_bytes(symptoms, hypotheses);
  add_units(symptoms, hypotheses);
  add_any_factor(symptoms, hypotheses);
  add_places(symptoms, hypotheses);
  add_single(symptoms, hypotheses);
}

}  // namespace terracast::validate
