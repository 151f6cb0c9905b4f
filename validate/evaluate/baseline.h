#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "validate/evaluate/task.h"

/// Results of well-known methods, made on the spot for a first number: by the program
/// terracast_baseline (OpenCV's DIS flow and semi-global stereo), and by COLMAP.
namespace terracast::validate {

/// What a baseline made, and where; a folder that nobody asked for is removed with it.
class BaselineResult {
 public:
  BaselineResult(std::filesystem::path folder, bool is_temporary);
  ~BaselineResult();
  BaselineResult(BaselineResult&& other) noexcept;
  BaselineResult(const BaselineResult&) = delete;
  BaselineResult& operator=(const BaselineResult&) = delete;
  BaselineResult& operator=(BaselineResult&&) = delete;

  const std::filesystem::path& folder() const { return folder_; }
  /// Names the results in the options.
  void apply(EvaluateOptions& options) const;

  std::string note;  ///< what ran, for the table

 private:
  std::filesystem::path folder_;
  bool is_temporary_ = false;
};

/// Runs the baseline of the options' task on all subjects, in REPORT/baseline.
/// report_folder  empty: in a temporary folder
/// threads        from the main thread
/// throws         Usage: the program is not installed, and how to install it; Io: it failed, with the
///                end of its log
BaselineResult run_baseline(const EvaluateOptions& options, const std::vector<Subject>& subjects,
                            const std::filesystem::path& report_folder,
                            const core::Context& context);

}  // namespace terracast::validate
