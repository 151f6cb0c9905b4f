#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "capture/channel.h"
#include "capture/frame.h"
#include "scene/ground/ground.h"
#include "scene/moving/moving_bodies.h"
#include "sensors/camera/views.h"
#include "world/timed_query.h"

namespace terracast::sensors {

/// How far the rays of the edge test stand from the pixel's centre.
inline constexpr double kEdgeShift_px = 1e-3;

/// What one geometry-only ray through each pixel's centre says. The doubles are what the capture's
/// floats are rounded from.
struct TruthFrame {
  std::vector<double> range_m;               ///< row by row; sky +inf
  std::vector<Eigen::Vector3d> point_world;  ///< of the hit; sky 0
  std::vector<double> crossing_error;        ///< of objects: SurfaceSample::crossing_error; else 0
  capture::CameraFrame facts;                ///< all but the colour
};

/// Traces the facts of camera `camera` at frame `frame`: range, normal, semantic class, instance,
/// primitive, edge bit (a pixel one of whose eight neighbours shows another object is asked by rays
/// shifted by kEdgeShift_px to four sides whether they meet another), and whether the exact hit point is seen from the same camera in the next and the
/// previous frame and from the rig's other cameras at the same time. Visibility is by ray: the
/// point projects into that image, and the first crossing of the ray from that centre to the point
/// is the point; where a model's rays start at many places, from where the ray of that image point starts.
/// Ranges count from there too. Of a rolling shutter each line's pixels are traced from where the camera is in the middle
/// of that line's exposure, and a point projects into the line that sees it. A point of something that moves
/// moves with it: another view sees it where it then is.
/// moving        of the sequence
/// bed           the world without water: fills bottom_range_m; null: nobody wants it
/// flags         those that are looked for; others stay 0 and cost no rays
/// truth         overwritten, all but the colour; a frame that is used again costs no new memory
/// trail         takes the tiles to which the rays come; null: nobody wants to know
/// determinism   the facts depend on the views and the world alone
/// throws        as RayQuery
void trace_truth(const world::RayQuery& query, const scene::MovingBodies& moving,
                 const scene::Ground& ground, const ViewTable& views, int frame, int camera,
                 TruthFrame& truth, world::RayTrail* trail = nullptr,
                 const world::RayQuery* bed = nullptr, std::uint32_t flags = capture::kAllFlags);

/// The id of a triangle in a capture (capture/channel.h). tile_index below 2^15 - 1.
inline std::uint32_t primitive_id(const world::SurfaceHit& hit) {
  if (!hit.is_ground())
    return capture::kObjectPrimitives + hit.triangle % capture::kMaxObjectPrimitives;
  return hit.tile_index << capture::kPrimitiveTileShift |
         static_cast<std::uint32_t>(hit.cell_y) << 9 | static_cast<std::uint32_t>(hit.cell_x) << 1 |
         static_cast<std::uint32_t>(hit.upper);
}
/// Tiles that primitive ids can tell apart; one less than 2^15, for kNoPrimitive.
inline constexpr std::size_t kMaxCutTiles = capture::kMaxShownTiles;

}  // namespace terracast::sensors
