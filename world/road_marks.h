#pragma once

namespace terracast::world {

// What is painted along roads: Richtlinien für die Markierung von Straßen (RMS-1, 1993). Narrow lines are 0.12 m wide,
// 0.15 m on motorways, where broad ones are 0.30 m.
inline constexpr double kLine_m = 0.12;
inline constexpr double kMotorwayLine_m = 0.15;
inline constexpr double kMotorwayBroadLine_m = 0.30;
/// Between an edge line and the end of the paving (edge strips of RAL 2012 and RAA 2008).
inline constexpr double kEdgeStrip_m = 0.25;
inline constexpr double kMotorwayEdgeStrip_m = 0.50;
inline constexpr double kMotorwayShoulder_m = 2.50;  ///< RAA 2008, RQ 31
inline constexpr double kMotorwayLane_m = 3.50;

}  // namespace terracast::world
