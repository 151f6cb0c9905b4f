#pragma once

#include <filesystem>
#include <vector>

#include "core/json.h"
#include "validate/evaluate/evaluate.h"

namespace terracast::validate {

/// Everything that was measured: options in words, rows, and each frame's own figures.
core::Json evaluation_json(const Evaluation& evaluation);

/// report.json and a self-contained index.html.
/// pictures  of the worst frame
void write_evaluation(const Evaluation& evaluation,
                      const std::vector<CheckResult::Picture>& pictures,
                      const std::filesystem::path& folder);

/// A figure over some frames.
/// returns  nothing where there is nothing to measure
std::optional<double> figure_of(const Measure& measure, std::size_t index,
                                const std::vector<const FrameScore*>& frames, Averaging averaging);

}  // namespace terracast::validate
