#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <vector>

/// The times at which pixels are looked at.
namespace terracast::sensors::events {

/// What a pixel sees at a time.
struct Look {
  double log_light = 0.0;
  double flow_pxps = 0.0;  ///< speed of the image there
};

/// A pixel at a time.
struct LookPlace {
  std::uint32_t pixel = 0;
  double time_s = 0.0;
};

/// Looks at pixels; a function of place and time alone.
using LookAt = std::function<void(std::span<const LookPlace> places, std::span<Look> looks)>;

/// How finely time is divided.
struct StepRule {
  /// Most change of ln luminance over a step; a quarter of it is the most by which a step's middle is expected to lie beside
  /// the line between its ends, by what the middle of the step twice as long did.
  double brightness_step = 0.1;
  double flow_step_px = 0.5;  ///< most motion of the image over a step
  /// A step over which the image moves by less is not divided for its brightness: the pixel has no finer detail.
  double finest_px = 0.0;
  double finest_s = 1e-4;  ///< no step is divided that is no longer
  double longest_s = std::numeric_limits<double>::infinity();  ///< all that are longer are
};

/// A look with its pixel and time.
struct TimedLook {
  std::uint32_t pixel = 0;
  double time_s = 0.0;
  Look look;
};

/// Looks of pixels over an interval of time: its beginning is known, then halves of halves until each pixel's own steps keep
/// the rule. Its end counts; what happens between two looks that see no difference is missed.
/// begin     one a pixel, at the interval's beginning
/// result    each pixel's in the order of time, beginning and end included, pixel after pixel in the order of `begin`
/// source    Rebecq, Gehrig and Scaramuzza 2018 (ESIM), adaptive sampling by brightness and by flow; here checked over each
///           step at both of its ends, not predicted from its beginning
std::vector<TimedLook> divide_time(std::span<const TimedLook> begin, double end_s,
                                   const StepRule& rule, const LookAt& look_at);

}  // namespace terracast::sensors::events
