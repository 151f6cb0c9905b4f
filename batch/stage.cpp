#include "batch/stage.h"

#include <fmt/format.h>

#include <vector>

#include "core/error.h"
#include "core/registry.h"

namespace terracast::batch {

using core::ErrorKind;
using core::fail;

std::string_view stage_name(Stage stage) {
  static constexpr std::array<std::string_view, kStages.size()> kNames = {
      "tile", "render", "export", "validate", "merge"};
  return kNames[static_cast<std::size_t>(stage)];
}

Stage stage_from_name(const std::string& name) {
  std::vector<std::string> names;
  for (const Stage stage : kStages) {
    if (stage_name(stage) == name) return stage;
    names.emplace_back(stage_name(stage));
  }
  fail(ErrorKind::Usage, "{}", core::unknown_name_message("stage", name, names));
}

std::string ShardId::text() const { return fmt::format("{}/{}", stage_name(stage), index); }

ShardId ShardId::parse(const std::string& text) {
  const auto slash = text.find('/');
  const std::string digits = slash == std::string::npos ? "" : text.substr(slash + 1);
  if (digits.empty() || digits.size() > 9 ||
      digits.find_first_not_of("0123456789") != std::string::npos)
    fail(ErrorKind::Usage, "{}: a shard is written STAGE/INDEX, as render/12", text);
  return {.stage = stage_from_name(text.substr(0, slash)), .index = std::stoi(digits)};
}

}  // namespace terracast::batch
