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
/// results  of all checks, of all sequences
/// cost     nothing where nothing failed; else a few times what the checks cost on six frames
/// threads  deterministic for any number
std::vector<Cause> diagnose(const Dataset& dataset, const Sequence& sequence,
                            const std::vector<CheckResult>& results);

/// Damaged files as causes, as far as `causes` do not explain them.
void add_damage(const std::vector<std::string>& findings, std::vector<Cause>& causes);

core::Json causes_json(const std::vector<Cause>& causes);

}  // namespace terracast::validate
