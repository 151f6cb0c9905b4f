#include "validate/sampling.h"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <array>
#include <limits>

#include "validate/null_distribution.h"

namespace terracast::validate {

namespace {

/// Weights of the four neighbours at a fraction t between the middle two, and their derivatives.
void cubic_weights(double t, double weights[4], double slopes[4]) {
  const double t2 = t * t;
  const double t3 = t2 * t;
  weights[0] = 0.5 * (-t3 + 2.0 * t2 - t);
  weights[1] = 0.5 * (3.0 * t3 - 5.0 * t2 + 2.0);
  weights[2] = 0.5 * (-3.0 * t3 + 4.0 * t2 + t);
  weights[3] = 0.5 * (t3 - t2);
  slopes[0] = 0.5 * (-3.0 * t2 + 4.0 * t - 1.0);
  slopes[1] = 0.5 * (9.0 * t2 - 10.0 * t);
  slopes[2] = 0.5 * (-9.0 * t2 + 8.0 * t + 1.0);
  slopes[3] = 0.5 * (3.0 * t2 - 2.0 * t);
}

struct Corner {
  int x;
  int y;
  double fraction_x;
  double fraction_y;
};

/// The second of the four columns and rows, and where the point stands after it.
Corner corner_of(const Eigen::Vector2d& pixel) {
  const double x = std::floor(pixel.x() - 0.5);
  const double y = std::floor(pixel.y() - 0.5);
  return {static_cast<int>(x), static_cast<int>(y), pixel.x() - 0.5 - x, pixel.y() - 0.5 - y};
}

template <class ValueAt>
CubicSample interpolate(const Corner& corner, const ValueAt& value_at) {
  double wx[4], sx[4], wy[4], sy[4];
  cubic_weights(corner.fraction_x, wx, sx);
  cubic_weights(corner.fraction_y, wy, sy);
  CubicSample sample;
  for (int j = 0; j < 4; ++j) {
    double value = 0.0;
    double slope = 0.0;
    for (int i = 0; i < 4; ++i) {
      const double v = value_at(i, j);
      value += wx[i] * v;
      slope += sx[i] * v;
    }
    sample.value += wy[j] * value;
    sample.gradient.x() += wy[j] * slope;
    sample.gradient.y() += sy[j] * value;
  }
  return sample;
}

constexpr double kLeastContrast = 1.5;  // grey levels: below it rounding to 8 bits rules

using PatchValues = std::array<double, kPatchPixels>;

/// Takes off what two images of one place need not have in common: an offset, and where brightness goes along with
/// the images a slope.
void take_off(PatchValues& values, bool has_shading) {
  double sum = 0.0, sum_x = 0.0, sum_y = 0.0;
  std::size_t k = 0;
  for (int y = -kPatchRadius_px; y <= kPatchRadius_px; ++y)
    for (int x = -kPatchRadius_px; x <= kPatchRadius_px; ++x, ++k) {
      sum += values[k];
      sum_x += x * values[k];
      sum_y += y * values[k];
    }
  // Of x^2 over the patch; offset and slopes are at right angles.
  constexpr double kSquares = kPatchSide_px * 2.0 * (1.0 + 4.0 + 9.0);
  static_assert(kPatchRadius_px == 3);
  const double mean = sum / kPatchPixels;
  const double by_x = has_shading ? sum_x / kSquares : 0.0;
  const double by_y = has_shading ? sum_y / kSquares : 0.0;
  k = 0;
  for (int y = -kPatchRadius_px; y <= kPatchRadius_px; ++y)
    for (int x = -kPatchRadius_px; x <= kPatchRadius_px; ++x, ++k)
      values[k] -= mean + by_x * x + by_y * y;
}

double product_of(const PatchValues& a, const PatchValues& b) {
  double product = 0.0;
  for (std::size_t k = 0; k < kPatchPixels; ++k) product += a[k] * b[k];
  return product;
}

bool has_shading(const View& a, const View& b) {
  return a.camera->imaging.has_shading || b.camera->imaging.has_shading;
}

struct Patch {
  PatchValues values{};
  std::array<Eigen::Vector2d, kPatchPixels> predicted;

