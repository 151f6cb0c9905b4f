#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "validate/dataset.h"

namespace terracast::validate {

/// The body between frames: the polynomial through the poses of the four frames about a time, and others, which bound its
/// error.
class BodyBetween {
 public:
  BodyBetween(const Dataset& dataset, const Sequence& sequence);

  struct Placed {
    Pose local_from_body;
    double doubt_m = 0.0;
    double doubt_rad = 0.0;
  };
  /// Nothing where too few frames have poses.
  std::optional<Placed> at(double time_s) const;
  /// At the last frame no later than a time.
  std::optional<Pose> at_frame_before(double time_s) const;

 private:
  std::optional<Pose> pose(std::ptrdiff_t frame) const;
  double distance_m(const Pose& at) const;
  /// Lagrange's polynomial through the poses of `count` frames.
  std::optional<Eigen::Matrix<double, 6, 1>> between(const Pose& near, double frame,
                                                     std::ptrdiff_t first, int count,
                                                     int step = 1) const;

  double rate_hz_;
  std::string format_;
  std::vector<std::optional<Pose>> poses_;
};

}  // namespace terracast::validate
