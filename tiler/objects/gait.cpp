#include "tiler/objects/gait.h"

#include <algorithm>
#include <cmath>

namespace terracast::tiler {
namespace {

constexpr double kUsualWalk_mps = 1.34;
/// m of a step at one step a minute.
constexpr double kWalkRatio = 0.0065;
/// Of a stature.
constexpr double kLongestStep = 0.5;
/// Of a step over the height of the hip. 0.447 would hold a foot in place while its leg is upright; a little more makes
/// up for where the leg is slower, towards the ends of its swing.
constexpr double kSwingOfStep = 0.455;
/// Hands go less far than feet.
constexpr double kArmShare = 0.75;

}  // namespace

double usual_walk_mps(double stature_m) {
  return kUsualWalk_mps * std::sqrt(stature_m / kDrawnStature_m);
}

double longest_step_m(double stature_m) { return kLongestStep * stature_m; }

double step_length_m(double stature_m, double speed_mps) {
  const double walk_ratio = kWalkRatio * std::pow(stature_m / kDrawnStature_m, 1.5);
  return std::min(std::sqrt(walk_ratio * 60.0 * speed_mps), longest_step_m(stature_m));
}

double leg_swing_rad(double stature_m, double step_m) {
  return kSwingOfStep * step_m / (kHipHeight * stature_m);
}

double arm_swing_rad(double stature_m, double step_m) {
  return kArmShare * leg_swing_rad(stature_m, step_m);
}

}  // namespace terracast::tiler
