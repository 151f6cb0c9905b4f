#include "validate/evidence.h"

#include <fmt/format.h>

#include <cmath>

#include "validate/sampling.h"

namespace terracast::validate {

namespace {

/// A cause as the report speaks of it.
struct Judged {
  const char* suffix;
  const char* title;
  const char* unit;
  int first;
  int last;
  double factor;  ///< from the estimate's unit to the report's
  double Evidence::Bounds::*bound;
  bool is_of_cameras;
  bool is_of_images;
};
constexpr Judged kJudged[] = {
    {"principal_point", "principal point", "px", kPrincipalX, kPrincipalY, 1.0,
     &Evidence::Bounds::principal_px, true, false},
    {"focal_length", "focal length", "%", kFocal, kFocal, 100.0, &Evidence::Bounds::focal_percent,
     true, false},
    {"scale", "scale of depth against poses", "%", kScale, kScale, 100.0,
     &Evidence::Bounds::scale_percent, true, false},
    {"time", "time of images against poses", "frames", kTime, kTime, 1.0,
     &Evidence::Bounds::time_frames, true, false},
    {"line_time", "line time of rolling shutters", "%", kLineTime, kLineTime, 100.0,
     &Evidence::Bounds::line_time_percent, true, false},
    {"rotation", "rotation", "deg", kRotationX, kRotationZ, 180.0 / kPi,
     &Evidence::Bounds::rotation_deg, true, true},
    {"position", "position", "px", kPositionX, kPositionZ, 1.0, &Evidence::Bounds::position_px,
     false, true},
};

constexpr const char* kAxes[kNumCorrections] = {"x", "y", "",  "",  "",  "",
                                                "x", "y", "z", "x", "y", "z"};

struct Worst {
  double value = 0.0;
  std::string where;
  int num_seen = 0;
  int num_unseen = 0;
};

/// Takes one estimate into account. Beyond what the residuals can tell, only the part beyond five
/// standard errors counts.
/// common    what the residuals may be off by all alike
/// rounding  the most that each is off by
void judge(const Evidence::Sum& sum, double factor, double bound, double common, double rounding,
           const std::string& where, Worst& worst) {
  constexpr double kSure = 5.0;
  if (!(sum.slope_slope > 0.0)) {
    ++worst.num_unseen;
    return;
  }
  const double size = std::abs(factor * sum.slope_residual / sum.slope_slope);
  const double error = factor * (std::sqrt(sum.variance) / sum.slope_slope +
                                 common * std::sqrt(sum.weight / sum.slope_slope));
  const double unsure = kSure * error + factor * rounding * std::sqrt(sum.weight / sum.slope_slope);
  const bool is_seen = unsure < bound;
  ++(is_seen ? worst.num_seen : worst.num_unseen);
  const double value = is_seen ? size : std::max(0.0, size - unsure);
  if (value <= worst.value && !worst.where.empty()) return;
  if (!is_seen && value == 0.0) return;
  worst.value = value;
  worst.where = fmt::format("{}: {:.3g} ± {:.1g}", where,
                            -factor * sum.slope_residual / sum.slope_slope, error);
}

/// What the principal point, the focal length and the scale of depth move a pixel's point in `a` by.
/// in_a   d r / d point_a
void set_slopes_of_intrinsics(std::array<double, kNumCorrections>& a, const Intrinsics& k,
                              const Transfer::Place& place, const Eigen::Vector3d& in_a) {
  const Eigen::Vector3d& point = place.point_a;
  if (!k.plane) {
    a[kPrincipalX] = -point.z() / k.fx_px * in_a.x();
    a[kPrincipalY] = -point.z() / k.fy_px * in_a.y();
    a[kFocal] = -(point.x() * in_a.x() + point.y() * in_a.y());
    a[kScale] = point.dot(in_a);
    return;
  }
  // The place of a pixel in the model's plane is ((u - cx) / fx, (v - cy) / fy): so a principal point moves it as the
  // pixel does, the other way, and a focal length in proportion to the way from the principal point.
  const Eigen::Vector2d by_pixel =
      unprojection_jacobian(k, place.pixel_a, place.distance_a_m).transpose() * in_a;
  a[kPrincipalX] = -by_pixel.x();
  a[kPrincipalY] = -by_pixel.y();
  a[kFocal] = -by_pixel.dot(place.pixel_a - Eigen::Vector2d(k.cx_px, k.cy_px));
  a[kScale] = (point - k.origin_from_pixel(place.pixel_a)).dot(in_a);
}

}  // namespace

void set_slopes(Residual& residual, const ViewPair& pair, const Transfer& transfer,
                const Transfer::Place& place, const Eigen::RowVector3d& by_point,
                const Eigen::Vector2d& by_principal, double by_focal, double by_scale) {
  const Eigen::Vector3d& point_a = place.point_a;
  const Eigen::Vector3d& point_b = place.point_b;
  Eigen::Vector3d in_b = by_point.transpose();
  if (pair.b.lines) in_b = transfer.through_time(place).transpose() * in_b;
  // The same derivative by the point in a: b_from_a turns a's axes into b's.
  const Eigen::Vector3d in_a =
      transfer.local_from_a(place).transpose() * (transfer.local_from_b(place) * in_b);
  const Intrinsics& k = pair.a.camera->intrinsics;
  auto& a = residual.slopes[0];
  const Eigen::Vector3d turn_a = point_a.cross(in_a);
  set_slopes_of_intrinsics(a, k, place, in_a);
  a[kTime] = pair.a.velocity_camera.dot(in_a) + pair.a.angular_velocity_camera.dot(turn_a);
  auto& b = residual.slopes[1];
  const Eigen::Vector3d turn_b = -point_b.cross(in_b);
  b[kPrincipalX] = by_principal.x();
  b[kPrincipalY] = by_principal.y();
  b[kFocal] = by_focal;
  b[kScale] = by_scale;
  b[kTime] = -pair.b.velocity_camera.dot(in_b) + pair.b.angular_velocity_camera.dot(turn_b);
  // A line of `a` that is exposed later is so where the camera is then, as with kTime.
  if (const auto& lines = pair.a.lines)
    a[kLineTime] = place.offset_a_s * (lines->velocity_mps(place.offset_a_s).dot(in_a) +
                                       lines->turn_radps(place.offset_a_s).dot(turn_a));
  if (const auto& lines = pair.b.lines)
    b[kLineTime] = place.offset_b_s * (-lines->velocity_mps(place.offset_b_s).dot(in_b) +
                                       lines->turn_radps(place.offset_b_s).dot(turn_b));
  for (int axis = 0; axis < 3; ++axis) {
    a[static_cast<std::size_t>(kRotationX + axis)] = turn_a[axis];
    a[static_cast<std::size_t>(kPositionX + axis)] = in_a[axis];
    b[static_cast<std::size_t>(kRotationX + axis)] = turn_b[axis];
    b[static_cast<std::size_t>(kPositionX + axis)] = -in_b[axis];
  }
}

Evidence::Sum& Evidence::Sum::operator+=(const Sum& other) {
  slope_residual += other.slope_residual;
  slope_slope += other.slope_slope;
  variance += other.variance;
  weight += other.weight;
  return *this;
}

Evidence::Part Evidence::sum(const ViewPair& pair, const std::vector<Residual>& residuals,
                             double residuals_per_fact) {
  Part part;
  part.cameras = {pair.a.camera_index, pair.b.camera_index};
  part.frames = {pair.a.frame, pair.b.frame};
  if (residuals.size() < 16) return part;  // too few to tell their scale
  std::vector<double> sizes;
  sizes.reserve(residuals.size());
  for (const Residual& residual : residuals)
    sizes.push_back(std::abs(residual.value) / residual.sigma);
  // About zero, not about their median: a mistake common to all must not look like outliers.
  const double scale = std::max(1.4826 * median(sizes), 1e-12);
  constexpr double kCut = 6.0;
  for (const Residual& residual : residuals) {
    const double sigma = residual.sigma * scale;
    const double size = residual.value / (kCut * sigma);
    if (std::abs(size) >= 1.0) continue;
    const double tukey = (1.0 - size * size) * (1.0 - size * size);
    // The scale of the pair only cuts outliers. In the weight it would silence just those pairs
    // that a mistake spoils.
    const double weight = tukey / (residual.sigma * residual.sigma);
    for (std::size_t cause = 0; cause < kNumCorrections; ++cause) {
      const double a = residual.slopes[0][cause];
      const double b = residual.slopes[1][cause];
      part.sides[0][cause].add(weight, a, residual.value);
      part.sides[1][cause].add(weight, b, residual.value);
      part.both[cause].add(weight, a + b, residual.value);
    }
    // A frame's rotation and position, common to its cameras, along the local frame's axes.
    for (const int first : {static_cast<int>(kRotationX), static_cast<int>(kPositionX)}) {
      std::array<Eigen::Vector3d, 2> local;
      for (std::size_t side = 0; side < 2; ++side) {
        const auto& slopes = residual.slopes[side];
        const auto x = static_cast<std::size_t>(first);
        const Eigen::Matrix3d& rotation = (side == 0 ? pair.a : pair.b).local_from_camera.rotation;
        local[side] = rotation * Eigen::Vector3d(slopes[x], slopes[x + 1], slopes[x + 2]);
      }
      for (int axis = 0; axis < 3; ++axis) {
        const auto cause = static_cast<std::size_t>(first + axis);
        if (pair.is_same_time()) {
          part.of_frames[0][cause].add(weight, local[0][axis] + local[1][axis], residual.value);
        } else {
          part.of_frames[0][cause].add(weight, local[0][axis], residual.value);
          part.of_frames[1][cause].add(weight, local[1][axis], residual.value);
        }
      }
    }
    ++part.num_residuals;
  }
  for (auto* sums :
       {&part.sides[0], &part.sides[1], &part.both, &part.of_frames[0], &part.of_frames[1]})
    for (Sum& of_cause : *sums) of_cause.variance *= residuals_per_fact;
  return part;
}

void Evidence::add(const Part& part) {
  if (part.num_residuals == 0) return;
  num_residuals_ += part.num_residuals;
  for (std::size_t cause = 0; cause < kNumCorrections; ++cause) {
    cameras_[-1][cause] += part.both[cause];
    if (part.cameras[0] == part.cameras[1]) {
      cameras_[part.cameras[0]][cause] += part.both[cause];
    } else {
      cameras_[part.cameras[0]][cause] += part.sides[0][cause];
      cameras_[part.cameras[1]][cause] += part.sides[1][cause];
    }
    for (std::size_t side = 0; side < 2; ++side)
      images_[{part.cameras[side], part.frames[side]}][cause] += part.sides[side][cause];
    images_[{-1, part.frames[0]}][cause] += part.of_frames[0][cause];
    if (part.frames[0] != part.frames[1])
      images_[{-1, part.frames[1]}][cause] += part.of_frames[1][cause];
  }
  for (std::size_t side = 0; side < 2; ++side)
    if (part.pixels_per_metre[side] > 0.0)
      pixels_per_metre_[part.cameras[side]] = pixels_per_metre_[-1] = part.pixels_per_metre[side];
}

std::vector<CheckResult> Evidence::results(const std::string& prefix, const Sequence& sequence,
                                           const Bounds& bounds, const std::string& what,
                                           const std::string& detects) const {
  const auto camera_name = [&](int index) {
    return index < 0 ? std::string("all cameras alike")
                     : sequence.cameras[static_cast<std::size_t>(index)].name;
  };
  std::vector<CheckResult> results;
  for (const Judged& judged : kJudged) {
    const double bound = bounds.*judged.bound;
    if (bound <= 0.0) continue;
    if (judged.first == kLineTime && !sequence.has_rolling_shutters()) continue;
    const double common = judged.first == kTime ? bounds.time_residual : 0.0;
    Worst worst;
    std::map<int, CheckResult::Plot> plots;
    for (int cause = judged.first; cause <= judged.last; ++cause) {
      const auto index = static_cast<std::size_t>(cause);
      const std::string axis =
          std::string(kAxes[cause]).empty() ? "" : std::string(", ") + kAxes[cause];
      if (judged.is_of_cameras)
        for (const auto& [camera, sums] : cameras_)
          judge(sums[index], judged.factor, bound, common, bounds.rounding,
                camera_name(camera) + ", all frames" + axis, worst);
      if (!judged.is_of_images) continue;
      for (const auto& [image, sums] : images_) {
        const auto pixels = pixels_per_metre_.find(image.first);
        const double factor = cause >= kPositionX
                                  ? (pixels == pixels_per_metre_.end() ? 0.0 : pixels->second)
                                  : judged.factor;
        if (factor <= 0.0) continue;
        judge(sums[index], factor, bound, common, bounds.rounding,
              fmt::format("{}, frame {}{}", camera_name(image.first), image.second, axis), worst);
        if (!(sums[index].slope_slope > 0.0)) continue;
        CheckResult::Plot& plot = plots[cause];
        plot.title = fmt::format("{}{} that each image asks for", judged.title, axis);
        plot.x_label = "image (all cameras of a frame alike, then each camera's frames)";
        plot.y_label = judged.unit;
        plot.x.push_back(static_cast<double>(plot.x.size()));
        plot.y.push_back(-factor * sums[index].slope_residual / sums[index].slope_slope);
      }
    }
    CheckResult result;
    result.name = prefix + "_" + judged.suffix;
    result.value = worst.value;
    result.bound = bound;
    result.unit = judged.unit;
    result.ok = worst.value <= bound;
    result.worst = worst.where;
    result.skipped = result.is_unseen = worst.num_seen == 0 && result.ok;
    if (result.skipped) result.worst = "the motion and the ground of this dataset do not show it";
    result.summary = fmt::format(
        "The correction of the {} that explains {} best, each alone: {} of {} corrections could be "
        "told to a fifth of the "
        "bound, from {} residuals.",
        judged.title, what, worst.num_seen, worst.num_seen + worst.num_unseen, num_residuals_);
    result.reason =
        "The bound is half the smallest error that must be found; the estimate in a right dataset "
        "is 0 within its "
        "standard error.";
    result.detects = detects;
    for (auto& [cause, plot] : plots) result.plots.push_back(std::move(plot));
    results.push_back(std::move(result));
  }
  return results;
}

}  // namespace terracast::validate
