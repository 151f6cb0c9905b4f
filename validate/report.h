#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/json.h"
#include "validate/check.h"

namespace terracast::validate {

/// What the head of a report says.
struct ReportHead {
  std::string title;               ///< "kitti: demo"
  std::vector<std::string> lines;  ///< what was validated
  std::vector<Cause> causes = {};  ///< what is wrong, in words
};

core::Json report_json(const std::vector<CheckResult>& results);

/// report.json and a self-contained index.html: no scripts, plots as SVG, pictures as PNG inside
/// it.
/// samples  frames of each camera
void write_report(const ReportHead& head, const std::vector<CheckResult>& results,
                  const std::vector<CheckResult::Picture>& samples,
                  const std::filesystem::path& folder);

/// A line plot as SVG.
std::string svg_of(const CheckResult::Plot& plot);

}  // namespace terracast::validate
