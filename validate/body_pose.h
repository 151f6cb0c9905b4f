#pragma once

#include <optional>

#include "validate/dataset.h"

namespace terracast::validate {

/// The body at a frame, in the sequence's frame, by the first camera that has a pose there.
std::optional<Pose> local_from_body(const Sequence& sequence, std::size_t frame);

}  // namespace terracast::validate
