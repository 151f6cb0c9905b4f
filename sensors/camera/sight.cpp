#include "sensors/camera/sight.h"

#include <algorithm>
#include <array>
#include <optional>

namespace terracast::sensors {
namespace {

/// To a point and a little beyond, so that the crossing at the point is within.
world::WorldRay ray_just_beyond(const Eigen::Vector3d& origin_world,
                                const Eigen::Vector3d& point_world) {
  return {.origin_world = origin_world,
          .direction_world = point_world - origin_world,
          .t_max = scene::kJustBeyond};
}

/// A body at another frame; null: it is not there.
const world::MovingBody* find_body(const world::MovingScene& moving,
                                   const world::MovingBody& wanted) {
  const std::vector<world::MovingBody>& bodies = moving.bodies();
  const auto found = std::find_if(bodies.begin(), bodies.end(), [&](const world::MovingBody& body) {
    return body.provenance == wanted.provenance && body.first_triangle == wanted.first_triangle;
  });
  return found == bodies.end() ? nullptr : &*found;
}

/// Rays by which a view sees points, each at a time of its own.
struct SightRays {
  std::vector<world::WorldRay> rays;
  std::vector<double> offsets_s;
  std::vector<std::size_t> points;

  void add(const OpenView::SeenFrom& seen, const Eigen::Vector3d& point_world, std::size_t point) {
    rays.push_back(ray_just_beyond(seen.origin_world, point_world));
    offsets_s.push_back(seen.offset_s);
    points.push_back(point);
  }
  /// Calls see(point) of each point at which its ray ends.
  template <class See>
  void cast(const world::TimedQuery& scene, world::Coherence coherence, world::RayTrail* trail,
            const See& see) const {
    std::vector<world::SurfaceHit> hits(rays.size());
    scene.intersect(rays, offsets_s, hits, coherence, {}, trail);
    for (std::size_t i = 0; i < hits.size(); ++i)
      if (is_at_point(hits[i].t)) see(points[i]);
  }
};

/// Of a camera that sees each point from a place of its own.
void see_from_lines(const Target& target, MetPoints& met, world::RayTrail* trail) {
  constexpr std::size_t kBlock = geo::VectorBlock::kVectors;
  SightRays sight;
  for (std::size_t i = 0; i < met.pixels.size(); ++i) {
    const geo::VectorBlock& block = met.points_world[i / kBlock];
    const Eigen::Vector3d point(block.x[i % kBlock], block.y[i % kBlock], block.z[i % kBlock]);
    if (const std::optional<OpenView::SeenFrom> seen = target.view.that_sees(point))
      sight.add(*seen, point, i);
  }
  sight.cast(target.scene, world::Coherence::Coherent, trail,
             [&](std::size_t i) { met.flags[i] |= target.flag; });
}

/// Of a camera that sees all points from its centre.
void see_from_center(const Target& target, MetPoints& met, UnitScratch& scratch,
                     world::RayTrail* trail) {
  constexpr std::size_t kBlock = geo::VectorBlock::kVectors;
  const Eigen::Vector3d& center = target.view.middle.center_world;
  scratch.directions.clear(kUnitRays);
  for (std::size_t b = 0; b < met.points_world.size(); ++b) {
    const geo::VectorBlock& block = met.points_world[b];
    const std::size_t first = b * kBlock;
    const std::size_t count = std::min(kBlock, met.pixels.size() - first);
    const std::uint32_t in_image = target.view.middle.find_in_image(block);
    for (std::size_t i = 0; i < count; ++i) {
      scratch.asked[scratch.directions.size()] = first + i;
      scratch.directions.add_if(
          ((in_image >> i) & 1U) != 0,
          {block.x[i] - center.x(), block.y[i] - center.y(), block.z[i] - center.z()});
    }
  }
  const std::span<const double> t =
      scratch.cast(target.scene, scratch.directions.just_beyond(center), trail);
  for (std::size_t i = 0; i < t.size(); ++i)
    if (is_at_point(t[i])) met.flags[scratch.asked[i]] |= target.flag;
}

}  // namespace

void see_standing(const Target& target, MetPoints& met, UnitScratch& scratch,
                  world::RayTrail* trail) {
  if (target.view.is_rolling() || !target.view.is_central())
    see_from_lines(target, met, trail);
  else
    see_from_center(target, met, scratch, trail);
}

void see_moving(const Target& target, const world::MovingScene& then,
                std::span<const MovingPoint> points, double offset_s,
                std::span<std::uint32_t> flags, world::RayTrail* trail) {
  SightRays sight;
  for (const MovingPoint& met : points) {
    const world::MovingBody* const body = find_body(then, *met.body);
    if (body == nullptr) continue;
    const geo::Rigid3d world_from_body = met.body->state.pose_after(offset_s);
    const Eigen::Vector3d point_body =
        world_from_body.rotation.conjugate() * (met.point_world - world_from_body.translation);
    const auto point_world_at = [&](double at_s) -> Eigen::Vector3d {
      return body->state.pose_after(at_s) * point_body;
    };
    if (const std::optional<OpenView::SeenFrom> seen = target.view.that_sees(point_world_at))
      sight.add(*seen, point_world_at(seen->offset_s), met.pixel);
  }
  sight.cast(target.scene, world::Coherence::Coherent, trail,
             [&](std::size_t pixel) { flags[pixel] |= target.flag; });
}

std::vector<std::uint8_t> visible_in_view(const world::TimedQuery& scene, const OpenView& view,
                                          std::span<const Eigen::Vector3d> points_world) {
  std::vector<std::uint8_t> is_visible(points_world.size(), 0);
  const std::size_t num_units = (points_world.size() + kUnitRays - 1) / kUnitRays;
  scene.still().run_units(static_cast<std::int64_t>(num_units), [&](std::int64_t unit) {
    const std::size_t begin = static_cast<std::size_t>(unit) * kUnitRays;
    SightRays sight;
    for (std::size_t i = begin; i < std::min(begin + kUnitRays, points_world.size()); ++i)
      if (const std::optional<OpenView::SeenFrom> seen = view.that_sees(points_world[i]))
        sight.add(*seen, points_world[i], i);
    sight.cast(scene, world::Coherence::Incoherent, nullptr,
               [&](std::size_t i) { is_visible[i] = 1; });
  });
  return is_visible;
}

}  // namespace terracast::sensors
