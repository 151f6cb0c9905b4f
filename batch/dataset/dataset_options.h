#pragma once

#include <limits>

#include "batch/dataset/dataset_facts.h"
#include "batch/dataset/splits.h"

namespace terracast::batch {

/// Config `[dataset]`: what the merged dataset says of itself, and how it is divided.
struct DatasetOptions {
  Publication publication;
  SplitOptions splits;
  double within_m = 0.0;

  /// GroundOptions::within_m
  double reach_m() const {
    return within_m > 0.0 ? within_m : std::numeric_limits<double>::infinity();
  }

  template <class Visitor>
  void describe(Visitor& visit) {
    publication.describe(visit);
    visit.key(
        "within_m", within_m,
        "Ground farther from the cameras than this does not count as seen when the dataset is "
        "divided; 0: all counts, to the horizon.",
        core::at_least(0.0));
    visit.section("splits", splits, "How the sequences are divided.");
  }
  void validate() const { publication.validate(); }
};

}  // namespace terracast::batch
