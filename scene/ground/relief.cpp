#include "scene/ground/relief.h"

#include <cmath>

#include "core/packet_code.h"

namespace terracast::scene {
namespace {

TERRACAST_PACKET_CODE void bend(const GroundPacket& g, const NoiseSlope& slope,
                                const Lanes<float>& bed_slope, const NoisePlane* planes,
                                GroundLook& look) {
  Lanes3f gradient;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto across_beds = static_cast<float>(kAcrossBeds[k]);
    for (int i = 0; i < kLanes; ++i) gradient[k][i] = across_beds * bed_slope[i];
  }
  for (int plane = 0; plane < kNumNoisePlanes; ++plane) {
    for (std::size_t k = 0; k < 3; ++k) {
      const auto along_u = static_cast<float>(planes[plane].u.data()[k]);
      const auto along_v = static_cast<float>(planes[plane].v.data()[k]);
      for (int i = 0; i < kLanes; ++i)
        gradient[k][i] += slope.u[plane][i] * along_u + slope.v[plane][i] * along_v;
    }
  }
  for (int i = 0; i < kLanes; ++i) {
    const float nx = g.normal[0][i];
    const float ny = g.normal[1][i];
    const float nz = g.normal[2][i];
    const float across = gradient[0][i] * nx + gradient[1][i] * ny + gradient[2][i] * nz;
    const float x = nx - (gradient[0][i] - across * nx);
    const float y = ny - (gradient[1][i] - across * ny);
    const float z = nz - (gradient[2][i] - across * nz);
    const float scale = 1.0f / std::sqrt(x * x + y * y + z * z);
    look.normal[0][i] = x * scale;
    look.normal[1][i] = y * scale;
    look.normal[2][i] = z * scale;
  }
}

}  // namespace

void bend_normals(const GroundPacket& packet, const NoiseSlope& slope, GroundLook& look) {
  bend(packet, slope, Lanes<float>{}, noise_planes().data(), look);
}

void bend_normals(const GroundPacket& packet, const NoiseSlope& slope,
                  const Lanes<float>& bed_slope, GroundLook& look) {
  bend(packet, slope, bed_slope, noise_planes().data(), look);
}

}  // namespace terracast::scene
