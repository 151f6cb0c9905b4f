#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "core/semantic_class.h"
#include "scene/moving/moving_bodies.h"
#include "tests/sensors/plane_flight.h"
#include "world/prototype_library.h"
#include "world/shape.h"
#include "world/tile_id.h"

/// A box that turns as it goes over the plane of tests/sensors/plane_flight.h, with a bar that turns on it, and where
/// rays meet them in closed form.
namespace terracast::test {

/// A box about its frame's origin.
inline scene::MovingShape box_shape(const Eigen::Vector3d& half_m) {
  world::Shape shape;
  const Eigen::Vector3i half = (half_m / world::kHeightStep_m).array().round().cast<int>();
  for (int corner = 0; corner < 8; ++corner)
    shape.vertices_steps.emplace_back((corner & 1) != 0 ? half.x() : -half.x(),
                                      (corner & 2) != 0 ? half.y() : -half.y(),
                                      (corner & 4) != 0 ? half.z() : -half.z());
  constexpr std::uint32_t kFaces[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                                          {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
  for (const auto& f : kFaces)
    for (const auto& corners : {std::array{f[0], f[1], f[2]}, std::array{f[0], f[2], f[3]}})
      shape.triangles.push_back({.corners = corners, .finish = 0});
  shape.finishes = {{.material = world::Material::Plain,
                     .semantic_class = core::SemanticClass::Car,
                     .color_srgb = {200, 40, 30}}};
  return {.thing = "box",
          .shown = std::make_shared<const world::PrototypeLibrary::Shown>(std::move(shape))};
}

inline const Eigen::Vector3d kHalf_m(7.0, 5.0, 4.0);
inline const Eigen::Vector3d kPartHalf_m(9.0, 1.0, 1.0);
inline const Eigen::Vector3d kPartOrigin_m(2.0, 1.0, 6.5);  // above the box: they do not touch

/// A box that turns as it goes, with a bar that turns on it.
inline scene::MovingThing turning_box(const render::SequencePlan& plan,
                                      const Eigen::Vector3d& place_world) {
  scene::MovingThing thing{.name = "box",
                           .shape = box_shape(kHalf_m),
                           .semantic_id = static_cast<std::uint32_t>(core::SemanticClass::Car),
                           .parts = {{.name = "bar1",
                                      .shape = box_shape(kPartHalf_m),
                                      .origin_m = kPartOrigin_m,
                                      .axis = Eigen::Vector3d(0.0, 0.6, 0.8),
                                      .rate_radps = 30.0}},
                           .states = {},
                           .gone_m = {}};
  for (std::size_t frame = 0; frame < plan.states.size(); ++frame) {
    const double turn = 0.4 + 0.5 * static_cast<double>(frame);
    thing.states.push_back(
        geo::BodyState{.time_s = plan.states[frame].time_s,
                       .world_from_body = {Eigen::Quaterniond(Eigen::AngleAxisd(
                                               turn, Eigen::Vector3d(0.2, -0.3, 1.0).normalized())),
                                           place_world + static_cast<double>(frame) *
                                                             Eigen::Vector3d(3.0, -2.0, 1.5)},
                       .velocity_world_mps = {25.0, -18.0, 9.0},
                       .acceleration_world_mps2 = {-12.0, 6.0, 3.0},
                       .angular_velocity_body_radps = {0.8, -0.6, 2.5},
                       .terms = lively_terms()});
    thing.gone_m.push_back(0.0);
  }
  return thing;
}

/// A body's pose so much after a frame's time.
struct BoxPose {
  Eigen::Matrix3d world_from_box;
  Eigen::Vector3d place_world;

  BoxPose(const geo::BodyState& state, double t) {
    const BodyThen body(state, t);
    world_from_box = body.rotation;
    place_world = body.place;
  }
  Eigen::Vector3d box_from_world(const Eigen::Vector3d& point) const {
    return world_from_box.transpose() * (point - place_world);
  }
  Eigen::Vector3d world_from(const Eigen::Vector3d& point_box) const {
    return place_world + world_from_box * point_box;
  }
};

/// Where a ray comes into a box, by its slabs, and through which side; nothing where it passes.
struct BoxHit {
  double t;
  Eigen::Vector3d normal_world;
};
inline std::optional<BoxHit> meet_box(const BoxPose& pose, const Eigen::Vector3d& half_m,
                                      const Eigen::Vector3d& origin,
                                      const Eigen::Vector3d& direction) {
  const Eigen::Vector3d o = pose.box_from_world(origin);
  const Eigen::Vector3d d = pose.world_from_box.transpose() * direction;
  double in = -1e300, out = 1e300;
  int side = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double a = (-half_m[axis] - o[axis]) / d[axis], b = (half_m[axis] - o[axis]) / d[axis];
    if (std::min(a, b) > in) side = axis;
    in = std::max(in, std::min(a, b));
    out = std::min(out, std::max(a, b));
  }
  if (!(in < out) || in <= 0.0) return std::nullopt;
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  normal[side] = d[side] > 0.0 ? -1.0 : 1.0;
  return BoxHit{in, pose.world_from_box * normal};
}

/// The plane and both boxes, at a frame.
struct Truth {
  enum What { kNothing = -2, kPlane = -1, kBox = 0, kBar = 1 };
  struct Hit {
    double t = 1e300;
    int what = kNothing;
    Eigen::Vector3d normal_world = Eigen::Vector3d::UnitZ();
  };
  std::vector<std::optional<geo::BodyState>> states;

  Hit meet(double time_s, const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
           double grown_m = 0.0) const {
    Hit hit;
    const double t = (kPlane_z - origin.z()) / direction.z();
    if (t > 0.0) hit = {t, kPlane, Eigen::Vector3d::UnitZ()};
    for (const int what : {kBox, kBar}) {
      const Eigen::Vector3d half =
          (what == kBox ? kHalf_m : kPartHalf_m) + Eigen::Vector3d::Constant(grown_m);
      const auto met = meet_box(BoxPose(*states[static_cast<std::size_t>(what)], time_s), half,
                                origin, direction);
      if (met && met->t < hit.t) hit = {met->t, what, met->normal_world};
    }
    return hit;
  }
};

}  // namespace terracast::test
