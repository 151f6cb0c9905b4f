#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "geo/trajectory.h"
#include "world/box_tree.h"
#include "world/prototype_library.h"
#include "world/ray_query.h"
#include "world/tile_objects.h"
#include "world/world_ray.h"

namespace terracast::world {

/// Something rigid that moves.
struct MovingBody {
  const PrototypeLibrary::Shown* shown = nullptr;  ///< its shape, in its own frame: x forward, z up
  Provenance provenance;
  /// Added to the numbers of its triangles.
  std::uint32_t first_triangle = 0;
  std::uint8_t variety = 0;
  geo::BodyState state;  ///< at the frame's time; it goes on as BodyState::pose_after has it
};

/// What moves, about the time of one frame. As of instances a tree of boxes proposes and doubles decide: rays are
/// moved into the frame of a body in double, where its corners are exact.
///
/// accuracy      the t of a crossing: as crossing_error() bounds it, of the ray and the body's pose
/// determinism   what a ray meets depends on the ray, its time and the bodies alone
/// threads       safe
class MovingScene {
 public:
  /// Nothing moves.
  MovingScene() = default;
  /// The shapes must outlive it.
  /// reach_s   no ray's time differs by more from the frame's
  MovingScene(std::vector<MovingBody> bodies, double reach_s);

  bool is_empty() const { return bodies_.empty(); }
  const std::vector<MovingBody>& bodies() const { return bodies_; }

  /// Where a ray meets a body before it meets what stands, its hit and the sample are set.
  /// offset_s   the ray's time, counted from the frame's
  /// hit        of what stands, and in the end of the nearer of both
  /// surface    set as `need` says; null: nobody wants it
  void intersect(const WorldRay& ray, double offset_s, SurfaceHit& hit, SurfaceSample* surface,
                 SurfaceNeed need) const;
  /// Of which only t is told, the smaller of that which is given and that of a body.
  double intersect(const WorldRay& ray, double offset_s, double t) const;
  bool occludes(const WorldRay& ray, double offset_s) const;

 private:
  struct Meeting {
    double t = 0.0;
    std::uint32_t body = 0;
    std::uint32_t triangle = 0;  ///< of the body's shape
  };
  std::optional<Meeting> meet(const WorldRay& ray, double offset_s, double t_until,
                              bool is_any) const;
  void set_surface(const WorldRay& ray, const geo::Rigid3d& world_from_body, const Meeting& meeting,
                   SurfaceNeed need, SurfaceSample& surface) const;

  std::vector<MovingBody> bodies_;
  BoxTree tree_;
  BoxTree::Leaves leaves_;
};

}  // namespace terracast::world
