#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "geo/geodesy.h"
#include "world/instance_frame.h"
#include "world/prototype_library.h"
#include "world/tile_objects.h"
#include "world/triangle_mesh.h"
#include "world/world_ray.h"

namespace terracast::world {

/// What the objects of all tiles of a cut go by.
struct ObjectRules {
  const PrototypeLibrary& prototypes;
  const geo::WorldFrame& frame;
  /// The level of the cut's tile that holds a place of the world: it says how finely the object whose
  /// place it is is shown, in all tiles. Nothing: the place is in none, and the object not shown.
  std::function<std::optional<int>(double x_world, double y_world)> level_at;
};

/// What a ray meets of a tile's objects.
struct ObjectMeeting {
  double t;
  std::uint32_t object;    ///< of the tile's solids, then its instances
  std::uint32_t triangle;  ///< of the shape shown
  std::uint32_t shown;     ///< for ObjectScene::surface()
};

/// How the place of a meeting looks.
struct ObjectSurface {
  const Provenance* provenance;
  const Finish* finish;
  Eigen::Vector2f uv;
  float uv_per_m;  ///< Textured: lengths of uv in a metre of the surface, 0 without uv
  std::uint8_t variety;
  Eigen::Vector3f from_place_m;  ///< as SurfaceSample
  float reach_m;
  float height_m;
  double crossing_error;  ///< of the meeting's t (crossing_error.h)
};

/// The objects that one tile shows: its solids' triangles under one tree of boxes, its instances under
/// another, whose rays go on in the prototype's frame under the prototype's own, shared by all tiles.
/// The trees are floats and propose; cross_triangle() decides in double, on corners that are exact and
/// a ray that is the world's own, or has been moved into the prototype's frame in double. So what a ray
/// meets, and its t to the last bit, depends on the ray and the objects alone, not on the tile in which
/// they are met nor on what else is in it. Immutable; threads: safe.
class ObjectScene {
  struct Lists;

 public:
  /// Keeps of the objects what the tile shows within its square.
  /// objects   its solids' shapes are moved out of it
  /// where     for messages
  /// throws    Input: an instance of a prototype that is not there; corners out of the world; an
  ///           object that is higher than the tile says
  ObjectScene(const TileId& id, TileObjects& objects, double top_z_world, const ObjectRules& rules,
              const std::string& where);

  /// What the scene is made from again: all but the corners in its trees, which the scene shares with it.
  class Packed {
   public:
    std::size_t num_bytes() const;

   private:
    friend class ObjectScene;
    std::shared_ptr<const Lists> lists_;
    TriangleMesh::Packed solid_mesh_;
  };
  Packed packed() const;
  explicit ObjectScene(const Packed& packed);

  /// The first meetings with t from where the rays come into the tile to t_until, without it; by the
  /// smaller object and triangle where several are at one t. A ray that starts (at its t_min) on a
  /// triangle's plane, within kOnSurface_m, is not stopped by it.
  /// lanes      that are asked, group after group
  /// is_any     one meeting of each ray is enough, whichever
  /// meetings   set for the lanes returned, which meet something
  template <int kLanes>
  LaneMask meet(const RayGroups<kLanes>& rays, LaneMask lanes, const double* t_until, bool is_any,
                std::array<ObjectMeeting, kLanes>& meetings) const;

  /// Of the triangle that a ray meets: unit, on the side from which the ray comes.
  Eigen::Vector3d normal_world(const WorldRay& ray, const ObjectMeeting& meeting) const;

  /// How it looks where a ray meets a triangle.
  /// has_error   whether crossing_error is asked for; else it is 0
  ObjectSurface surface(const WorldRay& ray, const ObjectMeeting& meeting, bool has_error) const;
  /// What it belongs to.
  const Provenance& provenance(const ObjectMeeting& meeting) const {
    return meeting.object < num_solids_ ? solids_[meeting.shown].provenance
                                        : instances_[meeting.shown].provenance;
  }

  bool is_empty() const { return solid_mesh_.bounds().isEmpty() && instance_tree_->is_empty(); }
  std::size_t num_bytes() const { return num_bytes_; }

 private:
  struct ShownSolid {
    Provenance provenance;
    Eigen::Vector3i origin_steps;
    std::uint32_t object;
    std::uint32_t first_triangle;  ///< number of its first one among those of all
    Shape shape;
  };
  /// Where an instance stands, for rays that come near it: a cache line.
  struct alignas(64) Placed {
    float shape_from_world[9];  ///< row by row; of directions
    float scale;
    Eigen::Vector3i place_steps;
    std::uint32_t object;
    const PrototypeLibrary::Shown* shown;
  };
  static_assert(sizeof(Placed) == 64);
  /// What else is known of it, for rays that come near its triangles.
  struct ShownInstance {
    Eigen::Quaterniond world_from_prototype;
    Provenance provenance;
    std::uint16_t scale;  ///< Instance::scale
    std::uint8_t variety;
  };

  /// Exactly as a ray meets an instance's triangles.
  MeshRay ray_to_instance(const WorldRay& ray, double length_m, std::uint32_t shown) const;

  template <int kLanes>
  class Cast;

  /// What stays as it is when a scene is packed.
  struct Lists {
    std::vector<ShownSolid> solids;        ///< sorted by object
    std::uint32_t num_solids = 0;          ///< of the tile, shown or not
    std::vector<Placed> placed;            ///< instances, by leaf of the tree
    std::vector<ShownInstance> instances;  ///< of placed
    BoxTree instance_tree;
    std::size_t num_bytes = 0;  ///< set when all is there

    /// returns   the solids' triangles
    std::vector<TriangleMesh::Triangle> add_solids(std::vector<Solid>& tile_solids,
                                                   const geo::Box3d& clip, double top_z_world,
                                                   const ObjectRules& rules,
                                                   const std::string& where);
    void add_instances(const TileObjects& objects, const geo::Box3d& clip, double top_z_world,
                       const ObjectRules& rules, const std::string& where);
    void count_bytes();
  };

  void take_lists(std::shared_ptr<const Lists> lists);

  std::shared_ptr<const Lists> lists_;
  TriangleMesh solid_mesh_;
  // Of lists_, for rays.
  std::uint32_t num_solids_ = 0;
  std::span<const ShownSolid> solids_;
  std::span<const Placed> placed_;
  std::span<const ShownInstance> instances_;
  const BoxTree* instance_tree_ = nullptr;
  std::size_t num_bytes_ = 0;
};

}  // namespace terracast::world
