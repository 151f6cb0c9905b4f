#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "geo/geodesy.h"
#include "scene/ground/sample_width.h"
#include "scene/light/sky.h"
#include "world/box_tree.h"
#include "world/tile_store.h"
#include "world/volume.h"
#include "world/volume_info.h"

namespace terracast::scene {

/// The volumes of a world: clouds, fog, smoke. They change colour alone; rays of ground truth go through
/// them as through air.
///
/// Light is lost by Beer and Lambert's law along fixed steps of a voxel (longer where a sample is wider),
/// moved along the ray by the sample's own jitter. What comes in is the sun's light, weakened by what of the
/// same volume lies toward it, scattered by Henyey and Greenstein's phase function; orders of scattering
/// above the first as Wrenninge, Kulla and Lundqvist (2013) sum them up: the n-th octave weaker by
/// 0.8^n, through 0.5^n of the optical depth, about 0.5^n of the mean cosine. To this comes the light of the sky
/// and the ground, weakened as two streams are by what lies straight above and below (Bohren 1987). Where two
/// volumes lie in each other the one whose box a ray comes to first counts as being in front.
///
/// threads   safe
class Clouds {
 public:
  /// None.
  Clouds() = default;
  /// throws   Input: a damaged volume; Io
  Clouds(const world::TileStore& store, const Eigen::Vector3d& sun_direction_world);
  Clouds(std::vector<world::Volume> volumes, const std::vector<world::VolumePlace>& places,
         const geo::WorldFrame& frame, const Eigen::Vector3d& sun_direction_world);
  ~Clouds();
  Clouds(Clouds&&) noexcept;
  Clouds& operator=(Clouds&&) noexcept;

  bool is_empty() const { return placed_.empty(); }

  /// Optical depth along a ray.
  /// direction_world   unit
  /// steps_per_voxel   how finely it is marched through
  /// jitter            of the first step, 0 … 1
  double optical_depth(const Eigen::Vector3d& origin_world, const Eigen::Vector3d& direction_world,
                       double until_m, double steps_per_voxel = 1.0, double jitter = 0.5) const;

  /// Share of the sun's light that comes to a place through all volumes, without what they scatter: by optical depths
  /// kept on every third voxel in steps of 1/64. Of a ball 60 voxels across, of 0.02 each, the depth is within 0.051.
  double sun_transmittance(const Eigen::Vector3d& point_world) const;

  /// What lies before a distance.
  struct Seen {
    float transmittance = 1.0f;
    Color radiance = Color::Zero();  ///< that comes from the volumes, without the air before them
    double distance_m = 0.0;         ///< of what is seen of them, on the average
  };
  /// direction_world   unit
  /// until_m           to what lies behind; +inf: the sky
  /// sample_width      by the distance from the origin
  Seen look(const Eigen::Vector3d& origin_world, const Eigen::Vector3d& direction_world,
            double until_m, const SampleWidth& sample_width, double jitter, const Sky& sky) const;

 private:
  struct Blocks;
  struct Columns;
  struct Placed;
  struct Interval {
    double from_m;
    double until_m;
    std::size_t placed;
  };
  void place(const std::vector<world::VolumePlace>& places, const geo::WorldFrame& frame);
  void intervals(const Eigen::Vector3d& origin_world, const Eigen::Vector3d& direction_world,
                 double until_m, std::vector<Interval>& found) const;

  Eigen::Vector3d sun_world_ = Eigen::Vector3d::UnitZ();
  std::vector<world::Volume> volumes_;
  std::vector<std::unique_ptr<Blocks>> blocks_;  ///< of volumes
  std::vector<std::unique_ptr<Columns>> columns_;
  std::vector<std::unique_ptr<Placed>> placed_;  ///< by leaf of the tree
  world::BoxTree tree_;
};

}  // namespace terracast::scene
