#pragma once

#include <span>
#include <vector>

#include "capture/frame.h"
#include "scene/moving/moving_bodies.h"

namespace terracast::sensors {

/// The record of moving things that a capture's sequence holds: bodies in the order of scene::list_bodies().
std::vector<capture::MovingBody> describe_moving(std::span<const scene::MovingThing> things);

/// The bodies as a sequence captured them.
/// things   those of which describe_moving() gives the sequence's record; their states do not count
scene::MovingBodies captured_bodies(std::span<const scene::MovingThing> things,
                                    std::span<const capture::FrameRecord> frames);

}  // namespace terracast::sensors
