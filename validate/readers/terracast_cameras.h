#pragma once

#include "validate/dataset.h"

namespace terracast::validate {

/// cameras.json of terracast's own format, and the tables of rays that it names: models into the cameras, each of their
/// other members held against dataset.json's. Mounts and shutters of the sequence's cameras are those that the file
/// should state.
void read_terracast_cameras(const Dataset& dataset, Sequence& sequence, Findings& findings);

}  // namespace terracast::validate
