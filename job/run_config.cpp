#include "job/run_config.h"

#include <algorithm>
#include <set>

#include "capture/sequence_files.h"
#include "core/plugin_rows.h"
#include "core/registry.h"
#include "core/toml_reader.h"
#include "job/carried_rigs.h"

namespace terracast::job {

using core::ErrorKind;
using core::fail;

namespace {

/// Names of a part of a split trajectory stand for the whole one.
bool is_called(const geo::TrajectoryOptions& trajectory, const std::string& name) {
  return trajectory.name == name || trajectory.split_from == name;
}

void check_clearance(const ClearanceConfig& clearance,
                     const std::vector<geo::TrajectoryOptions>& trajectories) {
  std::vector<std::string> names;
  for (const auto& trajectory : trajectories) names.push_back(trajectory.name);
  for (const std::string& name : clearance.trajectories)
    if (std::none_of(trajectories.begin(), trajectories.end(),
                     [&](const auto& trajectory) { return is_called(trajectory, name); }))
      fail(ErrorKind::Config, "clearance.trajectories: {}",
           core::unknown_name_message("trajectory", name, names));
}

}  // namespace

bool ClearanceConfig::is_of(const geo::TrajectoryOptions& trajectory) const {
  return trajectories.empty() ||
         std::any_of(trajectories.begin(), trajectories.end(),
                     [&](const std::string& name) { return is_called(trajectory, name); });
}

void RunConfig::describe(core::SchemaVisitor& visit) {
  visit.key("name", name, "Name of the job.");
  visit.key(
      "requires", required_plugins,
      "Plug-ins that must be loaded, as \"mine\" or \"mine >= 1.2\"; a config never names their "
      "files (--plugin, TERRACAST_PLUGIN_PATH).",
      {.min_size = 1});
  // Before the kinds that they bring are sought by name: an older plug-in may lack them.
  for (const std::string& required : required_plugins) core::check_requirement(required);
  visit.key("seed", seed,
            "Seed of everything that is drawn in the capture: sub-pixel samples, track points.");
  visit.key("data", data, "Folder of source data; written ${data} in the paths of this config.");
  visit.key("shared_geometry", shared_geometry,
            "Every sequence shows the same geometry, each place as fine as whichever camera of all "
            "trajectories asks for most. Off: as fine as its own cameras ask for. Pairs of cameras "
            "of several sequences need it.");
  visit.section("world", world, "The world: its place, its sources of heights.");
  visit.section("detail", detail, "How fine the terrain is near the cameras.");
  visit.section("tracing", tracing, "How rays are traced; the result does not depend on it.");
  visit.list("rigs", rigs, "Cameras: rigs, of which a body carries one or several.");
  visit.list("trajectories", trajectories, "Motions of the body; each becomes a sequence.");
  visit.list("moving", moving, "Things that move through every sequence.");
  visit.list(
      "traffic", traffic,
      "Vehicles, people, trains and ships on the world's own roads, paths, railways and water.");
  visit.section("clearance", clearance, "How far paths are proved to stay from the world.");
  visit.section("conditions", conditions, "Light and air.");
  visit.section("facts", facts, "What the capture holds of each pixel.");
  visit.section("tracks", tracks, "Points of the ground that are followed through each sequence.");
  visit.list("labels", labels,
             "Labels that are made after rendering, beside those that exports need.");
  visit.list("exports", exports, "Formats that the capture is written in.");
  visit.section("validate", validation, "How the exported datasets are checked.");
}

void RunConfig::validate() const {
  if (rigs.empty()) fail(ErrorKind::Config, "no rig; add a [[rigs]] with at least one camera");
  if (trajectories.empty()) fail(ErrorKind::Config, "no trajectory; add a [[trajectories]]");
  std::set<std::string> names;
  for (const auto& trajectory : trajectories) {
    if (!capture::is_safe_name(trajectory.name))
      fail(ErrorKind::Config,
           "trajectory name \"{}\" becomes a folder: it takes 1 to 64 letters, digits, _ or -",
           trajectory.name);
    if (!names.insert(trajectory.name).second)
      fail(ErrorKind::Config, "two trajectories are called \"{}\"; give each its own name",
           trajectory.name);
  }
  check_carried_rigs(rigs, trajectories);
  check_clearance(clearance, trajectories);
  check_moving(moving, trajectories);
  check_traffic(traffic);
  std::set<std::string> kinds;
  for (const auto& chosen : labels)
    if (!kinds.insert(chosen.kind).second)
      fail(ErrorKind::Config, "labels \"{}\" are asked for twice; one [[labels]] a kind",
           chosen.kind);
  std::set<std::string> formats;
  for (const auto& chosen : exports)
    if (!formats.insert(chosen.format).second)
      fail(ErrorKind::Config, "format \"{}\" is exported twice; one [[exports]] a format",
           chosen.format);
  check_flags(*this);
}

RunConfig load_run_config(const std::filesystem::path& file, const std::vector<std::string>& sets) {
  return core::with_context(
      [&] {
        const core::TomlDocument document = core::TomlDocument::load(file, sets);
        for (const char* section : {"sweep", "dataset"})
          if (document.has(section))
            fail(
                ErrorKind::Config,
                "{}: it has a [{}], so it describes a dataset of many runs; `terracast batch plan` "
                "takes it",
                file.string(), section);
        RunConfig config;
        document.read(config);
        resolve_flags(config);
        return config;
      },
      fmt::format("reading the config {}", file.string()));
}

}  // namespace terracast::job
