#include <fmt/format.h>

#include "core/parallel.h"
#include "validate/checks/checker.h"
#include "validate/null_distribution.h"
#include "validate/sampling.h"
#include "validate/transfer.h"

/// Classes of one image, carried by its depth and by poses into another, against the classes there.
namespace terracast::validate {

namespace {

/// Whether the 3 x 3 pixels around one are of one class.
bool is_inside(const core::Image8& classes, int x, int y) {
  if (x < 1 || y < 1 || x + 1 >= classes.width() || y + 1 >= classes.height()) return false;
  for (int dy = -1; dy <= 1; ++dy)
    for (int dx = -1; dx <= 1; ++dx)
      if (classes(x + dx, y + dy) != classes(x, y)) return false;
  return true;
}

struct Agreement {
  std::int64_t num_compared = 0;
  std::int64_t num_different = 0;
};

Agreement compare(const ViewPair& pair, const ValidateOptions& options) {
  Agreement agreement;
  const core::Image8& classes_a = pair.a.image->segmentation;
  const core::Image8& classes_b = pair.b.image->segmentation;
  const Transfer transfer(pair.a, pair.b);
  const std::uint64_t salt = (static_cast<std::uint64_t>(pair.b.frame) * 1000 +
                              static_cast<std::uint64_t>(pair.b.camera_index)) |
                             1ULL << 42;
  for (const Eigen::Vector2i& at :
       draw_pixels(pair.a.camera->intrinsics, options.samples_per_image, options, pair.a, salt)) {
    const auto depth_m = static_cast<double>(pair.a.image->depth(at.x(), at.y()));
    if (!std::isfinite(depth_m) || !is_inside(classes_a, at.x(), at.y())) continue;
    const auto place = transfer.point({at.x() + 0.5, at.y() + 0.5}, depth_m);
    if (!place || !(place->distance_b_m > 1e-3 * depth_m)) continue;
    const Eigen::Vector2d& pixel = place->pixel;
    const auto seen = sample_inverse_depth(pair.b.image->depth, pixel);
    if (!seen || std::abs(seen->inverse_depth.value * place->distance_b_m - 1.0) > 0.01) continue;
    const int x = static_cast<int>(pixel.x()), y = static_cast<int>(pixel.y());
    if (!is_inside(classes_b, x, y)) continue;
    ++agreement.num_compared;
    if (classes_b(x, y) != classes_a(at.x(), at.y())) ++agreement.num_different;
  }
  return agreement;
}

class SegmentationChecker : public Checker {
 public:
  explicit SegmentationChecker(const ValidateOptions& options) : options_(options) {}

  void frame(const FrameWindow&, const std::vector<ViewPair>& all_pairs) override {
    std::vector<ViewPair> pairs;
    for (const ViewPair& pair : all_pairs) {
      has_classes_ = has_classes_ || !pair.a.image->segmentation.empty();
      if (!pair.a.image->segmentation.empty() && !pair.b.image->segmentation.empty() &&
          !pair.b.image->depth.empty())
        pairs.push_back(pair);
    }
    std::vector<Agreement> agreements(pairs.size());
    core::parallel_for(static_cast<std::int64_t>(pairs.size()), [&](std::int64_t i) {
      agreements[static_cast<std::size_t>(i)] =
          compare(pairs[static_cast<std::size_t>(i)], options_);
    });
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      constexpr std::int64_t kEnough = 100;  // fewer may all lie behind one roof
      if (agreements[i].num_compared < kEnough) continue;
      shares_.add({agreements[i].num_different, agreements[i].num_compared,
                   fmt::format("{} in {}", place_of(pairs[i].a), place_of(pairs[i].b))});
    }
  }

  std::vector<CheckResult> finish(const Dataset&, const Sequence&) override {
    if (!has_classes_)
      return {skipped_result("segmentation", "the format holds no classes, or none with depth")};
    if (shares_.empty())
      return {unseen_result("segmentation", "no two images share 100 points inside of classes")};
    CheckResult result;
    result.name = "segmentation";
    shares_.judge(result);
    result.summary = fmt::format(
        "Share of points whose class is another one in the other image, of the worst pair of "
        "images; {} points whose 3 x 3 pixels are of one class in both.",
        shares_.num_points());
    result.reason =
        "A place has one class from all sides; things thinner than three pixels are left out. 2 % "
        "are left for what stands before them, and what few points may be more by chance.";
    result.detects = "classes of another frame, or numbered otherwise in one image";
    return {std::move(result)};
  }

 private:
  ValidateOptions options_;
  bool has_classes_ = false;
  PointShares shares_{0.02, 0.5};  // worth finding: classes of another frame
};

}  // namespace

std::unique_ptr<Checker> make_segmentation_check(const ValidateOptions& options) {
  return std::make_unique<SegmentationChecker>(options);
}

}  // namespace terracast::validate
