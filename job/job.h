#pragma once

#include <filesystem>
#include <memory>
#include <span>
#include <vector>

#include "core/context.h"
#include "job/carried_rigs.h"
#include "job/run_config.h"
#include "labels/label.h"
#include "render/render_stage.h"
#include "tiler/preview.h"
#include "tiler/surface.h"

namespace terracast::job {

/// What the stages of a job are built from: the sources opened, the cameras and motions computed.
struct Job {
  RunConfig config;
  CarriedCameras cameras;
  std::shared_ptr<const tiler::WorldSurface> ground;  ///< without the world's layers
  std::vector<render::SequencePlan> sequences;        ///< one a trajectory, in their order
};

/// How near to the world's origin along its x and y the body of each trajectory stays, m: inside the world with all it
/// carries.
std::vector<double> half_sizes_m(const Job& job);

/// How long before and after a frame's time what moves is looked at by its state at that time: by lines of rolling
/// shutters, and by sensors, which measure between frames. Sensors' own places follow the motion itself.
double reach_of_bodies_s(const render::SequencePlan& plan);

/// Whether all formats can hold what the bodies of a config carry, errors left aside.
/// throws   as exporters::check_formats
void check_formats(const RunConfig& config, const CarriedCameras& cameras);

/// Whether formats and labels can be made of the sequences of a config that check_formats() has let pass.
/// sequences   the cameras as they are, errors included
/// log         is told of what makes nothing in a sequence, or may fall short
/// throws      Config: a format that cannot hold the cameras, or so few track points that its checks cannot but fail;
///             as labels::check_labels
void check_outputs(const RunConfig& config, std::span<const labels::SequenceOutline> sequences,
                   const core::Log& log);

/// The sequences of a job, for check_outputs().
std::vector<labels::SequenceOutline> outlines_of(const Job& job);

/// A config with its sequences: only the ground tells what sequences a recording is split into. Nothing else is laid out
/// or checked: stages hold what was captured against the config.
/// store    as prepare_job has it
/// throws   Input, Io, Config: as prepare_job
RunConfig with_sequences(RunConfig config, const core::Context& context,
                         const std::filesystem::path& store = {});

/// Opens what a config names and checks that everything fits together, exporters' demands on the
/// rigs included, before any stage starts. The world's layers are left to lay_out_world(): of all
/// stages only tiling needs them, and they take the most time.
/// store    the world's folder, if there is one: what it keeps of the ground is not made again. The job is the same
///          without it.
/// ground   of the same world, where it was opened before
Job prepare_job(RunConfig config, const core::Context& context,
                const std::filesystem::path& store = {},
                std::shared_ptr<const tiler::WorldSurface> ground = nullptr);

/// The job's ground with all layers of its world.
/// throws   as tiler::WorldSurface::prepare()
std::shared_ptr<const tiler::WorldSurface> lay_out_world(const Job& job,
                                                         const core::Context& context);

/// The config of one sequence, as its capture records it: another sequence, format or memory bound
/// changes no byte of this one. Of another that it sees, or shares its geometry with, the rigs count too.
std::string toml_of_sequence(const RunConfig& config, const geo::TrajectoryOptions& trajectory);

/// The config of all that is captured: another format, check or memory bound changes no byte of it, but for the flags
/// that formats need.
std::string toml_of_captures(const RunConfig& config);

/// The bodies' paths, for maps.
std::vector<tiler::PreviewPath> paths_of(const Job& job);

}  // namespace terracast::job
