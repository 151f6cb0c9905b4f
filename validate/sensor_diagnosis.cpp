#include "validate/sensor_diagnosis.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <optional>
#include <set>

#include "core/error.h"
#include "validate/causes/sensor_trial.h"
#include "validate/causes/trial.h"
#include "validate/checks/checker.h"
#include "validate/sequence_part.h"

// One line a kind of causes; the file is causes/<name>.cpp and defines make_<name>_causes().
#define TERRACAST_SENSOR_CAUSES(X)                                              \
  X(inertial, "gravity, the Earth's turning, arms, axes and units of IMUs")     \
  X(lidar, "poses, times, axes, ranges and rings of scanners' points")          \
  X(navigation, "heights, units, axes and arms of receivers and others beside") \
  X(sensor_clocks, "offsets, drifts, units and order of stamps")

namespace terracast::validate {

#define TERRACAST_DECLARE(name, summary) \
  void make_##name##_causes(const SensorSymptoms&, std::vector<SensorHypothesis>&);
TERRACAST_SENSOR_CAUSES(TERRACAST_DECLARE)
#undef TERRACAST_DECLARE

namespace {

constexpr SensorCauseMaker kMakers[] = {
#define TERRACAST_ROW(name, summary) &make_##name##_causes,
    TERRACAST_SENSOR_CAUSES(TERRACAST_ROW)
#undef TERRACAST_ROW
};

/// Checks that look at sensors beside cameras.
constexpr std::string_view kChecks[] = {"clocks", "inertial", "lidar", "navigation", "sensors"};

bool is_sensor_check(std::string_view check) {
  return std::find(std::begin(kChecks), std::end(kChecks), check) != std::end(kChecks);
}

/// A sequence with one sensor, to be changed.
class SensorTrial {
 public:
  SensorTrial(const Dataset& dataset, const Sequence& sequence, const ValidateOptions& options)
      : dataset_(dataset), undulation_m_(options.undulation_m), seed_(options.seed) {
    std::vector<int> cameras(sequence.cameras.size());
    std::iota(cameras.begin(), cameras.end(), 0);
    sequence_ = part_of(sequence, 0, sequence.num_frames, cameras);
  }

  const Sequence& sequence() const { return sequence_; }

  SensorShares measure(const SensorRecord& sensor) {
    sequence_.tried_sensors =
        std::make_shared<const std::vector<SensorRecord>>(std::vector<SensorRecord>{sensor});
    ValidateOptions options;
    options.seed = seed_;
    options.undulation_m = undulation_m_;
    options.is_trial = true;
    SensorShares shares;
    for (const CheckInfo& info : checks()) {
      if (!is_sensor_check(info.name)) continue;
      for (const CheckResult& result : info.make(options)->finish(dataset_, sequence_)) {
        if (result.skipped || !is_of_sensors(result.name)) continue;
        const double share = share_of_bound(result.value, result.bound, result.is_lower_bound);
        shares[result.name] = result.ok ? std::min(share, 1.0) : std::max(share, 1.0 + 1e-9);
      }
    }
    return shares;
  }

