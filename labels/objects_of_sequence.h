#pragma once

#include <vector>

#include "labels/label.h"
#include "labels/shown_objects.h"

namespace terracast::labels {

/// All objects of which an image of a sequence shows a pixel, by instance id: what stands, then what moves.
/// cost     reads the facts of all images, and as find_objects
/// throws   Input: the store is not the world of the sequence; Io
std::vector<ShownObject> objects_of_sequence(const LabelInputs& inputs);

}  // namespace terracast::labels
