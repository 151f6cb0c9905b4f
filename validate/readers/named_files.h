#pragma once

#include <string>
#include <vector>

#include "validate/dataset.h"

namespace terracast::validate {

/// A finding for each file of a folder that should be there and is not, and one for those of other names.
/// names         of the files, one a frame
/// is_optional   a folder that neither exists nor stands in dataset.json is a modality that the dataset does not hold
/// returns       paths relative to the root, one a name, empty where a file is missing; none of a modality that is not held
std::vector<std::string> named_files(const Dataset& dataset, const std::string& folder,
                                     const std::vector<std::string>& names, bool is_optional,
                                     Findings& findings);

}  // namespace terracast::validate
