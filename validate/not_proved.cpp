#include "validate/not_proved.h"

#include <span>

namespace terracast::validate {

namespace {

bool matches(std::string_view pattern, std::string_view text) {
  if (pattern.empty()) return text.empty();
  if (pattern.front() != '*')
    return !text.empty() && pattern.front() == text.front() &&
           matches(pattern.substr(1), text.substr(1));
  for (std::size_t skipped = 0; skipped <= text.size(); ++skipped)
    if (matches(pattern.substr(1), text.substr(skipped))) return true;
  return false;
}

struct Row {
  std::string_view format;  ///< empty: all
  std::string_view files, fields, why;
};

constexpr Row kRows[] = {
    {"", "nothing", "nothing", "nothing"},
};

}  // namespace

std::vector<NotProved> not_proved(const Dataset& dataset) {
  std::vector<NotProved> named;
  for (const Row& row : kRows) {
    if (!row.format.empty() && row.format != dataset.format) continue;
    NotProved one{std::string(row.files), std::string(row.fields), std::string(row.why)};
    for (const auto& [path, record] : dataset.files) one.num_files += matches(one.files, path) ? 1 : 0;
    if (row.files == "dataset.json") one.num_files = 1;
    if (one.num_files > 0) named.push_back(std::move(one));
  }
  return named;
}

const NotProved* named_by(const std::vector<NotProved>& named, const std::string& file,
                          const std::string& field) {
  for (const NotProved& one : named)
    if (matches(one.files, file) && matches(one.fields, field)) return &one;
  return nullptr;
}

core::Json not_proved_json(const std::vector<NotProved>& named) {
  core::Json list = core::Json::array();
  for (const NotProved& one : named)
    list.push(core::Json::object()
                  .set("files", one.files)
                  .set("fields", one.fields)
                  .set("why", one.why)
                  .set("num_files", one.num_files));
  return list;
}

}  // namespace terracast::validate
