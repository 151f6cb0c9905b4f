#include <algorithm>
#include <iterator>
#include <limits>
#include <optional>

#include "core/error.h"
#include "core/parallel.h"
#include "core/plugin_rows.h"
#include "core/printable.h"
#include "core/progress.h"
#include "validate/check.h"
#include "validate/checks/checker.h"
#include "validate/colmap/job.h"
#include "validate/diagnosis.h"
#include "validate/plugin_format.h"
#include "validate/report.h"
#include "validate/sensor_diagnosis.h"
#include "validate/text.h"

namespace terracast::validate {

namespace {

/// How bad a result is: failed before right before skipped, then by the share of its bound. Where all sequences have to
/// show something, that one does not comes before that another does.
std::pair<int, double> badness(const CheckResult& result) {
  const int unseen = result.is_of_all ? 3 : 1;
  const int rank = !result.ok ? 4 : !result.skipped ? 2 : result.is_unseen ? unseen : 0;
  return {rank, share_of_bound(result.value, result.bound, result.is_lower_bound)};
}

/// Adds results of one sequence, their words printable. Those of `structure` are: they are findings.
void add_results(std::vector<CheckResult> more, std::vector<CheckResult>& own) {
  for (CheckResult& result : more) {
    if (result.name != "structure")
      for (std::string* words : {&result.worst, &result.summary}) {
        std::string lines;
        for (const TextLine& line : split_lines(*words))
          lines += (lines.empty() ? "" : "\n") + core::printable(line.text);
        *words = std::move(lines);
      }
    own.push_back(std::move(result));
  }
}

/// What a diagnosis needs of results: those that failed, without plots and pictures.
std::vector<CheckResult> failed_of(const std::vector<CheckResult>& results) {
  std::vector<CheckResult> failed;
  for (const CheckResult& result : results) {
    if (result.ok) continue;
    CheckResult known;
    known.name = result.name;
    known.value = result.value;
    known.worst = result.worst;
    known.unit = result.unit;
    known.mistake = result.mistake;
    failed.push_back(std::move(known));
  }
  return failed;
}

/// Results of several sequences under one name: the worst stands for all.
void merge(std::vector<CheckResult>& all, std::vector<CheckResult> more,
           const std::string& sequence, bool is_only) {
  for (CheckResult& result : more) {
    // Files are looked at once, for all sequences, and lines name them.
    if (!is_only && !result.worst.empty() && result.name != "structure")
      result.worst = sequence + ": " + result.worst;
    const auto same = std::find_if(all.begin(), all.end(),
                                   [&](const CheckResult& r) { return r.name == result.name; });
    if (same == all.end())
      all.push_back(std::move(result));
    else if (badness(result) > badness(*same))
      *same = std::move(result);
  }
}

/// What the readers met on their way joins the check of the files.
void add_findings(const Findings& findings, std::vector<CheckResult>& results) {
  const auto structure = std::find_if(results.begin(), results.end(),
                                      [](const CheckResult& r) { return r.name == "structure"; });
  if (structure == results.end() || findings.count() == 0) return;
  structure->value += static_cast<double>(findings.count());
  structure->ok = false;
  const std::string lines = fmt::format("{}", fmt::join(findings.lines(), "\n"));
  structure->worst = structure->worst.empty() ? lines : lines + "\n" + structure->worst;
}

/// All that the readers met, and what the check of the files found, a line each.
std::vector<std::string> damage_of(const Findings& findings,
                                   const std::vector<CheckResult>& results) {
  std::vector<std::string> lines = findings.lines(std::numeric_limits<std::size_t>::max());
  for (const CheckResult& result : results)
    if (result.name == "structure" && !result.ok)
      for (const TextLine& line : split_lines(result.worst))
        if (std::find(lines.begin(), lines.end(), line.text) == lines.end())
          lines.emplace_back(line.text);
  return lines;
}

/// What checks leave of a sequence for its diagnosis.
struct Checked {
  std::vector<CheckResult> failed;
  std::int64_t num_comparisons = 0;  ///< pairs of images times checks
};

/// What checks themselves know of a sequence; of several results with one mistake one cause.
std::vector<Cause> known_causes(const std::vector<CheckResult>& failed,
                                const std::string& sequence) {
  std::vector<Cause> causes;
  for (const CheckResult& result : failed) {
    if (!result.mistake) continue;
    const auto same = std::find_if(causes.begin(), causes.end(), [&](const Cause& cause) {
      return cause.name == result.mistake->name;
    });
    if (same != causes.end()) {
      same->checks.push_back(result.name);
      continue;
    }
    Cause cause;
    cause.name = result.mistake->name;
    cause.words = result.mistake->words;
    cause.sequence = sequence;
    cause.checks = {result.name};
    causes.push_back(std::move(cause));
  }
  return causes;
}

/// Causes in all sequences; those of several name theirs.
std::vector<Cause> diagnose_all(const Dataset& dataset, const std::vector<Checked>& checked,
                                std::vector<std::string> damage, const ValidateOptions& options,
                                const core::Context& context) {
  std::vector<Cause> causes;
  const auto add = [&](std::vector<Cause> found) {
    for (Cause& cause : found) {
      if (dataset.sequences.size() > 1) cause.words = cause.sequence + ": " + cause.words;
      cause.words = core::printable(cause.words);
      causes.push_back(std::move(cause));
    }
  };
  for (std::size_t i = 0; i < dataset.sequences.size(); ++i) {
    const Sequence& sequence = dataset.sequences[i];
    std::vector<CheckResult> failed = checked[i].failed;
    add(known_causes(failed, sequence.name));
    std::erase_if(failed, [](const CheckResult& result) { return result.mistake.has_value(); });
    add(diagnose(dataset, sequence, failed, checked[i].num_comparisons, damage, options, context));
    add(diagnose_sensors(dataset, sequence, failed, options));
  }
  add_damage(damage, causes);
  return causes;
}

std::string words_of_belief(const Sequence& sequence) {
  return fmt::format(
      "Sequence {}: the format's own files state what is believed of its cameras; they are held "
      "against calibration_believed.json, and images and labels against the cameras as they are",
      sequence.name);
}

}  // namespace

std::vector<CheckResult> run_validate_stage(const std::filesystem::path& folder,
                                            const ValidateOptions& options,
                                            const std::filesystem::path& report_folder,
                                            const core::Context& context) {
  const core::ThreadLimit limit(context.num_threads);
  Findings findings;
  const Dataset dataset = read_dataset(folder, options.format, findings);
  std::int64_t num_frames = 0;
  for (const Sequence& sequence : dataset.sequences) num_frames += sequence.num_frames;
  for (const Sequence& sequence : dataset.sequences)
    if (sequence.states_belief) context.log.info("{}", words_of_belief(sequence));
  context.log.info("{}: {}, {} sequences, {} frames, {} files", folder.string(), dataset.format,
                   dataset.sequences.size(), num_frames, dataset.files.size());

  if (is_format_of_plugin(dataset.format))
    context.log.warn("{}: no reader knows the format {} of a plug-in; its files alone are checked",
                     folder.string(), dataset.format);

  std::vector<CheckResult> results;
  std::vector<Checked> checked;  // each sequence
  std::optional<core::Progress> progress(std::in_place, context, "frames", num_frames);
  // A dataset whose sequences cannot be read still has its files looked at.
  std::vector<Sequence> nothing(1);
  nothing[0].rate_hz = 1.0;
  const std::vector<Sequence>& sequences = dataset.sequences.empty() ? nothing : dataset.sequences;
  for (const Sequence& sequence : sequences) {
    std::vector<std::unique_ptr<Checker>> checkers;
    for (const CheckInfo& info : checks()) {
      if (dataset.sequences.empty() && info.name != "structure") continue;
      if (info.name == "structure" && &sequence != sequences.data())
        continue;  // of the whole dataset
      checkers.push_back(core::made(info.make(options), "check", info.name));
    }
    FrameWindow window(dataset, sequence, findings);
    std::int64_t num_comparisons = 0;
    while (window.advance()) {
      const std::vector<ViewPair> pairs = window.pairs();
      num_comparisons += static_cast<std::int64_t>(pairs.size() * checkers.size());
      for (const auto& checker : checkers) checker->frame(window, pairs);
      progress->advance();
    }
    std::vector<CheckResult> own;
    for (const auto& checker : checkers) add_results(checker->finish(dataset, sequence), own);
    const auto number = static_cast<std::size_t>(&sequence - sequences.data());
    add_results(run_colmap_modes(dataset, sequence, options,
                                 report_folder / "colmap" / fmt::format("{:02}", number), context),
                own);
    checked.push_back({failed_of(own), num_comparisons});
    merge(results, std::move(own), core::printable(sequence.name), sequences.size() == 1);
  }
  progress.reset();  // what follows has its own
  add_findings(findings, results);
  for (const CheckResult& result : results) {
    if (result.ok)
      context.log.debug("{}: {:.4g} {} (bound {:.4g}){}", result.name, result.value, result.unit,
                        result.bound, result.skipped ? " skipped: " + result.worst : "");
    else
      context.log.warn("{}: {:.4g} {} (bound {:.4g}) FAILED: {}", result.name, result.value,
                       result.unit, result.bound, result.worst);
  }
  ReportHead head;
  head.title = core::printable(fmt::format("{}: {}", dataset.format, dataset.world_name));
  for (const Sequence& sequence : dataset.sequences) {
    std::string cameras;
    for (const Camera& camera : sequence.cameras)
      cameras += fmt::format("{}{} ({} × {})", cameras.empty() ? "" : ", ", camera.name,
                             camera.intrinsics.width_px, camera.intrinsics.height_px);
    head.lines.push_back(
        core::printable(fmt::format("Sequence {}: {} frames at {} Hz from {:.5f}, {:.5f}; {}",
                                    sequence.name, sequence.num_frames, sequence.rate_hz,
                                    sequence.origin.lat_deg, sequence.origin.lon_deg, cameras)));
    if (sequence.states_belief) head.lines.push_back(core::printable(words_of_belief(sequence)));
  }
  head.causes = diagnose_all(dataset, checked, damage_of(findings, results), options, context);
  write_report(
      head, results,
      {.dataset = &dataset, .ground_map = options.ground_map, .events_file = context.events_file},
      report_folder);
  context.log.info("{}", verdict_line(report_folder));
  for (const Cause& cause : head.causes) context.log.warn("cause: {}", cause.words);
  return results;
}

}  // namespace terracast::validate
