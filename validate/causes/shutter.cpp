#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "validate/causes/trial.h"
#include "validate/checks/checker.h"
#include "validate/sampling.h"
#include "validate/transfer.h"

/// Rolling shutters that dataset.json does not state, or states with lines that follow each other the other way
/// round, along the other axis or in another time. How the body moves meanwhile, motion.csv says.
namespace terracast::validate {

namespace {

/// Median length of stored flow less flow from depth, poses and shutters, px; nothing without flow.
std::optional<double> flow_disagreement(const Trial& trial) {
  constexpr int kStep = 16;
  constexpr std::size_t kEnough = 50;
  std::vector<double> sizes;
  for (int c = 0; c < trial.num_cameras(); ++c)
    for (int f = 0; f + 1 < trial.num_frames(); ++f) {
      const LoadedImage& image = trial.image(c, f);
      if (!image.flow || image.depth.empty()) continue;
      const auto now = view_at(trial.sequence, c, f, &image);
      const auto next = view_at(trial.sequence, c, f + 1, &trial.image(c, f + 1));
      if (!now || !next) continue;
      trial.spend(1);
      const Transfer transfer(*now, *next);
      const core::ImageF& flow = image.flow->forward;
      for (int y = kStep / 2; y < flow.height(); y += kStep)
        for (int x = kStep / 2; x < flow.width(); x += kStep) {
          const auto depth_m = static_cast<double>(image.depth(x, y));
          if (!std::isfinite(depth_m) || image.flow->in_view_forward(x, y) == 0) continue;
          const Eigen::Vector2d pixel(x + 0.5, y + 0.5);
          const auto place = transfer.point(pixel, depth_m);
          const Eigen::Vector2d stored(static_cast<double>(flow(x, y, 0)),
                                       static_cast<double>(flow(x, y, 1)));
          constexpr double kGross_px = 1e3;
          sizes.push_back(place ? (pixel + stored - place->pixel).norm() : kGross_px);
        }
    }
  if (sizes.size() < kEnough) return std::nullopt;
  return median(sizes);
}

/// Median |r| of depth between neighbouring frames of one camera; nothing where it has no depth.
std::optional<double> own_disagreement(const Trial& trial, int camera) {
  constexpr std::int64_t kPixels = 80;
  constexpr std::size_t kEnough = 25;
  std::vector<double> sizes;
  for (int f = 0; f + 1 < trial.num_frames(); ++f) {
    const auto now = view_at(trial.sequence, camera, f, &trial.image(camera, f));
    const auto next = view_at(trial.sequence, camera, f + 1, &trial.image(camera, f + 1));
    if (!now || !next || now->image->depth.empty() || next->image->depth.empty()) continue;
    trial.spend(1);
    const Transfer transfer(*now, *next);
    for (const Eigen::Vector2i& at : draw_pixels(now->camera->intrinsics, kPixels, {}, *now, 13)) {
      const auto depth_m = static_cast<double>(now->image->depth(at.x(), at.y()));
      if (!std::isfinite(depth_m)) continue;
      const auto place = transfer.point({at.x() + 0.5, at.y() + 0.5}, depth_m);
      if (!place || !(place->distance_b_m > 0.0)) continue;
      const auto seen = sample_inverse_depth(next->image->depth, place->pixel);
      if (seen) sizes.push_back(std::abs(seen->inverse_depth.value * place->distance_b_m - 1.0));
    }
  }
  if (sizes.size() < kEnough) return std::nullopt;
  return median(sizes);
}

/// Whether a camera may be wrong alone: no other disagrees with itself half as much.
bool may_be_alone(const Trial& trial, int camera) {
  const std::optional<double> own = own_disagreement(trial, camera);
  for (int other = 0; own && other < trial.num_cameras(); ++other) {
    const std::optional<double> of_other =
        other == camera ? std::nullopt : own_disagreement(trial, other);
    if (of_other && *of_other > 0.5 * *own) return false;
  }
  return true;
}

/// What is most exact of what a format holds: observations, flow, depth.
double sharp_disagreement(const Trial& trial) {
  if (trial.model) {
    const Shares shares = measure(trial, {"colmap_observations"});
    const auto found = shares.find("colmap_reprojection");
    if (found != shares.end()) return found->second;
  }
  if (const auto flow = flow_disagreement(trial)) return *flow;
  return depth_disagreement(trial);
}

void set_shutter(Trial& trial, const std::vector<int>& cameras,
                 const std::optional<Shutter>& shutter) {
  for (const int c : cameras) trial.camera(c).shutter = shutter;
}

/// A signed line time, along rows or columns: above 0 down or right.
Shutter shutter_of(double signed_line_time_s, bool is_of_columns) {
  const Readout onward = is_of_columns ? Readout::Right : Readout::Down;
  return {std::abs(signed_line_time_s), signed_line_time_s < 0.0 ? opposite(onward) : onward};
}

/// The least of a function between two values that has one, by golden sections.
template <class Cost>
double find_least(double low, double high, int num_steps, const Cost& cost) {
  constexpr double kGolden = 0.6180339887498949;
  double inner_low = high - kGolden * (high - low), inner_high = low + kGolden * (high - low);
  double cost_low = cost(inner_low), cost_high = cost(inner_high);
  for (int step = 0; step < num_steps; ++step) {
    if (cost_low <= cost_high) {
      high = inner_high;
      inner_high = inner_low;
      cost_high = cost_low;
      inner_low = high - kGolden * (high - low);
      cost_low = cost(inner_low);
    } else {
      low = inner_low;
      inner_low = inner_high;
      cost_low = cost_high;
      inner_high = low + kGolden * (high - low);
      cost_high = cost(inner_high);
    }
  }
  return cost_low <= cost_high ? inner_low : inner_high;
}

/// The line time of cameras that brings depth, and what is more exact, together best.
struct LineFit {
  Shutter shutter;
  double left = 0.0;  ///< of the disagreement in depth
};
LineFit fit_line_time(const Trial& trial, const std::vector<int>& cameras, bool is_of_columns) {
  const Intrinsics& size = trial.camera(cameras.front()).intrinsics;
  const int num_lines = is_of_columns ? size.width_px : size.height_px;
  // An image takes no longer than the time to the next.
  const double longest_s = 1.0 / (trial.sequence.rate_hz * num_lines);
  Trial tried = trial;
  const auto with = [&](double signed_s, double (*disagreement)(const Trial&)) {
    set_shutter(tried, cameras, shutter_of(signed_s, is_of_columns));
    return disagreement(tried);
  };
  // Far from the right one pairs share too little to tell; so all over first, densest about 0.
  constexpr int kSteps = 12;
  constexpr double kRatio = 1.6;
  std::vector<double> candidates = {0.0};
  for (int i = 0; i < kSteps; ++i)
    for (const double sign : {-1.0, 1.0})
      candidates.push_back(sign * longest_s * std::pow(kRatio, -i));
  std::sort(candidates.begin(), candidates.end());
  std::size_t best = 0;
  std::vector<double> costs;
  for (const double candidate : candidates) {
    costs.push_back(with(candidate, depth_disagreement));
    if (costs.back() < costs[best]) best = costs.size() - 1;
  }
  const double low = candidates[best == 0 ? 0 : best - 1];
  const double high = candidates[std::min(best + 1, candidates.size() - 1)];
  const double rough_s =
      find_least(low, high, 14, [&](double s) { return with(s, depth_disagreement); });
  constexpr double kNear = 0.05;
  const double reach_s = std::max(kNear * std::abs(rough_s), 1e-3 * (high - low));
  const double fine_s = find_least(rough_s - reach_s, rough_s + reach_s, 26,
                                   [&](double s) { return with(s, sharp_disagreement); });
  LineFit fit{shutter_of(fine_s, is_of_columns), 0.0};
  fit.left = with(fine_s, depth_disagreement);
  return fit;
}

std::string words_of(const Shutter& shutter) {
  return fmt::format("lines are read {}, one every {:.5g} us", name_of(shutter.readout),
                     1e6 * shutter.line_time_s);
}

Hypothesis hypothesis(int rank, std::function<bool(Trial&, Cause&)> undo) {
  Hypothesis h;
  h.checks = {"reprojection", "flow", "colmap_observations", "photometric"};
  h.rank = rank;
  h.undo = std::move(undo);
  return h;
}

/// Cameras whose dataset.json states a shutter.
void add_stated(const Trial& trial, const std::vector<int>& cameras,
                std::vector<Hypothesis>& hypotheses, int rank) {
  const Shutter stated = *trial.camera(cameras.front()).shutter;
  const auto add_readout = [&](Readout readout, int more) {
    hypotheses.push_back(hypothesis(rank + more, [=](Trial& t, Cause& cause) {
      set_shutter(t, cameras, Shutter{stated.line_time_s, readout});
      cause.name = "readout";
      cause.camera = cameras.size() == 1 ? t.camera(cameras.front()).name : "";
      cause.words = fmt::format("{}: lines are read {}, where dataset.json says {}",
                                t.camera_names(cameras), name_of(readout), name_of(stated.readout));
      return true;
    }));
  };
  add_readout(opposite(stated.readout), 0);
  const bool is_of_columns = stated.readout == Readout::Right || stated.readout == Readout::Left;
  for (const Readout other : {is_of_columns ? Readout::Down : Readout::Right,
                              is_of_columns ? Readout::Up : Readout::Left})
    add_readout(other, 1);
  hypotheses.push_back(hypothesis(rank + 1, [=](Trial& t, Cause& cause) {
    set_shutter(t, cameras, std::nullopt);
    cause.name = "shutter_stated";
    cause.camera = cameras.size() == 1 ? t.camera(cameras.front()).name : "";
    cause.words = fmt::format(
        "{}: all lines are exposed at once, where dataset.json states a rolling shutter",
        t.camera_names(cameras));
    return true;
  }));
  hypotheses.push_back(hypothesis(rank + 2, [=](Trial& t, Cause& cause) {
    const LineFit fit = fit_line_time(t, cameras, is_of_columns);
    if (fit.shutter.readout != stated.readout || !(fit.left < 0.5 * depth_disagreement(t)))
      return false;
    set_shutter(t, cameras, fit.shutter);
    cause.name = "line_time";
    cause.camera = cameras.size() == 1 ? t.camera(cameras.front()).name : "";
    cause.size = 100.0 * (stated.line_time_s / fit.shutter.line_time_s - 1.0);
    cause.unit = "%";
    cause.words = fmt::format("{}: line_time_s of dataset.json is {:+.3g} % off: {}",
                              t.camera_names(cameras), cause.size, words_of(fit.shutter));
    return true;
  }));
}

/// Cameras of which dataset.json states none.
void add_unstated(const std::vector<int>& cameras, std::vector<Hypothesis>& hypotheses, int rank) {
  for (const bool is_of_columns : {false, true})
    hypotheses.push_back(hypothesis(rank + (is_of_columns ? 1 : 0), [=](Trial& t, Cause& cause) {
      const LineFit fit = fit_line_time(t, cameras, is_of_columns);
      if (!(fit.left < 0.5 * depth_disagreement(t))) return false;
      set_shutter(t, cameras, fit.shutter);
      cause.name = "shutter_missing";
      cause.camera = cameras.size() == 1 ? t.camera(cameras.front()).name : "";
      cause.size = 1e6 * fit.shutter.line_time_s;
      cause.unit = "us";
      cause.words = fmt::format("{}: dataset.json states no shutter, where {}",
                                t.camera_names(cameras), words_of(fit.shutter));
      return true;
    }));
}

}  // namespace

void make_shutter_causes(const Symptoms& symptoms, std::vector<Hypothesis>& hypotheses) {
  const Trial& trial = symptoms.trial;
  // Without motions nothing is known of where other lines were exposed.
  const auto& motion = trial.sequence.motion;
  if (motion.empty() ||
      std::none_of(motion.begin(), motion.end(), [](const auto& row) { return row.has_value(); }))
    return;
  std::vector<int> stated, unstated;
  for (int c = 0; c < trial.num_cameras(); ++c)
    (trial.camera(c).shutter ? stated : unstated).push_back(c);
  const bool are_alike = std::all_of(stated.begin(), stated.end(), [&](int c) {
    return trial.camera(c).shutter == trial.camera(stated.front()).shutter;
  });
  constexpr int kAlone = 3;  // of some of the cameras a mistake is less simple
  if (!stated.empty() && are_alike) add_stated(trial, stated, hypotheses, 1);
  if (stated.size() > 1 || !are_alike)
    for (const int c : stated)
      if (may_be_alone(trial, c)) add_stated(trial, {c}, hypotheses, 1 + kAlone);
  if (!unstated.empty()) add_unstated(unstated, hypotheses, 2);
  if (unstated.size() > 1)
    for (const int c : unstated)
      if (may_be_alone(trial, c)) add_unstated({c}, hypotheses, 2 + kAlone);
}

}  // namespace terracast::validate
