#pragma once

#include <Eigen/Core>
#include <span>
#include <string>
#include <vector>

#include "core/schema.h"
#include "sensors/lidar/pattern.h"

/// The width of a beam, and what comes back of it.
namespace terracast::sensors::lidar {

/// A ray that stands for a part of a beam.
struct BeamRay {
  Eigen::Vector2d offset;  ///< left and up of the axis, in halves of the divergence
  double weight = 1.0;     ///< share of the beam's power
};

/// Rays whose sums are the means over a Gaussian beam's power, all of it, of what varies over the beam as a polynomial:
/// rings of 6, 12, 18 about one on the axis.
/// num_rays   1, 7, 19 or 37
/// accuracy   exact for polynomials of degree 5, and for those of the distance from the axis of degree 4, 8 and 12;
///            LidarBeam.RaysHaveTheMomentsOfAGaussian. At an edge, averaged over turns of 37 rays: an eighth of the power
std::span<const BeamRay> beam_rays(int num_rays);

struct BeamOptions {
  std::int64_t rays = 1;
  double divergence_mrad = 0.0;
  double divergence_vertical_mrad = 0.0;
  std::string divergence_at = "1/e2";

  void describe(core::SchemaVisitor& visit);
  void validate() const;

  /// Directions of a pulse's rays, unit.
  /// turn_rad   by which all are turned about the axis, before the beam is drawn out to its divergences
  void directions(const Pulse& pulse, double turn_rad, std::vector<Eigen::Vector3d>& into) const;
};

/// The echo of one ray.
struct Echo {
  double range_m = 0.0;
  double power = 0.0;
  std::size_t ray = 0;
};

/// Echoes that a receiver cannot separate.
struct Return {
  double range_m = 0.0;   ///< mean by power
  double spread_m = 0.0;  ///< standard deviation by power
  double power = 0.0;     ///< sum
  std::size_t ray = 0;    ///< the one that brought the most
};

/// Separates echoes into returns: where the gap between neighbours is larger than that.
/// echoes    in any order; they are put into that of their ranges
/// returns   in the order of range
void separate_returns(std::vector<Echo>& echoes, double gap_m, std::vector<Return>& returns);

}  // namespace terracast::sensors::lidar
