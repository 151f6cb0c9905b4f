#pragma once

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <string>

namespace terracast::cli {

/// That a number of an option lies within bounds, as CLI::Range; "nan" does not.
inline CLI::Validator within(double lowest, double highest) {
  return CLI::Validator(
      [lowest, highest](const std::string& text) -> std::string {
        double value = 0.0;
        if (!CLI::detail::lexical_cast(text, value) || !(lowest <= value && value <= highest))
          return fmt::format("{} is not a number from {:.10g} to {:.10g}", text, lowest, highest);
        return {};
      },
      fmt::format("FLOAT in [{:.10g} - {:.10g}]", lowest, highest));
}

}  // namespace terracast::cli