  /// Whether the other image shows it about as large, along both axes of the stretch. Else one
  /// image resolves what the other averages, and the two do not look alike.
  bool keeps_its_size() const {
    const auto across = [&](std::size_t from, std::size_t to) {
      return ((predicted[to] - predicted[from]) / (kPatchSide_px - 1)).eval();
    };
    constexpr std::size_t kMiddle = kPatchRadius_px * kPatchSide_px;
    Eigen::Matrix2d stretch;
    stretch << across(kMiddle, kMiddle + kPatchSide_px - 1),
        across(kPatchRadius_px, kPatchPixels - 1 - kPatchRadius_px);
    constexpr double kMost = 1.5;
    const Eigen::Vector2d sizes = stretch.jacobiSvd().singularValues();
    return sizes[0] < kMost && sizes[1] > 1.0 / kMost;
  }
};

/// A window of a patch's size in the luma of colours.
PatchValues window_at(const core::Image8& color, int x, int y, bool has_shading) {
  PatchValues values;
  std::size_t k = 0;
  for (int row = y - kPatchRadius_px; row <= y + kPatchRadius_px; ++row)
    for (int column = x - kPatchRadius_px; column <= x + kPatchRadius_px; ++column, ++k)
      values[k] = 0.299 * color(column, row, 0) + 0.587 * color(column, row, 1) +
                  0.114 * color(column, row, 2);
  take_off(values, has_shading);
  return values;
}

double own_correlation_at(const core::Image8& color, int x, int y, bool has_shading) {
  if (color.empty()) return 1.0;
  const auto inward = [](int at, int size) { return 2 * at < size ? 1 : -1; };
  const PatchValues here = window_at(color, x, y, has_shading);
  const auto correlation_with = [&](const PatchValues& beside) {
    const double power = product_of(here, here) * product_of(beside, beside);
    return power > 0.0 ? product_of(here, beside) / std::sqrt(power) : 0.0;
  };
  return 0.5 * (correlation_with(window_at(color, x + inward(x, color.width()), y, has_shading)) +
                correlation_with(window_at(color, x, y + inward(y, color.height()), has_shading)));
}

/// Whether the surface through the places of a patch's corners lies level, on an Earth that is round.
bool lies_level(const View& a, const std::array<Eigen::Vector3d, 4>& corners) {
  constexpr double kEarth_m = 6.371e6;
  constexpr double kSteepest = 5e-4;  // the geoid leans by up to 1e-4
  constexpr double kRounding = 2e-7;  // of float32 depth, at both ends
  const Pose& pose = a.local_from_camera;
  const Eigen::Vector3d across = pose.rotation * (corners[1] - corners[0]);
  const Eigen::Vector3d down = pose.rotation * (corners[3] - corners[2]);
  const Eigen::Vector3d normal = across.cross(down);
  const Eigen::Vector3d place = pose * corners[0];
  const Eigen::Vector3d up =
      Eigen::Vector3d(place.x() / kEarth_m, place.y() / kEarth_m, 1.0).normalized();
  const double lean = normal.normalized().cross(up).norm();
  const double thinnest = std::min(across.norm(), normal.norm() / std::max(across.norm(), 1e-300));
  return lean < kSteepest + kRounding * corners[0].norm() / std::max(thinnest, 1e-300);
}

/// Gauss-Newton on the difference of the normalised patches.
void align(const core::ImageF& image, const Patch& patch, bool has_shading, PatchMatch& match) {
  constexpr double kLeastPower = kLeastContrast * kLeastContrast * kPatchPixels;
  PatchValues of_a = patch.values;
  take_off(of_a, has_shading);
  const double power_a = product_of(of_a, of_a);
  if (power_a < kLeastPower) return;
  constexpr int kMostTurns = 8;
  constexpr double kFarthest_px = 3.0;  // half the patch: farther off it is another place
  Eigen::Vector2d shift = Eigen::Vector2d::Zero();
  for (int turn = 0; turn < kMostTurns; ++turn) {
    PatchValues of_b, by_x, by_y;
    for (std::size_t k = 0; k < kPatchPixels; ++k) {
      const Eigen::Vector2d at = patch.predicted[k] + shift;
      if (!has_cubic_support(image, at)) return;
      const CubicSample seen = sample_cubic(image, at);
      of_b[k] = seen.value;
      by_x[k] = seen.gradient.x();
      by_y[k] = seen.gradient.y();
    }
    for (PatchValues* values : {&of_b, &by_x, &by_y}) take_off(*values, has_shading);
    const double power_b = product_of(of_b, of_b);
    if (power_b < kLeastPower) return;
    const double product = product_of(of_a, of_b);
    if (turn == 0) match.correlation = product / std::sqrt(power_a * power_b);
    const double gain = product / power_b;
    PatchValues difference;
    for (std::size_t k = 0; k < kPatchPixels; ++k) difference[k] = of_a[k] - gain * of_b[k];
    Eigen::Matrix2d normal;
    normal << product_of(by_x, by_x), product_of(by_x, by_y),  //
        product_of(by_x, by_y), product_of(by_y, by_y);
    const Eigen::Vector2d right(product_of(by_x, difference), product_of(by_y, difference));
    if (!(gain > 0.2) || normal.determinant() < 0.02 * normal.trace() * normal.trace()) return;
    const Eigen::Vector2d step = normal.inverse() * right / gain;
    shift += step;
    if (!(shift.norm() < kFarthest_px)) return;
    if (step.norm() < 2e-3) {
      match.shift_px = shift;
      match.has_converged = true;
      return;
    }
  }
}

}  // namespace

Eigen::Matrix<double, 2, 3> projection_jacobian(const Intrinsics& camera,
                                                const Eigen::Vector3d& point) {
  Eigen::Matrix<double, 2, 3> jacobian;
  if (camera.plane) {
    // Central differences: with a step of 1e-5 of the distance their error is of 1e-10, and rounding leaves 1e-11.
    // Beside the rim of what the model sees, where one side has no image, those of the other side.
    const double step = 1e-5 * camera.plane->distance_m(point);
    const Eigen::Vector2d here = camera.pixel_from_point(point);
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d shift = step * Eigen::Vector3d::Unit(axis);
      const Eigen::Vector2d after = camera.way_px(here, camera.pixel_from_point(point + shift));
      const Eigen::Vector2d before = camera.way_px(here, camera.pixel_from_point(point - shift));
      if (!before.allFinite())
        jacobian.col(axis) = after / step;
      else if (!after.allFinite())
        jacobian.col(axis) = -before / step;
      else
        jacobian.col(axis) = (after - before) / (2.0 * step);
    }
    return jacobian;
  }
  const double inverse = 1.0 / point.z();
  jacobian << camera.fx_px * inverse, 0.0, -camera.fx_px * point.x() * inverse * inverse,  //
      0.0, camera.fy_px * inverse, -camera.fy_px * point.y() * inverse * inverse;
  if (camera.lens.kind == Lens::Kind::None) return jacobian;
  const Eigen::Vector2d focal_px(camera.fx_px, camera.fy_px);
  return focal_px.asDiagonal() * camera.lens.jacobian(point.hnormalized()) *
         focal_px.cwiseInverse().asDiagonal() * jacobian;
}

