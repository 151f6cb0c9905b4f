#include <fmt/format.h>

#include <algorithm>

#include "validate/causes/trial.h"
#include "validate/sampling.h"

/// A constant added to all depths: the minimum of the disagreement by golden section, after a coarse
/// search.
namespace terracast::validate {

namespace {

void subtract(Trial& trial, double offset_m) {
  for (int c = 0; c < trial.num_cameras(); ++c)
    for (int f = 0; f < trial.num_frames(); ++f) {
      if (trial.image(c, f).depth.empty()) continue;
      for (float& value : trial.edit(c, f).depth.data())
        value = static_cast<float>(static_cast<double>(value) - offset_m);
    }
}

/// A trial that holds depths alone: cheap to copy.
Trial depths_of(const Trial& trial) {
  Trial thin = trial;
  for (int c = 0; c < trial.num_cameras(); ++c)
    for (int f = 0; f < trial.num_frames(); ++f) {
      auto image = std::make_shared<LoadedImage>();
      image->depth = trial.image(c, f).depth;
      thin.images[static_cast<std::size_t>(f)][static_cast<std::size_t>(c)] = std::move(image);
    }
  return thin;
}

}  // namespace

void make_depth_offset_causes(const Symptoms& symptoms, std::vector<Hypothesis>& hypotheses) {
  if (!symptoms.fails("reprojection") && !symptoms.fails("flow") && !symptoms.fails("stereo"))
    return;
  std::vector<float> depths;
  for (int c = 0; c < symptoms.trial.num_cameras() && depths.empty(); ++c)
    for (const float value : symptoms.trial.image(c, 0).depth.data())
      if (std::isfinite(value)) depths.push_back(value);
  const double typical_m = median(depths);
  if (!(typical_m > 0.0)) return;
  const Trial thin = depths_of(symptoms.trial);
  const auto cost = [&](double offset_m) {
    Trial tried = thin;
    subtract(tried, offset_m);
    return depth_disagreement(tried);
  };
  constexpr double kReach = 0.2;
  constexpr int kSteps = 8;
  const double before = cost(0.0);
  double best = 0.0, least = before;
  for (int i = -kSteps; i <= kSteps; ++i) {
    const double offset_m = kReach * typical_m * i / kSteps;
    const double value = i == 0 ? before : cost(offset_m);
    if (value >= least) continue;
    least = value;
    best = offset_m;
  }
  double low = best - kReach * typical_m / kSteps, high = best + kReach * typical_m / kSteps;
  constexpr double kGolden = 0.381966;
  double a = low + kGolden * (high - low), b = high - kGolden * (high - low);
  double cost_a = cost(a), cost_b = cost(b);
  for (int turn = 0; turn < 24 && high - low > 2e-5 * typical_m; ++turn) {
    if (cost_a < cost_b) {
      high = b;
      b = a;
      cost_b = cost_a;
      cost_a = cost(a = low + kGolden * (high - low));
    } else {
      low = a;
      a = b;
      cost_a = cost_b;
      cost_b = cost(b = high - kGolden * (high - low));
    }
  }
  const double found_m = 0.5 * (low + high);
  if (std::abs(found_m) < 1e-4 * typical_m || cost(found_m) > 0.5 * before) return;
  Hypothesis h;
  h.checks = {"reprojection", "flow", "stereo", "depth", "photometric"};
  h.rank = 3;
  h.undo = [found_m](Trial& trial, Cause& cause) {
    subtract(trial, found_m);
    cause.name = "depth_offset";
    cause.size = found_m;
    cause.unit = "m";
    cause.words = fmt::format("depth is {:.3g} m too {} everywhere", std::abs(found_m),
                              found_m > 0.0 ? "large" : "small");
    return true;
  };
  hypotheses.push_back(std::move(h));
}

}  // namespace terracast::validate
