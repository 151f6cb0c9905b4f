#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/schema.h"
#include "export/exporter.h"
#include "geo/trajectory.h"
#include "job/facts_config.h"
#include "job/moving.h"
#include "job/traffic/traffic.h"
#include "labels/label.h"
#include "render/render_stage.h"
#include "rigs/rig.h"
#include "tiler/world_options.h"
#include "world/lod.h"
#include "world/ray_query.h"

namespace terracast::job {

/// Config `[validate]`.
struct ValidateConfig {
  std::int64_t seed = 1;
  std::int64_t samples_per_image = 2000;
  std::int64_t oracle_samples = 200;

  template <class Visitor>
  void describe(Visitor& visit) {
    visit.key("seed", seed, "Seed of the pixels that sampling checks draw.");
    visit.key("samples_per_image", samples_per_image,
              "Pixels that a sampling check draws from each image.", core::between(100, 1000000));
    visit.key("oracle_samples", oracle_samples,
              "Pixels that the oracle draws at random from each image, and as many where mistakes "
              "hide.",
              core::between(1, 1000000));
  }
};

/// Config `[clearance]`: how far paths are proved to stay from the world.
struct ClearanceConfig {
  double min_m = 0.0;                     ///< 0: nothing is proved
  std::vector<std::string> trajectories;  ///< names; none: all

  template <class Visitor>
  void describe(Visitor& visit) {
    visit.key(
        "min_m", min_m,
        "Bodies stay at least so far from every surface of the world, on their whole paths and "
        "not only at their frames: ground, water, buildings, trees, masts, as the sequence "
        "shows them. A path that cannot be proved to do so is refused before it is rendered. "
        "Bodies that move are not looked at. 0: nothing is proved.",
        core::between(0.0, 10000.0));
    visit.key("trajectories", trajectories,
              "Names of the [[trajectories]] whose paths are proved; none named: all.");
  }
  /// Whether it is of a trajectory, or of the one that this is a part of.
  bool is_of(const geo::TrajectoryOptions& trajectory) const;
};

/// A whole job: the file that `terracast run` is given.
struct RunConfig {
  std::string name = "run";
  std::vector<std::string> required_plugins;
  std::int64_t seed = 1;
  core::Path data;
  tiler::WorldOptions world;
  world::DetailOptions detail;
  bool shared_geometry = false;
  world::RayQueryOptions tracing;
  std::vector<rigs::RigOptions> rigs;
  std::vector<geo::TrajectoryOptions> trajectories;
  std::vector<MovingOptions> moving;
  std::vector<TrafficOptions> traffic;
  scene::ConditionOptions conditions;
  ClearanceConfig clearance;
  FactsConfig facts;
  sensors::TrackOptions tracks;
  std::vector<labels::LabelOptions> labels;
  std::vector<exporters::ExportOptions> exports;
  ValidateConfig validation;

  void describe(core::SchemaVisitor& visit);
  /// throws   Config: no rig or trajectory, names that repeat or cannot be folders, rigs that are carried and not there
  ///          or there and not carried
  void validate() const;
};

/// Reads a job; `sets` are the command line's KEY=VALUE.
RunConfig load_run_config(const std::filesystem::path& file, const std::vector<std::string>& sets);

}  // namespace terracast::job
