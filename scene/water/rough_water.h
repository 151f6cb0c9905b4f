#pragma once

namespace terracast::scene {

/// Facets of rough water as an eye sees them: of slopes that are normally distributed each counts by the
/// area that it shows (Ross, Dion and Potvin 2005, without their shadows). A slope toward the eye is
/// above 0. It shows nothing from -cotangent on, where cotangent is that of the angle between the eye's
/// direction and the mean normal: cosine over sine.

/// Share of what is seen that slopes less than this.
/// deviation   root mean square of slopes along the direction to the eye, above 0
double seen_slopes_below(double slope, double deviation, double cotangent);

/// The slope below which lies a share of what is seen: numbers spread evenly over [0, 1] give the facets
/// that an eye sees, each as often as it sees them.
/// accuracy   5e-4 deviations within 4 of them, beyond which nothing is drawn
/// threads    safe
double seen_slope(double share, double deviation, double cotangent);

}  // namespace terracast::scene
