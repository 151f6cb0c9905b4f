#pragma once

#include "render/material.h"
#include "render/noise.h"

namespace terracast::render {

/// Turns the slope of small relief into normals: the gradient of the height above the triangle, along it.
void bend_normals(const GroundPacket& packet, const NoiseSlope& slope, GroundLook& look);

}  // namespace terracast::render
