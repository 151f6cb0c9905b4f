#pragma once

#include <fmt/format.h>

#include <concepts>
#include <cstdint>
#include <string>
#include <utility>

#include "validate/check.h"

namespace terracast::validate {

/// Counts contradictions between files, and keeps the first.
struct FileContradictions {
  std::int64_t num_compared = 0;
  std::int64_t count = 0;
  std::string first;

  /// Notes one where two statements disagree.
  template <class... Args>
  void expect(bool do_agree, fmt::format_string<Args...> format, Args&&... args) {
    ++num_compared;
    if (!do_agree && ++count == 1) first = fmt::format(format, std::forward<Args>(args)...);
  }
  /// describe   asked for the first one alone
  template <std::invocable Describe>
  void expect(bool do_agree, const Describe& describe) {
    ++num_compared;
    if (!do_agree && ++count == 1) first = describe();
  }

  /// A result whose bound is none of them.
  CheckResult result(std::string name) const {
    CheckResult result;
    result.name = std::move(name);
    result.value = static_cast<double>(count);
    result.unit = "contradictions";
    result.ok = count == 0;
    result.worst = first;
    return result;
  }
};

}  // namespace terracast::validate
