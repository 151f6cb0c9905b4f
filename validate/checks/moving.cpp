#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>
#include <map>

#include "core/parallel.h"
#include "validate/checks/checker.h"
#include "validate/flow_rules.h"
#include "validate/null_distribution.h"
#include "validate/sampling.h"
#include "validate/transfer.h"

/// What moves, carried by its poses from one image into the next and back: its depth there, and stored flow.
namespace terracast::validate {

namespace {

/// Farther or nearer by this share is another surface.
constexpr double kClear = 0.01;

/// What one image says of a body in another.
struct BodySums {
  std::vector<float> residuals;  ///< |z predicted / z measured - 1| where nothing hides the point
  std::int64_t num_surface = 0;  ///< points inside of the body's pixels, within the other image
  std::int64_t num_seen_through = 0;

  void add(const BodySums& other) {
    residuals.insert(residuals.end(), other.residuals.begin(), other.residuals.end());
    num_surface += other.num_surface;
    num_seen_through += other.num_seen_through;
  }
};

struct Summary {
  std::map<int, BodySums> bodies;
  std::int64_t num_flow = 0;
  std::int64_t num_agreeing = 0;   ///< points whose depth agrees in both images
  std::int64_t num_unclaimed = 0;  ///< of these, not called co-visible
  double worst_px = 0.0;
  std::string worst_place;
  std::int64_t num_contradictions = 0;
  std::string first_contradiction;
};

/// Two images of a camera, and the flow from one to the other where it is stored.
struct Step {
  ViewPair pair;
  const core::ImageF* flow = nullptr;
  const core::Image8* in_view = nullptr;
  const core::Image8* covisible = nullptr;
};

class StepComparison {
 public:
  explicit StepComparison(const Step& step) : step_(step), transfer_(step.pair.a, step.pair.b) {}

  Summary run() {
    const core::Image16& bodies = step_.pair.a.image->moving;
    for (int y = 0; y < bodies.height(); ++y)
      for (int x = 0; x < bodies.width(); ++x)
        if (bodies(x, y) != 0) compare(x, y, bodies(x, y));
    return std::move(summary_);
  }

 private:
  void contradict(int x, int y, const char* what) {
    if (++summary_.num_contradictions == 1)
      summary_.first_contradiction = fmt::format("{}: {}", place_of(step_.pair.a, x, y), what);
  }

  void compare(int x, int y, int body) {
    const auto depth_m = static_cast<double>(step_.pair.a.image->moving_depth(x, y));
    const Eigen::Vector2d pixel(x + 0.5, y + 0.5);
    const auto place = transfer_.point_of_body(body, pixel, depth_m);
    const bool is_before = place && place->distance_b_m > 0.0;
    if (step_.flow != nullptr) compare_flow(x, y, pixel, is_before ? &*place : nullptr);
    if (is_before) compare_depth(x, y, body, *place);
  }

  /// Whether the other image's camera sees a point, whatever roundings do. How far outside of an image its lines see
  /// one is not stated.
  bool is_surely_seen(const Transfer::Place& place) const {
    const ViewPair& pair = step_.pair;
    return !pair.a.lines && !pair.b.lines && is_told_by_depth(place) &&
           sees_surely(pair.b.camera->intrinsics, place.point_b);
  }
  /// So near the other camera float32 depth tells no flow.
  static bool is_told_by_depth(const Transfer::Place& place) {
    return place.distance_b_m >= 0.05 * place.distance_a_m;
  }

