#pragma once

#include <string>
#include <vector>

#include "batch/dataset/ground_cells.h"
#include "batch/dataset/splits.h"
#include "core/image.h"
#include "geo/geodesy.h"

namespace terracast::batch {

/// A sequence as the map shows it.
struct MapTrack {
  std::string world;
  Split split = Split::Train;
  std::vector<geo::Geodetic> places;   ///< along the track
  const GroundSeen* ground = nullptr;  ///< shown as a tint below the tracks; may be missing
};

/// A map of all sequences, coloured by split: one for each world, in latitude and longitude with a scale
/// bar, and the margin between splits as a bar beside it where it is long enough to be seen. Of many
/// worlds the 12 with most tracks, by name.
/// margin_m   SplitOptions::margin_m
core::Image8 draw_sequence_map(const std::vector<MapTrack>& tracks, double margin_m);

}  // namespace terracast::batch
