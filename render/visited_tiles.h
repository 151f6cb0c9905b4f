#pragma once

#include <span>
#include <vector>

#include "capture/frame.h"
#include "geo/box3.h"
#include "sensors/camera/frame_renderer.h"
#include "world/ray_trail.h"

/// What a frame tells of the world that it was rendered from: the tiles that its rays touched, and how
/// low they passed over others. As long as the touched tiles are the same and no other reaches into
/// the way of a ray, the frame is the same.
///
/// Rays of a frame are those of its images: for facts, for visibility from the frames beside it and
/// from other cameras of the rig, for colour and for the sun's light. Those to track points do not
/// count.
namespace terracast::render {

/// The z up to which a frame tells how low its rays pass over tiles: 64 m above the highest point of the
/// tiles that it touches; -inf where it touches none. So what a frame tells follows from its rays and
/// the tiles that they touch, and from no other tile.
/// tiles   of the cut
double told_below_z(std::span<const int> touched_tiles, std::span<const capture::TileScale> tiles);

/// Sets a record's touched and passed tiles.
void set_seen_tiles(const world::RayTrail& trail, std::span<const capture::TileScale> tiles,
                    capture::FrameRecord& record);

/// Where rays of frames may come, above what the frames tell. Threads: safe.
class FrameSight {
 public:
  /// tile_boxes   of the cut; the renderer must outlive this
  FrameSight(const sensors::FrameRenderer& renderer, const std::vector<geo::Box3d>& tile_boxes);

  /// Whether rays of a frame may come into a box that begins above told_below_z of its tiles.
  ///
  /// Above told_below_z nothing stands that the frame's rays touch, so that rays from cameras up there
  /// come as far as they are straight: what is told of them is exact, to the pixel. More is told than
  /// is so of rays from below that a ridge might stop, of those from another frame to any point of a
  /// touched tile, and of those from any point of a touched tile to the sun.
  bool may_reach(int frame, std::span<const int> touched_tiles, const geo::Box3d& box_world) const;

 private:
  bool may_see(const sensors::View& view, const geo::Box3d& box_world) const;
  bool may_ask_through(const sensors::View& view, std::span<const int> touched_tiles,
                       const geo::Box3d& box_world) const;
  bool may_shade(std::span<const int> touched_tiles, const geo::Box3d& box_world) const;

  const sensors::FrameRenderer& renderer_;
  std::vector<geo::Box3d>
      points_;  ///< boxes of the tiles' points from which rays start or to which they go
};

}  // namespace terracast::render
