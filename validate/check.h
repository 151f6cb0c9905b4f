#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/context.h"
#include "core/image.h"

namespace terracast::validate {

/// What one check found. `ok` is value <= bound (or >= where the check says so).
struct CheckResult {
  std::string name;  ///< "reprojection", "completeness", …
  double value = 0.0;
  double bound = 0.0;
  std::string unit;
  bool ok = false;
  bool skipped = false;  ///< the format does not hold what the check needs; `worst` says what
  std::string worst;     ///< where the worst value stands: frame, camera, pixel
  std::string summary;   ///< a sentence for the report: what was compared, how many samples
  std::string reason;    ///< why the bound is what it is
  std::string detects;   ///< the smallest errors it finds, as tests prove
  struct Plot {
    std::string title, x_label, y_label;
    std::vector<double> x, y;
  };
  std::vector<Plot> plots;
  struct Picture {
    std::string title;
    core::Image8 image;
  };
  std::vector<Picture> pictures;
};

struct ValidateOptions {
  std::string format;  ///< empty: found out from the folder
  std::int64_t seed = 1;
  std::int64_t samples_per_image = 2000;  ///< pixels drawn for the checks that sample
};

/// Validates one exported dataset: reads the folder alone, by code that shares nothing with the exporters. Writes
/// report.json and index.html (with plots and sample frames) into `report_folder`.
/// returns  all results; the dataset is right when every one is ok
/// throws   Input: not a dataset of a known format; Io. Damage inside a dataset is a failed check, not an error.
std::vector<CheckResult> run_validate_stage(const std::filesystem::path& dataset,
                                            const ValidateOptions& options,
                                            const std::filesystem::path& report_folder,
                                            const core::Context& context);

/// Joins the reports of several formats (folder of each, named by format) into report.json and index.html of `folder`; names
/// become `<format>/<check>`.
/// returns  whether all are ok
bool join_reports(const std::filesystem::path& folder, const std::vector<std::string>& formats);

/// Names and summaries of all checks and formats, for `terracast list`.
struct NameAndSummary {
  std::string_view name;
  std::string_view summary;
};
std::span<const NameAndSummary> check_list();
std::vector<std::string> format_names();

}  // namespace terracast::validate
