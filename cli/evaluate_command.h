#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "validate/evaluate/evaluate.h"

namespace CLI {
class App;
}

namespace terracast::cli {

/// What the options of `evaluate` are parsed into.
struct EvaluateArguments {
  validate::EvaluateOptions options;
  double max_depth_m = 0.0;
  double rpe_delta_m = 0.0;
  validate::Alignment align = validate::Alignment::Se3;
  std::filesystem::path report;
};

/// Adds the command `evaluate` with its own options.
/// arguments  filled while the command line is parsed; must live as long as the app
CLI::App* add_evaluate_command(CLI::App& app, EvaluateArguments& arguments);

/// The options as given.
/// throws  Usage: an option that the task does not know
validate::EvaluateOptions checked_options(const CLI::App& command,
                                          const EvaluateArguments& arguments);

}  // namespace terracast::cli
