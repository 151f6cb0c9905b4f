#pragma once

namespace terracast::tiler {

/// The stature for which people are drawn; others are scaled.
inline constexpr double kDrawnStature_m = 1.75;
/// From the foot to the hip and to the shoulder of a stature of 1 m.
inline constexpr double kHipHeight = 0.88 / kDrawnStature_m;
inline constexpr double kShoulderHeight = 1.40 / kDrawnStature_m;
/// Of a stature, from the heel behind to the toes in front in the longest step.
inline constexpr double kStepReach = 0.57;

/// Freely chosen walking speed: 1.34 m/s, of adults (Weidmann, Transporttechnik der Fussgänger, 1993); of
/// other statures at the same Froude number.
double usual_walk_mps(double stature_m);

/// From one foot's place on the ground to the next one's. The ratio of step length and cadence, the walk ratio, is the
/// same over the usual speeds (Sekiya and Nagasaki, Gait & Posture 7, 1998): 0.0065 m of a step a minute of adults. Of
/// other statures it goes with the power of 1.5 of these, as of similar pendulums.
/// Faster than 1.96 m/s (of 1.75 m) steps stay as long and become more.
double step_length_m(double stature_m, double speed_mps);
double longest_step_m(double stature_m);

/// How far straight legs swing to both sides of the vertical for feet to stay in place below the body in steps of a
/// length, and arms with them; rad.
double leg_swing_rad(double stature_m, double step_m);
double arm_swing_rad(double stature_m, double step_m);

}  // namespace terracast::tiler
