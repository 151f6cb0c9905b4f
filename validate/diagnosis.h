#pragma once

#include <string>
#include <vector>

#include "core/json.h"
#include "validate/check.h"
#include "validate/dataset.h"

/// What is wrong with a dataset, in words. Every cause is a hypothesis that is tested on the
/// dataset: the supposed mistake is undone in memory, in some frames around the worst place, and
/// the checks run again there. It is named only when all that failed in one check comes within its
/// bound, nothing that was right fails, and nothing simpler does as much; what still fails is then
/// looked at again.
namespace terracast::validate {

/// Causes of what failed in one sequence; the one that repairs most first.
/// failed   results of that sequence
/// damage   findings of `structure` in all sequences; those that follow from a cause are taken out
/// cost     nothing where nothing failed; else a few times what the checks cost on six frames
/// threads  deterministic for any number
std::vector<Cause> diagnose(const Dataset& dataset, const Sequence& sequence,
                            const std::vector<CheckResult>& failed,
                            std::vector<std::string>& damage, const ValidateOptions& options);

/// Findings that no cause explains, as causes: of missing, extra, changed and unreadable files the
/// first few each.
void add_damage(const std::vector<std::string>& damage, std::vector<Cause>& causes);

core::Json causes_json(const std::vector<Cause>& causes);

}  // namespace terracast::validate
