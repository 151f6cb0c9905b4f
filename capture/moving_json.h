#pragma once

#include <optional>
#include <string>
#include <vector>

#include "capture/json_parts.h"
#include "capture/moving.h"
#include "core/error.h"

/// What moves, in the capture's JSON files.
namespace terracast::capture {

core::Json json_from_moving(const std::vector<MovingBody>& moving);
/// throws   Input: too many, or numbers that are not finite
std::vector<MovingBody> moving_from_json(const core::Json& json, const Source& source);
/// throws   of `kind`: names that repeat or are none, ids that are not in their order, boxes that are none
void check_moving(const std::vector<MovingBody>& moving, core::ErrorKind kind,
                  const std::string& where);

using MovingStates = std::vector<std::optional<geo::BodyState>>;
core::Json json_from_states(const MovingStates& states);
/// time_s   of the frame
MovingStates states_from_json(const core::Json& json, double time_s, const Source& source);
/// throws   of `kind`: another number of them, one that is not finite, or a part that is there without its thing
void check_states(const MovingStates& states, const std::vector<MovingBody>& bodies,
                  core::ErrorKind kind, const std::string& where);

}  // namespace terracast::capture
