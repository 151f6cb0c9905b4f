#pragma once

#include <Eigen/Core>
#include <cmath>
#include <optional>
#include <string_view>

#include "geo/body_state.h"
#include "geo/rigid3.h"

/// When the lines of an image are exposed, and where the camera is meanwhile.
namespace terracast::geo {

/// Which way the lines of a rolling shutter follow each other; rows go down and up, columns right and left.
enum class Readout { Down, Up, Right, Left };
/// In the order of Readout.
inline constexpr std::string_view kReadoutNames[] = {"down", "up", "right", "left"};

/// How an image is exposed. A frame's time is the middle of the exposure of the image's middle; a line is
/// exposed as long as another, and its middle comes line_time_s after that of the line before.
struct Shutter {
  double exposure_s = 0.0;
  double line_time_s = 0.0;  ///< 0: all lines at once, a global shutter
  Readout readout = Readout::Down;

  bool is_rolling() const { return line_time_s > 0.0; }
  bool is_instant() const { return !is_rolling() && exposure_s == 0.0; }
  bool has_columns() const { return readout == Readout::Right || readout == Readout::Left; }
  bool operator==(const Shutter&) const = default;

  /// The middle of the exposure at an image point, counted from the frame's time; linear over the image, so
  /// that a line has at its own middle what it has all over.
  double offset_s(const Eigen::Vector2d& pixel, int width_px, int height_px) const {
    const double along = has_columns() ? pixel.x() - 0.5 * width_px : pixel.y() - 0.5 * height_px;
    const bool is_backward = readout == Readout::Up || readout == Readout::Left;
    return (is_backward ? -line_time_s : line_time_s) * along;
  }
  /// The most that any moment of the image differs from the frame's time.
  double reach_s(int width_px, int height_px) const {
    return 0.5 * (exposure_s + line_time_s * (has_columns() ? width_px : height_px));
  }
};

/// What a lens lets through. What lies at the depth focus_m (in cameras whose rays are of unit length: at
/// that range) is sharp; a point elsewhere becomes the pupil's image.
struct Aperture {
  double diameter_m = 0.0;  ///< of the entrance pupil; 0: all is sharp
  double focus_m = 0.0;     ///< 0: infinitely far
  bool operator==(const Aperture&) const = default;
};

/// A camera on a body about the time of a frame: the body goes on as its state then says
/// (BodyState::pose_after).
struct CameraMotion {
  BodyState state;
  Rigid3d body_from_camera;
  Shutter shutter;

  Rigid3d world_from_camera(double offset_s) const {
    return state.pose_after(offset_s) * body_from_camera;
  }
};

/// Image point of what a rolling shutter sees, and when.
struct SeenPoint {
  Eigen::Vector2d pixel;
  double offset_s;
};

/// Solves for the time at which a point is seen: that at which the line is exposed on which it then stands.
/// project_at   image point at a time, counted from the frame's; nothing where there is none
/// returns      nothing where project_at says so, where the point runs along with the shutter, so that the
///              time does not come out, or where it lies 16 times as far off as the image's first and last
///              lines; of points that lines meet several times, where the secant's way from the frame's time
///              ends
/// accuracy     1e-10 of a line's time; 1e-6 of it where project_at rounds by more
template <class ProjectAt>
std::optional<SeenPoint> find_seen(const Shutter& shutter, int width_px, int height_px,
                                   const ProjectAt& project_at) {
  constexpr int kMostSteps = 40;
  constexpr double kLines = 1e-10;
  constexpr double kRoundedLines = 1e-6;
  constexpr double kImages = 16.0;
  const std::optional<Eigen::Vector2d> at_once = project_at(0.0);
  if (!at_once) return std::nullopt;
  if (!shutter.is_rolling()) return SeenPoint{*at_once, 0.0};
  const double farthest_s = kImages * shutter.reach_s(width_px, height_px);
  SeenPoint best{*at_once, 0.0};
  double best_miss_s = std::abs(shutter.offset_s(*at_once, width_px, height_px));
  double before_s = 0.0;
  double miss_before_s = shutter.offset_s(*at_once, width_px, height_px);
  double at_s = miss_before_s;
  for (int step = 0; step < kMostSteps && best_miss_s > kLines * shutter.line_time_s; ++step) {
    const std::optional<Eigen::Vector2d> pixel = project_at(at_s);
    if (!pixel) return std::nullopt;
    const double miss_s = shutter.offset_s(*pixel, width_px, height_px) - at_s;
    // As near as roundings let it come.
    if (std::abs(miss_s) > 0.5 * best_miss_s && best_miss_s <= kRoundedLines * shutter.line_time_s)
      break;
    if (std::abs(miss_s) < best_miss_s) {
      best = {*pixel, at_s};
      best_miss_s = std::abs(miss_s);
    }
    const double slope = (miss_s - miss_before_s) / (at_s - before_s);
    before_s = at_s;
    miss_before_s = miss_s;
    at_s = slope < 0.0 ? at_s - miss_s / slope : at_s + miss_s;
    if (!(std::abs(at_s) < farthest_s)) break;
  }
  if (best_miss_s > kRoundedLines * shutter.line_time_s) return std::nullopt;
  return best;
}

}  // namespace terracast::geo
