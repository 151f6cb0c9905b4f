#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/context.h"
#include "validate/check.h"
#include "validate/colmap/program.h"
#include "validate/colmap/work_folder.h"
#include "validate/dataset.h"

/// What COLMAP itself makes of a dataset: its commands run on the exported folder, and their
/// results are held against what the folder says. Needs the program (3.8) and minutes to hours.
namespace terracast::validate {

/// An image of the exported model, with where and by what it was taken.
struct Shot {
  std::int64_t image_id = 0;
  std::string name;  ///< below images/
  int camera_index = 0;
  int frame = 0;
  const Camera* camera = nullptr;
  Pose local_from_camera;
  const ColmapImage* model_image = nullptr;
};

/// A sequence that is given to COLMAP.
struct ColmapJob {
  const Dataset& dataset;
  const Sequence& sequence;
  std::vector<Shot> shots;  ///< by id
  ColmapProgram program;
  WorkFolder work;
  int num_threads = 0;
  int num_seeds = 0;
  const core::Log& log;

  std::filesystem::path folder() const;  ///< the sequence's, absolute
  std::filesystem::path images() const;
  const Shot* find(std::int64_t image_id) const;
  /// Planar depth of an image; empty when the dataset has none, or a damaged one.
  core::ImageF depth(const Shot& shot) const;
  /// What one pixel covers on the ground: median of depth / focal length over the model's
  /// observations, m.
  double ground_pixel_m() const;
};

/// One thing that COLMAP is asked for.
struct ColmapMode {
  std::string_view name;     ///< after --colmap
  std::string_view check;    ///< what its results' names begin with: "colmap_free"
  std::string_view summary;  ///< for `terracast list checks`
  /// throws  ColmapFailure: a command failed, or its result is none
  std::vector<CheckResult> (*run)(const ColmapJob&);
};

/// The table of modes, alphabetical.
std::span<const ColmapMode> colmap_modes();

/// Runs the modes that the options name on every sequence. A mode that COLMAP could not finish is a
/// failed check `colmap_<mode>_program`.
/// work     folder of the steps and logs, kept: a run that was cut off goes on there
std::vector<CheckResult> run_colmap_modes(const Dataset& dataset, const Sequence& sequence,
                                          const ValidateOptions& options,
                                          const std::filesystem::path& work,
                                          const core::Context& context);

/// Whether at least 30 % of a depth map is ground; false for none.
bool shows_ground(const core::ImageF& depth);

/// A result of COLMAP's work, judged.
CheckResult colmap_result(std::string name, double value, double bound, std::string unit);

}  // namespace terracast::validate
