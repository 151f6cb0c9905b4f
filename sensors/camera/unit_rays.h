#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/lanes.h"
#include "geo/camera_model.h"
#include "scene/ground/ground.h"
#include "scene/light/directions.h"
#include "sensors/camera/views.h"
#include "world/timed_query.h"

namespace terracast::sensors {

/// Pixels of an image are traced in units, squares of this side or as many on a line.
inline constexpr int kUnitSide = 32;
inline constexpr std::size_t kUnitRays = static_cast<std::size_t>(kUnitSide) * kUnitSide;

/// Hits of a packet, field by field.
struct HitPacket {
  core::Lanes3d direction_world;
  core::Lanes<double> t;
  core::Lanes<double> slope_x;
  core::Lanes<double> slope_y;
};

/// Rays of a unit that met something, and where. The rays' own buffers are used again for visibility.
struct MetPoints {
  std::vector<std::size_t> rays;
  std::vector<std::size_t> pixels;
  std::vector<std::uint32_t> flags;
  std::vector<geo::VectorBlock> points_world;  ///< the last point fills the last block

  MetPoints() {
    rays.reserve(kUnitRays);
    pixels.reserve(kUnitRays);
    flags.reserve(kUnitRays);
    points_world.reserve(kUnitRays / geo::VectorBlock::kVectors + 1);
  }
};

struct UnitScratch {
  View view;                     ///< of the unit
  scene::Directions directions;  ///< of the rays
  std::vector<Eigen::Vector3d>
      origins_world;                      ///< of the rays; empty: all start at the view's centre
  std::vector<world::WorldRay> own_rays;  ///< the same, with these origins
  std::vector<double> offsets_s;          ///< of these
  std::vector<double> t_ends;             ///< of the rays; empty: they have none
  std::vector<world::SurfaceHit> hits;    ///< of the rays
  std::vector<double> t;                  ///< of rays to points
  std::vector<world::SurfaceSample> surfaces;  ///< of the rays
  std::vector<std::size_t> pixels;             ///< of the rays
  MetPoints ground;
  MetPoints objects;
  std::vector<std::size_t> moving_rays;  ///< that met what moves
  std::vector<std::size_t> asked;        ///< of the points, those to which there are rays
  HitPacket packet_hits;
  core::Lanes<double> range_m;
  scene::GroundPlaces places;
  scene::GroundPacket packet;
  core::Lanes<std::uint8_t> classes;

  UnitScratch() {
    hits.reserve(kUnitRays);
    t.reserve(kUnitRays);
    surfaces.reserve(kUnitRays);
    pixels.reserve(kUnitRays);
    asked.resize(kUnitRays + 1);
  }
  Eigen::Vector3d origin_world(std::size_t ray) const {
    return origins_world.empty() ? view.center_world : origins_world[ray];
  }
  /// What the rays meet, all at one time; leaves it in hits and surfaces.
  void intersect(const world::TimedQuery& scene, double offset_s, world::RayTrail* trail,
                 world::SurfaceNeed need) {
    hits.resize(directions.size());
    surfaces.resize(directions.size());
    if (origins_world.empty()) {
      world::RayFan rays = directions.from(view.center_world);
      rays.t_ends = t_ends;
      scene.intersect(rays, offset_s, hits, world::Coherence::Coherent, surfaces, trail, need);
      return;
    }
    own_rays.clear();
    for (std::size_t i = 0; i < directions.size(); ++i)
      own_rays.push_back({.origin_world = origins_world[i], .direction_world = directions[i]});
    for (std::size_t i = 0; i < t_ends.size(); ++i) own_rays[i].t_max = t_ends[i];
    offsets_s.assign(own_rays.size(), offset_s);
    scene.intersect(own_rays, offsets_s, hits, world::Coherence::Coherent, surfaces, trail, need);
  }
  std::span<const double> cast(const world::TimedQuery& scene, const world::RayFan& rays,
                               world::RayTrail* trail) {
    t.resize(rays.size());
    scene.intersect(rays, 0.0, t, world::Coherence::Coherent, trail);
    return t;
  }
};

}  // namespace terracast::sensors
