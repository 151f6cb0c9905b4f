#pragma once

#include <Eigen/Core>
#include <optional>
#include <string_view>

#include "validate/dataset.h"

namespace terracast::validate {

/// Which image of a dataset a result speaks of, and where in it.
struct Place {
  int sequence = 0;
  int camera = 0;
  int frame = 0;
  std::optional<Eigen::Vector2i> pixel = {};
  bool operator==(const Place&) const = default;
};

/// The place that the words of CheckResult::worst name: what place_of() writes ("left, frame 3,
/// pixel (12, 300)"), a frame of all cameras ("frame 3": its first camera), or a file of the
/// dataset. Of several the one named first. Where a dataset has several sequences, the words begin
/// with one's name.
/// returns  nothing where no image is named, or none that the dataset holds
std::optional<Place> place_in(std::string_view worst, const Dataset& dataset);

}  // namespace terracast::validate
