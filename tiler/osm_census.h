#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/schema.h"

namespace terracast::tiler {

/// What a file of OpenStreetMap's says by its own count: GDAL leaves out in silence what it cannot put together.
struct OsmCensus {
  std::int64_t num_nodes = 0;
  std::int64_t num_ways = 0;
  std::int64_t num_areas = 0;  ///< relations that are areas: type = multipolygon or boundary
  std::int64_t num_ways_without_nodes = 0;  ///< of which the file holds one node or none
  std::int64_t num_ways_cut = 0;            ///< of which it lacks some nodes
  std::int64_t num_areas_cut = 0;           ///< of which it lacks ways
  std::int64_t num_negative = 0;    ///< numbers below 0: drawn in an editor, and never uploaded
  bool has_places_in_ways = false;  ///< ways hold their places themselves, and nodes are left out
  /// Numbers of what an editor has deleted (action = delete, visible = false), by kind: n, w, r; sorted.
  std::vector<std::pair<char, std::int64_t>> deleted;
  /// Ways before their nodes and areas before their ways, whatever else of them is missing: as Overpass writes them by
  /// "out body; >; out skel".
  std::int64_t num_before_members = 0;
  /// Nodes and ways that stand there once more, as Overpass writes what a query meets twice.
  std::int64_t num_repeated = 0;
  bool has_nodes_in_order =
      true;              ///< by number, without which GDAL's quick table of nodes takes none
  bool is_text = false;  ///< .osm
  bool is_whole = true;  ///< false: it could not be read to its end

  bool is_deleted(char kind, std::int64_t number) const;
  /// For VectorData::counts: those that are not 0.
  std::vector<std::pair<std::string, std::int64_t>> counts() const;
};

/// Counts an .osm or .osm.pbf file, whatever the order of its elements.
/// path      as GDAL knows it
/// cost      reads the file once in a process, for as long as it stays as it is; 8 bytes a node, a way, and a member of
///           what stands before its members
/// throws    nothing: what cannot be read is not counted
/// threads   safe
OsmCensus count_osm(const std::string& path);

}  // namespace terracast::tiler
