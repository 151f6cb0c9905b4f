#include <algorithm>
#include <vector>

#include "core/plugin_rows.h"
#include "scene/media/medium.h"

// Every medium, in alphabetical order: X(name) is scene/media/name.cpp, which defines `MediumInfo name_medium()`.
#define TERRACAST_MEDIA(X) X(air) X(clouds) X(exponential_haze)

namespace terracast::scene {

#define TERRACAST_DECLARE(name) MediumInfo name##_medium();
TERRACAST_MEDIA(TERRACAST_DECLARE)
#undef TERRACAST_DECLARE

std::span<const MediumInfo> media() {
#define TERRACAST_ENTRY(name) name##_medium(),
  static const auto table = core::with_plugin_rows<MediumInfo>({TERRACAST_MEDIA(TERRACAST_ENTRY)});
#undef TERRACAST_ENTRY
  return table;
}

namespace {

/// The kinds that a config names.
std::span<const MediumInfo> chosen_media() {
  static const std::vector<MediumInfo> table = [] {
    std::vector<MediumInfo> chosen;
    for (const MediumInfo& info : media())
      if (!info.is_always) chosen.push_back(info);
    return chosen;
  }();
  return table;
}

}  // namespace

void MediumChoice::describe(core::SchemaVisitor& visit) {
  Choice::describe(visit, "kind", "medium", "Medium that hangs in the air beside air and clouds.",
                   chosen_media());
}

std::vector<std::unique_ptr<Medium>> make_media(const std::vector<MediumChoice>& chosen,
                                                const MediumSite& site) {
  std::vector<std::unique_ptr<Medium>> media_of_scene;
  const auto add = [&](const MediumOptions& options, std::string_view kind) {
    std::unique_ptr<Medium> medium = core::made(options.make(site), "medium", kind);
    if (medium->is_any()) media_of_scene.push_back(std::move(medium));
  };
  for (const MediumInfo& info : media())
    if (info.is_always) add(*info.make(), info.name);
  for (const MediumChoice& one : chosen) add(*one, one.kind());
  return media_of_scene;
}

}  // namespace terracast::scene
