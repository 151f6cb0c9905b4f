#pragma once

#include <span>

#include "world/moving_scene.h"
#include "world/ray_query.h"

namespace terracast::world {

/// A world and what moves in it, about the time of one frame: RayQuery's queries, with a time for each ray. Rays
/// come to the same tiles as in the still world. Threads: safe.
class TimedQuery {
 public:
  /// Both must outlive it.
  TimedQuery(const RayQuery& still, const MovingScene& moving) : still_(still), moving_(moving) {}
  /// Nothing moves.
  TimedQuery(const RayQuery& still);  // NOLINT(google-explicit-constructor)

  const RayQuery& still() const { return still_; }
  const MovingScene& moving() const { return moving_; }

  /// offsets_s   the rays' times, counted from the frame's; empty: all are cast at that
  void intersect(std::span<const WorldRay> rays, std::span<const double> offsets_s,
                 std::span<SurfaceHit> hits, Coherence coherence,
                 std::span<SurfaceSample> surfaces = {}, RayTrail* trail = nullptr,
                 SurfaceNeed need = SurfaceNeed::Look) const;
  /// offset_s   the time of all
  void intersect(const RayFan& rays, double offset_s, std::span<SurfaceHit> hits,
                 Coherence coherence, std::span<SurfaceSample> surfaces = {},
                 RayTrail* trail = nullptr, SurfaceNeed need = SurfaceNeed::Look) const;
  void intersect(const RayFan& rays, double offset_s, std::span<double> t, Coherence coherence,
                 RayTrail* trail = nullptr) const;
  void occluded(std::span<const WorldRay> rays, std::span<const double> offsets_s,
                std::span<std::uint8_t> is_occluded, RayTrail* trail = nullptr) const;

 private:
  const RayQuery& still_;
  const MovingScene& moving_;
};

}  // namespace terracast::world
