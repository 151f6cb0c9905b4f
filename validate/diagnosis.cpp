#include "validate/diagnosis.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "validate/causes/trial.h"
#include "validate/checks/checker.h"
#include "validate/report_page.h"
#include "validate/sensor_diagnosis.h"

// One line a kind of causes; the file is causes/<name>.cpp and defines make_<name>_causes(). Of
// causes that repair equally much at the same rank, the one that stands first is named.
#define TERRACAST_CAUSES(X)                                                     \
  X(cameras, "intrinsics and mounts; images or poses of two cameras swapped")   \
  X(poses, "frames, order, units and rows of poses")                            \
  X(depth, "ranges, units, limits, steps and bytes of depth; sky that is none") \
  X(flow, "signs, order, directions, offsets and masks of flow")                \
  X(disparity, "scale of disparity; that of the other image")                   \
  X(colors, "channels, shifts by frames, single images")                        \
  X(image_shift, "images that stand a part of a pixel beside depth and poses")  \
  X(order, "colours, depths, flow or poses of frames in another order")         \
  X(shutter, "rolling shutters: order and time of lines; none stated")          \
  X(times, "units and shifts of time stamps")                                   \
  X(georeference, "datums, units, order and axes of places on WGS84")           \
  X(oxts, "units and axes of inertial packets")                                 \
  X(colmap, "observations, tracks, places and colours of COLMAP's points")      \
  X(georegistration, "axes, units, heights and frames of georegistration.txt")  \
  X(depth_offset, "a constant offset of depth")                                 \
  X(corrections,                                                                \
    "small errors by least squares: principal point, focal length, scale, "     \
    "rotation, position, time")

