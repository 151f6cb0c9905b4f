#include "world/moving_scene.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "world/crossing_error.h"
#include "world/shape_surface.h"

namespace terracast::world {
namespace {

/// Keys of crossings: the body, then the triangle.
constexpr int kBodyShift = 32;

/// Around all places of a body while rays are cast.
geo::Box3d box_of(const MovingBody& body, double reach_s) {
  constexpr double kRounding = 1.0 + 0x1.0p-40;
  const geo::Box3d& bounds = body.shown->mesh.bounds();
  const double radius_m =
      kRounding * bounds.min().cwiseAbs().cwiseMax(bounds.max().cwiseAbs()).norm();
  const Eigen::Vector3d way_m =
      body.state.velocity_world_mps.cwiseAbs() * reach_s +
      body.state.acceleration_world_mps2.cwiseAbs() * (0.5 * reach_s * reach_s) +
      Eigen::Vector3d::Constant(body.state.terms.most_position_m(reach_s));
  const Eigen::Vector3d reach_m = kRounding * (way_m + Eigen::Vector3d::Constant(radius_m));
  const Eigen::Vector3d& place = body.state.world_from_body.translation;
  return {place - reach_m, place + reach_m};
}

/// A world ray in a body's frame.
MeshRay ray_to(const geo::Rigid3d& world_from_body, const WorldRay& ray) {
  const Eigen::Quaterniond body_from_world = world_from_body.rotation.conjugate();
  return {body_from_world * (ray.origin_world - world_from_body.translation),
          body_from_world * ray.direction_world, ray.direction_world.norm(), ray.t_min};
}

Eigen::Vector3d normal_toward(const WorldRay& ray, const Eigen::Vector3d& normal_world) {
  return normal_world.dot(ray.direction_world) > 0.0 ? Eigen::Vector3d(-normal_world)
                                                     : normal_world;
}

}  // namespace

MovingScene::MovingScene(std::vector<MovingBody> bodies, double reach_s)
    : bodies_(std::move(bodies)) {
  std::vector<geo::Box3d> boxes;
  boxes.reserve(bodies_.size());
  for (const MovingBody& body : bodies_) boxes.push_back(box_of(body, reach_s));
  tree_ = BoxTree(boxes, 1, leaves_);
}

std::optional<MovingScene::Meeting> MovingScene::meet(const WorldRay& ray, double offset_s,
                                                      double t_until, bool is_any) const {
  const double length = ray.direction_world.norm();
  const Eigen::Vector3d inverse(safe_inverse(ray.direction_world.x(), length),
                                safe_inverse(ray.direction_world.y(), length),
                                safe_inverse(ray.direction_world.z(), length));
  // What ends at t_until is still in the ray.
  FirstCrossing first{
      .t_from = ray.t_min,
      .t = std::nextafter(std::min(t_until, ray.t_max), std::numeric_limits<double>::infinity())};
  BoxTree::Ray in_tree;
  if (!tree_.enter(ray.origin_world, ray.direction_world, inverse, length, ray.t_min, first.t,
                   in_tree))
    return std::nullopt;
  tree_.traverse(in_tree, [&](std::uint32_t leaf, float) {
    for (std::uint32_t at = leaves_.leaves[leaf].begin; at < leaves_.leaves[leaf].end; ++at) {
      const std::uint32_t body = leaves_.order[at];
      bodies_[body].shown->mesh.cross(ray_to(bodies_[body].state.pose_after(offset_s), ray),
                                      std::uint64_t{body} << kBodyShift, is_any, first);
    }
    if (first.is_found) in_tree.end_at(first.t);
    return is_any && first.is_found;
  });
  if (!first.is_found) return std::nullopt;
  return Meeting{.t = first.t,
                 .body = static_cast<std::uint32_t>(first.key >> kBodyShift),
                 .triangle = static_cast<std::uint32_t>(first.key)};
}

void MovingScene::intersect(const WorldRay& ray, double offset_s, SurfaceHit& hit,
                            SurfaceSample* surface, SurfaceNeed need) const {
  const std::optional<Meeting> meeting = meet(ray, offset_s, hit.t, false);
  if (!meeting || !(meeting->t < hit.t)) return;
  const MovingBody& body = bodies_[meeting->body];
  const geo::Rigid3d world_from_body = body.state.pose_after(offset_s);
  const Eigen::Vector3d normal_body =
      normal_of(corners_of(body.shown->shape, meeting->triangle)).normalized();
  hit = SurfaceHit{};
  hit.t = meeting->t;
  hit.tile_index = SurfaceHit::kMoving;
  hit.object = meeting->body;
  hit.triangle = body.first_triangle + meeting->triangle;
  hit.object_normal_world = normal_toward(ray, world_from_body.rotation * normal_body);
  if (surface != nullptr) set_surface(ray, world_from_body, *meeting, need, *surface);
}

void MovingScene::set_surface(const WorldRay& ray, const geo::Rigid3d& world_from_body,
                              const Meeting& meeting, SurfaceNeed need,
                              SurfaceSample& surface) const {
  const MovingBody& body = bodies_[meeting.body];
  surface = SurfaceSample{};
  surface.provenance = body.provenance;
  if (need == SurfaceNeed::Object) return;
  const Shape& shape = body.shown->shape;
  const geo::Box3d& bounds = body.shown->mesh.bounds();
  const TriangleCorners corners = corners_of(shape, meeting.triangle);
  const MeshRay own_ray = ray_to(world_from_body, ray);
  const Eigen::Vector3d in_body = own_ray.origin + meeting.t * own_ray.direction;
  surface.finish = shape.finishes[shape.triangles[meeting.triangle].finish];
  surface.uv = uv_at(shape, meeting.triangle, own_ray.sheared, corners);
  surface.uv_per_m = uv_per_m(shape, meeting.triangle, normal_of(corners));
  surface.variety = body.variety;
  surface.from_place_m = (world_from_body.rotation * in_body).cast<float>();
  surface.in_body_m = in_body.cast<float>();
  surface.reach_m = static_cast<float>(std::max(bounds.min().head<2>().cwiseAbs().maxCoeff(),
                                                bounds.max().head<2>().cwiseAbs().maxCoeff()));
  surface.height_m = static_cast<float>(bounds.max().z());
  surface.crossing_error =
      need == SurfaceNeed::Facts
          ? crossing_error(
                own_ray.origin, own_ray.direction,
                error_of_moved_ray(own_ray.origin, own_ray.direction, world_from_body.rotation),
                corners)
          : 0.0;
}

double MovingScene::intersect(const WorldRay& ray, double offset_s, double t) const {
  const std::optional<Meeting> meeting = meet(ray, offset_s, t, false);
  return meeting ? std::min(meeting->t, t) : t;
}

bool MovingScene::occludes(const WorldRay& ray, double offset_s) const {
  return meet(ray, offset_s, ray.t_max, true).has_value();
}

}  // namespace terracast::world
