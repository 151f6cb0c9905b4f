#pragma once

#include <string>
#include <vector>

#include "batch/dataset/dataset_facts.h"
#include "core/json.h"

namespace terracast::batch {

/// What `terracast validate` wrote of one exported dataset.
struct ValidationReport {
  std::string run;
  std::string format;
  core::Json report;  ///< report.json
};

/// Of each check the value that uses most of its bound, over all runs and formats; by name. A failed
/// check comes before every other, of equals the first by run and format.
/// throws   Input: a report lacks what report.json holds
std::vector<CheckFacts> worst_checks(std::vector<ValidationReport> reports);

}  // namespace terracast::batch