namespace terracast::validate {

#define TERRACAST_DECLARE(name, summary) \
  void make_##name##_causes(const Symptoms&, std::vector<Hypothesis>&);
TERRACAST_CAUSES(TERRACAST_DECLARE)
#undef TERRACAST_DECLARE

namespace {

/// A row of the table.
struct Kind {
  std::string_view name;
  std::string_view summary;
  CauseMaker make;
};

constexpr Kind kKinds[] = {
#define TERRACAST_ROW(name, summary) {#name, summary, &make_##name##_causes},
    TERRACAST_CAUSES(TERRACAST_ROW)
#undef TERRACAST_ROW
};

constexpr std::string_view kStructure = "structure";

/// What a diagnosis may compare: as often as the checks did, ten times.
constexpr std::int64_t kEffortByChecks = 10;

bool has_failures(const Shares& shares) {
  return std::any_of(shares.begin(), shares.end(),
                     [](const auto& entry) { return entry.second > 1.0; });
}

/// A hypothesis that holds.
struct Accepted {
  Trial trial;
  Cause cause;
  Shares shares;  ///< after it was undone
  std::size_t num_repaired = 0;
  int rank = 0;
  double left = 0.0;  ///< sum of the logarithms of shares
  std::vector<std::string_view> marks;
  std::vector<std::string> damage;  ///< what it does not explain
};

bool has_any(const std::string& line, const std::vector<std::string>& words) {
  return std::any_of(words.begin(), words.end(),
                     [&](const std::string& part) { return line.find(part) != std::string::npos; });
}

/// Words of Reader::check_mounts().
const std::vector<std::string> kUnfitMount = {" m right, down and forward of ",
                                              " deg past where its name says"};

/// Whether files as they should be may read so, by a mistake in what they hold.
bool may_follow(const std::string& line) {
  return has_any(line, kUnfitMount) || has_any(line, kUnfitDepth) || has_any(line, kUnfitSize) ||
         has_any(line, kUnfitClass) || has_any(line, kUnfitPlace);
}

bool has_right_mounts(const Trial& trial) {
  Findings findings;
  find_reader(trial.dataset->format).check_mounts(trial.sequence, findings);
  return findings.count() == 0;
}

/// Damage that does not follow from a cause. That of mounts follows from what rights them.
std::vector<std::string> damage_without(const Cause& cause, const Trial& before, const Trial& after,
                                        const std::vector<std::string>& damage) {
  std::vector<std::string> left = damage;
  const bool is_of_mounts =
      std::any_of(damage.begin(), damage.end(),
                  [](const std::string& line) { return has_any(line, kUnfitMount); }) &&
      !has_right_mounts(before) && has_right_mounts(after);
  std::erase_if(left, [&](const std::string& line) {
    return has_any(line, cause.explains) || (is_of_mounts && has_any(line, kUnfitMount));
  });
  return left;
}

/// A sequence's own findings, and those of no sequence.
bool is_of_sequence(const std::string& line, const Dataset& dataset, const Sequence& sequence) {
  return std::none_of(
      dataset.sequences.begin(), dataset.sequences.end(), [&](const Sequence& other) {
        return &other != &sequence &&
               (line.starts_with(other.path + "/") || line.starts_with(other.path + ":"));
      });
}

/// Whether all that failed of a check is within its bounds, and what was right still is. A result that
/// is no more to be seen (of time, in steady straight flight) counts neither way, if others are.
bool is_repaired(std::string_view check, const Shares& before, const Shares& after) {
  std::size_t num_repaired = 0;
  for (const auto& [name, share] : after) {
    if (check_of(name) != check) continue;
    if (share > 1.0) return false;
    const auto was = before.find(name);
    if (was != before.end() && was->second > 1.0) ++num_repaired;
  }
  return num_repaired > 0;
}

/// Nothing that was right, or not seen, fails; nothing that failed is over half as bad again.
bool is_no_worse(const Shares& before, const Shares& after) {
  for (const auto& [name, share] : after) {
    if (share <= 1.0) continue;
    const auto was = before.find(name);
    if (was == before.end() || was->second <= 1.0 || share > 1.5 * was->second) return false;
  }
  return true;
}

/// What is measured without the checks that are explained already.
Shares measure_open(const Trial& trial, const std::vector<std::string_view>& checks,
                    const std::set<std::string_view>& explained) {
  std::vector<std::string_view> open;
  for (const std::string_view check : checks)
    if (!explained.contains(check)) open.push_back(check);
  return measure(trial, open);
}

std::optional<Accepted> test(const Hypothesis& hypothesis, const Trial& trial, const Shares& before,
                             const std::vector<std::string_view>& all,
                             const std::set<std::string_view>& explained,
                             const std::vector<std::string>& damage) {
  const auto fails = [&](std::string_view check) {
    return std::any_of(before.begin(), before.end(), [&](const auto& entry) {
      return entry.second > 1.0 && check_of(entry.first) == check;
    });
  };
  const auto key = std::find_if(hypothesis.checks.begin(), hypothesis.checks.end(), fails);
  if (key == hypothesis.checks.end()) return std::nullopt;
  Accepted accepted{trial, {}, {}, 0, hypothesis.rank, 0.0, {}, {}};
  if (!hypothesis.undo(accepted.trial, accepted.cause)) return std::nullopt;
  accepted.damage = damage_without(accepted.cause, trial, accepted.trial, damage);
  const bool explains_damage = accepted.damage.size() < damage.size();
  if (*key == kStructure && !explains_damage) return std::nullopt;
  if (explains_damage) {
    ++accepted.num_repaired;
    accepted.cause.checks.emplace_back(kStructure);
  }
  if (!hypothesis.marks.empty()) {
    accepted.marks = hypothesis.marks;
    accepted.shares = before;
    for (auto& [name, share] : accepted.shares)
      if (share > 1.0 && name != kStructure &&
          std::find(hypothesis.marks.begin(), hypothesis.marks.end(), check_of(name)) !=
              hypothesis.marks.end()) {
        ++accepted.num_repaired;
        accepted.cause.checks.push_back(name);
        share = 1.0;
      }
    return accepted;
  }
  if (*key != kStructure && !is_repaired(*key, before, measure(accepted.trial, {*key})))
    return std::nullopt;
  std::set<std::string_view> others(hypothesis.checks.begin(), hypothesis.checks.end());
  others.insert(all.begin(), all.end());
  // The rest at once: results of the key's check again among them.
  accepted.shares = measure_open(accepted.trial, {others.begin(), others.end()}, explained);
  if (!is_no_worse(before, accepted.shares)) return std::nullopt;
  for (const auto& [name, share] : before) {
    const auto now = accepted.shares.find(name);
    if (share > 1.0 && now != accepted.shares.end() && now->second <= 1.0) {
      ++accepted.num_repaired;
      accepted.cause.checks.push_back(name);
    }
    if (now != accepted.shares.end()) accepted.left += std::log(std::max(now->second, 1e-6));
  }
  return accepted;
}

/// The order in which causes are believed.
bool is_better(const Accepted& a, const Accepted& b) {
  if (a.num_repaired != b.num_repaired) return a.num_repaired > b.num_repaired;
  if (a.rank != b.rank) return a.rank < b.rank;
  return a.left < b.left - 1e-9;
}

/// The best of all causes, each tested on the trial.
/// best  holds what was found so far where the effort ends
/// throws  EffortSpent
void find_best(const Symptoms& symptoms, const std::vector<std::string_view>& checks,
               const std::set<std::string_view>& explained, const std::vector<std::string>& damage,
               std::optional<Accepted>& best) {
  for (const Kind& kind : kKinds) {
    // What is searched for by many evaluations comes when nothing simpler explains all.
    const bool is_search = kind.name == "depth_offset" || kind.name == "corrections";
    if (is_search && best && !has_failures(best->shares)) break;
    std::vector<Hypothesis> hypotheses;
    kind.make(symptoms, hypotheses);
    for (const Hypothesis& hypothesis : hypotheses) {
      std::optional<Accepted> accepted =
          test(hypothesis, symptoms.trial, symptoms.shares, checks, explained, damage);
      if (accepted && (!best || is_better(*accepted, *best))) best = std::move(accepted);
    }
  }
}

/// Failed results that the few frames and cameras of the trial did not show, of checks that a cause repaired, are its
/// as well.
void add_unshown(const std::vector<CheckResult>& failed, Accepted& accepted) {
  std::set<std::string> shown(accepted.cause.checks.begin(), accepted.cause.checks.end());
  std::set<std::string_view> repaired;
  for (const std::string& name : shown) repaired.insert(check_of(name));
  for (const CheckResult& result : failed) {
    const auto now = accepted.shares.find(result.name);
    if (repaired.contains(check_of(result.name)) &&
        (now == accepted.shares.end() || now->second <= 1.0))
      shown.insert(result.name);
  }
  accepted.cause.checks.assign(shown.begin(), shown.end());
}

/// Names of the checks that results belong to, of those that can be run on a trial.
std::vector<std::string_view> checks_of(const std::vector<CheckResult>& failed) {
  std::vector<std::string_view> names;
  for (const CheckResult& result : failed) {
    const std::string_view check = check_of(result.name);
    if (!check.empty() && check != kStructure && check != "colmap_model" &&
        std::find(names.begin(), names.end(), check) == names.end())
      names.push_back(check);
  }
  return names;
}

Cause cause_of_end(const Effort& effort, const Sequence& sequence) {
  Cause cause;
  cause.name = "search_ended";
  cause.sequence = sequence.name;
  cause.words = fmt::format(
      "the search for causes ended at its bound of {} comparisons of images; there may be others",
      effort.bound());
  return cause;
}

}  // namespace

std::vector<Cause> diagnose(const Dataset& dataset, const Sequence& sequence,
                            const std::vector<CheckResult>& failed_results,
                            std::int64_t num_comparisons, std::vector<std::string>& damage,
                            const ValidateOptions& options, const core::Context& context,
                            std::int64_t least_effort) {
  std::vector<CheckResult> failed = failed_results;
  std::erase_if(failed, [](const CheckResult& result) {
    return result.name == kStructure || is_of_sensors(result.name);
  });
  std::vector<std::string> own_damage;
  for (const std::string& line : damage)
    if (is_of_sequence(line, dataset, sequence)) own_damage.push_back(line);
  if (!own_damage.empty()) {
    failed.emplace_back();
    failed.back().name = kStructure;
    failed.back().worst = own_damage.front();
  }
  std::vector<std::string_view> checks_to_run = checks_of(failed);
  if (failed.empty() || sequence.cameras.empty() || sequence.num_frames < 1) return {};
  const std::int64_t bound = std::max(least_effort, kEffortByChecks * num_comparisons);
  core::Progress progress(context, "comparisons for causes (at most)", bound);
  Effort effort(bound, &progress);
  Trial trial = make_trial(dataset, sequence, failed);
  trial.undulation_m = options.undulation_m;
  trial.effort = &effort;
  // Depth that broke a rule was left out of what the checks saw: here it is seen.
  if (!own_damage.empty())
    for (const std::string_view check : {"reprojection", "depth"})
      if (std::find(checks_to_run.begin(), checks_to_run.end(), check) == checks_to_run.end())
        checks_to_run.push_back(check);
  Shares shares;
  bool is_at_end = false;
  try {
    shares = measure(trial, checks_to_run);
  } catch (const EffortSpent&) {
    is_at_end = true;
  }
  // What files are damaged by is no cause's to explain, and not looked for.
  const auto note_damage = [&] {
    if (std::any_of(own_damage.begin(), own_damage.end(), may_follow))
      shares[std::string(kStructure)] = 2.0;
    else
      shares.erase(std::string(kStructure));
  };
  note_damage();
  std::set<std::string_view> explained;
  std::vector<Cause> causes;
  constexpr int kMostRounds = 3;
  for (int round = 0; round < kMostRounds && !is_at_end && has_failures(shares); ++round) {
    const Symptoms symptoms{trial, shares, failed};
    std::optional<Accepted> best;
    try {
      find_best(symptoms, checks_to_run, explained, own_damage, best);
    } catch (const EffortSpent&) {
      is_at_end = true;
    }
    if (!best) break;
    best->cause.sequence = sequence.name;
    add_unshown(failed, *best);
    causes.push_back(std::move(best->cause));
    trial = std::move(best->trial);
    for (auto& [name, share] : best->shares) shares[name] = share;
    explained.insert(best->marks.begin(), best->marks.end());
    own_damage = std::move(best->damage);
    note_damage();
    std::erase_if(shares,
                  [&](const auto& entry) { return explained.contains(check_of(entry.first)); });
  }
  if (is_at_end) causes.push_back(cause_of_end(effort, sequence));
  std::erase_if(damage, [&](const std::string& line) {
    return is_of_sequence(line, dataset, sequence) &&
           std::find(own_damage.begin(), own_damage.end(), line) == own_damage.end();
  });
  return causes;
}

void add_damage(const std::vector<std::string>& damage, std::vector<Cause>& causes) {
  struct Kind {
    const char* name;
    const char* words;
    std::vector<std::string> signs;
  };
  static const std::vector<Kind> kinds = {
      {"file_missing", "a file is missing", {}},
      {"file_extra", "a file too many", {"not listed in dataset.json", "files that are not"}},
      {"file_changed",
       "a file is not the one that was exported",
       {"where dataset.json says", "(hash)"}},
      {"file_damaged", "a file does not hold what it should", {""}}};
  constexpr std::size_t kMostOfAKind = 5;
  std::vector<std::vector<std::string>> lines(kinds.size());
  for (const std::string& line : damage) {
    std::size_t kind = line.ends_with(": missing") ? 0 : 1;
    while (kind > 0 && !has_any(line, kinds[kind].signs)) ++kind;
    lines[kind].push_back(line);
  }
  for (std::size_t kind = 0; kind < kinds.size(); ++kind)
    for (std::size_t i = 0; i < lines[kind].size() && i < kMostOfAKind; ++i) {
      Cause cause;
      cause.name = kinds[kind].name;
      cause.words = fmt::format("{}: {}", kinds[kind].words, lines[kind][i]);
      if (i + 1 == kMostOfAKind && lines[kind].size() > kMostOfAKind) cause.words += " (and more)";
      cause.checks = {std::string(kStructure)};
      causes.push_back(std::move(cause));
    }
}

core::Json causes_json(const std::vector<Cause>& causes) {
  core::Json list = core::Json::array();
  for (const Cause& cause : causes)
    list.push(core::Json::object()
                  .set("name", cause.name)
                  .set("words", cause.words)
                  .set("sequence", cause.sequence)
                  .set("camera", cause.camera)
                  .set("frame", cause.frame)
                  .set("size", std::isfinite(cause.size) ? cause.size : 0.0)
                  .set("unit", cause.unit)
                  .set("checks", core::Json::array_of(cause.checks)));
  return list;
}

}  // namespace terracast::validate