  void compare_flow(int x, int y, const Eigen::Vector2d& pixel, const Transfer::Place* place) {
    const bool says_in_view = (*step_.in_view)(x, y) != 0;
    const bool says_covisible = (*step_.covisible)(x, y) != 0;
    if (says_covisible && !says_in_view)
      contradict(x, y, "co-visible but not in the field of view");
    const Eigen::Vector2d stored(static_cast<double>((*step_.flow)(x, y, 0)),
                                 static_cast<double>((*step_.flow)(x, y, 1)));
    const bool marks_missing = step_.pair.a.camera->marks_missing_flow;
    if (place == nullptr) {
      // How far outside the image a line still sees a point is not stated.
      if (marks_missing && stored.allFinite() && !step_.pair.b.lines)
        contradict(x, y, "not there in the other image, but it has flow");
      if (says_in_view)
        contradict(x, y, "not there in the other image, but called in its field of view");
      return;
    }
    const Intrinsics& k_b = step_.pair.b.camera->intrinsics;
    if (!stored.allFinite() && marks_missing) {
      if (k_b.contains(place->pixel, kFlowBorder_px) || is_surely_seen(*place))
        contradict(x, y, "seen by the other camera, but its flow says that it is not");
      if (!k_b.contains(place->pixel, -kFlowBorder_px) && says_in_view)
        contradict(x, y, "outside the other's image, but called in its field of view");
      return;
    }
    if (!stored.allFinite()) {
      const double reach_px =
          step_.pair.a.camera->flow_reach_px - step_.pair.a.camera->flow_step_px;
      if (std::isinf(reach_px) || !((place->pixel - pixel).cwiseAbs().maxCoeff() > reach_px))
        contradict(x, y, "flow is not finite, and not longer than the format can hold");
      return;
    }
    // Flow that is too long for the format has no masks either.
    if (k_b.contains(place->pixel, kFlowBorder_px) && !says_in_view)
      contradict(x, y, "in the other's field of view, but masked out");
    if (!k_b.contains(place->pixel, -kFlowBorder_px) && says_in_view)
      contradict(x, y, "outside the other's image, but called in its field of view");
    if (is_beyond_seam(k_b, pixel + stored)) contradict(x, y, "flow that leads across the seam");
    if (!is_told_by_depth(*place) || !k_b.contains(place->pixel, -0.5 * k_b.width_px)) return;
    ++summary_.num_flow;
    const double size = k_b.way_px(place->pixel, pixel + stored).norm();
    if (size > summary_.worst_px || summary_.worst_place.empty()) {
      summary_.worst_px = size;
      summary_.worst_place = place_of(step_.pair.a, x, y);
    }
  }

  void compare_depth(int x, int y, int body, const Transfer::Place& place) {
    const LoadedImage& seen = *step_.pair.b.image;
    const double predicted_m = place.distance_b_m;
    if (seen.depth.empty() || !step_.pair.b.camera->intrinsics.contains(place.pixel, 2.0) ||
        !is_inside(*step_.pair.a.image, x, y, body) || is_thin(*step_.pair.a.image, x, y))
      return;
    const int column = static_cast<int>(place.pixel.x());
    const int row = static_cast<int>(place.pixel.y());
    BodySums& sums = summary_.bodies[body];
    ++sums.num_surface;
    double nearest_m = std::numeric_limits<double>::infinity(), farthest_m = 0.0;
    for (int j = row - 1; j <= row + 1; ++j)
      for (int i = column - 1; i <= column + 1; ++i) {
        const float here_m = seen.depth_at(i, j);
        const double here = std::isfinite(here_m) ? static_cast<double>(here_m)
                                                  : std::numeric_limits<double>::infinity();
        nearest_m = std::min(nearest_m, here);
        farthest_m = std::max(farthest_m, here);
      }
    const bool says_covisible = step_.covisible != nullptr && (*step_.covisible)(x, y) != 0;
    if (says_covisible && farthest_m < predicted_m * (1.0 - kClear) && resolves(seen, place.pixel))
      contradict(x, y, "called co-visible, but the other image shows something nearer there");
    if (nearest_m > predicted_m * (1.0 + kClear)) ++sums.num_seen_through;
    if (seen.moving.empty() || !is_inside(seen, column, row, body)) return;
    const auto sample = sample_inverse_depth(seen.moving_depth, place.pixel);
    if (!sample || sample->roughness >= kResolvedRoughness ||
        sample->farthest_m < predicted_m * (1.0 - kClear))
      return;
    const double residual = std::abs(sample->inverse_depth.value * predicted_m - 1.0);
    sums.residuals.push_back(static_cast<float>(residual));
    constexpr double kAgrees = 1e-3;
    if (step_.covisible == nullptr || residual >= kAgrees) return;
    ++summary_.num_agreeing;
    if (!says_covisible) ++summary_.num_unclaimed;
  }

  /// Whether 3 x 3 pixels show the body.
  static bool is_inside(const LoadedImage& image, int x, int y, int body) {
    if (x < 1 || y < 1 || x + 1 >= image.moving.width() || y + 1 >= image.moving.height())
      return false;
    for (int j = y - 1; j <= y + 1; ++j)
      for (int i = x - 1; i <= x + 1; ++i)
        if (image.moving(i, j) != body) return false;
    return true;
  }

