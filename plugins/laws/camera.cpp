#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "core/error.h"
#include "core/random.h"
#include "plugins/laws/laws.h"

namespace terracast::plugins {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using geo::CameraIntrinsics;
using geo::CameraModel;
using geo::PixelBlock;
using geo::VectorBlock;

constexpr std::uint64_t kSeed = 2;

std::string text_of(const Eigen::VectorXd& v) {
  return fmt::format("({:.17g})", fmt::join(v, ", "));
}

double angle_between(const Vector3d& a, const Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

Vector2d random_pixel(const CameraModel& camera, std::uint64_t index) {
  return {core::random_between(0, camera.width_px(), kSeed, 1, index),
          core::random_between(0, camera.height_px(), kSeed, 2, index)};
}

Vector3d point_on_ray(const CameraModel& camera, const Vector2d& pixel, double t) {
  return camera.origin_from_pixel(pixel) + t * camera.ray_from_pixel(pixel);
}

class CameraLaws {
 public:
  CameraLaws(const CameraModel& camera, LawReport& report) : camera_(camera), report_(report) {}

  void try_all() {
    pixel_to_ray_to_pixel_returns();
    what_is_seen_is_seen_at_one_place();
    nothing_is_no_ray_and_no_pixel();
    several_pixels_have_the_rays_of_each_one();
    several_rays_are_in_the_image_as_each_one();
    jacobian_is_the_central_difference();
    no_pixel_spans_fewer_angle_than_stated();
    is_made_again_from_its_intrinsics();
    refuses_wrong_parameters();
  }

 private:
  void pixel_to_ray_to_pixel_returns() {
    report_.begin("an image point's ray projects to that point");
    int num_rays = 0;
    double farthest = 0.0;
    Vector2d worst(0.0, 0.0);
    for (std::uint64_t i = 0; i < 10000 && report_.holds(); ++i) {
      const Vector2d pixel = random_pixel(camera_, i);
      const Vector3d ray = camera_.ray_from_pixel(pixel);
      if (!ray.allFinite()) continue;
      ++num_rays;
      report_.expect(ray.z() == 1.0 || std::abs(ray.norm() - 1.0) < 4e-15,
                     fmt::format("the ray {} of the image point {} has neither z = 1 nor length 1",
                                 text_of(ray), text_of(pixel)));
      const double t = core::random_between(1e-3, 1e6, kSeed, 3, i);
      const auto back = camera_.pixel_from_ray(point_on_ray(camera_, pixel, t));
      report_.expect(back.has_value(),
                     fmt::format("the ray of {} projects to no image point", text_of(pixel)));
      if (!back) return;
      const double away = (*back - pixel).norm();
      if (away > farthest || std::isnan(away)) {
        farthest = std::isnan(away) ? std::numeric_limits<double>::infinity() : away;
        worst = pixel;
      }
    }
    // Rounding of 1000 px, some hundred times over; where rays end sideways it grows.
    report_.expect(
        farthest < (camera_.intrinsics().model == "pinhole" ? 1e-11 : 1e-9),
        fmt::format("the image point {} comes back {:.3g} px away", text_of(worst), farthest));
    report_.expect(num_rays > 4000,
                   fmt::format("only {} of 10000 image points have a ray", num_rays));
  }

  // A camera that folds its image has two rays for a pixel.
  void what_is_seen_is_seen_at_one_place() {
    report_.begin("a point is seen at one image point alone");
    int num_seen = 0;
    for (std::uint64_t i = 0; i < 20000 && report_.holds(); ++i) {
      Vector3d point;
      for (int axis = 0; axis < 3; ++axis)
        point[axis] = core::random_between(-1, 1, kSeed, 30 + axis, i);
      if (!camera_.is_central()) point *= 100.0;
      const auto pixel = camera_.pixel_from_ray(point);
      if (!pixel) continue;
      ++num_seen;
      const Vector3d ray = camera_.ray_from_pixel(*pixel);
      // At the rim the image's radius has a maximum: the root of a rounding.
      report_.expect(
          ray.allFinite() && angle_between(ray, point - camera_.origin_from_pixel(*pixel)) < 1e-6,
          fmt::format("the point {} is seen at {}, whose ray goes elsewhere: {}", text_of(point),
                      text_of(*pixel), text_of(ray)));
    }
    report_.expect(num_seen > 2000,
                   fmt::format("only {} of 20000 points all around are seen", num_seen));
  }

  void nothing_is_no_ray_and_no_pixel() {
    report_.begin("NaN and the camera's own place are seen nowhere");
    const double nan = std::numeric_limits<double>::quiet_NaN();
    report_.expect(!camera_.pixel_from_ray({nan, 0.1, 1.0}), "(NaN, 0.1, 1) is seen");
    report_.expect(!camera_.pixel_from_ray({0.1, 0.1, nan}), "(0.1, 0.1, NaN) is seen");
    if (camera_.is_central())
      report_.expect(!camera_.pixel_from_ray(Vector3d::Zero()), "(0, 0, 0) is seen");
  }

  void several_pixels_have_the_rays_of_each_one() {
    report_.begin("find_rays gives what ray_from_pixel gives, to the bit");
    for (std::uint64_t i = 0; i < 1000 && report_.holds(); ++i) {
      PixelBlock pixels;
      for (int k = 0; k < PixelBlock::kPixels; ++k) {
        const Vector2d pixel =
            random_pixel(camera_, i * PixelBlock::kPixels + static_cast<std::uint64_t>(k));
        pixels.x[k] = pixel.x();
        pixels.y[k] = pixel.y();
      }
      VectorBlock rays;
      camera_.find_rays(pixels, rays);
      for (int k = 0; k < PixelBlock::kPixels; ++k) {
        const Vector2d pixel(pixels.x[k], pixels.y[k]);
        const Vector3d ray = camera_.ray_from_pixel(pixel);
        const Vector3d found(rays.x[k], rays.y[k], rays.z[k]);
        report_.expect(
            found.allFinite() == ray.allFinite() && (!ray.allFinite() || found == ray),
            fmt::format("of {}: {} and {}", text_of(pixel), text_of(found), text_of(ray)));
      }
    }
  }

  // Rays all around, and rays a few roundings on either side of the image's borders.
  void several_rays_are_in_the_image_as_each_one() {
    report_.begin("find_in_image says what pixel_from_ray and contains say");
    int num_in = 0;
    for (std::uint64_t i = 0; i < 5000 && report_.holds(); ++i) {
      VectorBlock block;
      std::uint32_t expected = 0;
      for (int k = 0; k < VectorBlock::kVectors; ++k) {
        const std::uint64_t index = i * VectorBlock::kVectors + static_cast<std::uint64_t>(k);
        Vector3d ray;
        if (k % 2 == 0) {
          for (int axis = 0; axis < 3; ++axis)
            ray[axis] = core::random_between(-1, 1, kSeed, 20 + axis, index);
        } else {
          Vector2d pixel = random_pixel(camera_, index);
          pixel[k / 2 % 2] =
              k < 4 ? 0.0 : (k / 2 % 2 == 0 ? camera_.width_px() : camera_.height_px());
          ray = point_on_ray(camera_, pixel, core::random_between(0.5, 2.0, kSeed, 23, index));
        }
        block.x[k] = ray.x();
        block.y[k] = ray.y();
        block.z[k] = ray.z();
        const auto pixel = camera_.pixel_from_ray(ray);
        if (pixel && camera_.contains(*pixel)) expected |= std::uint32_t{1} << k;
      }
      const std::uint32_t found = camera_.find_in_image(block);
      report_.expect(found == expected,
                     fmt::format("{:#x} in place of {:#x}, a bit a ray", found, expected));
      num_in += __builtin_popcount(expected);
    }
    report_.expect(num_in > 1000 && num_in < 40000,
                   fmt::format("{} of 40000 rays are in the image", num_in));
  }

  std::optional<Vector2d> central_difference(const Vector3d& point, int axis, double step_m) const {
    const Vector3d step = step_m * Vector3d::Unit(axis);
    const auto after = camera_.pixel_from_ray(point + step);
    const auto before = camera_.pixel_from_ray(point - step);
    if (!after || !before) return std::nullopt;
    return Vector2d((*after - *before) / (2.0 * step_m));
  }

  void jacobian_is_the_central_difference() {
    report_.begin("pixel_jacobian is the derivative of pixel_from_ray");
    int num_compared = 0;
    for (std::uint64_t i = 0; i < 1000 && report_.holds(); ++i) {
      const double t = core::random_between(0.5, 2.0, kSeed, 4, i);
      const Vector3d point = point_on_ray(camera_, random_pixel(camera_, i), t);
      if (!point.allFinite()) continue;
      const Eigen::Matrix<double, 2, 3> jacobian = camera_.pixel_jacobian(point);
      constexpr double kStep = 2e-6;
      for (int axis = 0; axis < 3; ++axis) {
        const auto difference = central_difference(point, axis, kStep);
        const auto of_half = central_difference(point, axis, 0.5 * kStep);
        if (!difference || !of_half) continue;  // at the rim
        // Truncation is step^2 of the third derivative, rounding 1e-13 px over the step. Beside a pole, and where an
        // image's two sides meet, differences are no derivative, and depend on the step.
        if ((*difference - *of_half).norm() > 0.5e-6 * difference->norm()) continue;
        report_.expect((jacobian.col(axis) - *difference).norm() < 1e-6 * jacobian.norm(),
                       fmt::format("at {}, axis {}: {} in place of {}", text_of(point), axis,
                                   text_of(jacobian.col(axis)), text_of(*difference)));
        ++num_compared;
      }
      if (camera_.is_central())  // a ray's length does not move its pixel
        report_.expect((jacobian * point).norm() < 1e-9,
                       fmt::format("at {}: it moves along the ray", text_of(point)));
    }
    report_.expect(num_compared > 1000,
                   fmt::format("only {} derivatives could be compared", num_compared));
  }

  void no_pixel_spans_fewer_angle_than_stated() {
    if (!camera_.is_central()) return;  // what a radian spans is no pixel's alone
    report_.begin("finest_pixels_per_radian is the largest that the image has");
    const bool has_poles = camera_.intrinsics().model == "equirectangular";
    double finest = 0.0;
    Vector2d finest_pixel(0.0, 0.0);
    const auto look = [&](const Vector2d& pixel, double direction) {
      const Vector2d step(1e-3 * std::cos(direction), 1e-3 * std::sin(direction));
      const Vector3d a = camera_.ray_from_pixel(pixel - step);
      const Vector3d b = camera_.ray_from_pixel(pixel + step);
      if (!a.allFinite() || !b.allFinite()) return;
      const double value = 2e-3 / angle_between(a, b);
      if (value > finest) {
        finest = value;
        finest_pixel = pixel;
      }
    };
    const auto direction_of = [&](std::uint64_t i) {
      return has_poles ? 0.5 * std::numbers::pi
                       : core::random_between(0, 2 * std::numbers::pi, kSeed, 5, i);
    };
    for (std::uint64_t i = 0; i < 20000; ++i) {
      const bool is_at_corner = i < 1000;
      look(is_at_corner ? Vector2d(i % 2 == 0 ? 0.0 : camera_.width_px(),
                                   i % 4 < 2 ? 0.0 : camera_.height_px())
                        : random_pixel(camera_, i),
           direction_of(i));
    }
    // It may be finest on the rim of what is seen, where few pixels lie: nearer and nearer to the best.
    for (std::uint64_t i = 0; i < 20000; ++i) {
      const double reach_px = 100.0 * std::pow(0.9994, static_cast<double>(i));
      const Vector2d pixel =
          finest_pixel + Vector2d(core::random_between(-reach_px, reach_px, kSeed, 40, i),
                                  core::random_between(-reach_px, reach_px, kSeed, 41, i));
      if (camera_.contains(pixel)) look(pixel, direction_of(i));
    }
    const double stated = camera_.finest_pixels_per_radian();
    // On a rim it rises like a root: the last thousandth of a pixel, which has no neighbour outside, holds some per
    // cent of it.
    report_.expect(
        finest <= stated * (1.0 + 1e-6) && finest >= stated * 0.9,
        fmt::format("{:.9g} at {}, stated are {:.9g}", finest, text_of(finest_pixel), stated));
  }

  void is_made_again_from_its_intrinsics() {
    report_.begin("it is made again from its intrinsics");
    const auto again = geo::make_camera(camera_.intrinsics());
    report_.expect(again->intrinsics() == camera_.intrinsics(), "its intrinsics are others");
    for (std::uint64_t i = 0; i < 100 && report_.holds(); ++i) {
      const Vector2d pixel = random_pixel(camera_, i);
      const Vector3d ray = camera_.ray_from_pixel(pixel);
      const Vector3d ray_again = again->ray_from_pixel(pixel);
      report_.expect(ray == ray_again || (!ray.allFinite() && !ray_again.allFinite()),
                     fmt::format("the ray of {} is another", text_of(pixel)));
    }
  }

  void refuses_wrong_parameters() {
    report_.begin("wrong parameters are refused as an error of the config");
    const auto refuses = [&](const std::string& what, auto spoil) {
      CameraIntrinsics wrong = camera_.intrinsics();
      spoil(wrong);
      try {
        geo::make_camera(wrong);
        report_.broken(what + " is taken");
      } catch (const core::Error& error) {
        report_.expect(error.kind() == core::ErrorKind::Config,
                       what + ": another kind of error: " + error.what());
      }
    };
    refuses("an image 0 px wide", [](CameraIntrinsics& wrong) { wrong.width_px = 0; });
    refuses("an image -1 px high", [](CameraIntrinsics& wrong) { wrong.height_px = -1; });
    refuses("one parameter more", [](CameraIntrinsics& wrong) { wrong.parameters.push_back(0.0); });
    refuses("no parameter", [](CameraIntrinsics& wrong) { wrong.parameters.clear(); });
    refuses("fx = NaN", [](CameraIntrinsics& wrong) {
      wrong.parameters[0] = std::numeric_limits<double>::quiet_NaN();
    });
    refuses("fx = 0", [](CameraIntrinsics& wrong) { wrong.parameters[0] = 0.0; });
    refuses("fy = 0", [](CameraIntrinsics& wrong) { wrong.parameters[1] = 0.0; });
  }

  const CameraModel& camera_;
  LawReport& report_;
};

}  // namespace

void try_camera(const CameraIntrinsics& intrinsics, LawReport& report) {
  report.begin("a camera is made of its parameters");
  const auto camera = geo::make_camera(intrinsics);
  CameraLaws(*camera, report).try_all();
}

CameraIntrinsics example_camera(const geo::CameraModelInfo& info) {
  CameraIntrinsics camera{std::string(info.name), 720, 640, {}};
  const Vector2d focal = info.whole_view != nullptr
                             ? info.whole_view(camera.width_px, camera.height_px)
                             : Vector2d(400.0, 410.0);
  camera.parameters = {focal.x(), focal.y(), 371.3, 318.9};
  for (const geo::CameraParameter& parameter : info.parameters)
    camera.parameters.push_back(parameter.default_value);
  return camera;
}

}  // namespace terracast::plugins
