#include <map>
#include <string>
#include <vector>

#include "core/schema_writer.h"
#include "geo/camera_model.h"
#include "rigs/rig_table.h"

namespace terracast::rigs {
namespace {

/// A key's name in its section: headings do not know of sections.
std::string heading_of(const std::string& key) { return key.substr(key.rfind('.') + 1); }

std::map<std::string, std::string> meanings() {
  std::map<std::string, std::string> meanings = {
      {"image_resolution", "width and height in one cell, 720 x 640"},
      {"roll_angle", "place on a compound eye, degrees"},
      {"pitch_angle", "place on a compound eye, degrees"},
      {"radius_mm", "place on a compound eye"},
  };
  for (const geo::CameraModelInfo& model : geo::camera_models()) {
    CameraOptions camera;
    camera.model = model.name;
    camera.lens.set_model(camera.model);
    for (const core::KeyInfo& key : core::list_keys(camera))
      meanings.emplace(heading_of(key.name), key.meaning);
  }
  for (const core::KeyInfo& key : core::list_keys(RigOptions{})) {
    if (key.name.starts_with("cameras") || key.name.starts_with("sensors")) continue;
    meanings.emplace(key.name == "name" ? "rig" : heading_of(key.name), key.meaning);
  }
  meanings.erase("template");
  for (const auto& [key, parts] : components_of_keys())
    for (const std::string& part : parts) meanings.emplace(part, "of " + key);
  return meanings;
}

}  // namespace

std::span<const core::KnownName> known_headings() {
  static const std::map<std::string, std::string> words = meanings();
  static const std::vector<core::KnownName> table = [] {
    std::vector<core::KnownName> names;
    for (const auto& [heading, meaning] : words) names.push_back({heading, meaning});
    return names;
  }();
  return table;
}

}  // namespace terracast::rigs
