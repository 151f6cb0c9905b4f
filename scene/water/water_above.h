#pragma once

#include <Eigen/Core>
#include <span>

#include "world/ray_query.h"

namespace terracast::scene {

/// The water straight above a place.
struct WaterAbove {
  double depth_m = 0.0;                     ///< of the place below the surface; 0 where it is dry
  world::Cover cover = world::Cover::Land;  ///< of the surface

  double sea_depth_m() const { return cover == world::Cover::Sea ? depth_m : 0.0; }
};

/// What water stands above places, whoever looks at them: of beds, solids in water, and cameras.
/// whole    the world with its water; things in it do not count
/// above    as many as places; dry outside the tiles
/// trail    the tiles of the places are added to it; null: nobody wants to know
/// cost     two queries a place
/// threads  safe
void find_water_above(const world::RayQuery& whole, std::span<const Eigen::Vector3d> places_world,
                      std::span<WaterAbove> above, world::RayTrail* trail);

}  // namespace terracast::scene
