#include "validate/evidence.h"

#include <fmt/format.h>

#include <algorithm>
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
  double Evidence::Bounds::*worth_finding;
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

int block_of(const Intrinsics& camera, const Eigen::Vector2d& pixel) {
  constexpr int kSide = 4;
  const auto part = [](double at, int size) {
    return std::clamp(static_cast<int>(kSide * at / size), 0, kSide - 1);
  };
  return kSide * part(pixel.y(), camera.height_px) + part(pixel.x(), camera.width_px);
}

Evidence::Sum& Evidence::Sum::operator+=(const Sum& other) {
  slope_residual += other.slope_residual;
  slope_slope += other.slope_slope;
  weight += other.weight;
  residual_squares += other.residual_squares;
  products += other.products;
  slope_squares += other.slope_squares;
  common += other.common;
  return *this;
}

namespace {

/// The sums of one correction over the residuals of a pair, block by block.
class BlockSums {
 public:
  void add(const Residual& residual, double weight, double slope) {
    const double product = weight * slope * residual.value;
    const double square = weight * slope * slope;
    auto& block = blocks_[static_cast<std::size_t>(residual.block)];
    block[0] += product;
    block[1] += square;
    sum_.slope_residual += product;
    sum_.slope_slope += square;
    sum_.weight += weight;
    slopes_[static_cast<std::size_t>(residual.axis)] += weight * slope;
  }
  Evidence::Sum done(const std::array<double, 2>& common) const {
    Evidence::Sum sum = sum_;
    for (const auto& [product, square] : blocks_) {
      sum.residual_squares += product * product;
      sum.products += product * square;
      sum.slope_squares += square * square;
    }
    for (std::size_t axis = 0; axis < 2; ++axis)
      sum.common += common[axis] * std::abs(slopes_[axis]);
    return sum;
  }

 private:
  Evidence::Sum sum_;
  std::array<std::array<double, 2>, kNumBlocks> blocks_{};  ///< slope_residual, slope_slope
  std::array<double, 2> slopes_{};
};
using BlockSumsOfAll = std::array<BlockSums, kNumCorrections>;

}  // namespace

Evidence::Part Evidence::sum(const ViewPair& pair, const std::vector<Residual>& residuals,
                             const std::array<double, 2>& common) {
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
  std::array<BlockSumsOfAll, 2> sides, of_frames;
  BlockSumsOfAll both;
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
      sides[0][cause].add(residual, weight, a);
      sides[1][cause].add(residual, weight, b);
      both[cause].add(residual, weight, a + b);
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
          of_frames[0][cause].add(residual, weight, local[0][axis] + local[1][axis]);
        } else {
          of_frames[0][cause].add(residual, weight, local[0][axis]);
          of_frames[1][cause].add(residual, weight, local[1][axis]);
        }
      }
    }
    ++part.num_residuals;
  }
  const auto finish = [&](const BlockSumsOfAll& from, Sums& to) {
    for (std::size_t cause = 0; cause < kNumCorrections; ++cause)
      to[cause] = from[cause].done(common);
  };
  for (std::size_t side = 0; side < 2; ++side) {
    finish(sides[side], part.sides[side]);
    finish(of_frames[side], part.of_frames[side]);
  }
  finish(both, part.both);
  return part;
}

void Evidence::Target::add(const Sums& more, const std::array<int, 2>& of_frames) {
  for (std::size_t cause = 0; cause < kNumCorrections; ++cause) {
    sums[cause] += more[cause];
    for (std::size_t side = 0; side < (of_frames[0] == of_frames[1] ? 1 : 2); ++side) {
      auto& cluster = frames[of_frames[side]][cause];
      cluster[0] += more[cause].slope_residual;
      cluster[1] += more[cause].slope_slope;
    }
  }
}

void Evidence::add(const Part& part) {
  if (part.num_residuals == 0) return;
  num_residuals_ += part.num_residuals;
  const auto& [a, b] = part.cameras;
  cameras_[-1].add(part.both, part.frames);
  if (a == b) {
    cameras_[a].add(part.both, part.frames);
  } else {
    cameras_[a].add(part.sides[0], part.frames);
    cameras_[b].add(part.sides[1], part.frames);
  }
  for (std::size_t side = 0; side < 2; ++side)
    images_[{part.cameras[side], part.frames[side]}].add(part.sides[side], part.frames);
  images_[{-1, part.frames[0]}].add(part.of_frames[0], part.frames);
  if (part.frames[0] != part.frames[1])
    images_[{-1, part.frames[1]}].add(part.of_frames[1], part.frames);
  for (std::size_t side = 0; side < 2; ++side)
    if (part.pixels_per_metre[side] > 0.0)
      pixels_per_metre_[part.cameras[side]] = pixels_per_metre_[-1] = part.pixels_per_metre[side];
}

