#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "tiler/gradient_noise.h"

namespace terracast::tiler {

/// The ground at a place of the square's border, or beyond it.
struct BorderSample {
  double height_m = 0.0;  ///< above the geoid, or the ellipsoid where no geoid is used
  bool is_sea = false;
  double sea_depth_m = 0.0;  ///< of the sea's floor
};

/// The ground beyond the square. Near the border it mirrors the square's own; farther out it passes
/// into the border's heights carried outward, smoothed along the border the more the farther out,
/// with hills like those of the border. Beyond a place of the border that lies in the sea stands sea,
/// out to the horizon, and never mirrored land: coasts go on away from the border. With outside = "sea"
/// all sinks to the sea.
///
/// threads   safe
class Apron {
 public:
  /// border   of a place on the border, called for places all round it
  Apron(double half_size_m, bool sinks_to_sea, std::uint64_t seed,
        const std::function<BorderSample(double x_world, double y_world)>& border);

  /// Nearest place of the square.
  Eigen::Vector2d nearest_inside(double x_world, double y_world) const;

  /// The place as the border mirrors it into the square: land goes on beyond the border as before
  /// it.
  Eigen::Vector2d mirrored_inside(double x_world, double y_world) const;

  /// How much the mirrored surface counts: 1 at the border, 0 where it does not.
  double mirror_share(double distance_m) const;

  /// The ground beyond the border, above what the border's is above.
  /// mirrored   the square's at mirrored_inside(), where mirror_share() is above 0
  BorderSample beyond(double x_world, double y_world, double distance_m,
                      const std::optional<BorderSample>& mirrored) const;

 private:
  double along(const Eigen::Vector2d& inside) const;  ///< in profile samples
  static double at(const std::vector<double>& profile, double along);
  void measure_inland(const std::vector<std::uint8_t>& is_sea);
  double inland_m(double along) const;

  double half_size_m_;
  bool sinks_to_sea_;
  bool has_sea_ = false;      ///< at the border
  double sea_level_m_ = 0.0;  ///< of the border's sea; 0, the geoid, where it has none
  double step_m_ = 0.0;
  GradientNoise hills_;
  std::vector<std::vector<double>> heights_m_;  ///< smoothed over 1, 2, 4 … samples
  std::vector<double> hill_heights_m_;
  std::vector<double> sea_share_;
  /// Along the border, from the nearest sea; negative at sea, from the nearest land. Empty where the
  /// border is all sea or all land.
  std::vector<double> inland_m_;
};

}  // namespace terracast::tiler
