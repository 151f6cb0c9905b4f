// Packets of rays against the objects of a tile.

#include <algorithm>
#include <array>
#include <limits>
#include <optional>

#include "world/lane_vectors.h"
#include "world/object_scene.h"

namespace terracast::world {
namespace {

constexpr int kGroup = RayLanes::kLanes;

/// Solids by the triangles' numbers in the mesh of all, instances behind them.
constexpr int kShownShift = 32;
std::uint64_t key_of_instance(std::uint32_t object) {
  return (std::uint64_t{object} + 1) << kShownShift;
}

/// Where an instance's shape stands, for the rays of a packet.
struct Turn {
  const float* shape_from_world;
  double place[3];
  float center[3];
  float margin_m;
};

/// Eight lanes, from `first` on, of the rays of a tile's tree of instances, as the tree of an instance's
/// shape sees them from near_m along the tile's ray on.
template <int kLanes>
TERRACAST_PACKET_INLINE void turn_group(const Turn& turn, const RayLanes& rays,
                                        const RayPacket<kLanes>& tile_rays, const float* near_m,
                                        int first, RayPacket<kLanes>& shape_rays) {
  using Floats = typename LaneVectors<kGroup>::Floats;
  using Doubles = typename LaneVectors<kGroup>::Doubles;
  constexpr float kLeastDirection = 0x1.0p-60F;
  constexpr float kRounding = 1.0F + 0x1.0p-20F;
  const double* ray_origin[3] = {rays.origin_x, rays.origin_y, rays.origin_z};
  const double* ray_direction[3] = {rays.direction_x, rays.direction_y, rays.direction_z};
  const float* unit[3] = {rays.unit_x, rays.unit_y, rays.unit_z};
  Floats near, reach;
  std::memcpy(&near, near_m + first, sizeof near);
  std::memcpy(&reach, tile_rays.reach_m + first, sizeof reach);
  const Floats none = {};
  const Floats way = near <= reach ? near : none;
  Doubles t_origin, inverse_length;
  std::memcpy(&t_origin, tile_rays.t_origin + first, sizeof t_origin);
  std::memcpy(&inverse_length, rays.inverse_length, sizeof inverse_length);
  const Doubles t = t_origin + __builtin_convertvector(way, Doubles) * inverse_length;
  std::memcpy(shape_rays.t_origin + first, &t, sizeof t);
  std::copy_n(rays.length_m, kGroup, shape_rays.length_m + first);
  Floats start[3], along[3];
  for (int axis = 0; axis < 3; ++axis) {
    Doubles from, rate;
    std::memcpy(&from, ray_origin[axis], sizeof from);
    std::memcpy(&rate, ray_direction[axis], sizeof rate);
    std::memcpy(&along[axis], unit[axis], sizeof along[axis]);
    start[axis] = __builtin_convertvector((from - turn.place[axis]) + t * rate, Floats);
  }
  for (int axis = 0; axis < 3; ++axis) {
    const float* row = turn.shape_from_world + 3 * axis;
    const Floats origin =
        row[0] * start[0] + row[1] * start[1] + row[2] * start[2] - turn.center[axis];
    const Floats direction = row[0] * along[0] + row[1] * along[1] + row[2] * along[2];
    const Floats size = direction < 0.0F ? -direction : direction;
    const Floats least = none + kLeastDirection;
    const Floats safe = size >= least ? direction : least;
    const Floats inverse = 1.0F / safe;
    std::memcpy(shape_rays.origin[axis] + first, &origin, sizeof origin);
    std::memcpy(shape_rays.direction[axis] + first, &direction, sizeof direction);
    std::memcpy(shape_rays.inverse[axis] + first, &inverse, sizeof inverse);
  }
  const Floats left = (reach - way) * kRounding + turn.margin_m;
  const Floats done = none + RayPacket<kLanes>::kDone;
  const Floats shape_reach = near <= reach ? left : done;
  std::memcpy(shape_rays.reach_m + first, &shape_reach, sizeof shape_reach);
}

TERRACAST_PACKET_CODE
void turn_rays(const Turn& turn, const RayGroups<8>& rays, const RayPacket<8>& tile_rays,
               const float* near_m, RayPacket<8>& shape_rays) {
  turn_group(turn, *rays[0], tile_rays, near_m, 0, shape_rays);
}
TERRACAST_PACKET_CODE
void turn_rays(const Turn& turn, const RayGroups<16>& rays, const RayPacket<16>& tile_rays,
               const float* near_m, RayPacket<16>& shape_rays) {
  turn_group(turn, *rays[0], tile_rays, near_m, 0, shape_rays);
  turn_group(turn, *rays[1], tile_rays, near_m, kGroup, shape_rays);
}

}  // namespace

/// The rays of one packet.
template <int kLanes>
class ObjectScene::Cast {
 public:
  Cast(const ObjectScene& scene, const RayGroups<kLanes>& rays, bool is_any)
      : scene_(scene), rays_(rays), is_any_(is_any) {}

