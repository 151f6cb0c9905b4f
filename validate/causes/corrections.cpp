#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "validate/causes/trial.h"
#include "validate/checks/checker.h"
#include "validate/evidence.h"
#include "validate/sampling.h"
#include "validate/transfer.h"

/// Small errors of intrinsics, mounts, poses, scale and of the time of lines, by joint least squares of each
/// family's parameters on what two views disagree about. Families are told apart by what is left
/// when their correction is applied.
namespace terracast::validate {

namespace {

/// One family: parameters that change together, of one camera, of all alike, or of one image.
struct Family {
  int first = 0;
  int last = 0;
  int camera = -1;  ///< -1: all alike
  int frame = -1;   ///< -1: all
  int rank = 0;
};

enum class Source { Depth, Flow };

/// A residual with both sides' slopes, of a pair.
struct Sample {
  Residual residual;
  std::array<int, 2> cameras, frames;
  std::array<Eigen::Matrix3d, 2> local_from_camera;
};

void add_depth_samples(const ViewPair& pair, std::vector<Sample>& samples) {
  if (pair.b.image->depth.empty()) return;
  const Intrinsics& k_b = pair.b.camera->intrinsics;
  const Transfer transfer(pair.a, pair.b);
  constexpr std::int64_t kPixels = 200;
  for (const Eigen::Vector2i& at :
       draw_pixels(pair.a.camera->intrinsics, kPixels, {}, pair.a, 11)) {
    const auto depth_m = static_cast<double>(pair.a.image->depth(at.x(), at.y()));
    if (!std::isfinite(depth_m)) continue;
    const auto place = transfer.point({at.x() + 0.5, at.y() + 0.5}, depth_m);
    if (!place || !(place->distance_b_m > 1e-3 * depth_m)) continue;
    const Eigen::Vector3d& point_b = place->point_b;
    const double predicted_m = place->distance_b_m;
    const Eigen::Vector2d& pixel = place->pixel;
    const auto seen = sample_inverse_depth(pair.b.image->depth, pixel);
    if (!seen) continue;
    Sample sample;
    const double r = seen->inverse_depth.value * predicted_m - 1.0;
    if (std::abs(r) > 0.1) continue;
    sample.residual.value = r;
    sample.residual.sigma = std::max(seen->roughness, 2e-5);
    const Eigen::RowVector2d by_pixel = predicted_m * seen->inverse_depth.gradient.transpose();
    Eigen::RowVector3d by_point = by_pixel * projection_jacobian(k_b, point_b);
    by_point += seen->inverse_depth.value * k_b.distance_gradient(point_b);
    set_slopes(sample.residual, pair, transfer, *place, by_point, by_pixel.transpose(),
               by_pixel.x() * (pixel.x() - k_b.cx_px) + by_pixel.y() * (pixel.y() - k_b.cy_px),
               -(1.0 + r));
    sample.cameras = {pair.a.camera_index, pair.b.camera_index};
    sample.frames = {pair.a.frame, pair.b.frame};
    samples.push_back(sample);
  }
}

void add_flow_samples(const ViewPair& pair, std::vector<Sample>& samples) {
  const bool is_forward = pair.a.frame + 1 == pair.b.frame;
  if (pair.a.camera_index != pair.b.camera_index ||
      (!is_forward && pair.a.frame != pair.b.frame + 1))
    return;
  const LoadedImage& holder = *(is_forward ? pair.a : pair.b).image;
  if (!holder.flow) return;
  const core::ImageF& flow = is_forward ? holder.flow->forward : holder.flow->backward;
  if (flow.empty()) return;
  const Intrinsics& k = pair.b.camera->intrinsics;
  const Transfer transfer(pair.a, pair.b);
  constexpr std::int64_t kPixels = 200;
  for (const Eigen::Vector2i& at :
       draw_pixels(pair.a.camera->intrinsics, kPixels, {}, pair.a, 12)) {
    const auto depth_m = static_cast<double>(pair.a.image->depth(at.x(), at.y()));
    if (!std::isfinite(depth_m)) continue;
    const Eigen::Vector2d pixel(at.x() + 0.5, at.y() + 0.5);
    const auto place = transfer.point(pixel, depth_m);
    if (!place || !(place->distance_b_m > 0.05 * depth_m)) continue;
    const Eigen::Vector2d& target = place->pixel;
    const Eigen::Matrix<double, 2, 3> jacobian = projection_jacobian(k, place->point_b);
    for (int axis = 0; axis < 2; ++axis) {
      Sample sample;
      sample.residual.value =
          static_cast<double>(flow(at.x(), at.y(), axis)) - (target[axis] - pixel[axis]);
      sample.residual.sigma = 1e-3;
      set_slopes(sample.residual, pair, transfer, *place, -jacobian.row(axis),
                 axis == 0 ? Eigen::Vector2d(-1.0, 0.0) : Eigen::Vector2d(0.0, -1.0),
                 -(target[axis] - (axis == 0 ? k.cx_px : k.cy_px)), 0.0);
      sample.cameras = {pair.a.camera_index, pair.b.camera_index};
      sample.frames = {pair.a.frame, pair.b.frame};
      samples.push_back(sample);
    }
  }
}

std::vector<Sample> samples_of(const Trial& trial, Source source) {
  std::vector<Sample> samples;
  Findings ignored;
  FrameWindow window(*trial.dataset, trial.sequence, ignored, trial.images);
  while (window.advance()) {
    const std::vector<ViewPair> pairs = window.pairs();
    trial.spend(pairs.size());
    for (const ViewPair& pair : pairs) {
      if (pair.a.image->depth.empty()) continue;
      if (source == Source::Depth)
        add_depth_samples(pair, samples);
      else
        add_flow_samples(pair, samples);
    }
  }
  return samples;
}

/// The slope of a sample by a parameter of a family.
double slope_of(const Sample& sample, const Family& family, int parameter) {
  double slope = 0.0;
  for (std::size_t side = 0; side < 2; ++side) {
    if (family.camera >= 0 && sample.cameras[side] != family.camera) continue;
    if (family.frame >= 0 && sample.frames[side] != family.frame) continue;
    slope += sample.residual.slopes[side][static_cast<std::size_t>(parameter)];
  }
  return slope;
}

/// What a correction leaves: sum of weighted squares, cut off where outliers begin.
double cost_of(const std::vector<Sample>& samples, double cut) {
  double cost = 0.0;
  for (const Sample& sample : samples) {
    const double size = sample.residual.value / (sample.residual.sigma * cut);
    cost += std::min(1.0, size * size);
  }
  return cost;
}

/// One step of least squares; outliers are cut at `cut` sigmas.
/// returns  nothing where the samples do not tell the parameters
std::optional<Eigen::VectorXd> solve(const std::vector<Sample>& samples, const Family& family,
                                     double cut, double& predicted_gain) {
  const int count = family.last - family.first + 1;
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(count, count);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(count);
  Eigen::VectorXd row(count);
  std::size_t num_used = 0;
  for (const Sample& sample : samples) {
    const double size = sample.residual.value / (sample.residual.sigma * cut);
    if (std::abs(size) >= 1.0) continue;
    for (int i = 0; i < count; ++i) row[i] = slope_of(sample, family, family.first + i);
    if (row.isZero()) continue;
    const double weight = 1.0 / (sample.residual.sigma * sample.residual.sigma);
    normal += weight * row * row.transpose();
    right -= weight * row * sample.residual.value;
    ++num_used;
  }
  if (num_used < 50) return std::nullopt;
  const Eigen::LDLT<Eigen::MatrixXd> factored(normal);
  if (factored.info() != Eigen::Success || !factored.isPositive() || factored.rcond() < 1e-12)
    return std::nullopt;
  const Eigen::VectorXd x = factored.solve(right);
  predicted_gain = x.dot(right);
  return x.allFinite() ? std::optional(x) : std::nullopt;
}

Eigen::Matrix3d turn_by(const Eigen::Vector3d& turn_rad) {
  if (turn_rad.isZero()) return Eigen::Matrix3d::Identity();
  return Eigen::AngleAxisd(turn_rad.norm(), turn_rad.normalized()).toRotationMatrix();
}

/// Applies what the dataset needs: `x` is the correction, as Evidence has it.
void apply(Trial& trial, const Family& family, const Eigen::VectorXd& x) {
  for (int c = 0; c < trial.num_cameras(); ++c) {
    if (family.camera >= 0 && c != family.camera) continue;
    Camera& camera = trial.camera(c);
    if (family.first == kPrincipalX) {
      camera.intrinsics.cx_px += x[0];
      camera.intrinsics.cy_px += x[1];
    } else if (family.first == kFocal) {
      camera.intrinsics.fx_px *= 1.0 + x[0];
      camera.intrinsics.fy_px *= 1.0 + x[0];
    } else if (family.first == kLineTime) {
      if (camera.shutter) camera.shutter->line_time_s *= 1.0 + x[0];
    } else if (family.first == kScale) {
      for (int f = 0; f < trial.num_frames(); ++f) {
        if (trial.image(c, f).depth.empty()) continue;
        for (float& value : trial.edit(c, f).depth.data())
          value = static_cast<float>(static_cast<double>(value) * (1.0 + x[0]));
      }
    } else {
      for (int f = 0; f < trial.num_frames(); ++f) {
        auto& pose = camera.local_from_camera[static_cast<std::size_t>(f)];
        if (!pose || (family.frame >= 0 && f != family.frame)) continue;
        if (family.first == kRotationX)
          pose->rotation = pose->rotation * turn_by(x);
        else if (family.first == kPositionX)
          pose->translation += pose->rotation * Eigen::Vector3d(x);
      }
    }
  }
}

struct Fit {
  Family family;
  Trial trial;
  Eigen::VectorXd x;
  double cost = 0.0;
};

constexpr double kCut = 400.0;  // sigmas: a mistake is no outlier

/// One correction after another; factors multiply.
Eigen::VectorXd one_after_another(const Family& family, const Eigen::VectorXd& first,
                                  const Eigen::VectorXd& second) {
  if (family.first != kScale && family.first != kFocal) return first + second;
  return Eigen::VectorXd::Constant(1, (1.0 + first[0]) * (1.0 + second[0]) - 1.0);
}

/// What other cameras see of the points of each camera, over its own depths: a median, by camera.
/// only     the one camera that is asked; -1: all
/// returns  1 for a camera of which others see too little
std::vector<double> depth_ratios(const Trial& trial, int only) {
  std::vector<std::vector<double>> ratios(static_cast<std::size_t>(trial.num_cameras()));
  Findings ignored;
  FrameWindow window(*trial.dataset, trial.sequence, ignored, trial.images);
  while (window.advance()) {
    for (const ViewPair& pair : window.pairs()) {
      const int camera = pair.a.camera_index;
      if ((only >= 0 && camera != only) || pair.b.camera_index == camera ||
          pair.a.image->depth.empty() || pair.b.image->depth.empty())
        continue;
      trial.spend(1);
      const Transfer transfer(pair.a, pair.b);
      constexpr std::int64_t kPixels = 200;
      for (const Eigen::Vector2i& at :
           draw_pixels(pair.a.camera->intrinsics, kPixels, {}, pair.a, 13)) {
        const auto depth_m = static_cast<double>(pair.a.image->depth(at.x(), at.y()));
        if (!std::isfinite(depth_m)) continue;
        const auto place = transfer.point({at.x() + 0.5, at.y() + 0.5}, depth_m);
        if (!place || !(place->distance_b_m > 1e-3 * depth_m)) continue;
        if (const auto seen = sample_inverse_depth(pair.b.image->depth, place->pixel))
          ratios[static_cast<std::size_t>(camera)].push_back(seen->inverse_depth.value *
                                                             place->distance_b_m);
      }
    }
  }
  constexpr std::size_t kEnough = 100;
  std::vector<double> medians;
  for (std::vector<double>& of_camera : ratios)
    medians.push_back(of_camera.size() < kEnough ? 1.0 : median(of_camera));
  return medians;
}

/// By what the depths of one camera should be longer, less 1, roughly. Where it is far off, all its samples are outliers
/// to least squares.
/// ratio  of depth_ratios()
double rough_scale(Trial trial, const Family& family, double ratio) {
  double scale = 0.0;
  constexpr int kMostTurns = 6;
  for (int turn = 0; turn < kMostTurns; ++turn) {
    const double step = 1.0 / ratio - 1.0;
    const Eigen::VectorXd by = Eigen::VectorXd::Constant(1, step);
    apply(trial, family, by);
    scale = (1.0 + scale) * (1.0 + step) - 1.0;
    constexpr double kNear = 1e-3;
    if (std::abs(step) < kNear) return scale;
    ratio = depth_ratios(trial, family.camera)[static_cast<std::size_t>(family.camera)];
  }
  return 0.0;  // it found no end
}

/// x   a correction to begin with
Fit fit(const Trial& start, const Family& family, Source source, const Eigen::VectorXd& x) {
  Fit result{family, start, x, 0.0};
  apply(result.trial, family, x);
  std::vector<Sample> samples = samples_of(result.trial, source);
  result.cost = cost_of(samples, kCut);
  for (int turn = 0; turn < 4; ++turn) {
    double gain = 0.0;
    const auto step = solve(samples, family, kCut, gain);
    if (!step) break;
    Trial next = result.trial;
    apply(next, family, *step);
    std::vector<Sample> next_samples = samples_of(next, source);
    const double cost = cost_of(next_samples, kCut);
    if (!(cost < result.cost)) break;
    result.trial = std::move(next);
    result.x = one_after_another(family, result.x, *step);
    samples = std::move(next_samples);
    const bool is_done = cost > 0.999 * result.cost;
    result.cost = cost;
    if (is_done) break;
  }
  return result;
}

std::string all_cameras(const Trial& trial) {
  std::vector<int> all(static_cast<std::size_t>(trial.num_cameras()));
  std::iota(all.begin(), all.end(), 0);
  return all.size() == 1 ? "all cameras" : trial.camera_names(all);
}

/// What was wrong is the opposite of the correction.
void describe(const Trial& trial, const Fit& fit, Source source, Cause& cause) {
  const Family& family = fit.family;
  const std::string camera =
      family.camera < 0 ? all_cameras(trial) : trial.camera(family.camera).name;
  const std::string place =
      family.frame < 0 ? camera
                       : fmt::format("{}, frame {}", camera, trial.first_frame + family.frame);
  cause.camera = family.camera < 0 ? "" : camera;
  cause.frame = family.frame < 0 ? -1 : trial.first_frame + family.frame;
  // The dataset is off by the opposite of what it needs; a flow was made with what would fit it.
  const Eigen::VectorXd off =
      source == Source::Flow ? Eigen::VectorXd(fit.x) : Eigen::VectorXd(-fit.x);
  const char* of_flow = source == Source::Flow ? ", as the flow was made with" : "";
  switch (family.first) {
    case kPrincipalX:
      cause.name = "principal_point";
      cause.size = off.norm();
      cause.unit = "px";
      cause.words = fmt::format("{}: principal point off by ({:.2f}, {:.2f}) px{}", place, off[0],
                                off[1], of_flow);
      break;
    case kFocal:
      cause.name = "focal_length";
      cause.size = 100.0 * off[0];
      cause.unit = "%";
      cause.words = fmt::format("{}: focal length off by {:+.3f} %{}", place, cause.size, of_flow);
      break;
    case kScale:
      cause.name = "depth_scale";
      cause.size = 100.0 * (1.0 / (1.0 + fit.x[0]) - 1.0);
      cause.unit = "%";
      cause.words = fmt::format("{}: depth is {:+.3f} % off against the poses", place, cause.size);
      break;
    case kLineTime:
      cause.name = "line_time";
      cause.size = 100.0 * (1.0 / (1.0 + fit.x[0]) - 1.0);
      cause.unit = "%";
      cause.words =
          fmt::format("{}: line_time_s of dataset.json is {:+.3g} % off", place, cause.size);
      break;
    case kRotationX:
      cause.name = "rotation";
      cause.size = degrees_from_radians(off.norm());
      cause.unit = "deg";
      cause.words = fmt::format(
          "{}: rotation off by ({:.4f}, {:.4f}, {:.4f}) deg about right, down, forward", place,
          degrees_from_radians(off[0]), degrees_from_radians(off[1]), degrees_from_radians(off[2]));
      break;
    default:
      cause.name = "position";
      cause.size = off.norm();
      cause.unit = "m";
      cause.words =
          fmt::format("{}: position off by ({:.4f}, {:.4f}, {:.4f}) m right, down, forward", place,
                      off[0], off[1], off[2]);
  }
}

/// Beyond these sizes least squares knows nothing: a gross error is another cause's.
bool is_small(const Fit& fit) {
  const double size = fit.x.norm();
  switch (fit.family.first) {
    case kPrincipalX:
      return size < 50.0;  // px
    case kPositionX:
      return true;  // m, of any scene
    case kScale:
      return std::abs(1.0 / (1.0 + fit.x[0]) - 1.0) < 0.5;  // it begins with a rough one
    default:
      return size < 0.2;  // relative, or rad
  }
}

void add_families(const Symptoms& symptoms, Source source, std::vector<Hypothesis>& hypotheses) {
  const Trial& trial = symptoms.trial;
  std::vector<Family> families;
  const int num_cameras = trial.num_cameras();
  const bool has_more = num_cameras > 1;
  const auto add_for_cameras = [&](int first, int last, int rank) {
    families.push_back({first, last, -1, -1, rank});
    if (has_more)
      for (int c = 0; c < num_cameras; ++c) families.push_back({first, last, c, -1, rank + 1});
  };
  add_for_cameras(kPrincipalX, kPrincipalY, 10);
  add_for_cameras(kFocal, kFocal, 10);
  if (source == Source::Depth) {
    add_for_cameras(kScale, kScale, 10);
    if (trial.sequence.has_rolling_shutters()) add_for_cameras(kLineTime, kLineTime, 10);
    if (has_more)
      for (int c = 0; c < num_cameras; ++c) {
        families.push_back({kRotationX, kRotationZ, c, -1, 12});
        families.push_back({kPositionX, kPositionZ, c, -1, 13});
      }
    families.push_back({kRotationX, kRotationZ, -1, -1, 12});
    for (int f = 0; f < trial.num_frames(); ++f)
      for (int c = has_more ? -1 : 0; c < num_cameras; ++c) {
        families.push_back({kRotationX, kRotationZ, c, f, 14});
        families.push_back({kPositionX, kPositionZ, c, f, 15});
      }
  }
  // One step tells which explain anything; of these the best are followed to their end.
  const std::vector<Sample> samples = samples_of(trial, source);
  std::vector<std::pair<double, Family>> by_gain;
  for (const Family& family : families) {
    double gain = 0.0;
    if (solve(samples, family, kCut, gain)) by_gain.emplace_back(-gain, family);
  }
  std::stable_sort(by_gain.begin(), by_gain.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  constexpr std::size_t kMostFollowed = 5;
  std::vector<Fit> fits;
  const auto nothing_of = [](const Family& family) {
    return Eigen::VectorXd(Eigen::VectorXd::Zero(family.last - family.first + 1));
  };
  for (std::size_t i = 0; i < by_gain.size() && i < kMostFollowed; ++i)
    fits.push_back(fit(trial, by_gain[i].second, source, nothing_of(by_gain[i].second)));
  const auto of_one_camera = [](const Family& family) {
    return family.first == kScale && family.camera >= 0;
  };
  if (std::any_of(families.begin(), families.end(), of_one_camera)) {
    const std::vector<double> ratios = depth_ratios(trial, -1);
    for (const Family& family : families) {
      if (!of_one_camera(family)) continue;
      constexpr double kFarOff = 0.02;
      const double ratio = ratios[static_cast<std::size_t>(family.camera)];
      if (std::abs(ratio - 1.0) < kFarOff) continue;
      const double scale = rough_scale(trial, family, ratio);
      if (std::abs(scale) > kFarOff)
        fits.push_back(fit(trial, family, source, Eigen::VectorXd::Constant(1, scale)));
    }
  }
  std::stable_sort(fits.begin(), fits.end(),
                   [](const Fit& a, const Fit& b) { return a.cost < b.cost; });
  for (std::size_t i = 0; i < fits.size(); ++i) {
    // Another family leaves as little only where the motion does not tell the two apart.
    constexpr double kAsGood = 2.0;
    if (i > 0 && fits[i].cost > kAsGood * fits[0].cost) break;
    if (!is_small(fits[i])) continue;
    Hypothesis h;
    h.checks = source == Source::Depth
                   ? std::vector<std::string_view>{"reprojection", "flow", "photometric"}
                   : std::vector<std::string_view>{"flow"};
    h.rank = 20 + fits[i].family.rank;
    h.undo = [found = fits[i], source](Trial& t, Cause& cause) {
      describe(t, found, source, cause);
      // Georeference.csv was written with the same mistake, if it agreed before.
      t.images = found.trial.images;
      for (int c = 0; c < t.num_cameras(); ++c) {
        t.camera(c).intrinsics = found.trial.camera(c).intrinsics;
        t.camera(c).shutter = found.trial.camera(c).shutter;
        t.camera(c).local_from_camera = found.trial.camera(c).local_from_camera;
      }
      return true;
    };
    if (source == Source::Flow) {
      // Only the flow was made with other intrinsics: what is left of it is judged, not the depth.
      h.marks = {"flow"};
      const double before = cost_of(samples, kCut);
      if (fits[i].cost > 1e-2 * before) continue;
    }
    hypotheses.push_back(std::move(h));
  }
}

}  // namespace

void make_corrections_causes(const Symptoms& symptoms, std::vector<Hypothesis>& hypotheses) {
  if (symptoms.fails("reprojection"))
    add_families(symptoms, Source::Depth, hypotheses);
  else if (symptoms.fails("flow"))
    add_families(symptoms, Source::Flow, hypotheses);
}

}  // namespace terracast::validate