Eigen::Matrix<double, 3, 2> unprojection_jacobian(const Intrinsics& camera,
                                                  const Eigen::Vector2d& pixel, double distance_m) {
  constexpr double kStep_px = 1e-3;
  Eigen::Matrix<double, 3, 2> jacobian;
  const Eigen::Vector3d here = camera.point_from_pixel(pixel, distance_m);
  for (int axis = 0; axis < 2; ++axis) {
    const Eigen::Vector2d shift = kStep_px * Eigen::Vector2d::Unit(axis);
    const Eigen::Vector3d after = camera.point_from_pixel(pixel + shift, distance_m);
    const Eigen::Vector3d before = camera.point_from_pixel(pixel - shift, distance_m);
    if (!before.allFinite())
      jacobian.col(axis) = (after - here) / kStep_px;
    else if (!after.allFinite())
      jacobian.col(axis) = (here - before) / kStep_px;
    else
      jacobian.col(axis) = (after - before) / (2.0 * kStep_px);
  }
  return jacobian;
}

double pixels_per_metre(const Intrinsics& camera, double distance_m) {
  if (!camera.plane) return camera.fx_px / distance_m;
  const double metres_per_pixel =
      unprojection_jacobian(camera, 0.5 * Eigen::Vector2d(camera.width_px, camera.height_px),
                            distance_m)
          .col(0)
          .norm();
  return metres_per_pixel > 0.0 ? 1.0 / metres_per_pixel : 0.0;
}