  LaneMask meet(LaneMask lanes, const double* t_until,
                std::array<ObjectMeeting, kLanes>& meetings) {
    for_each_lane(lanes, [&](int lane) {
      first_[static_cast<std::size_t>(lane)] = {.t_from = group(lane).t_entry[lane % kGroup],
                                                .t = t_until[lane]};
    });
    RayPacket<kLanes> packet;
    if (!scene_.solid_mesh_.tree().is_empty() &&
        scene_.solid_mesh_.tree().enter(rays_, lanes, t_until, packet))
      cross_solids(packet);
    alignas(64) double t_left[kLanes];
    std::copy_n(t_until, kLanes, t_left);
    LaneMask left = lanes;
    for_each_lane(lanes, [&](int lane) {
      const FirstCrossing& first = first_[static_cast<std::size_t>(lane)];
      t_left[lane] = first.t;
      if (is_any_ && first.is_found) left &= ~lane_bit(lane);
    });
    if (!scene_.instance_tree_->is_empty() &&
        scene_.instance_tree_->enter(rays_, left, t_left, packet))
      cross_instances(packet);
    LaneMask met = 0;
    for_each_lane(lanes, [&](int lane) {
      if (!first_[static_cast<std::size_t>(lane)].is_found) return;
      met |= lane_bit(lane);
      meetings[static_cast<std::size_t>(lane)] = meeting(lane);
    });
    return met;
  }

 private:
  const RayLanes& group(int lane) const { return *rays_[static_cast<std::size_t>(lane / kGroup)]; }
  WorldRay world_ray(int lane) const { return group(lane).world_ray(lane % kGroup); }
  double length_m(int lane) const { return group(lane).length_m[lane % kGroup]; }

  /// The exact ray of a lane, made once for each mesh.
  template <class Make>
  const MeshRay& exact_ray(int lane, const Make& make) {
    std::optional<MeshRay>& exact = exact_[static_cast<std::size_t>(lane)];
    if ((is_made_ & lane_bit(lane)) == 0) {
      exact.emplace(make());
      is_made_ |= lane_bit(lane);
    }
    return *exact;
  }

  void cross_solids(RayPacket<kLanes>& packet) {
    is_made_ = 0;
    scene_.solid_mesh_.cross(
        packet,
        [&](int lane) -> const MeshRay& {
          return exact_ray(lane, [&] {
            const WorldRay ray = world_ray(lane);
            return MeshRay(ray.origin_world, ray.direction_world, length_m(lane), ray.t_min);
          });
        },
        0, is_any_, first_);
  }

  void cross_instances(RayPacket<kLanes>& tile_rays) {
    RayPacket<kLanes> shape_rays;
    scene_.instance_tree_->traverse(
        tile_rays,
        [&](std::uint32_t leaf, const float* near_m) {
          cross_instance(leaf, near_m, tile_rays, shape_rays);
        },
        [&](int lane, std::uint32_t leaf, float near_m, BoxTree::Ray& ray) {
          alignas(64) float only_m[kLanes];
          std::fill_n(only_m, kLanes, std::numeric_limits<float>::infinity());
          only_m[lane] = near_m;
          cross_instance(leaf, only_m, tile_rays, shape_rays);
          ray.reach_m = tile_rays.reach_m[lane];
          return ray.reach_m < 0.0F;
        });
  }

