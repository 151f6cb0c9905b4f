#include "world/timed_query.h"

#include "core/error.h"

namespace terracast::world {
namespace {

double offset_of(std::span<const double> offsets_s, std::size_t ray) {
  return offsets_s.empty() ? 0.0 : offsets_s[ray];
}

SurfaceSample* sample_of(std::span<SurfaceSample> surfaces, std::size_t ray) {
  return surfaces.empty() ? nullptr : &surfaces[ray];
}

void check_offsets(std::size_t num_rays, std::span<const double> offsets_s) {
  TERRACAST_CHECK(offsets_s.empty() || offsets_s.size() == num_rays, "{} times of {} rays",
                  offsets_s.size(), num_rays);
}

}  // namespace

TimedQuery::TimedQuery(const RayQuery& still)
    : still_(still), moving_([]() -> const MovingScene& {
        static const MovingScene nothing;
        return nothing;
      }()) {}

void TimedQuery::intersect(std::span<const WorldRay> rays, std::span<const double> offsets_s,
                           std::span<SurfaceHit> hits, Coherence coherence,
                           std::span<SurfaceSample> surfaces, RayTrail* trail,
                           SurfaceNeed need) const {
  still_.intersect(rays, hits, coherence, surfaces, trail, need);
  if (moving_.is_empty()) return;
  check_offsets(rays.size(), offsets_s);
  for (std::size_t i = 0; i < rays.size(); ++i)
    moving_.intersect(rays[i], offset_of(offsets_s, i), hits[i], sample_of(surfaces, i), need);
}

void TimedQuery::intersect(const RayFan& rays, double offset_s, std::span<SurfaceHit> hits,
                           Coherence coherence, std::span<SurfaceSample> surfaces, RayTrail* trail,
                           SurfaceNeed need) const {
  still_.intersect(rays, hits, coherence, surfaces, trail, need);
  if (moving_.is_empty()) return;
  for (std::size_t i = 0; i < rays.size(); ++i)
    moving_.intersect(rays[i], offset_s, hits[i], sample_of(surfaces, i), need);
}

void TimedQuery::intersect(const RayFan& rays, double offset_s, std::span<double> t,
                           Coherence coherence, RayTrail* trail) const {
  still_.intersect(rays, t, coherence, trail);
  if (moving_.is_empty()) return;
  for (std::size_t i = 0; i < rays.size(); ++i) t[i] = moving_.intersect(rays[i], offset_s, t[i]);
}

void TimedQuery::occluded(std::span<const WorldRay> rays, std::span<const double> offsets_s,
                          std::span<std::uint8_t> is_occluded, RayTrail* trail) const {
  still_.occluded(rays, is_occluded, trail);
  if (moving_.is_empty()) return;
  check_offsets(rays.size(), offsets_s);
  for (std::size_t i = 0; i < rays.size(); ++i)
    if (is_occluded[i] == 0 && moving_.occludes(rays[i], offset_of(offsets_s, i)))
      is_occluded[i] = 1;
}

}  // namespace terracast::world