CubicSample sample_cubic(const core::ImageF& image, const Eigen::Vector2d& pixel) {
  const Corner corner = corner_of(pixel);
  const float* rows[4];
  for (int j = 0; j < 4; ++j) rows[j] = &image(corner.x - 1, corner.y - 1 + j);
  return interpolate(corner, [&](int i, int j) { return static_cast<double>(rows[j][i]); });
}

MedianEstimate estimate_median(std::vector<double>& values, double values_per_fact) {
  const auto count = static_cast<double>(values.size());
  const double reach = 0.5 *
                       student_quantile(kFalseVerdict, std::numeric_limits<double>::infinity()) *
                       std::sqrt(count * values_per_fact);
  const double low = std::floor(0.5 * count - reach);
  const double high = std::ceil(0.5 * count + reach);
  if (low < 0.0 || high >= count) return {median(values), std::numeric_limits<double>::infinity()};
  std::sort(values.begin(), values.end());
  const double middle = values[values.size() / 2];
  return {middle, std::max(middle - values[static_cast<std::size_t>(low)],
                           values[static_cast<std::size_t>(high)] - middle)};
}

std::optional<InverseDepthSample> sample_inverse_depth(const core::ImageF& depth,
                                                       const Eigen::Vector2d& pixel) {
  if (!has_cubic_support(depth, pixel)) return std::nullopt;
  const Corner corner = corner_of(pixel);
  double inverse[4][4];
  double least = 1e300;
  double greatest = 0.0;
  for (int j = 0; j < 4; ++j)
    for (int i = 0; i < 4; ++i) {
      const double value = 1.0 / static_cast<double>(depth(corner.x - 1 + i, corner.y - 1 + j));
      if (!(value > 0.0)) return std::nullopt;
      inverse[j][i] = value;
      least = std::min(least, value);
      greatest = std::max(greatest, value);
    }
  double squares = 0.0;
  for (int j = 0; j < 4; ++j)
    for (int i = 0; i < 2; ++i) {
      const double along_x = inverse[j][i] - 2.0 * inverse[j][i + 1] + inverse[j][i + 2];
      const double along_y = inverse[i][j] - 2.0 * inverse[i + 1][j] + inverse[i + 2][j];
      squares += along_x * along_x + along_y * along_y;
    }
  InverseDepthSample sample;
  sample.inverse_depth = interpolate(corner, [&](int i, int j) { return inverse[j][i]; });
  sample.roughness = 0.25 * std::sqrt(squares / 16.0) / inverse[1][1];
  sample.nearest_m = 1.0 / greatest;
  sample.farthest_m = 1.0 / least;
  return sample;
}

