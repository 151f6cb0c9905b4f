#pragma once

#include <string>
#include <vector>

#include "batch/dataset/dataset_facts.h"
#include "batch/dataset/ground_seen.h"
#include "core/json.h"
#include "geo/geodesy.h"

namespace terracast::batch {

/// What the merge needs to know of a captured sequence, taken when it is exported: so that a dataset
/// is described without its captures being read again.
struct SequenceSummary {
  SequenceFacts facts;  ///< as sequence_facts() and ground_seen() give them
  PlaceFacts place;
  std::vector<CameraFacts> cameras;
  std::vector<geo::Geodetic> track;  ///< of the body, kTrackPlaces at most, evenly over the frames
  std::vector<double> speeds_mps;    ///< of these
  std::vector<double> heights_m;     ///< of these, above the world's measured ground
  GroundSeen ground;
};
inline constexpr int kTrackPlaces = 200;

/// heights   above the ground, of a place; NaN where there is none
SequenceSummary summary_of(const std::string& run, const capture::SequenceReader& sequence,
                           const world::WorldManifest& manifest, const GroundOptions& options,
                           const std::function<double(const geo::Geodetic&)>& height_above_ground);

core::Json json_from_summary(const SequenceSummary& summary);
/// throws   Input: it is not as it was made; `file` names it
SequenceSummary summary_from_json(const core::Json& json, const std::string& file);

}  // namespace terracast::batch
