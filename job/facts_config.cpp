#include "job/facts_config.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <optional>
#include <span>

#include "capture/begun_sequence.h"
#include "capture/channel.h"
#include "core/error.h"
#include "job/job.h"

namespace terracast::job {
namespace {

std::vector<std::string> flag_names_of(std::uint32_t bits) {
  std::vector<std::string> names;
  for (const capture::FlagGroup& group : capture::flag_groups())
    if ((group.bits & bits) != 0) names.emplace_back(group.name);
  return names;
}

}  // namespace

bool FactsConfig::has_needed() const {
  return std::find(flags.begin(), flags.end(), kNeeded) != flags.end();
}

void FactsConfig::describe(core::SchemaVisitor& visit) {
  std::vector<std::string> choices = sensors::FactOptions::all_flags();
  choices.emplace_back(kNeeded);
  visit.key("flags", flags,
            "Which flags the capture holds of each pixel: edge (beside what else it shows), next "
            "and previous (whether the point is seen in the next and the previous frame: flow's "
            "masks), cameras (whether the rig's other cameras see it), needed (those that the "
            "exports need). Each costs a ray a pixel and more; those that are left out stay 0.",
            core::one_of(std::move(choices)));
}

void resolve_flags(RunConfig& config) {
  if (!config.facts.has_needed()) return;
  std::uint32_t bits = config.facts.options().flag_bits();
  for (const auto& chosen : config.exports) bits |= chosen.exporter().flags();
  config.facts = {.flags = flag_names_of(bits), .follow_exports = true};
}

void keep_captured_flags(RunConfig& config, const std::filesystem::path& captures) {
  if (!config.facts.follow_exports) return;
  const std::uint32_t needed = config.facts.options().flag_bits();
  const std::span<const capture::FlagGroup> groups = capture::flag_groups();
  for (const geo::TrajectoryOptions& trajectory : config.trajectories) {
    const std::optional<std::string> captured =
        capture::captured_config(captures / trajectory.name);
    if (!captured) continue;
    RunConfig tried = config;
    for (unsigned choice = 0; choice < 1U << groups.size(); ++choice) {
      std::uint32_t bits = 0;
      for (std::size_t i = 0; i < groups.size(); ++i)
        if ((choice >> i & 1U) != 0) bits |= groups[i].bits;
      tried.facts.flags = flag_names_of(bits);
      if ((needed & ~bits) != 0 || toml_of_sequence(tried, trajectory) != *captured) continue;
      config.facts = tried.facts;
      return;
    }
  }
}

void check_flags(const RunConfig& config) {
  if (config.facts.has_needed()) return;
  const std::uint32_t bits = config.facts.options().flag_bits();
  for (const auto& chosen : config.exports) {
    std::vector<std::string> missing;
    for (const std::string& name : flag_names_of(chosen.exporter().flags() & ~bits))
      missing.push_back(fmt::format("\"{}\"", name));
    if (!missing.empty())
      core::fail(core::ErrorKind::Config,
                 "format \"{}\" needs the flags {}, which facts.flags leaves out: add them there, "
                 "or leave the format out",
                 chosen.format, fmt::join(missing, ", "));
  }
}

}  // namespace terracast::job
