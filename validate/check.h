#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/context.h"
#include "core/image.h"
#include "validate/ground_map.h"

namespace terracast::validate {

/// What one check found. `ok` is value <= bound, or value >= bound where that is a lower one.
struct CheckResult {
  std::string name;  ///< "reprojection", "stereo_scale", …
  double value = 0.0;
  double bound = 0.0;
  bool is_lower_bound = false;
  std::string unit;
  bool ok = false;
  bool skipped = false;    ///< nothing was measured; `worst` says why
  bool is_unseen = false;  ///< skipped although the format could show it: this dataset does not
  bool is_of_all = false;  ///< of several sequences it is unseen where one of them does not show it
  std::string worst;       ///< where the worst value stands: frame, camera, pixel
  std::string summary;     ///< a sentence for the report: what was compared, how many samples
  std::string reason;      ///< why the bound is what it is
  std::string detects;     ///< the smallest errors it finds, as tests prove
  /// Probability that a right dataset shows this value or a worse one; nothing for arithmetic bounds.
  std::optional<double> probability;
  /// The smallest error that this dataset would have shown, in `unit`; nothing where that was not found out.
  std::optional<double> smallest;
  /// Of one that is seen elsewhere: cameras or sensors of which this dataset would not have shown it.
  std::vector<std::string> unseen_parts;
  /// What is wrong, where the check itself knows it: it becomes a cause of the report.
  struct Mistake {
    std::string name;   ///< "lidar_not_deskewed", …: docs/validate.md lists them
    std::string words;  ///< one sentence for people, with where it stands
  };
  std::optional<Mistake> mistake = std::nullopt;
  struct Plot {
    std::string title, x_label, y_label;
    std::vector<double> x, y;
  };
  std::vector<Plot> plots;
  struct Picture {
    std::string title;
    core::Image8 image;
  };
  std::vector<Picture> pictures;

  bool is_within_bound() const { return is_lower_bound ? value >= bound : value <= bound; }
};

/// How much of what a bound allows is used: 1 at the bound, more beyond it, infinite beyond a bound
/// of 0.
double share_of_bound(double value, double bound, bool is_lower_bound);

/// EGM96's height above the ellipsoid at a latitude and longitude in degrees; nothing where no grid of
/// it is at hand.
using Undulation = std::function<std::optional<double>(double lat_deg, double lon_deg)>;

struct ValidateOptions {
  std::string format;  ///< empty: found out from the folder
  std::int64_t seed = 1;
  std::int64_t samples_per_image = 2000;  ///< pixels drawn for the checks that sample
  std::vector<std::string> colmap = {};   ///< what the program COLMAP is asked for: colmap_modes()
  std::int64_t colmap_seeds = 3;          ///< free reconstructions, of which the worst counts
  std::filesystem::path world = {};   ///< the oracle's: of which the dataset is; empty: no oracle
  std::int64_t oracle_samples = 200;  ///< pixels of an image that the oracle draws at random
  GroundMapMaker ground_map = {};     ///< draws the map below the page's tracks
  Undulation undulation_m = {};       ///< what the checks and a diagnosis call mean sea level
  /// A diagnosis tries a supposed cause on some frames: checks of every pixel take every 8th both
  /// ways, and make no pictures.
  bool is_trial = false;
};

/// A mistake that explains failed checks: with it undone, in memory, the dataset agrees.
struct Cause {
  std::string name;   ///< "principal_point", "pose_inverted", …: docs/validate.md lists them
  std::string words;  ///< one sentence for people, with the size and where it stands
  std::string sequence;
  std::string camera;               ///< empty: all, or none in particular
  int frame = -1;                   ///< -1: all, or none in particular
  double size = 0.0;                ///< of the mistake; 0 where it has none
  std::string unit;                 ///< of the size
  std::vector<std::string> checks;  ///< those that show it
  /// Words of findings of `structure` that follow from it, as "a depth that is none"; not reported.
  std::vector<std::string> explains;
};

/// Validates one exported dataset: reads the folder alone (and the world's tiles, where the oracle is
/// asked), by code that shares nothing with the exporters. Writes report.json and index.html into
/// `report_folder`; what COLMAP is asked for works in its folder `colmap`, which is kept. The page stands in
/// the report's folder `page`.
/// returns  all results; the dataset is right when every one is ok
/// throws   Input: not a dataset of a known format (damage inside one is a failed check), or the world
///          is another one than the dataset's; Io
std::vector<CheckResult> run_validate_stage(const std::filesystem::path& dataset,
                                            const ValidateOptions& options,
                                            const std::filesystem::path& report_folder,
                                            const core::Context& context);

/// Joins the reports of several formats (folder of each, named by format) into report.json and
/// index.html of `folder`; names become `<format>/<check>`. A map.png of that folder is shown.
/// events_file  of the run, for what its stages cost; may be missing
/// returns      whether all are ok
bool join_reports(const std::filesystem::path& folder, const std::vector<std::string>& formats,
                  const std::filesystem::path& events_file = {});

/// The verdict of a report.json in one line: "every bound holds; not seen: photometric_shift".
/// throws  Input, Io: no report there
std::string verdict_line(const std::filesystem::path& report_folder);

/// The words of the causes that a report.json names, one a line; none where all bounds hold.
/// throws  Input, Io: no report there
std::vector<std::string> cause_lines(const std::filesystem::path& report_folder);

/// What `ValidateOptions::colmap` may hold.
std::vector<std::string> colmap_mode_names();

/// Names and summaries of all checks and formats, for `terracast list`.
struct NameAndSummary {
  std::string_view name;
  std::string_view summary;
};
std::vector<NameAndSummary> check_list();
/// A line for each of all checks, as core::plugin_marks() takes them.
std::string names_of_checks();
std::vector<std::string> format_names();

}  // namespace terracast::validate
