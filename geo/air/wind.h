#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/schema.h"
#include "geo/air/turbulence.h"

/// Wind that a body meets on its way through the air, by MIL-F-8785C: a mean wind by height, gusts, and turbulence that is
/// frozen in the air. It is a function of places and of ways through the air, never of time.
namespace terracast::geo {

/// Air that gets faster over a length, as (1 - cos), and stays so.
struct GustOptions {
  double start_m = 0.0;     ///< of the way through the air, from time 0 on
  double length_m = 100.0;  ///< until it is full
  double along_mps = 0.0;   ///< where the mean wind blows to
  double left_mps = 0.0;    ///< of that, seen from above
  double up_mps = 0.0;

  void describe(core::SchemaVisitor& visit);
};

struct WindOptions {
  double speed_mps = 0.0;  ///< 20 ft (6.1 m) above the ground
  double from_deg = 0.0;   ///< clockwise from north
  std::string profile = "shear";
  double roughness_m = 0.6096;
  std::string turbulence = "none";
  double turbulence_speed_mps = 0.0;  ///< 0: speed_mps
  std::int64_t seed = 0;
  std::vector<GustOptions> gusts = {};

  void describe(core::SchemaVisitor& visit);
  /// throws Config: speeds of another unit; turbulence or gusts without what they need
  void validate() const;
  bool is_calm() const { return speed_mps == 0.0 && turbulence == "none" && gusts.empty(); }
};

/// Lengths of the scales of turbulence and its strengths at a height above the ground.
struct TurbulenceScale {
  double level_m, vertical_m;
  double level_mps, vertical_mps;
};
/// agl_m       above the ground; below 3.048 m (10 ft) as there
/// speed_mps   of the mean wind 20 ft above the ground
/// source      MIL-F-8785C, sections 3.7.3.2 to 3.7.3.4: up to 1000 ft by height, from 2000 ft on lengths of 1750 ft (Dryden) or
///             2500 ft (von Karman), in between linear. Above 1000 ft the strength stays what it is there: the
///             standard's own depends on a probability.
TurbulenceScale turbulence_scale(TurbulenceModel model, double agl_m, double speed_mps);

/// How far a body has come through the air, in m and in lengths of the turbulence, which differ by height.
struct AirWay {
  double distance_m = 0.0, level_lengths = 0.0, vertical_lengths = 0.0;
};

/// Threads: safe.
class WindField {
 public:
  /// A place in the air.
  struct Place {
    Eigen::Matrix3d world_from_enu;
    double agl_m;
  };

  /// most_distance_m   of the way through the air; its turbulence is drawn so far
  /// least_agl_m       the lowest height of that
  /// throws   Input: turbulence that is too fine for the way (UnitTurbulence)
  WindField(const WindOptions& options, double most_distance_m, double least_agl_m);

  /// Mean wind along the world's axes: speed_mps at 20 ft, with shear a logarithm of the height, of 3 to 1000 ft.
  Eigen::Vector3d mean_mps(const Place& place) const;
  /// With gusts and turbulence.
  /// throws   Input: more lengths of turbulence than were drawn: farther through the air than most_distance_m, or long
  ///          below least_agl_m, where lengths are shorter
  Eigen::Vector3d at(const Place& place, const AirWay& way) const;
  /// Derivative of the way by time.
  /// speed_mps   at which the body goes through the mean wind
  AirWay way_rate(double agl_m, double speed_mps) const;

 private:
  struct Turbulence {
    TurbulenceModel model;
    std::array<UnitTurbulence, 3> components;  ///< along the wind, left of it, up
  };

  WindOptions options_;
  Eigen::Matrix3d enu_from_wind_;  ///< downwind, left, up
  double turbulence_speed_mps_;
  std::optional<Turbulence> turbulence_;
};

}  // namespace terracast::geo
