#pragma once

#include <string>
#include <vector>

#include "core/image.h"
#include "validate/check.h"

/// Pictures of errors and of flow for the report of an evaluation.
namespace terracast::validate {

/// 0 to `full` as dark blue, green, yellow, red. NaN (the truth does not judge it) is grey, +inf
/// (the result says nothing) magenta.
core::Image8 error_picture(const core::ImageF& errors, float full);

/// The colours' end for an error map: the 99th percentile of the finite errors, at least `least`.
float error_scale(const core::ImageF& errors, float least);

/// Direction as hue, length up to `full_px` as saturation; unknown grey.
core::Image8 flow_picture(const core::ImageF& flow, float full_px);
float longest_flow(const core::ImageF& flow);

/// Image, truth, result and error side by side in a report: shrunk to fit.
CheckResult::Picture shown_picture(std::string title, const core::Image8& image);
CheckResult::Picture shown_errors(const std::string& what, const std::string& unit,
                                  const core::ImageF& errors, float least);

}  // namespace terracast::validate
