#include "cli/reference.h"

#include <algorithm>
#include <functional>
#include <map>
#include <set>

#include "batch/description.h"
#include "core/registry.h"
#include "core/schema_writer.h"
#include "core/semantic_class.h"
#include "export/exporter.h"
#include "export/world/world_format.h"
#include "geo/camera_model.h"
#include "geo/fixes/fix_format.h"
#include "geo/fixes/placing.h"
#include "geo/trajectory.h"
#include "job/run_config.h"
#include "rigs/lens_options.h"
#include "rigs/rig_format.h"
#include "rigs/rig_template.h"
#include "scene/media/medium.h"
#include "sensors/lidar/pattern.h"
#include "sensors/sensor.h"
#include "tiler/elevation_registry.h"
#include "tiler/layer.h"
#include "tiler/objects/things.h"
#include "validate/check.h"
#include "validate/evaluate/evaluate.h"

namespace terracast::cli {
namespace {

using core::ErrorKind;
using core::fail;
using core::KeyInfo;

template <class Table>
std::string lines_of(const Table& table) {
  std::string text;
  for (const auto& entry : table) text += fmt::format("{:18} {}\n", entry.name, entry.summary);
  return text;
}

std::string color_text(const core::SemanticClassInfo& info) {
  return fmt::format("#{:02x}", fmt::join(info.color_srgb, ""));
}

std::string class_lines() {
  constexpr const char* kLine = "{:13} {:>3} {:8} {:13} {:6} {:>10} {:>7} {:>5} {:>10}  {}\n";
  std::string text = fmt::format(kLine, "name", "id", "color", "parent", "kind", "cityscapes",
                                 "ade20k", "coco", "tartanair", "meaning");
  for (const core::SemanticClassInfo& info : core::semantic_classes())
    text += fmt::format(kLine, info.name, static_cast<int>(info.id), color_text(info), info.parent,
                        info.is_thing ? "thing" : "stuff", info.cityscapes_id, info.ade20k_id,
                        info.coco_id, static_cast<int>(info.id), info.meaning);
  return text;
}

std::string thing_lines() {
  std::string text =
      fmt::format("{:22} {:15} {:>24} {:>8}  {}\n", "name", "class", "size m", "colours", "as");
  for (const tiler::ThingInfo& thing : tiler::all_things())
    text +=
        fmt::format("{:22} {:15} {:>24} {:>8}  {}\n", thing.name,
                    core::semantic_class_names()[static_cast<std::size_t>(thing.semantic_class)],
                    fmt::format("{:.2f} x {:.2f} x {:.2f}", thing.size_m.x(), thing.size_m.y(),
                                thing.size_m.z()),
                    thing.num_variants, thing.source);
  return text;
}

const std::map<std::string, std::function<std::string()>>& lists() {
  static const std::map<std::string, std::function<std::string()>> table{
      {"cameras", [] { return lines_of(geo::camera_models()); }},
      {"checks", [] { return lines_of(validate::check_list()); }},
      {"classes", class_lines},
      {"elevation", [] { return lines_of(tiler::elevation_kinds()); }},
      {"exporters", [] { return lines_of(exporters::exporters()); }},
      {"labels", [] { return lines_of(labels::labels()); }},
      {"layers", [] { return lines_of(tiler::layer_kinds()); }},
      {"media", [] { return lines_of(scene::media()); }},
      {"recordings", [] { return lines_of(geo::fix_formats()); }},
      {"rig_formats", [] { return lines_of(rigs::rig_formats()); }},
      {"rig_templates", [] { return lines_of(rigs::rig_templates()); }},
      {"sensors", [] { return lines_of(sensors::sensors()); }},
      {"tasks", [] { return lines_of(validate::task_list()); }},
      {"things", thing_lines},
      {"trajectories", [] { return lines_of(geo::trajectory_kinds()); }},
      {"world_formats", [] { return lines_of(world_export::world_formats()); }},
  };
  return table;
}

constexpr std::string_view kItemRule =
    "for [] stands the number of the list's item, counted from 0: --set "
    "trajectories.0.num_frames=4.";

constexpr std::string_view kMovingRule =
    "A [[moving]] takes the keys of its kind of trajectory, and of its recording's format, "
    "likewise: moving[] for "
    "trajectories[].";

template <class Options>
std::vector<KeyInfo> keys_of(Options& options, const std::string& prefix) {
  std::vector<KeyInfo> keys;
  const auto lister = core::make_key_lister(keys);
  options.describe(*lister);
  for (auto& key : keys) key.name = prefix + key.name;
  return keys;
}

/// Keys of recordings whose places are x, y, z about an origin, beside those of others.
std::vector<KeyInfo> keys_of_local_recordings() {
  const auto keys_with = [](geo::FixFrame frame) {
    std::vector<KeyInfo> keys;
    geo::PlacingOptions placing;
    placing.describe(*core::make_key_lister(keys), frame, "");
    return keys;
  };
  std::vector<KeyInfo> local;
  const std::vector<KeyInfo> others = keys_with(geo::FixFrame::Geodetic);
  for (KeyInfo& key : keys_with(geo::FixFrame::Local)) {
    if (std::any_of(others.begin(), others.end(),
                    [&](const KeyInfo& other) { return other.name == key.name; }))
      continue;
    key.name = "trajectories[]." + key.name;
    local.push_back(std::move(key));
  }
  return local;
}

/// Without those of a lidar's default pattern, which stand with the others'.
std::vector<KeyInfo> keys_of_sensor(const sensors::SensorInfo& kind) {
  constexpr const char* kPrefix = "rigs[].sensors[].";
  std::vector<KeyInfo> keys = keys_of(*core::made(kind.make(), "sensor", kind.name), kPrefix);
  if (kind.name != "lidar") return keys;
  for (const auto& pattern : sensors::lidar::scan_patterns())
    for (const KeyInfo& of_pattern : keys_of(*pattern.make(), kPrefix))
      std::erase_if(keys, [&](const KeyInfo& key) { return key.name == of_pattern.name; });
  return keys;
}

/// Keys that come with a kind of layer or trajectory, a template of rigs, a format of recordings or exports, a
/// camera model, by the name of their heading.
std::vector<std::pair<std::string, std::vector<KeyInfo>>> keys_by_kind() {
  std::vector<std::pair<std::string, std::vector<KeyInfo>>> result;
  for (const auto& kind : tiler::layer_kinds())
    result.emplace_back(fmt::format("layers of kind {}", kind.name),
                        keys_of(*core::made(kind.make(), "layer", kind.name), "world.layer[]."));
  for (const auto& shape : rigs::rig_templates())
    result.emplace_back(fmt::format("rigs of template {}", shape.name),
                        keys_of(*shape.make(), "rigs[]."));
  for (const auto& kind : geo::trajectory_kinds())
    result.emplace_back(fmt::format("trajectories of kind {}", kind.name),
                        keys_of(*kind.make(), "trajectories[]."));
  for (const auto& format : geo::fix_formats())
    result.emplace_back(fmt::format("recorded trajectories of format {}", format.name),
                        keys_of(*format.make(), "trajectories[]."));
  result.emplace_back(
      "recorded trajectories of formats euroc and tum, of ulog with places = local_origin, and of "
      "csv with frame = local",
      keys_of_local_recordings());
  for (const auto& model : geo::camera_models()) {
    rigs::LensOptions lens{std::string(model.name)};
    result.emplace_back(fmt::format("cameras of model {}", model.name),
                        keys_of(lens, "rigs[].cameras[]."));
  }
  for (const auto& kind : sensors::sensors())
    result.emplace_back(fmt::format("sensors of kind {}", kind.name), keys_of_sensor(kind));
  for (const auto& pattern : sensors::lidar::scan_patterns())
    result.emplace_back(fmt::format("lidars of pattern {}", pattern.name),
                        keys_of(*pattern.make(), "rigs[].sensors[]."));
  for (const auto& kind : scene::media())
    result.emplace_back(
        fmt::format("media of kind {}", kind.name),
        keys_of(*core::made(kind.make(), "medium", kind.name), "conditions.media[]."));
  for (const auto& kind : labels::labels())
    result.emplace_back(fmt::format("labels of kind {}", kind.name),
                        keys_of(*kind.make(), "labels[]."));
  for (const auto& format : exporters::exporters())
    result.emplace_back(
        fmt::format("exports of format {}", format.name),
        keys_of(*core::made(format.make(), "export format", format.name), "exports[]."));
  return result;
}

/// Keys that every job has, and those that make many runs of it. A list's items have the keys of their default kind
/// too: these are that kind's.
std::vector<KeyInfo> common_keys() {
  std::set<std::string> of_kinds;
  for (const auto& [heading, keys] : keys_by_kind())
    for (const KeyInfo& key : keys) of_kinds.insert(key.name);
  std::vector<KeyInfo> keys = core::list_keys<job::RunConfig>();
  std::erase_if(keys, [&](const KeyInfo& key) { return of_kinds.contains(key.name); });
  for (KeyInfo& key : core::list_keys<batch::DescriptionSections>()) keys.push_back(std::move(key));
  return keys;
}

std::string explain(const KeyInfo& key, const std::string& when) {
  std::string text = fmt::format("{}\n    {}\n    {}", key.name, key.meaning, key.type);
  if (!key.unit.empty()) text += fmt::format(", {}", key.unit);
  if (!key.range.empty()) text += fmt::format(", {}", key.range);
  if (!key.default_value.empty()) text += fmt::format("; default {}", key.default_value);
  if (!when.empty()) text += fmt::format("; {}", when);
  return text + "\n";
}

std::string section_of(const std::string& key) {
  const auto dot = key.find('.');
  return dot == std::string::npos ? std::string() : key.substr(0, dot);
}

}  // namespace

std::string joined(const std::vector<std::string>& words) {
  return fmt::format("{}", fmt::join(words, ", "));
}

std::vector<std::string> listable_names() {
  std::vector<std::string> names;
  for (const auto& [name, print] : lists()) names.push_back(name);
  return names;
}

std::string list_text(const std::string& what) {
  const auto found = lists().find(what);
  if (found == lists().end())
    fail(ErrorKind::Usage, "{}", core::unknown_name_message("list", what, listable_names()));
  return found->second();
}

std::string explain_text(const std::string& part) {
  std::string text;
  std::vector<std::string> known;
  const auto add = [&](const std::vector<KeyInfo>& keys, const std::string& when, bool is_all) {
    for (const auto& key : keys) {
      known.push_back(key.name);
      if (is_all || key.name.find(part) != std::string::npos) text += explain(key, when);
    }
  };
  add(common_keys(), "", false);
  // "survey", as "exports of format kitti" ends in a kind: all that it takes.
  for (const auto& [heading, keys] : keys_by_kind())
    add(keys, "in " + heading, heading.ends_with(" " + part));
  if (text.empty()) {
    const std::string nearest = core::nearest_name(part, known);
    fail(ErrorKind::Usage, "no key contains \"{}\"{}; `terracast config explain` lists all", part,
         nearest.empty() ? "" : fmt::format(" (nearest: \"{}\")", nearest));
  }
  if (text.find("\ntrajectories[]") != std::string::npos || text.starts_with("trajectories[]"))
    text += fmt::format("\n{}\n", kMovingRule);
  if (text.find("[]") != std::string::npos) text += fmt::format("\n{}\n", kItemRule);
  return text;
}

std::string reference_text() {
  std::string text =
      "# Config keys\n\n"
      "Written by `terracast docs`. A config is TOML; a section or list item may also be the path "
      "of a file that holds\n"
      "it, and any table may say `extends = \"file.toml\"`. Relative paths start at the file they "
      "stand in. Keys carry "
      "their unit.\n"
      "An item of a list whose items have kinds (layers, trajectories, cameras, …) takes the keys "
      "of "
      "its list, and those of its kind further below.\n"
      "On the command line `--set KEY=VALUE` sets a key; " +
      std::string(kItemRule) + "\n" + std::string(kMovingRule) + "\n";
  std::string section = "?";
  std::vector<KeyInfo> group;
  const auto flush = [&] {
    if (group.empty()) return;
    text += fmt::format("\n## {}\n\n{}", section.empty() ? "top level" : section,
                        core::markdown_table(group));
    group.clear();
  };
  for (const auto& key : common_keys()) {
    if (section_of(key.name) != section) {
      flush();
      section = section_of(key.name);
    }
    group.push_back(key);
  }
  flush();
  for (const auto& [heading, keys] : keys_by_kind()) {
    if (!keys.empty()) text += fmt::format("\n## {}\n\n{}", heading, core::markdown_table(keys));
  }
  return text;
}

std::string classes_page() {
  std::string text =
      "# Semantic classes\n\n"
      "Written by `terracast docs classes` from configs/classes.toml, which says where the numbers "
      "of "
      "other sets come from.\n"
      "`terracast list classes` prints the same. A class never changes its number or its "
      "meaning.\n\n"
      "Things can be counted, and each has an instance id; stuff cannot. KITTI's semantic classes "
      "have the numbers of\n"
      "Cityscapes. 0 in a column of another set: it has no class that is meant so. TartanAir has "
      "no "
      "numbers of its own\n"
      "that hold beyond one environment: its exports hold ours, and seg_label_map.json names "
      "them.\n\n"
      "| id | name | meaning | parent | kind | color | Cityscapes, KITTI | ADE20K | COCO panoptic "
      "|\n| ---: | --- | --- | --- | --- | --- | ---: | ---: | ---: |\n";
  for (const core::SemanticClassInfo& info : core::semantic_classes())
    text +=
        fmt::format("| {} | {} | {} | {} | {} | {} | {} | {} | {} |\n", static_cast<int>(info.id),
                    info.name, info.meaning, info.parent, info.is_thing ? "thing" : "stuff",
                    color_text(info), info.cityscapes_id, info.ade20k_id, info.coco_id);
  return text;
}

}  // namespace terracast::cli
