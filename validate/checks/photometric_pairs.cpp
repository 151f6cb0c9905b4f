#include "validate/checks/photometric_pairs.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "validate/checks/checker.h"
#include "validate/transfer.h"

namespace terracast::validate {

namespace {

/// What a correlation counts as. Leaves that are finer than a pixel fall on others in each image: a forest correlates
/// by 0.5 to 0.65 where other ground does by 0.05; so there it counts twice.
double worth_of(const PatchMatch& match) {
  return match.is_resolved ? match.correlation : std::min(1.0, 2.0 * match.correlation);
}

/// Mean colour of 3 x 3 pixels.
Eigen::Vector3d color_around(const core::Image8& color, int x, int y) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int dy = -1; dy <= 1; ++dy)
    for (int dx = -1; dx <= 1; ++dx)
      for (int k = 0; k < 3; ++k) sum[k] += color(x + dx, y + dy, k);
  return sum / 9.0;
}

using ColorPair = std::array<Eigen::Vector3d, 2>;

double luma_of(const Eigen::Vector3d& c) { return 0.299 * c[0] + 0.587 * c[1] + 0.114 * c[2]; }
bool is_grey(const Eigen::Vector3d& c) { return c[0] == c[1] && c[1] == c[2]; }

/// Compares colours of places in two images; one that is grey is compared with the other's luma. What the second image
/// is brighter by all over, as with an exposure of its own, tells nothing, in either order of the channels.
ColorDifferences compare_colors(std::vector<ColorPair> pairs) {
  constexpr double kFull = 254.0;  // beyond it colours are cut to white
  std::erase_if(pairs, [&](const ColorPair& pair) {
    return (is_grey(pair[0]) && is_grey(pair[1])) || pair[0].maxCoeff() > kFull ||
           pair[1].maxCoeff() > kFull;
  });
  // The first of each is in colour.
  for (ColorPair& pair : pairs)
    if (is_grey(pair[0])) std::swap(pair[0], pair[1]);
  const auto swapped = [](const Eigen::Vector3d& c) { return Eigen::Vector3d(c[2], c[1], c[0]); };
  double of_first = 0.0, of_swapped = 0.0, of_second = 0.0;
  for (const ColorPair& pair : pairs) {
    of_first += luma_of(pair[0]);
    of_swapped += luma_of(swapped(pair[0]));
    of_second += luma_of(pair[1]);
  }
  ColorDifferences differences;
  if (!(of_first > 0.0 && of_swapped > 0.0)) return differences;
  for (const auto& [first, second] : pairs) {
    const auto difference = [&second = second, of_second](const Eigen::Vector3d& color,
                                                          double sum) {
      const Eigen::Vector3d as_bright = of_second / sum * color;
      return is_grey(second) ? std::abs(luma_of(as_bright) - second[0])
                             : (as_bright - second).cwiseAbs().sum() / 3.0;
    };
    differences.add(difference(first, of_first), difference(swapped(first), of_swapped));
  }
  return differences;
}

/// What shifts of patches between two images may all be off by alike: where the images move by the same part of a pixel
/// all over, matching pulls towards whole pixels, and by the more the less sure it is. Measured on pairs of right
/// datasets (docs/validate.md, Verdicts), it is up to the median deviation where that is small, and a quarter of it beyond.
double locking_px(std::vector<double> shifts) {
  const double middle = median(shifts);
  for (double& shift : shifts) shift = std::abs(shift - middle);
  const double deviation = median(shifts);
  return std::min(1.2 * deviation, 0.02 + 0.25 * deviation);
}

}  // namespace

void ColorDifferences::add(double difference, double swapped_difference) {
  ++num_patches;
  right += difference;
  swapped += swapped_difference;
  right_squares += difference * difference;
  products += difference * swapped_difference;
  swapped_squares += swapped_difference * swapped_difference;
}

ColorDifferences& ColorDifferences::operator+=(const ColorDifferences& other) {
  num_patches += other.num_patches;
  right += other.right;
  swapped += other.swapped;
  right_squares += other.right_squares;
  products += other.products;
  swapped_squares += other.swapped_squares;
  return *this;
}

Estimate ColorDifferences::swapped_fits_better(double patches_per_fact) const {
  // What stands between two cameras is bluer than what is near: the farther image is nearer to swapped colours.
  constexpr double kHaze = 0.18;  // log 1.2; of 500 right datasets the most was 0.03
  Estimate estimate;
  estimate.allowance = kHaze;
  constexpr std::int64_t kEnough = 20;
  estimate.degrees =
      num_patches < kEnough ? 0.0 : static_cast<double>(num_patches) / patches_per_fact - 1.0;
  if (!(right > 0.0)) return estimate;
  // The error of a ratio of sums, from what each patch departs from it.
  constexpr double kRounding = 0.1;  // levels, of means of nine
  const double ratio = right / swapped;
  const double squares =
      std::max(static_cast<double>(num_patches) * kRounding * kRounding,
               right_squares - ratio * (2.0 * products - ratio * swapped_squares));
  estimate.value = std::max(0.0, std::log(ratio));
  estimate.standard_error = std::sqrt(patches_per_fact * squares) / right;
  return estimate;
}

