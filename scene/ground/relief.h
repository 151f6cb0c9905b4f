#pragma once

#include "scene/ground/ground.h"
#include "scene/ground/noise.h"

namespace terracast::scene {

/// Turns the slope of small relief into normals: the gradient of the height above the triangle, along it.
void bend_normals(const GroundPacket& packet, const NoiseSlope& slope, GroundLook& look);

/// The same with steps and ledges of rock.
/// bed_slope   of them, along kAcrossBeds
void bend_normals(const GroundPacket& packet, const NoiseSlope& slope,
                  const Lanes<float>& bed_slope, GroundLook& look);

}  // namespace terracast::scene
