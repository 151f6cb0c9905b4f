#include <fmt/format.h>

#include <cmath>

#include "core/parallel.h"
#include "validate/checks/checker.h"

/// A table that says for each pixel where its ray starts and goes, against the projection of the camera's model: a
/// point on the ray stands at the pixel's centre.
namespace terracast::validate {

namespace {

constexpr double kWrong = 1e9;

/// What one ray of a table is off by.
struct Deviation {
  double center_px = 0.0;  ///< of its points in the image from the pixel's centre
  double length = 0.0;     ///< from 1
  double origin_m = 0.0;   ///< from where the model's ray starts
};

/// The largest deviation, and where it is.
struct Worst {
  double value = 0.0;
  int x = 0;
  int y = 0;

  void note(double other, int other_x, int other_y) {
    if (!(other <= value)) *this = {other, other_x, other_y};
  }
};
struct WorstOfAll {
  Worst center, length, origin;

  void note(const Deviation& deviation, int x, int y) {
    center.note(deviation.center_px, x, y);
    length.note(deviation.length, x, y);
    origin.note(deviation.origin_m, x, y);
  }
  void note(const WorstOfAll& other) {
    center.note(other.center.value, other.center.x, other.center.y);
    length.note(other.length.value, other.length.x, other.length.y);
    origin.note(other.origin.value, other.origin.x, other.origin.y);
  }
};

class RaysChecker : public Checker {
 public:
  std::vector<CheckResult> finish(const Dataset&, const Sequence& sequence) override {
    CheckResult center, length, origin;
    std::int64_t num_rays = 0, num_origins = 0;
    for (const Camera& camera : sequence.cameras) {
      if (!camera.pixel_rays) continue;
      const PixelRays& rays = *camera.pixel_rays;
      const WorstOfAll worst = worst_of(rays);
      num_rays += static_cast<std::int64_t>(rays.directions.size());
      num_origins += static_cast<std::int64_t>(rays.origins.size());
      const auto note = [&](CheckResult& result, const Worst& at) {
        note_worst(result, at.value, fmt::format("{}, pixel ({}, {})", camera.name, at.x, at.y));
      };
      note(center, worst.center);
      note(length, worst.length);
      if (!rays.origins.empty()) note(origin, worst.origin);
    }
    describe(center, length, origin, num_rays, num_origins);
    if (num_rays == 0) return {skipped_result(center.name, "the format holds no table of rays")};
    for (CheckResult* result : {&center, &length, &origin}) result->ok = result->is_within_bound();
    if (num_origins == 0) origin = skipped_result(origin.name, "all rays start at their cameras");
    return {center, length, origin};
  }

 private:
  static void describe(CheckResult& center, CheckResult& length, CheckResult& origin,
                       std::int64_t num_rays, std::int64_t num_origins) {
    center.name = "rays";
    center.bound = 1e-6;
    center.unit = "px";
    center.summary = fmt::format(
        "How far from its pixel's centre the model sees points on a ray of the table, 10 m and 1 "
        "km along it, of {} rays. A ray that one of the two has, and the other has not, counts as "
        "1e9 px.",
        num_rays);
    center.reason = "Rays of 53 bits leave 1e-9 px, and models are inverted to as much.";
    center.detects = "1e-5 px in one ray: a parameter that is wrong, another pixel rule";
    length.name = "rays_length";
    length.bound = 1e-12;
    length.unit = "";
    length.summary = fmt::format("How far {} rays of the table are from length 1.", num_rays);
    length.reason = "A division in 53 bits leaves 4e-16.";
    length.detects = "directions that are not brought to unit length, tables of float32";
    origin.name = "rays_origin";
    origin.bound = 1e-9;
    origin.unit = "m";
    origin.summary = fmt::format(
        "How far {} places of the table are from where the model's rays start.", num_origins);
    origin.reason = "53 bits of some kilometres leave 1e-12 m.";
    origin.detects = "ranges counted from elsewhere, a wrong metre a pixel";
  }

  static WorstOfAll worst_of(const PixelRays& rays) {
    const Intrinsics& camera = rays.camera;
    std::vector<WorstOfAll> rows(static_cast<std::size_t>(camera.height_px));
    core::parallel_for(camera.height_px, [&](std::int64_t y) {
      for (int x = 0; x < camera.width_px; ++x)
        rows[static_cast<std::size_t>(y)].note(deviation(rays, x, static_cast<int>(y)), x,
                                               static_cast<int>(y));
    });
    WorstOfAll worst;
    for (const WorstOfAll& row : rows) worst.note(row);
    return worst;
  }

  static Deviation deviation(const PixelRays& rays, int x, int y) {
    const Intrinsics& camera = rays.camera;
    const std::size_t index =
        static_cast<std::size_t>(y) * static_cast<std::size_t>(camera.width_px) +
        static_cast<std::size_t>(x);
    const Eigen::Vector2d center(x + 0.5, y + 0.5);
    const Eigen::Vector3d& ray = rays.directions[index];
    const Eigen::Vector3d* origin = rays.origins.empty() ? nullptr : &rays.origins[index];
    if (!camera.ray_from_pixel(center).allFinite()) {
      const bool has_none =
          ray.array().isNaN().all() && (origin == nullptr || origin->array().isNaN().all());
      return {.center_px = has_none ? 0.0 : kWrong};
    }
    Deviation found{.length = std::abs(ray.norm() - 1.0)};
    if (origin != nullptr) found.origin_m = (*origin - camera.origin_from_pixel(center)).norm();
    for (const double distance_m : {10.0, 1000.0}) {
      const Eigen::Vector3d along = distance_m * ray;
      const Eigen::Vector3d point = origin == nullptr ? along : Eigen::Vector3d(*origin + along);
      const Eigen::Vector2d seen = camera.pixel_from_point(point);
      const double way_px = camera.way_px(center, seen).norm();
      found.center_px = std::isfinite(way_px) ? std::max(found.center_px, way_px) : kWrong;
    }
    return found;
  }
};

}  // namespace

std::unique_ptr<Checker> make_rays_check(const ValidateOptions&) {
  return std::make_unique<RaysChecker>();
}

}  // namespace terracast::validate