  /// Whether an image resolves what it shows there: between its pixels' centres lies nothing else.
  static bool resolves(const LoadedImage& image, const Eigen::Vector2d& pixel) {
    for (const core::ImageF* depth : {&image.depth, &image.moving_depth}) {
      if (depth->empty()) continue;
      const auto sample = sample_inverse_depth(*depth, pixel);
      if (sample && sample->roughness < kResolvedRoughness) return true;
    }
    return false;
  }

  /// Whether a pixel shows what may be thinner than a pixel, as a boom or a skid before a hull: it stands clearly in
  /// front of its neighbours on two opposite sides. That may fall between the pixels' centres of another image.
  static bool is_thin(const LoadedImage& image, int x, int y) {
    const double here_m = static_cast<double>(image.moving_depth(x, y));
    const auto is_farther = [&](int dx, int dy) {
      return static_cast<double>(image.moving_depth(x + dx, y + dy)) > here_m * (1.0 + kClear);
    };
    for (const auto& [dx, dy] :
         {std::pair(1, 0), std::pair(0, 1), std::pair(1, 1), std::pair(1, -1)})
      if (is_farther(dx, dy) && is_farther(-dx, -dy)) return true;
    return false;
  }

  const Step& step_;
  Transfer transfer_;
  Summary summary_;
};

class MovingChecker : public Checker {
 public:
  explicit MovingChecker(const ValidateOptions& options) : options_(options) {}

  void frame(const FrameWindow& window, const std::vector<ViewPair>&) override {
    if (!window.sequence().moving || options_.is_trial) return;
    std::vector<Step> steps;
    for (int camera = 0; camera < static_cast<int>(window.sequence().cameras.size()); ++camera) {
      const std::optional<View> now = window.view(camera, window.frame());
      const std::optional<View> before = window.view(camera, window.frame() - 1);
      if (!now || !before) continue;
      Step there{.pair = {*before, *now}}, back{.pair = {*now, *before}};
      if (before->image->flow) {
        const FlowFields& flow = *before->image->flow;
        there = {there.pair, &flow.forward, &flow.in_view_forward, &flow.covisible_forward};
        if (!flow.backward.empty())
          back = {back.pair, &flow.backward, &flow.in_view_backward, &flow.covisible_backward};
      }
      for (const Step& step : {there, back})
        if (!step.pair.a.image->moving_depth.empty()) steps.push_back(step);
      has_flow_ = has_flow_ || before->image->flow != nullptr;
    }
    std::vector<Summary> summaries(steps.size());
    core::parallel_for(static_cast<std::int64_t>(steps.size()), [&](std::int64_t i) {
      summaries[static_cast<std::size_t>(i)] =
          StepComparison(steps[static_cast<std::size_t>(i)]).run();
    });
    for (const Summary& summary : summaries) add(summary);
  }

  std::vector<CheckResult> finish(const Dataset&, const Sequence& sequence) override {
    if (!sequence.moving) return {skipped_result("moving", "nothing moves but the cameras")};
    std::vector<CheckResult> results = {depth_result(sequence), through_result(sequence)};
    results.push_back(has_flow_ ? flow_result(sequence)
                                : skipped_result("moving_flow", "the dataset holds no flow"));
    results.push_back(has_flow_ ? covisible_result()
                                : skipped_result("moving_covisible", "the dataset holds no flow"));
    return results;
  }

 private:
  void add(const Summary& summary) {
    for (const auto& [body, sums] : summary.bodies) bodies_[body].add(sums);
    num_agreeing_ += summary.num_agreeing;
    num_unclaimed_ += summary.num_unclaimed;
    num_flow_ += summary.num_flow;
    num_contradictions_ += summary.num_contradictions;
    if (first_contradiction_.empty()) first_contradiction_ = summary.first_contradiction;
    if (summary.worst_px > worst_px_ || worst_place_.empty()) {
      worst_px_ = summary.worst_px;
      worst_place_ = summary.worst_place;
    }
  }

  static std::string name_of(const Sequence& sequence, int body) {
    return sequence.moving->names[static_cast<std::size_t>(body - 1)];
  }

