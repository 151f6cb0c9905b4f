#pragma once

#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/schema.h"
#include "tiler/layer.h"
#include "tiler/objects/candidate.h"

namespace terracast::tiler {

/// Things at places that a file lists.
struct PlacementList {
  std::vector<Candidate> candidates;
  std::string name;  ///< of the file
  std::string content_hash;
  std::int64_t num_repeated = 0;  ///< rows that say what another has said
  /// Features of files of OGR's that were left out, as LayerInfo::counts; none of 0.
  std::vector<std::pair<std::string, std::int64_t>> counts;
};

/// Row of a thing or model by name; nullopt: there is none.
using ThingByName = std::function<std::optional<std::uint32_t>(std::string_view)>;

/// Reads a list of things: .csv with a header, or anything of points that OGR reads (.geojson, …), whose
/// fields are the columns.
///     thing             name of a built-in thing or a model
///     lat, lon | x, y   degrees on WGS84, or metres in the world frame (.csv only); beyond the world they
///                       are left out and counted
///     heading_deg       clockwise from north, where its front points; 0 if left out
///     scale             1 if left out; 0.05 to 15
///     height_m          of its foot above the ground or water; 0 if left out
///     variant           of its colours, from 0; drawn from the place if left out
/// throws   Io: no such file; Input: naming the line: a column that is missing or unknown, a value that is no
///          number or beyond its range, an unknown thing; more than a million rows
PlacementList read_placements(const core::Path& file, const ThingByName& thing_by_name,
                              const LayerInputs& inputs);

}  // namespace terracast::tiler