  void cross_instance(std::uint32_t leaf, const float* near_m, RayPacket<kLanes>& tile_rays,
                      RayPacket<kLanes>& shape_rays) {
    const Placed& placed = scene_.placed_[leaf];
    const TriangleMesh& mesh = placed.shown->mesh;
    const BoxTree& tree = mesh.tree();
    Turn turn{.shape_from_world = placed.shape_from_world,
              .place = {},
              .center = {},
              .margin_m = static_cast<float>(tree.margin_m()) * placed.scale};
    for (int axis = 0; axis < 3; ++axis) {
      turn.place[axis] = placed.place_steps[axis] * kHeightStep_m;
      turn.center[axis] = static_cast<float>(tree.center()[axis]);
    }
    turn_rays(turn, rays_, tile_rays, near_m, shape_rays);
    shape_rays.margin_m = static_cast<double>(turn.margin_m);
    shape_rays.direction_length = 1.0F / placed.scale;
    make_ready(shape_rays);
    is_made_ = 0;
    const std::uint64_t key = key_of_instance(placed.object);
    LaneMask found = 0;
    mesh.cross(
        shape_rays,
        [&](int lane) -> const MeshRay& {
          found |= lane_bit(lane);
          return exact_ray(
              lane, [&] { return scene_.ray_to_instance(world_ray(lane), length_m(lane), leaf); });
        },
        key, is_any_, first_);
    for_each_lane(found, [&](int lane) {
      const FirstCrossing& first = first_[static_cast<std::size_t>(lane)];
      if (!first.is_found || first.key >> kShownShift != key >> kShownShift) return;
      met_instance_[static_cast<std::size_t>(lane)] = leaf;
      if (is_any_)
        tile_rays.end(lane);
      else
        tile_rays.end_at(lane, first.t);
    });
  }

  ObjectMeeting meeting(int lane) const {
    const FirstCrossing& first = first_[static_cast<std::size_t>(lane)];
    const auto number = static_cast<std::uint32_t>(first.key);
    if (first.key >> kShownShift != 0) {
      const std::uint32_t shown = met_instance_[static_cast<std::size_t>(lane)];
      return {
          .t = first.t, .object = scene_.placed_[shown].object, .triangle = number, .shown = shown};
    }
    const std::span<const ShownSolid> solids = scene_.solids_;
    const auto solid = std::upper_bound(solids.begin(), solids.end(), number,
                                        [](std::uint32_t triangle, const ShownSolid& one) {
                                          return triangle < one.first_triangle;
                                        }) -
                       1;
    return {.t = first.t,
            .object = solid->object,
            .triangle = number - solid->first_triangle,
            .shown = static_cast<std::uint32_t>(solid - solids.begin())};
  }

  const ObjectScene& scene_;
  const RayGroups<kLanes>& rays_;
  const bool is_any_;
  std::array<FirstCrossing, kLanes> first_;
  std::array<std::uint32_t, kLanes> met_instance_;  ///< of the lanes that have met one
  std::array<std::optional<MeshRay>, kLanes> exact_;
  LaneMask is_made_ = 0;
};

template <int kLanes>
LaneMask ObjectScene::meet(const RayGroups<kLanes>& rays, LaneMask lanes, const double* t_until,
                           bool is_any, std::array<ObjectMeeting, kLanes>& meetings) const {
  return Cast<kLanes>(*this, rays, is_any).meet(lanes, t_until, meetings);
}
template LaneMask ObjectScene::meet<8>(const RayGroups<8>&, LaneMask, const double*, bool,
                                       std::array<ObjectMeeting, 8>&) const;
template LaneMask ObjectScene::meet<16>(const RayGroups<16>&, LaneMask, const double*, bool,
                                        std::array<ObjectMeeting, 16>&) const;

}  // namespace terracast::world
