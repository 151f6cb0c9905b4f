#pragma once

#include <embree3/rtcore.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <set>
#include <vector>

#include "core/parallel.h"
#include "geo/geodesy.h"
#include "world/instance_frame.h"
#include "world/lod.h"
#include "world/ray_query.h"
#include "world/tile_map.h"
#include "world/tile_store.h"

/// What benchmarks call bare Embree: all tiles' stitched GRIDs in one scene, floats about the
/// camera, robust and compact; with them the solids as one geometry of triangles and each instance
/// as one of Embree's of a scene of its shape. Rays are ready in float packets of 16, and nothing is
/// done with the hits.
namespace terracast::bench {

class BareScene {
 public:
  BareScene(const world::TileStore& store, const std::vector<world::CutTile>& cut,
            const Eigen::Vector3d& origin_world)
      : device_(rtcNewDevice(nullptr)), scene_(rtcNewScene(device_)), origin_world_(origin_world) {
    attach_tiles(store, cut);
    commit(scene_);
  }
  ~BareScene() {
    rtcReleaseScene(scene_);
    for (const auto& [shape, scene] : shape_scenes_) rtcReleaseScene(scene);
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

  std::size_t num_instances() const { return num_instances_; }
  std::size_t num_solids() const { return solids_.size(); }

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

  struct Triangles {
    std::vector<float> vertices;
    std::vector<std::uint32_t> corners;

    /// origin   of the shape
    void add(const world::Shape& shape, const Eigen::Vector3d& origin) {
      const auto first = static_cast<std::uint32_t>(vertices.size() / 3);
      for (const Eigen::Vector3i& steps : shape.vertices_steps)
        for (int axis = 0; axis < 3; ++axis)
          vertices.push_back(static_cast<float>(steps[axis] * world::kHeightStep_m + origin[axis]));
      for (const world::Shape::Triangle& triangle : shape.triangles)
        for (const std::uint32_t corner : triangle.corners) corners.push_back(first + corner);
    }
  };

  static void commit(RTCScene scene) {
    rtcSetSceneFlags(scene,
                     static_cast<RTCSceneFlags>(RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_COMPACT));
    rtcCommitScene(scene);
  }

  void attach_tiles(const world::TileStore& store, const std::vector<world::CutTile>& cut) {
    const world::TileMap map(store, cut);
    const geo::WorldFrame frame(store.manifest().origin);
    for (std::size_t row = 0; row < store.manifest().prototypes.size(); ++row)
      prototypes_.push_back(store.load_prototype(row));
    Triangles solids;
    for (const world::CutTile& one : cut) {
      const world::Tile tile = store.load(one.id);
      attach(tile, one.coarser_sides);
      const auto level_at = [&](double x, double y) {
        const std::optional<std::uint32_t> at = map.tile_at_place(x, y);
        return at ? cut[*at].id.level : 127;
      };
      for (const world::Solid& solid : tile.objects.solids) {
        const world::Shape* shape =
            world::shape_at(solid.levels, level_at(solid.place_m.x(), solid.place_m.y()));
        if (shape == nullptr || !solids_.insert(solid.provenance.instance_id).second) continue;
        solids.add(*shape,
                   solid.origin_steps.cast<double>() * world::kHeightStep_m - origin_world_);
      }
      for (const world::Instance& instance : tile.objects.instances) {
        const world::InstanceFrame placed = world::instance_frame(instance, frame);
        const int level = level_at(placed.place_world.x(), placed.place_world.y());
        if (level > instance.coarsest_level) continue;
        const world::Shape* shape = world::shape_at(prototypes_[instance.prototype].levels, level);
        if (shape == nullptr || shape->triangles.empty()) continue;
        if (!instances_.insert(instance.provenance.instance_id).second) continue;
        attach(placed, *shape);
      }
    }
    num_instances_ = instances_.size();
    instances_.clear();
    if (!solids.corners.empty()) attach(solids, scene_);
  }

  void attach(const Triangles& triangles, RTCScene scene) {
    const RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
    std::copy(triangles.vertices.begin(), triangles.vertices.end(),
              static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0,
                                                          RTC_FORMAT_FLOAT3, 12,
                                                          triangles.vertices.size() / 3)));
    std::copy(triangles.corners.begin(), triangles.corners.end(),
              static_cast<std::uint32_t*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX,
                                                                  0, RTC_FORMAT_UINT3, 12,
                                                                  triangles.corners.size() / 3)));
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene, geometry);
    rtcReleaseGeometry(geometry);
  }

  void attach(const world::InstanceFrame& placed, const world::Shape& shape) {
    RTCScene& scene = shape_scenes_[&shape];
    if (scene == nullptr) {
      scene = rtcNewScene(device_);
      Triangles triangles;
      triangles.add(shape, Eigen::Vector3d::Zero());
      attach(triangles, scene);
      commit(scene);
    }
    Eigen::Matrix<float, 3, 4> transform;
    transform.leftCols<3>() =
        (placed.scale * placed.world_from_prototype.toRotationMatrix()).cast<float>();
    transform.col(3) = (placed.place_world - origin_world_).cast<float>();
    const RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_INSTANCE);
    rtcSetGeometryInstancedScene(geometry, scene);
    rtcSetGeometryTransform(geometry, 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, transform.data());
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene_, geometry);
    rtcReleaseGeometry(geometry);
  }

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
  std::vector<world::Prototype> prototypes_;
  std::map<const world::Shape*, RTCScene> shape_scenes_;
  std::set<std::uint32_t> solids_;     ///< by instance id
  std::set<std::uint32_t> instances_;  ///< by instance id, while they are attached
  std::size_t num_instances_ = 0;
};

}  // namespace terracast::bench
