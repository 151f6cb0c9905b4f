#pragma once

#include <string_view>
#include <vector>

#include "validate/check.h"
#include "validate/dataset.h"

/// What is wrong with sensors beside cameras, in words. Each sensor is looked at by itself: a supposed mistake is undone in
/// its samples, all of them, and the checks of its kind run again. A cause is named only when every result that failed in
/// one check comes within its bound and nothing that was right fails.
namespace terracast::validate {

/// Whether a result is one of sensors beside cameras, of which diagnose() knows no causes.
bool is_of_sensors(std::string_view result);

/// Causes of what failed in one sequence's sensors; nothing where its poses are wrong by what else failed: those are what
/// sensors are compared with.
/// failed   results of that sequence
std::vector<Cause> diagnose_sensors(const Dataset& dataset, const Sequence& sequence,
                                    const std::vector<CheckResult>& failed,
                                    const ValidateOptions& options);

}  // namespace terracast::validate