 private:
  const Dataset& dataset_;
  Sequence sequence_;
  Undulation undulation_m_;
  std::int64_t seed_;
};

/// A hypothesis that holds.
struct AcceptedCause {
  SensorRecord sensor;
  Cause cause;
  SensorShares shares;
  int rank = 0;
  double left = 0.0;  ///< sum of the logarithms of shares
};

/// Fills what a hypothesis repairs.
/// returns   false where it repairs no check whole, or spoils what was right or seen
bool does_hold(const SensorShares& before, AcceptedCause& accepted) {
  std::set<std::string_view> of_repaired, of_failing;
  for (const auto& [name, share] : before) {
    const auto now = accepted.shares.find(name);
    if (now == accepted.shares.end()) {
      // The jitter of a clock that has none is not looked at.
      if (share > 1.0 && name != "clocks_jitter") return false;
      if (share > 1.0) accepted.cause.checks.push_back(name);
      continue;
    }
    accepted.left += std::log(std::max(now->second, 1e-6));
    if (now->second > 1.0) {
      of_failing.insert(check_of(name));
      if (share <= 1.0 || now->second > 1.5 * share) return false;
    } else if (share > 1.0) {
      of_repaired.insert(check_of(name));
      accepted.cause.checks.push_back(name);
    }
  }
  for (const auto& [name, share] : accepted.shares)
    if (share > 1.0 && !before.contains(name)) return false;
  return std::any_of(of_repaired.begin(), of_repaired.end(), [&](std::string_view check) {
    // Results of `inertial` and `navigation` are of one column each, and wrong for reasons of their own.
    return !of_failing.contains(check) || check == "inertial" || check == "navigation";
  });
}

bool is_better(const AcceptedCause& a, const AcceptedCause& b) {
  if (a.cause.checks.size() != b.cause.checks.size())
    return a.cause.checks.size() > b.cause.checks.size();
  if (a.rank != b.rank) return a.rank < b.rank;
  return a.left < b.left - 1e-9;
}

bool has_failures(const SensorShares& shares) {
  return std::any_of(shares.begin(), shares.end(),
                     [](const auto& entry) { return entry.second > 1.0; });
}

std::vector<Cause> causes_of(SensorTrial& trial, const Dataset& dataset,
                             const std::vector<SensorRecord>& all, std::size_t index,
                             const ValidateOptions& options) {
  SensorRecord sensor = all[index];
  SensorShares shares = trial.measure(sensor);
  std::vector<Cause> causes;
  constexpr int kMostRounds = 3;
  for (int round = 0; round < kMostRounds && has_failures(shares); ++round) {
    const SensorSymptoms symptoms{.dataset = dataset,
                                  .sequence = trial.sequence(),
                                  .sensor = sensor,
                                  .all = all,
                                  .shares = shares,
                                  .undulation_m = options.undulation_m};
    std::vector<SensorHypothesis> hypotheses;
    for (const SensorCauseMaker make : kMakers) make(symptoms, hypotheses);
    std::optional<AcceptedCause> best;
    for (const SensorHypothesis& hypothesis : hypotheses) {
      AcceptedCause accepted{.sensor = sensor, .cause = {}, .shares = {}, .rank = hypothesis.rank};
      if (!hypothesis.undo(accepted.sensor, accepted.cause)) continue;
      accepted.shares = trial.measure(accepted.sensor);
      if (does_hold(shares, accepted) && (!best || is_better(accepted, *best)))
        best = std::move(accepted);
    }
    if (!best) break;
    best->cause.words = sensor.rig + "/" + sensor.name + ": " + best->cause.words;
    causes.push_back(std::move(best->cause));
    sensor = std::move(best->sensor);
    shares = std::move(best->shares);
  }
  return causes;
}

}  // namespace

bool is_of_sensors(std::string_view result) {
  // Of cameras' clocks.
  return result != "clocks" && is_sensor_check(check_of(result));
}

std::vector<Cause> diagnose_sensors(const Dataset& dataset, const Sequence& sequence,
                                    const std::vector<CheckResult>& failed,
                                    const ValidateOptions& options) {
  const auto is_one = [](const CheckResult& result) { return is_of_sensors(result.name); };
  if (std::none_of(failed.begin(), failed.end(), is_one)) return {};
  constexpr std::string_view kOfPoses[] = {"georeference", "motion", "oxts", "reprojection",
                                           "trajectory"};
  for (const CheckResult& result : failed)
    if (std::find(std::begin(kOfPoses), std::end(kOfPoses), check_of(result.name)) !=
        std::end(kOfPoses))
      return {};
  try {
    const std::vector<SensorRecord> sensors = read_sensors(dataset, sequence);
    SensorTrial trial(dataset, sequence, options);
    std::vector<Cause> causes;
    for (std::size_t i = 0; i < sensors.size(); ++i)
      for (Cause& cause : causes_of(trial, dataset, sensors, i, options)) {
        cause.sequence = sequence.name;
        causes.push_back(std::move(cause));
      }
    return causes;
  } catch (const core::Error& error) {
    if (error.kind() != core::ErrorKind::Input && error.kind() != core::ErrorKind::Io) throw;
    return {};  // the checks tell of files that cannot be read
  }
}

}  // namespace terracast::validate
