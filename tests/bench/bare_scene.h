#pragma once

#include <embree3/rtcore.h>

#include <Eigen/Core>
#include <algorithm>
#include <cstdint>
#include <vector>

#include "core/parallel.h"
#include "world/lod.h"
#include "world/ray_query.h"
#include "world/tile_store.h"

/// What benchmarks call bare Embree: all tiles' stitched GRIDs in one scene, floats about the
/// camera, robust and compact; rays ready in float packets of 16, nothing done with the hits.
namespace terracast::bench {

class BareScene {
 public:
  BareScene(const world::TileStore& store, const std::vector<world::CutTile>& cut,
            const Eigen::Vector3d& origin_world)
      : device_(rtcNewDevice(nullptr)), scene_(rtcNewScene(device_)), origin_world_(origin_world) {
    for (const world::CutTile& tile : cut) attach(store.load(tile.id), tile.coarser_sides);
    rtcSetSceneFlags(scene_,
                     static_cast<RTCSceneFlags>(RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_COMPACT));
    rtcCommitScene(scene_);
  }
  ~BareScene() {
    rtcReleaseScene(scene_);
    rtcReleaseDevice(device_);
  }
  BareScene(const BareScene&) = delete;
  BareScene& operator=(const BareScene&) = delete;

  std::vector<RTCRayHit16> packets(const std::vector<world::WorldRay>& rays) const {
    std::vector<RTCRayHit16> result((rays.size() + kPacket - 1) / kPacket);
    for (std::size_t i = 0; i < result.size() * kPacket; ++i) {
      const world::WorldRay& ray = rays[std::min(i, rays.size() - 1)];
      RTCRayHit16& packet = result[i / kPacket];
      const std::size_t lane = i % kPacket;
      const Eigen::Vector3f origin = (ray.origin_world - origin_world_).cast<float>();
      const Eigen::Vector3f direction = ray.direction_world.cast<float>();
      packet.ray.org_x[lane] = origin.x();
      packet.ray.org_y[lane] = origin.y();
      packet.ray.org_z[lane] = origin.z();
      packet.ray.dir_x[lane] = direction.x();
      packet.ray.dir_y[lane] = direction.y();
      packet.ray.dir_z[lane] = direction.z();
      packet.ray.tnear[lane] = static_cast<float>(ray.t_min);
      packet.ray.tfar[lane] = static_cast<float>(ray.t_max);
      packet.ray.mask[lane] = 0xffffffffU;
      packet.hit.geomID[lane] = RTC_INVALID_GEOMETRY_ID;
    }
    return result;
  }

  /// First hits of coherent packets.
  void intersect(const std::vector<RTCRayHit16>& packets) const {
    trace(packets, RTC_INTERSECT_CONTEXT_FLAG_COHERENT,
          [this](const int* valid, RTCIntersectContext* context, RTCRayHit16& packet) {
            rtcIntersect16(valid, scene_, context, &packet);
          });
  }
  /// Whether anything is hit, of packets that are not coherent.
  void occluded(const std::vector<RTCRayHit16>& packets) const {
    trace(packets, RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT,
          [this](const int* valid, RTCIntersectContext* context, RTCRayHit16& packet) {
            rtcOccluded16(valid, scene_, context, &packet.ray);
          });
  }

 private:
  static constexpr std::size_t kPacket = 16;

  void attach(const world::Tile& tile, std::uint8_t coarser_sides) {
    const std::vector<std::int32_t> half_steps = world::stitched_half_steps(tile, coarser_sides);
    const RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_GRID);
    auto* vertex = static_cast<float*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, half_steps.size()));
    auto* grid = static_cast<RTCGrid*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_GRID, 0, RTC_FORMAT_GRID, sizeof(RTCGrid), 1));
    *grid = {0, world::kTileSamples, world::kTileSamples, world::kTileSamples};
    const Eigen::Vector2d corner = tile.id.corner_world() - origin_world_.head<2>();
    for (int j = 0; j < world::kTileSamples; ++j) {
      for (int i = 0; i < world::kTileSamples; ++i) {
        *vertex++ = static_cast<float>(corner.x() + i * tile.id.spacing_m());
        *vertex++ = static_cast<float>(corner.y() + j * tile.id.spacing_m());
        *vertex++ =
            static_cast<float>(tile.center_z_m - origin_world_.z() +
                               half_steps[world::Tile::sample(i, j)] * (world::kHeightStep_m / 2));
      }
    }
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene_, geometry);
    rtcReleaseGeometry(geometry);
  }

  template <class Trace>
  static void trace(const std::vector<RTCRayHit16>& packets, RTCIntersectContextFlags flags,
                    const Trace& one) {
    constexpr std::int64_t kPacketsATime = 64;
    core::parallel_for_blocks(static_cast<std::int64_t>(packets.size()), kPacketsATime,
                              [&](std::int64_t begin, std::int64_t end) {
                                alignas(64) int valid[kPacket];
                                std::fill(std::begin(valid), std::end(valid), -1);
                                RTCIntersectContext context;
                                rtcInitIntersectContext(&context);
                                context.flags = flags;
                                for (std::int64_t i = begin; i < end; ++i) {
                                  RTCRayHit16 packet = packets[static_cast<std::size_t>(i)];
                                  one(valid, &context, packet);
                                  asm volatile("" : : "g"(&packet) : "memory");
                                }
                              });
  }

  RTCDevice device_;
  RTCScene scene_;
  Eigen::Vector3d origin_world_;
};

}  // namespace terracast::bench
