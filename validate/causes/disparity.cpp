#include <fmt/format.h>

#include <algorithm>

#include "validate/causes/trial.h"
#include "validate/sampling.h"

/// Disparity of a rectified pair: scaled, or of the other image.
namespace terracast::validate {

namespace {

/// Disparity as the file should have it, of the left image's depth.
void set_disparity(Trial& trial, int left, double product) {
  for (int f = 0; f < trial.num_frames(); ++f) {
    LoadedImage& image = trial.edit(left, f);
    for (std::size_t i = 0; i < image.disparity.data().size(); ++i) {
      const double right = product / static_cast<double>(image.depth.data()[i]);
      image.disparity.data()[i] = static_cast<float>(std::round(256.0 * right) / 256.0);
    }
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
    set_disparity(t, left, product);
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

/// Disparity of the right image's pixels, where the left's are meant.
void add_other_disparity(const Symptoms& symptoms, std::vector<Hypothesis>& hypotheses) {
  const Trial& trial = symptoms.trial;
  if (!trial.sequence.stereo) return;
  const int left = trial.sequence.stereo->left;
  const double product = trial.camera(left).intrinsics.fx_px * trial.sequence.stereo->baseline_m;
  // Where a left pixel stands in the right image, the disparity there is its own, to half a step of the file and as
  // much as two pixels' mean is off.
  constexpr double kTolerance_px = 0.5 / 256.0 + 1e-3;
  std::size_t num_same = 0, num_compared = 0;
  for (int f = 0; f < trial.num_frames(); ++f) {
    const LoadedImage& image = trial.image(left, f);
    if (image.disparity.empty() || image.depth.empty()) return;
    for (int y = 0; y < image.depth.height(); y += 2)
      for (int x = 0; x < image.depth.width(); x += 3) {
        const double right_px = product / static_cast<double>(image.depth(x, y));
        const double at = x - right_px;
        const int before = static_cast<int>(std::floor(at));
        if (!std::isfinite(right_px) || before < 0 || before + 1 >= image.depth.width()) continue;
        const double share = at - before;
        const double there = (1.0 - share) * static_cast<double>(image.disparity(before, y)) +
                             share * static_cast<double>(image.disparity(before + 1, y));
        const auto here = static_cast<double>(image.disparity(x, y));
        // Over level ground far below the right image has the same disparities as the left one.
        if (!std::isfinite(there) || std::abs(there - here) < kTolerance_px) continue;
        ++num_compared;
        if (std::abs(there - right_px) < kTolerance_px) ++num_same;
      }
  }
  if (num_compared < 50 || 10 * num_same < 9 * num_compared) return;
  Hypothesis h;
  h.checks = {"stereo"};
  h.rank = 1;
  h.undo = [=](Trial& t, Cause& cause) {
    set_disparity(t, left, product);
    cause.name = "disparity_of_other_camera";
    cause.words = "disparity is that of the right image, where the left's is meant";
    return true;
  };
  hypotheses.push_back(std::move(h));
}

}  // namespace

void make_disparity_causes(const Symptoms& symptoms, std::vector<Hypothesis>& hypotheses) {
  if (!symptoms.fails("stereo")) return;
  add_disparity(symptoms, hypotheses);
  add_other_disparity(symptoms, hypotheses);
}

}  // namespace terracast::validate
