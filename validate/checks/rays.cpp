#include <fmt/format.h>

#include <cmath>

#include "core/parallel.h"
#include "validate/checks/checker.h"

/// A table that says for each pixel where its ray starts and goes, against the projection of the camera's model: a
/// point on the ray stands at the pixel's centre.
namespace terracast::validate {

namespace {

/// The largest deviation of one row of pixels, and where it is.
struct Worst {
  double value_px = 0.0;
  int x = 0;
  int y = 0;
};

class RaysChecker : public Checker {
 public:
  std::vector<CheckResult> finish(const Dataset&, const Sequence& sequence) override {
    CheckResult result;
    result.name = "rays";
    result.bound = 1e-6;
    result.unit = "px";
    std::int64_t num_rays = 0;
    for (const Camera& camera : sequence.cameras) {
      if (!camera.pixel_rays) continue;
      const Worst worst = worst_of(*camera.pixel_rays);
      num_rays += static_cast<std::int64_t>(camera.pixel_rays->directions.size());
      note_worst(result, worst.value_px,
                 fmt::format("{}, pixel ({}, {})", camera.name, worst.x, worst.y));
    }
    if (num_rays == 0) return {skipped_result(result.name, "the format holds no table of rays")};
    result.ok = result.is_within_bound();
    result.summary = fmt::format(
        "How far from its pixel's centre the model sees points on a ray of the table, 10 m and 1 "
        "km along it, or how "
        "far the ray is from length 1, of {} rays. A ray that one of the two has, and the other "
        "has not, counts as "
        "1e9 px.",
        num_rays);
    result.reason = "Rays of 53 bits leave 1e-9 px, and models are inverted to as much.";
    result.detects = "1e-5 px in one ray: a parameter that is wrong, another pixel rule";
    return {result};
  }

 private:
  static Worst worst_of(const PixelRays& rays) {
    const Intrinsics& camera = rays.camera;
    std::vector<Worst> rows(static_cast<std::size_t>(camera.height_px));
    core::parallel_for(camera.height_px, [&](std::int64_t y) {
      for (int x = 0; x < camera.width_px; ++x) {
        const double value_px = deviation_px(rays, x, static_cast<int>(y));
        Worst& worst = rows[static_cast<std::size_t>(y)];
        if (!(value_px <= worst.value_px)) worst = {value_px, x, static_cast<int>(y)};
      }
    });
    Worst worst;
    for (const Worst& row : rows)
      if (!(row.value_px <= worst.value_px)) worst = row;
    return worst;
  }

  static double deviation_px(const PixelRays& rays, int x, int y) {
    constexpr double kWrong_px = 1e9;
    const Intrinsics& camera = rays.camera;
    const std::size_t index =
        static_cast<std::size_t>(y) * static_cast<std::size_t>(camera.width_px) +
        static_cast<std::size_t>(x);
    const Eigen::Vector2d center(x + 0.5, y + 0.5);
    const Eigen::Vector3d& ray = rays.directions[index];
    const bool has_ray = camera.ray_from_pixel(center).allFinite();
    if (!has_ray) return ray.array().isNaN().all() ? 0.0 : kWrong_px;
    if (!ray.allFinite()) return kWrong_px;
    const Eigen::Vector3d origin =
        rays.origins.empty() ? Eigen::Vector3d(Eigen::Vector3d::Zero()) : rays.origins[index];
    double largest = std::abs(ray.norm() - 1.0);
    for (const double distance_m : {10.0, 1000.0}) {
      const Eigen::Vector3d point = origin + distance_m * ray;
      const Eigen::Vector2d seen = camera.pixel_from_point(point);
      if (!seen.allFinite()) return kWrong_px;
      largest = std::max(largest, camera.way_px(center, seen).norm());
      if (!camera.plane->is_central())
        largest = std::max(largest, std::abs(camera.distance_m(point, seen) - distance_m));
    }
    return largest;
  }
};

}  // namespace

std::unique_ptr<Checker> make_rays_check(const ValidateOptions&) {
  return std::make_unique<RaysChecker>();
}

}  // namespace terracast::validate
