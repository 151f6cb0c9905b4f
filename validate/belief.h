#pragma once

#include <vector>

#include "validate/dataset.h"

/// Datasets whose rigs have errors, and whose own files state what is believed of them.
namespace terracast::validate {

/// Carries what the format's files state over to the cameras as they are, which all checks are of: by what
/// dataset.json says of them beyond what is believed. Whatever a file states otherwise than it is believed
/// stays off by as much.
/// believed   the cameras of calibration_believed.json, in the sequence's order
void adopt_truth(const std::vector<Camera>& believed, Sequence& sequence);

}  // namespace terracast::validate
