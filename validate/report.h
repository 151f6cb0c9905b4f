#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/json.h"
#include "validate/check.h"
#include "validate/page_data.h"

namespace terracast::validate {

/// What the head of a report says.
struct ReportHead {
  std::string title;               ///< "kitti: demo"
  std::vector<std::string> lines;  ///< what was validated
  std::vector<Cause> causes = {};  ///< what is wrong, in words
};

/// dataset   that the results are of: each check that names an image has its `place`
core::Json report_json(const std::vector<CheckResult>& results, const Dataset* dataset = nullptr);

/// report.json, index.html and the folder `page`, which index.html needs.
void write_report(const ReportHead& head, const std::vector<CheckResult>& results,
                  const PageSource& source, const std::filesystem::path& folder);

}  // namespace terracast::validate