  CheckResult depth_result(const Sequence& sequence) {
    constexpr std::size_t kEnough = 30;
    CheckResult result;
    result.name = "moving_depth";
    result.bound = 2e-3;
    result.unit = "of the depth";
    std::size_t num_points = 0, num_bodies = 0;
    for (auto& [body, sums] : bodies_) {
      if (sums.residuals.size() < kEnough) continue;
      num_points += sums.residuals.size();
      ++num_bodies;
      note_worst(result, median(sums.residuals), name_of(sequence, body));
    }
    if (num_bodies == 0)
      return unseen_result(result.name, "no body shows smooth sides of 30 pixels in two frames");
    result.ok = result.is_within_bound();
    result.summary = fmt::format(
        "Median |z predicted / z measured - 1| of the worst of {} bodies, carried from frame to "
        "frame "
        "and back by moving.csv; {} points.",
        num_bodies, num_points);
    result.reason = "As `reprojection`: sides are smooth but for edges, which are left out.";
    result.detects =
        "a body posed at another frame, or off by 0.2 % of its distance along the view";
    return result;
  }

  CheckResult through_result(const Sequence& sequence) {
    CheckResult result;
    result.name = "moving_see_through";
    constexpr double kEdgeOn = 0.02, kWorthFinding = 0.5;
    PointShares shares(kEdgeOn, kWorthFinding);
    constexpr std::int64_t kEnough = 50;  // fewer may all be of a side that is turned edge-on
    for (const auto& [body, sums] : bodies_)
      if (sums.num_surface >= kEnough)
        shares.add({sums.num_seen_through, sums.num_surface, name_of(sequence, body)});
    if (shares.empty())
      return unseen_result(result.name, "no body shows 50 points of its inside in two frames");
    shares.judge(result);
    result.summary = fmt::format(
        "Share of the {} points inside of a body's pixels that the other image sees through, of "
        "the worst body: all 9 pixels around are over 1 % farther.",
        shares.num_points());
    result.reason =
        "Bodies are opaque; what is turned edge-on may slip between pixels. What is thinner than "
        "a pixel does so often, and is left out: points over 1 % nearer than their neighbours on "
        "two opposite sides.";
    result.detects = "a body that stands elsewhere than its pose says, masks of another frame";
    return result;
  }

  CheckResult covisible_result() const {
    CheckResult result;
    result.name = "moving_covisible";
    if (num_agreeing_ == 0)
      return unseen_result(result.name, "no depth of what moves agrees in both images of a pair");
    constexpr double kJustHidden = 0.02, kWorthFinding = 0.5;
    PointShares shares(kJustHidden, kWorthFinding);
    shares.add({num_unclaimed_, num_agreeing_, "all that moves"});
    shares.judge(result);
    result.summary = fmt::format(
        "Share of {} points of what moves whose depth agrees in both images, yet are not called "
        "co-visible.",
        num_agreeing_);
    result.reason = "As `flow_covisible`; bodies are seen where the other image resolves them.";
    result.detects = "masks of what moves that are empty, or of another frame";
    return result;
  }

  CheckResult flow_result(const Sequence& sequence) const {
    if (num_flow_ + num_contradictions_ == 0)
      return unseen_result("moving_flow", "no point of what moves comes near the other image");
    double rounding_px = 0.0;
    for (const Camera& camera : sequence.cameras)
      rounding_px = std::max(rounding_px, camera.flow_rounding_px());
    CheckResult result;
    result.name = "moving_flow";
    result.value = num_contradictions_ > 0 ? 1e9 : worst_px_;
    result.bound = 5e-3 + rounding_px;
    result.unit = "px";
    result.ok = result.is_within_bound();
    result.worst = num_contradictions_ > 0 ? first_contradiction_ : worst_place_;
    result.summary = fmt::format(
        "Largest difference between stored flow of what moves and flow from depth and both poses, "
        "over {} "
        "pixels; {} contradictions in its masks.",
        num_flow_, num_contradictions_);
    result.reason = "As `flow`: float32 depth and flow leave less than 1e-3 px.";
    result.detects =
        "flow of what moves as if it stood still, a wrong pose of it, and with rolling shutters a "
        "wrong velocity";
    return result;
  }

  ValidateOptions options_;
  std::map<int, BodySums> bodies_;
  bool has_flow_ = false;
  std::int64_t num_flow_ = 0;
  std::int64_t num_contradictions_ = 0;
  std::int64_t num_agreeing_ = 0;
  std::int64_t num_unclaimed_ = 0;
  std::string first_contradiction_;
  double worst_px_ = 0.0;
  std::string worst_place_;
};

}  // namespace

std::unique_ptr<Checker> make_moving_check(const ValidateOptions& options) {
  return std::make_unique<MovingChecker>(options);
}

}  // namespace terracast::validate
