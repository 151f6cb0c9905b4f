#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "core/json.h"
#include "validate/check.h"
#include "validate/dataset.h"

/// What the report's page shows, as files below `page` that it loads by scripts and pictures alone,
/// so that it works from a folder without a server or a network.
namespace terracast::validate {

/// A page is made of: page.js, page.css    the program's, the same for all
///                    data.js              report, cameras, tracks, histograms: everything small
///                    images/NNNN.png .js  an image's colours; the values of its layers
///                    ground/NN.png .js    the map below a sequence's tracks; its cloud of points
///                    figures/NNNN.png     the checks' own pictures
/// Names are numbers: nothing that a dataset says becomes a path. Files of those names that an
/// earlier report left are removed.
struct PageSource {
  const Dataset* dataset = nullptr;  ///< nothing is shown of it when left out
  GroundMapMaker ground_map = {};
  std::filesystem::path events_file = {};  ///< of the run; may be missing
};

/// Writes the folder `page` of a report. The same dataset and results give the same bytes for any
/// number of threads, but for the run's times.
/// throws   Io
void write_page_data(const std::string& title, const std::vector<CheckResult>& results,
                     const core::Json& report, const PageSource& source,
                     const std::filesystem::path& folder);

/// What each stage of a run cost, the newest record of each: [{"stage", "wall_s", "cpu_s",
/// "peak_bytes"}]. Lines that are none are passed over; of a long file the end is read.
core::Json stage_costs(const std::filesystem::path& events_file);

/// Points of a plot, at most about `most`: of each run of neighbours the least and the greatest.
CheckResult::Plot thinned(const CheckResult::Plot& plot, std::size_t most);

}  // namespace terracast::validate
