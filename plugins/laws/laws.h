#pragma once

#include <filesystem>
#include <memory>
#include <vector>

#include "capture/frame_reader.h"
#include "core/choice.h"
#include "export/exporter.h"
#include "geo/camera_model.h"
#include "geo/trajectory.h"
#include "plugins/law_report.h"
#include "scene/media/medium.h"
#include "scene/scene.h"
#include "sensors/sensor.h"
#include "tiler/layer.h"
#include "validate/checks/checker.h"

/// The laws that every kind of a table keeps, the program's own and those of plug-ins. One file a type of
/// table. A law that throws is broken by what was thrown; the callers see to that.
namespace terracast::plugins {

/// Rays and image points go into each other, derivatives are derivatives, blocks are what single points are, image points
/// have one ray, bounds hold, bad parameters are refused.
void try_camera(const geo::CameraIntrinsics& camera, LawReport& report);
/// A camera of a model by its parameters' defaults.
geo::CameraIntrinsics example_camera(const geo::CameraModelInfo& info);

/// The scene in which sensors and media are tried: a small world of hills, a body that turns and climbs over it.
struct LawScene {
  const scene::Scene& scene;
  const geo::BodyMotion& body;
  double duration_s;
};

/// Samples depend on their own time alone: not on the others that are measured with them, their order, or threads; none is
/// NaN; options read back.
void try_sensor(const core::Choice<sensors::SensorInfo>& sensor, const LawScene& world,
                LawReport& report);

/// The same of scans, whose rows besides follow each other within the time of their scan.
void try_scanner(const core::Choice<sensors::SensorInfo>& sensor, const sensors::Scanner& scanner,
                 const LawScene& world, LawReport& report);

/// Light is passed on in shares from 0 to 1, the smaller the farther; light that is added is finite and not negative; the
/// same ray has the same light.
void try_medium(const core::Choice<scene::MediumInfo>& medium, const LawScene& world,
                LawReport& report);

/// The same bytes from any threads and any order of tiles, and nothing in the world is wrong.
/// folder   for its worlds; empty
void try_layer(const tiler::LayerOptions& layer, const std::filesystem::path& folder,
               LawReport& report);

/// The same bytes from any threads; a dataset that was cut off is completed, a finished one kept; its record lists what
/// there is; nothing is written of rigs that it refuses.
/// captures   of at least one sequence
void try_exporter(const exporters::ExportOptions& options, const std::filesystem::path& captures,
                  const std::filesystem::path& folder, LawReport& report);

/// A right dataset is never called wrong; results are numbers, agree with their bounds and do not depend on threads.
/// datasets   each of another format
void try_check(const validate::CheckInfo& check, const std::vector<std::filesystem::path>& datasets,
               LawReport& report);

}  // namespace terracast::plugins
