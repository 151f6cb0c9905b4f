#pragma once

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "core/atomic_file.h"
#include "core/registry.h"
#include "geo/camera_model.h"
#include "rigs/rig_format.h"

/// Models of lenses as the programs that write calibrations define them, for comparison with what their files are read as.
/// All count pixels from the first one's centre.
namespace terracast::rigs {

using Lens = std::function<Eigen::Vector2d(const Eigen::Vector3d&)>;  ///< a pixel of a point

struct Projection {
  double fx, fy, cx, cy;
  Eigen::Vector2d operator()(const Eigen::Vector2d& m) const {
    return {fx * m.x() + cx, fy * m.y() + cy};
  }
};

/// k1 k2 p1 p2 k3 k4 k5 k6; what is not given is 0.
inline Eigen::Vector2d radtan(const Eigen::Vector2d& m, std::vector<double> d) {
  d.resize(8, 0.0);
  const double x = m.x(), y = m.y(), r2 = x * x + y * y;
  const double radial = (1 + d[0] * r2 + d[1] * r2 * r2 + d[4] * r2 * r2 * r2) /
                        (1 + d[5] * r2 + d[6] * r2 * r2 + d[7] * r2 * r2 * r2);
  return {x * radial + 2 * d[2] * x * y + d[3] * (r2 + 2 * x * x),
          y * radial + d[2] * (r2 + 2 * y * y) + 2 * d[3] * x * y};
}

inline Lens pinhole_lens(Projection k, std::vector<double> d) {
  return [=](const Eigen::Vector3d& p) { return k(radtan({p.x() / p.z(), p.y() / p.z()}, d)); };
}

/// t + k1 t^3 + k2 t^5 + k3 t^7 + k4 t^9 of the angle t from the axis.
inline Lens equidistant_lens(Projection k, std::vector<double> d) {
  return [=](const Eigen::Vector3d& p) {
    const double across = std::hypot(p.x(), p.y()), t = std::atan2(across, p.z());
    const double radius = t + d[0] * std::pow(t, 3) + d[1] * std::pow(t, 5) +
                          d[2] * std::pow(t, 7) + d[3] * std::pow(t, 9);
    return k(across > 0 ? Eigen::Vector2d(p.head<2>() * (radius / across)) : Eigen::Vector2d(0, 0));
  };
}

inline Lens fov_lens(Projection k, double w) {
  return [=](const Eigen::Vector3d& p) {
    const double r = std::hypot(p.x() / p.z(), p.y() / p.z());
    const double scale = std::atan(2 * r * std::tan(w / 2)) / (w * r);
    return k({scale * p.x() / p.z(), scale * p.y() / p.z()});
  };
}

/// Kalibr's omni, camodocal's MEI: the unit sphere seen from xi behind its centre.
inline Lens mei_lens(Projection k, double xi, std::vector<double> d) {
  return [=](const Eigen::Vector3d& p) {
    const Eigen::Vector3d s = p / p.norm();
    return k(radtan({s.x() / (s.z() + xi), s.y() / (s.z() + xi)}, d));
  };
}

inline Lens eucm_lens(Projection k, double alpha, double beta) {
  return [=](const Eigen::Vector3d& p) {
    const double d = std::sqrt(beta * (p.x() * p.x() + p.y() * p.y()) + p.z() * p.z());
    const double below = alpha * d + (1 - alpha) * p.z();
    return k({p.x() / below, p.y() / below});
  };
}

inline Lens double_sphere_lens(Projection k, double xi, double alpha) {
  return [=](const Eigen::Vector3d& p) {
    const double d1 = p.norm(), z = xi * d1 + p.z();
    const double d2 = std::sqrt(p.x() * p.x() + p.y() * p.y() + z * z);
    const double below = alpha * d2 + (1 - alpha) * z;
    return k({p.x() / below, p.y() / below});
  };
}

/// Points that all of these lenses see.
inline std::vector<Eigen::Vector3d> seen_points() {
  return {{0.1, 0.2, 2.0}, {-0.5, 0.3, 1.5}, {0.7, -0.6, 3.0}, {-0.2, -0.9, 4.0}, {1.0, 0.8, 5.0}};
}

/// A camera of a rig shows points of its own axes at the pixels of a lens.
inline void expect_lens(const capture::CameraCalibration& camera, const Lens& lens) {
  const auto model = geo::make_camera(camera.intrinsics);
  for (const Eigen::Vector3d& point : seen_points()) {
    const auto found = model->pixel_from_ray(point);
    ASSERT_TRUE(found.has_value()) << camera.name << " does not see " << point.transpose();
    // Ours count from the first pixel's corner. Some hundred pixels in doubles are rounded to 1e-13.
    const Eigen::Vector2d wanted = lens(point) + Eigen::Vector2d(0.5, 0.5);
    EXPECT_LT((*found - wanted).norm(), 1e-9) << camera.name << ", " << camera.intrinsics.model;
  }
}

inline ImportedRig read_text(const char* format, const std::filesystem::path& file,
                             const std::string& text) {
  core::write_file(file, text);
  return core::find_registered(rig_formats(), "format", format).read(file, {});
}

/// What the command warns of: one of the lines has all of these words.
inline void expect_told(const core::Ledger& ledger, const std::vector<std::string>& words) {
  const std::vector<std::string> lines = lines_not_used(ledger);
  const auto has_all = [&](const std::string& line) {
    return std::all_of(words.begin(), words.end(), [&](const std::string& word) {
      return line.find(word) != std::string::npos;
    });
  };
  EXPECT_TRUE(std::any_of(lines.begin(), lines.end(), has_all))
      << testing::PrintToString(words) << " in " << testing::PrintToString(lines);
}

}  // namespace terracast::rigs
