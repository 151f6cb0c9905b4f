#pragma once

#include <cstdint>
#include <string>
#include <vector>

/// COCO's runs, read by the rule of its description alone.
namespace terracast::test {

/// The lengths that a text holds: characters less '0' are 6 bits, the sixth says that more follow, the fifth of
/// the last one is the sign; from the fourth length on what is held is the difference to that two before.
inline std::vector<std::int64_t> runs_of_text(const std::string& text) {
  std::vector<std::int64_t> runs;
  for (std::size_t at = 0; at < text.size();) {
    std::int64_t value = 0;
    std::int64_t weight = 1;
    for (bool has_more = true; has_more; ++at) {
      const int code = text.at(at) - '0';
      value += weight * (code % 32);
      weight *= 32;
      has_more = code >= 32;
      if (!has_more && code % 32 >= 16) value -= weight;
    }
    runs.push_back(runs.size() > 2 ? value + runs[runs.size() - 2] : value);
  }
  return runs;
}

/// By column, then row: whether a pixel is in the mask.
inline std::vector<bool> mask_of_runs(const std::vector<std::int64_t>& runs) {
  std::vector<bool> mask;
  for (std::size_t i = 0; i < runs.size(); ++i)
    mask.insert(mask.end(), static_cast<std::size_t>(runs[i]), i % 2 == 1);
  return mask;
}

}  // namespace terracast::test
