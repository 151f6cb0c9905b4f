#include "validate/readers/named_files.h"

#include <fmt/format.h>

#include <set>

#include "core/printable.h"

namespace terracast::validate {

std::vector<std::string> named_files(const Dataset& dataset, const std::string& folder,
                                     const std::vector<std::string>& names, bool is_optional,
                                     Findings& findings) {
  const std::vector<std::string> found = list_folder(dataset.root / folder);
  const auto listed = dataset.files.lower_bound(folder + "/");
  const bool is_listed = listed != dataset.files.end() && listed->first.starts_with(folder + "/");
  if (is_optional && found.empty() && !is_listed) return {};
  std::set<std::string> others(found.begin(), found.end());
  std::vector<std::string> paths;
  for (const std::string& name : names) {
    paths.push_back(others.erase(name) > 0 ? folder + "/" + name : "");
    if (paths.back().empty()) findings.add(folder + "/" + name, "missing");
  }
  if (!others.empty())
    findings.add(folder, fmt::format("{} files of no stamp in the list, such as {}", others.size(),
                                     core::first_letters(*others.begin(), 60)));
  return paths;
}

}  // namespace terracast::validate
