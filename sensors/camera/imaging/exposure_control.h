#pragma once

#include <functional>
#include <map>
#include <mutex>
#include <span>
#include <utility>
#include <vector>

#include "scene/light/sky.h"
#include "sensors/camera/imaging/imaging_options.h"

/// Automatic exposure. What a frame is exposed by follows from that frame and a bounded number of those
/// before it, each metered by itself: so it is the same in whatever order, shard or process frames are
/// rendered.
namespace terracast::sensors {

/// Frames before its own that an exposure may look at, and time constants.
inline constexpr int kMostEarlierFrames = 255;
inline constexpr double kTimeConstantsLookedAt = 6.0;

/// Luminance of what a light meter sees: its geometric mean, or a percentile (of n values the one at
/// ceil(n p / 100) from below).
/// seen   at the fixed exposure, 1 being white; not empty
double metered_luminance(const ExposureOptions& options, std::span<const scene::Color> seen);

/// Stops above the fixed exposure that make a luminance the target, within the limits.
double wanted_ev(const ExposureOptions& options, double luminance);

/// What an exposure control that follows with a time constant has reached at a frame: the mean of what the
/// frames up to it want, frame i weighing exp(-(times_s[frame] - times_s[i]) / time_constant_s). After a
/// step at frame s of evenly spaced frames it has made 1 - exp(-(frame - s + 1) dt / time_constant_s) of
/// it, where frames before have been looked at for some time constants.
/// wanted_ev_at   of a frame
double followed_ev(std::span<const double> times_s, int frame, double time_constant_s,
                   const std::function<double(int)>& wanted_ev_at);

/// Light meters of a sequence's cameras, which remember what they saw; threads that ask at the same time may look
/// twice. Threads: safe.
class LightMeters {
 public:
  /// What a camera's meter sees at a frame, a function of these alone: at the fixed exposure and balance. May be
  /// empty.
  using Look = std::function<std::vector<scene::Color>(int frame, int camera)>;
  struct Reading {
    double luminance = 0.0;
    scene::Color mean = scene::Color::Zero();
  };

  /// options_of_camera   one a camera
  LightMeters(std::vector<ExposureOptions> options_of_camera, Look look)
      : options_(std::move(options_of_camera)), look_(std::move(look)) {}

  Reading read(int frame, int camera) const;

 private:
  std::vector<ExposureOptions> options_;
  Look look_;
  mutable std::mutex mutex_;
  mutable std::map<std::pair<int, int>, Reading> readings_;
};

}  // namespace terracast::sensors
