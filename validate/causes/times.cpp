#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "validate/causes/trial.h"
#include "validate/sampling.h"

/// Time stamps of another unit, start or rate.
namespace terracast::validate {

namespace {

/// Where times are written.
enum class Where { Format, Georeference, Both };
const char* words_of(Where where, const Trial& trial) {
  if (where == Where::Georeference) return "georeference.csv: times";
  const bool is_kitti = trial.dataset->format == "kitti";
  if (where == Where::Both)
    return is_kitti ? "times.txt and georeference.csv: times"
                    : "timestamps.txt and georeference.csv: times";
  return is_kitti ? "times.txt: times" : "timestamps.txt: times";
}

void change_times(Trial& trial, Where where, const std::function<double(double)>& change) {
  const double start_s = trial.first_frame / trial.sequence.rate_hz;
  const auto undo = [&](double& time_s) { time_s = change(time_s + start_s) - start_s; };
  if (where != Where::Georeference)
    for (double& time_s : trial.sequence.times_s) undo(time_s);
  if (where != Where::Format)
    for (Camera& camera : trial.sequence.cameras)
      for (auto& row : camera.georeference)
        if (row) undo(row->time_s);
}

void add(std::vector<Hypothesis>& hypotheses, const char* name, Where where, int rank, double size,
         const char* unit, const std::string& words, const std::function<double(double)>& change) {
  Hypothesis h;
  h.checks = {"georeference"};
  h.rank = rank;
  h.undo = [=](Trial& trial, Cause& cause) {
    change_times(trial, where, change);
    cause.name = name;
    cause.size = size;
    cause.unit = unit;
    cause.words = fmt::format("{} {}", words_of(where, trial), words);
    return true;
  };
  hypotheses.push_back(std::move(h));
}

}  // namespace

void make_times_causes(const Symptoms& symptoms, std::vector<Hypothesis>& hypotheses) {
  if (!symptoms.fails_result("georeference_time")) return;
  const Trial& trial = symptoms.trial;
  const bool has_own = !trial.sequence.times_s.empty();
  for (const Where where : {Where::Format, Where::Georeference, Where::Both}) {
    if (where != Where::Georeference && !has_own) continue;
    const int rank = where == Where::Both ? 1 : 0;
    for (const auto& [factor, unit] : {std::pair{1e3, "ms"}, std::pair{1e6, "µs"},
                                       std::pair{1e9, "ns"}, std::pair{1.0 / 60.0, "min"}})
      add(hypotheses, "time_unit", where, rank, factor, unit,
          fmt::format("are in {} where seconds are meant", unit),
          [factor = factor](double time_s) { return time_s / factor; });
    // A shift, and a rate: by the first and the last frame.
    std::vector<double> times;
    if (where == Where::Georeference || !has_own) {
      for (const auto& row : trial.camera(0).georeference)
        if (row) times.push_back(row->time_s);
    } else {
      times = trial.sequence.times_s;
    }
    if (times.size() < 2) continue;
    const double rate_hz = trial.sequence.rate_hz;
    const double step_s = (times.back() - times.front()) / static_cast<double>(times.size() - 1);
    const double shift = times.front() * rate_hz;
    if (std::abs(shift) > 1e-6 && std::abs(step_s * rate_hz - 1.0) < 1e-6)
      add(hypotheses, "time_shifted", where, rank + 1, shift, "frames",
          fmt::format("are shifted by {:.6g} frames ({:+.6g} s)", shift, times.front()),
          [offset_s = times.front()](double time_s) { return time_s - offset_s; });
    if (std::abs(step_s * rate_hz - 1.0) > 1e-6 && step_s > 0.0)
      add(hypotheses, "time_rate", where, rank + 2, step_s * rate_hz, "times",
          fmt::format("go by {:.6g} s a frame where 1 / {:.6g} Hz is right: {:.6g} times too {}",
                      step_s, rate_hz,
                      step_s * rate_hz > 1.0 ? step_s * rate_hz : 1.0 / (step_s * rate_hz),
                      step_s * rate_hz > 1.0 ? "slow" : "fast"),
          [factor = step_s * rate_hz](double time_s) { return time_s / factor; });
  }
}

}  // namespace terracast::validate
