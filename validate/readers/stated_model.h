#pragma once

#include "validate/dataset.h"

namespace terracast::validate {

/// Gives what dataset.json states of a camera the plane of its model.
/// throws   Input: no such model, or parameters that are not its own
void complete_stated(Camera& camera);

/// Takes a camera from dataset.json, for formats that say nothing of cameras: pinholes as they are, with depth along the
/// axis; all others by their models. What is wrong becomes a finding.
void adopt_stated(Camera& camera, Findings& findings);

}  // namespace terracast::validate