Estimate Evidence::estimate(const Target& target, int cause, double factor, const Bounds& bounds,
                            double allowance, std::string where) const {
  const auto index = static_cast<std::size_t>(cause);
  const Sum& sum = target.sums[index];
  const double correction = -sum.slope_residual / sum.slope_slope;
  double of_frames = 0.0, squares = 0.0, total = 0.0;
  for (const auto& [frame, clusters] : target.frames) {
    const double score = clusters[index][0] + correction * clusters[index][1];
    of_frames += score * score;
    squares += clusters[index][1] * clusters[index][1];
    total += clusters[index][1];
  }
  const double factor_of_sum = factor / sum.slope_slope;
  const double pattern =
      bounds.pattern + bounds.rounding + (cause == kTime ? bounds.time_pattern : 0.0);
  // Sixteenths are many, and tell what they scatter by well; frames are few, and tell whether what all of a frame
  // have in common adds to it.
  const double of_blocks =
      bounds.shared *
      std::max(0.0, sum.residual_squares +
                        correction * (2.0 * sum.products + correction * sum.slope_squares));
  const double excess = std::max(of_frames - of_blocks, 0.0);
  // One of them the fit takes: of a single sixteenth nothing is left.
  const double num_blocks = sum.slope_slope * sum.slope_slope / sum.slope_squares - 1.0;
  const double num_frames = total * total / squares - 1.0;
  Estimate estimate;
  estimate.value = factor * correction;
  estimate.standard_error = factor_of_sum * std::sqrt(of_blocks + excess);
  estimate.degrees = num_blocks;
  if (excess > 0.0)
    estimate.degrees = (of_blocks + excess) * (of_blocks + excess) /
                       (of_blocks * of_blocks / num_blocks + excess * excess / num_frames);
  estimate.allowance = allowance + factor * pattern * std::sqrt(sum.weight / sum.slope_slope) +
                       factor_of_sum * sum.common;
  estimate.where = std::move(where);
  return estimate;
}

std::vector<int> Evidence::cameras_without_residuals(const Sequence& sequence,
                                                     std::string FrameFiles::*file) const {
  std::vector<int> cameras;
  for (int camera = 0; camera < static_cast<int>(sequence.cameras.size()); ++camera) {
    const std::vector<FrameFiles>& files = sequence.cameras[static_cast<std::size_t>(camera)].files;
    const bool has_files = std::any_of(
        files.begin(), files.end(), [&](const FrameFiles& each) { return !(each.*file).empty(); });
    if (has_files && !cameras_.contains(camera)) cameras.push_back(camera);
  }
  return cameras;
}

std::vector<CheckResult> Evidence::results(const std::string& prefix, const Sequence& sequence,
                                           const Bounds& bounds, std::string FrameFiles::*file,
                                           const std::string& what,
                                           const std::string& detects) const {
  const auto camera_name = [&](int index) {
    return index < 0 ? std::string("all cameras alike")
                     : sequence.cameras[static_cast<std::size_t>(index)].name;
  };
  std::vector<CheckResult> results;
  for (const Judged& judged : kJudged) {
    const double worth_finding = bounds.*judged.worth_finding;
    if (worth_finding <= 0.0) continue;
    const double allowance = 0.1 * worth_finding;
    if (judged.first == kLineTime && !sequence.has_rolling_shutters()) continue;
    Estimates estimates(worth_finding);
    std::map<int, CheckResult::Plot> plots;
    for (int cause = judged.first; cause <= judged.last; ++cause) {
      const auto index = static_cast<std::size_t>(cause);
      const std::string axis =
          std::string(kAxes[cause]).empty() ? "" : std::string(", ") + kAxes[cause];
      const auto add = [&](const Target& target, double factor, std::string where,
                           const std::string& part) {
        if (!(target.sums[index].slope_slope > 0.0)) return estimates.add_unseen(part);
        Estimate found = estimate(target, cause, factor, bounds, allowance, std::move(where));
        found.part = part;
        estimates.add(std::move(found));
      };
      const auto has_it = [&](int camera) {
        return judged.first != kLineTime || camera < 0 ||
               sequence.cameras[static_cast<std::size_t>(camera)].shutter.has_value();
      };
      if (judged.is_of_cameras) {
        for (const auto& [camera, target] : cameras_)
          if (has_it(camera))
            add(target, judged.factor, camera_name(camera) + ", all frames" + axis,
                camera < 0 ? "" : camera_name(camera));
        for (const int camera : cameras_without_residuals(sequence, file))
          if (has_it(camera)) estimates.add_unseen(camera_name(camera));
      }
      if (!judged.is_of_images) continue;
      for (const auto& [image, target] : images_) {
        const auto pixels = pixels_per_metre_.find(image.first);
        const double factor = cause >= kPositionX
                                  ? (pixels == pixels_per_metre_.end() ? 0.0 : pixels->second)
                                  : judged.factor;
        if (factor <= 0.0) continue;
        add(target, factor,
            fmt::format("{}, frame {}{}", camera_name(image.first), image.second, axis), "");
        const Sum& sum = target.sums[index];
        if (!(sum.slope_slope > 0.0)) continue;
        CheckResult::Plot& plot = plots[cause];
        plot.title = fmt::format("{}{} that each image asks for", judged.title, axis);
        plot.x_label = "image (all cameras of a frame alike, then each camera's frames)";
        plot.y_label = judged.unit;
        plot.x.push_back(static_cast<double>(plot.x.size()));
        plot.y.push_back(-factor * sum.slope_residual / sum.slope_slope);
      }
    }
    CheckResult result;
    result.name = prefix + "_" + judged.suffix;
    result.unit = judged.unit;
    estimates.judge(result);
    if (result.skipped) result.worst = "the motion and the ground of this dataset do not show it";
    result.summary = fmt::format(
        "The correction of the {} that explains {} best, each alone: {} of {} corrections could be "
        "told to {:.3g} {}, from {} residuals.",
        judged.title, what, estimates.num_seen(), estimates.num_all(), worth_finding, judged.unit,
        num_residuals_);
    result.reason = fmt::format(
        "In a right dataset it is 0 to within {:.3g} {}, a tenth of the smallest error to be "
        "found, plus what "
        "systematic errors of matching and rounding allow, plus what its standard error leaves "
        "with "
        "a probability of 1e-9.",
        allowance, judged.unit);
    result.detects = detects;
    for (auto& [cause, plot] : plots) result.plots.push_back(std::move(plot));
    results.push_back(std::move(result));
  }
  return results;
}

}  // namespace terracast::validate
