#pragma once

#include <Eigen/Core>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "geo/geodesy.h"
#include "scene/conditions.h"
#include "scene/ground/ground.h"
#include "scene/ground/ground_imagery.h"
#include "scene/light/sky.h"
#include "scene/media/medium.h"
#include "scene/moving/moving_bodies.h"
#include "scene/objects/texture_library.h"
#include "world/ray_query.h"
#include "world/tile_store.h"
#include "world/timed_query.h"

namespace terracast::scene {

class SceneAt;

struct SceneOptions {
  world::RayQueryOptions tracing;
  ConditionOptions conditions;
  std::string utc_start;                                     ///< UTC of time 0
  Eigen::Vector3d position_world = Eigen::Vector3d::Zero();  ///< for which the sun's position holds
  /// A viewer at time 0: whether water covers it decides what all viewers see.
  Eigen::Vector3d viewer_world = Eigen::Vector3d::Zero();
  std::vector<double> times_s = {};  ///< at which the states of what moves are given, ascending
};

/// A world at any time: terrain, objects, water, moving bodies, and, made when light is first sought, their looks, the
/// light and the media. It knows no camera, no frame and no file but the world's.
///
/// threads   safe
class Scene {
 public:
  /// The store must outlive it.
  /// moving   with a state at each of options.times_s
  /// throws   Input: as MovingBodies and RayQuery; Io
  Scene(const world::TileStore& store, std::vector<world::CutTile> cut,
        std::span<const MovingThing> moving, const SceneOptions& options);
  /// Of bodies whose states are known, as a capture's are.
  /// moving   must outlive it
  Scene(const world::TileStore& store, std::vector<world::CutTile> cut, const MovingBodies& moving,
        const SceneOptions& options);
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;
  ~Scene();

  const world::TileStore& store() const { return store_; }
  const geo::WorldFrame& frame() const { return frame_; }
  /// With its water.
  const world::RayQuery& whole() const { return whole_; }
  /// Without its water, for what is seen in it; null where there is no water.
  const world::RayQuery* bed() const { return bed_ ? &*bed_ : nullptr; }
  bool is_in_water() const { return is_in_water_; }
  /// The query that viewers' rays go to: the whole world, or its bed for viewers in water.
  const world::RayQuery& viewed() const { return is_in_water_ ? *bed_ : whole_; }
  const MovingBodies& moving() const { return moving_; }
  const ConditionOptions& conditions() const { return options_.conditions; }
  /// UTC of time 0, as geo::unix_seconds_from_utc() takes it.
  const std::string& utc_start() const { return options_.utc_start; }

  // Made when first asked for.
  /// The light of the sequence's place and time 0, and the air.
  const Daylight& daylight() const;
  const Ground& ground() const;
  const GroundImagery& imagery() const;
  const TextureLibrary& textures() const;
  const Sky& sky() const;
  /// The air first.
  std::span<const std::unique_ptr<Medium>> media() const;

  /// The scene about a time.
  /// reach_s   rays are cast no earlier or later than this
  SceneAt at(double time_s, double reach_s = 0.0) const;

 private:
  friend class SceneAt;
  struct Looks;
  const Looks& looks() const;
  void open_bed();

  const world::TileStore& store_;
  geo::WorldFrame frame_;
  SceneOptions options_;
  world::RayQuery whole_;
  std::optional<world::RayQuery> bed_;
  bool is_in_water_ = false;
  std::optional<MovingBodies> own_moving_;
  const MovingBodies& moving_;
  mutable std::once_flag daylight_once_, ground_once_, sky_once_, looks_once_;
  mutable std::optional<Daylight> daylight_;
  mutable std::optional<Ground> ground_;
  mutable std::optional<Sky> sky_;
  mutable std::unique_ptr<Looks> looks_;
};

/// A scene about one time: rays have times of their own, counted from it. Threads: safe.
class SceneAt {
 public:
  /// The scene must outlive it.
  SceneAt(const Scene& scene, double time_s, double reach_s);
  SceneAt(const SceneAt&) = delete;
  SceneAt& operator=(const SceneAt&) = delete;

  const Scene& scene() const { return scene_; }
  /// What rays hit: the world as viewers see it, and what moves in it.
  /// offsets_s   the rays' times; empty: all are cast at the scene's
  void trace(std::span<const world::WorldRay> rays, std::span<const double> offsets_s,
             std::span<world::SurfaceHit> hits, world::Coherence coherence,
             std::span<world::SurfaceSample> surfaces = {}, world::RayTrail* trail = nullptr,
             world::SurfaceNeed need = world::SurfaceNeed::Look) const;

  // The queries themselves; `shift_s` is to be added to the offsets of their rays.
  const world::TimedQuery& whole() const { return whole_; }
  const world::TimedQuery& bed() const { return bed_; }
  const world::TimedQuery& viewed() const { return viewed_; }
  double shift_s() const { return shift_s_; }

 private:
  const Scene& scene_;
  double shift_s_;
  world::MovingScene moving_;
  world::TimedQuery whole_;
  world::TimedQuery bed_;
  world::TimedQuery viewed_;
};

}  // namespace terracast::scene
