#pragma once

#include <array>

#include "tiler/objects/things.h"

namespace terracast::tiler {

/// Colours in which road vehicles are sold, the commonest first.
inline constexpr std::array<Color, 7> kCarColors = {{{236, 236, 234},
                                                     {88, 92, 96},
                                                     {22, 23, 25},
                                                     {168, 172, 176},
                                                     {34, 62, 118},
                                                     {150, 22, 26},
                                                     {72, 84, 66}}};
inline constexpr Color kTyre = {24, 24, 25};
inline constexpr Color kRim = {150, 152, 155};
inline constexpr Color kWindow = {28, 34, 40};
inline constexpr Color kDark = {30, 31, 33};

/// A wheel whose foot is at z = 0, its outer side at y = outer_y_m.
void add_wheel(ThingMesh& mesh, double x_m, double outer_y_m, double radius_m, double width_m,
               int detail);
/// A wheel on each side.
void add_axle(ThingMesh& mesh, double x_m, double outer_y_m, double radius_m, double width_m,
              int detail);

/// A body with upright walls: rings of a rounded rectangle with bands of windows.
struct BoxBody {
  double rear_x_m = 0.0;
  double front_x_m = 0.0;
  double half_width_m = 1.275;
  double low_z_m = 0.3;
  double belt_z_m = 1.2;    ///< lower edge of the windows
  double window_z_m = 2.4;  ///< upper edge
  double top_z_m = 3.0;
  double corner_m = 0.15;
  double front_slope_m = 0.1;   ///< by which the front leans back up to the roof
  int num_windows = 8;          ///< on a side; 0: none
  double first_window_m = 0.1;  ///< from the rear
  bool has_rear_window = true;
};
void add_box_body(ThingMesh& mesh, const BoxBody& body, FinishNumber paint, FinishNumber lower,
                  FinishNumber glass, FinishNumber roof);

/// A small box on both sides.
void add_pair(ThingMesh& mesh, const Eigen::Vector3d& lowest, const Eigen::Vector3d& highest,
              FinishNumber finish);

}  // namespace terracast::tiler
