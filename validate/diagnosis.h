#pragma once

#include <string>
#include <vector>

#include "core/context.h"
#include "core/json.h"
#include "validate/check.h"
#include "validate/dataset.h"

/// What is wrong with a dataset, in words. Every cause is a hypothesis that is tested on the
/// dataset: the supposed mistake is undone in memory, in some frames around the worst place, and
/// the checks run again there. It is named only when all that failed in one check comes within its
/// bound, nothing that was right fails, and nothing simpler does as much; what still fails is then
/// looked at again.
namespace terracast::validate {

/// What a diagnosis of a short sequence may take.
inline constexpr std::int64_t kLeastEffort = 200'000;

/// Causes of what failed in one sequence; the one that repairs most first.
/// failed   results of that sequence
/// damage   findings of `structure` in all sequences; those that follow from a cause are taken out
/// num_comparisons  of the checks: pairs of images times checks
/// least_effort     it may compare pairs of images so often, and ten times as often as the checks did
/// cost     nothing where nothing failed; else that at most; where that ends it, it says so as a cause of its own,
///          "search_ended". Shows its progress
/// threads  deterministic for any number
std::vector<Cause> diagnose(const Dataset& dataset, const Sequence& sequence,
                            const std::vector<CheckResult>& failed, std::int64_t num_comparisons,
                            std::vector<std::string>& damage, const ValidateOptions& options,
                            const core::Context& context, std::int64_t least_effort = kLeastEffort);

/// Findings that no cause explains, as causes: of missing, extra, changed and unreadable files the
/// first few each.
void add_damage(const std::vector<std::string>& damage, std::vector<Cause>& causes);

core::Json causes_json(const std::vector<Cause>& causes);

}  // namespace terracast::validate