std::optional<PatchMatch> match_patch(const View& a, const View& b, int x, int y) {
  const core::ImageF& grey = a.image->grey;
  const core::ImageF& depth = a.image->depth;
  if (grey.empty() || depth.empty() || b.image->grey.empty() || x < kPatchRadius_px ||
      y < kPatchRadius_px || x + kPatchRadius_px >= grey.width() ||
      y + kPatchRadius_px >= grey.height())
    return std::nullopt;
  const Transfer transfer(a, b);
  Patch patch;
  PatchMatch match;
  std::array<Eigen::Vector3d, 4> corners;  // left, right, top, bottom
  std::size_t k = 0;
  for (int dy = -kPatchRadius_px; dy <= kPatchRadius_px; ++dy)
    for (int dx = -kPatchRadius_px; dx <= kPatchRadius_px; ++dx, ++k) {
      const auto depth_m = static_cast<double>(depth(x + dx, y + dy));
      if (!std::isfinite(depth_m)) return std::nullopt;
      const auto place = transfer.point({x + dx + 0.5, y + dy + 0.5}, depth_m);
      if (!place || !(place->distance_b_m > 1e-3 * depth_m)) return std::nullopt;
      patch.values[k] = static_cast<double>(grey(x + dx, y + dy));
      patch.predicted[k] = place->pixel;
      if (!has_cubic_support(b.image->grey, patch.predicted[k])) return std::nullopt;
      if (dx == 0 && dy == 0) match.place = *place;
      if (dy == 0 && std::abs(dx) == kPatchRadius_px) corners[dx < 0 ? 0 : 1] = place->point_a;
      if (dx == 0 && std::abs(dy) == kPatchRadius_px) corners[dy < 0 ? 2 : 3] = place->point_a;
    }
  match.is_level = lies_level(a, corners);
  match.own_correlation = own_correlation_at(a.image->color, x, y, has_shading(a, b));
  if (!b.image->depth.empty()) {  // a patch that something hides in `b` is no match
    const auto seen = sample_inverse_depth(b.image->depth, match.place.pixel);
    if (!seen || std::abs(seen->inverse_depth.value * match.place.distance_b_m - 1.0) > 0.02)
      return std::nullopt;
    match.is_resolved = seen->roughness < kResolvedRoughness;
  }
  match.is_resolved = match.is_resolved && is_resolved(depth, x, y);
  if (!patch.keeps_its_size()) return std::nullopt;
  align(b.image->grey, patch, has_shading(a, b), match);
  if (match.correlation == 0.0) return std::nullopt;
  return match;
}

std::optional<PatchMatch> match_patch_by_disparity(const View& left, const View& right, int x,
                                                   int y) {
  const core::ImageF& grey = left.image->grey;
  const core::ImageF& disparity = left.image->disparity;
  if (grey.empty() || disparity.empty() || right.image->grey.empty() || x < kPatchRadius_px ||
      y < kPatchRadius_px || x + kPatchRadius_px >= grey.width() ||
      y + kPatchRadius_px >= grey.height())
    return std::nullopt;
  Patch patch;
  PatchMatch match;
  std::size_t k = 0;
  for (int dy = -kPatchRadius_px; dy <= kPatchRadius_px; ++dy)
    for (int dx = -kPatchRadius_px; dx <= kPatchRadius_px; ++dx, ++k) {
      const auto shift_px = static_cast<double>(disparity(x + dx, y + dy));
      if (!std::isfinite(shift_px)) return std::nullopt;
      patch.values[k] = static_cast<double>(grey(x + dx, y + dy));
      patch.predicted[k] = {x + dx + 0.5 - shift_px, y + dy + 0.5};
      if (!has_cubic_support(right.image->grey, patch.predicted[k])) return std::nullopt;
      if (dx == 0 && dy == 0) match.place.pixel = patch.predicted[k];
    }
  align(right.image->grey, patch, has_shading(left, right), match);
  if (match.correlation == 0.0) return std::nullopt;
  return match;
}

}  // namespace terracast::validate