double ColorDifferences::right_fits_better() const {
  return right > 0.0 ? std::max(0.0, std::log(swapped / right))
                     : std::numeric_limits<double>::infinity();
}

PairMatches compare_patches(const ViewPair& pair, const ValidateOptions& options) {
  PairMatches matches;
  const std::int64_t count = std::max<std::int64_t>(options.samples_per_image / 10, 1);
  const std::uint64_t salt = (static_cast<std::uint64_t>(pair.b.frame) * 1000 +
                              static_cast<std::uint64_t>(pair.b.camera_index)) |
                             1ULL << 40;
  std::vector<Residual> residuals;
  std::vector<ColorPair> colors;
  const Transfer transfer(pair.a, pair.b);
  // What makes a rig's world grey is another gain in each rig.
  const std::string& white = pair.a.camera->imaging.white_balance;
  matches.is_of_one_white =
      pair.a.camera_index == pair.b.camera_index ||
      (white == pair.b.camera->imaging.white_balance && white != "grey_world");
  for (const Eigen::Vector2i& at :
       draw_pixels(pair.a.camera->intrinsics, count, options, pair.a, salt)) {
    const std::optional<PatchMatch> match = match_patch(pair.a, pair.b, at.x(), at.y());
    if (!match) continue;
    if (match->is_level) {
      ++matches.num_level;
      continue;
    }
    matches.own.push_back(match->own_correlation);
    matches.correlation.push_back(worth_of(*match));
    if (!match->is_resolved) ++matches.num_unresolved;
    if (matches.is_of_one_white)
      colors.push_back({color_around(pair.a.image->color, at.x(), at.y()),
                        color_around(pair.b.image->color, static_cast<int>(match->place.pixel.x()),
                                     static_cast<int>(match->place.pixel.y()))});
    // Leaves finer than pixels, others in each image, shift patches as they like: of woods and gardens in
    // hundreds of patches by enough to look like a turn of all cameras by 0.012 degrees.
    if (!match->has_converged || !match->is_resolved) continue;
    matches.shift_x.push_back(match->shift_px.x());
    matches.shift_y.push_back(match->shift_px.y());
    const Intrinsics& k_b = pair.b.camera->intrinsics;
    const Eigen::Matrix<double, 2, 3> jacobian = projection_jacobian(k_b, match->place.point_b);
    for (int axis = 0; axis < 2; ++axis) {
      Residual residual;  // seen minus predicted: a correction that moves the prediction lowers it
      residual.value = match->shift_px[axis];
      residual.axis = axis;
      residual.block = block_of(pair.a.camera->intrinsics, {at.x() + 0.5, at.y() + 0.5});
      const double from_centre = match->place.pixel[axis] - (axis == 0 ? k_b.cx_px : k_b.cy_px);
      set_slopes(residual, pair, transfer, match->place, -jacobian.row(axis),
                 axis == 0 ? Eigen::Vector2d(-1.0, 0.0) : Eigen::Vector2d(0.0, -1.0), -from_centre,
                 0.0);
      residuals.push_back(residual);
    }
  }
  matches.colors = compare_colors(std::move(colors));
  matches.patches_per_fact =
      patches_per_fact(matches.correlation.size(), pair.a.camera->intrinsics.width_px,
                       pair.a.camera->intrinsics.height_px);
  matches.part =
      Evidence::sum(pair, residuals, {locking_px(matches.shift_x), locking_px(matches.shift_y)});
  return matches;
}

Likeness likeness_of(const PairMatches& matches, bool is_sure) {
  // Other ground has been seen to correlate by 0.3.
  constexpr double kLeastTold = 0.3;
  std::vector<double> correlation = matches.correlation, own = matches.own;
  const MedianEstimate estimate = estimate_median(correlation, matches.patches_per_fact);
  Likeness likeness;
  likeness.median = estimate.median;
  likeness.most = estimate.median + (is_sure ? estimate.unsure : 0.0);
  likeness.own = median(own);
  likeness.bound = std::min(kLeastCorrelation, likeness.own);
  likeness.tells = (!is_sure || std::isfinite(estimate.unsure)) && likeness.bound > kLeastTold;
  return likeness;
}

}  // namespace terracast::validate
