#pragma once

#include <string>
#include <string_view>

#include "batch/dataset/splits.h"
#include "tiler/map_drawing.h"

/// What the plots of a dataset have in common.
namespace terracast::batch::plot {

inline constexpr tiler::Colour kInk = {40, 40, 40};
inline constexpr tiler::Colour kGrid = {222, 222, 222};
inline constexpr tiler::Colour kWhite = {255, 255, 255};
inline constexpr tiler::Colour kMargin = {150, 60, 150};

/// Colours that the colour-blind tell apart (Okabe and Ito 2008).
tiler::Colour colour_of(Split split);
/// A light shade of it, for areas.
tiler::Colour tint_of(Split split);

/// "7.25 E", with the digits that multiples of a step need.
std::string angle_text(double angle_deg, double step_deg, char positive, char negative);
/// "1.5 km", "300 m".
std::string metres_text(double distance_m);
/// The start of a text that is at most so wide.
std::string fitting(std::string_view text, int width_px, int scale);

}  // namespace terracast::batch::plot
