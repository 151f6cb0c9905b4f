#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>

#include "core/parallel.h"
#include "validate/checks/checker.h"
#include "validate/null_distribution.h"
#include "validate/sampling.h"

/// What was done to the colours of single images: levels that are missing, marks of 8 x 8 blocks, plants that are blue.
namespace terracast::validate {

namespace {

/// What one image shows.
struct ImageMarks {
  double unused_levels = -1.0;  ///< share between its darkest and its brightest; -1: too plain
  std::optional<Estimate> block_marks;  ///< coefficients that JPEG's grid lacks; nothing: too plain
};

/// Share of levels that are left out next to well-filled ones: 1 - 1 / m, where m is the mean distance from a level
/// with many pixels to the next level with any. The longest tenth of the distances is ignored: between a bright sky and
/// dark ground there may be nothing.
double unused_levels(const core::Image8& color) {
  constexpr std::size_t kEnoughPixels = 5000;
  constexpr std::size_t kManyPixels =
      30;  // of a smooth histogram a neighbour is empty with a probability of e^-30
  constexpr std::size_t kEnoughLevels = 12;
  if (color.num_pixels() < kEnoughPixels) return -1.0;
  double worst = -1.0;
  for (std::size_t channel = 0; channel < 3; ++channel) {
    std::array<std::size_t, 256> counts{};
    for (std::size_t i = channel; i < color.data().size(); i += 3) ++counts[color.data()[i]];
    std::vector<int> ways;
    int last = -1;
    // Where light ends, at 0 and at 255, levels stand for all that is beyond.
    for (int level = 1; level < 255; ++level) {
      if (counts[static_cast<std::size_t>(level)] == 0) continue;
      if (last > 0) ways.push_back(level - last);
      last = counts[static_cast<std::size_t>(level)] >= kManyPixels ? level : -1;
    }
    if (ways.size() < kEnoughLevels) continue;
    std::sort(ways.begin(), ways.end());
    ways.resize(ways.size() - ways.size() / 10);
    const double mean = static_cast<double>(std::accumulate(ways.begin(), ways.end(), 0)) /
                        static_cast<double>(ways.size());
    worst = std::max(worst, 1.0 - 1.0 / mean);
  }
  return worst;
}

/// A mean over blocks.
struct BlockMean {
  double mean = 0.0;
  double standard_error = 0.0;
  double degrees = 0.0;
};

/// Share of the 63 cosine coefficients of blocks of 8 x 8 pixels that are not 0 to half a level a
/// pixel; blocks stand on a grid that starts at `offset` both ways.
BlockMean nonzero_share(const core::Image8& color, int offset) {
  static const auto basis = [] {
    std::array<std::array<double, 8>, 8> table{};
    for (std::size_t k = 0; k < 8; ++k)
      for (std::size_t n = 0; n < 8; ++n)
        table[k][n] =
            (k == 0 ? std::sqrt(0.125) : 0.5) *
            std::cos((2.0 * static_cast<double>(n) + 1.0) * static_cast<double>(k) * kPi / 16.0);
    return table;
  }();
  const int across = (color.width() - offset) / 8, down = (color.height() - offset) / 8;
  // A few thousand blocks tell the share to a hundredth.
  const int step = std::max(1, across * down / 2000);
  double sum = 0.0, squares = 0.0, count = 0.0;
  for (int block = 0; block < across * down; block += step) {
    std::size_t num_nonzero = 0;
    const int left = offset + 8 * (block % across), top = offset + 8 * (block / across);
    std::array<std::array<double, 8>, 8> rows{};
    for (std::size_t y = 0; y < 8; ++y)
      for (std::size_t x = 0; x < 8; ++x) {
        const int px = left + static_cast<int>(x), py = top + static_cast<int>(y);
        const double luma =
            0.299 * color(px, py, 0) + 0.587 * color(px, py, 1) + 0.114 * color(px, py, 2);
        for (std::size_t k = 0; k < 8; ++k) rows[y][k] += luma * basis[k][x];
      }
    for (std::size_t k = 0; k < 8; ++k)
      for (std::size_t l = 0; l < 8; ++l) {
        double value = 0.0;
        for (std::size_t y = 0; y < 8; ++y) value += rows[y][l] * basis[k][y];
        // Rounding to 8 bits leaves 0.2 in luma.
        if (k + l > 0 && std::abs(value) > 0.8) ++num_nonzero;
      }
    const double share = static_cast<double>(num_nonzero) / 63.0;
    sum += share;
    squares += share * share;
    count += 1.0;
  }
  if (count < 2.0) return {};
  const double mean = sum / count;
  const double variance = std::max(0.0, squares / count - mean * mean) * count / (count - 1.0);
  return {mean, std::sqrt(variance / count), count - 1.0};
}

/// By what share coefficients on JPEG's grid are fewer than beside it. Contrast lies in some blocks, so that few blocks
/// differ by chance; the two grids' blocks share pixels, by which they differ less than is counted.
std::optional<Estimate> block_marks(const core::Image8& color) {
  if (color.width() < 64 || color.height() < 64) return std::nullopt;
  const BlockMean on_grid = nonzero_share(color, 0), beside = nonzero_share(color, 4);
  // A plain image has hardly any on either grid.
  constexpr double kPlain = 0.02;
  if (beside.mean < kPlain) return std::nullopt;
  constexpr double kAlike = 0.2;  // pixels of a scene know nothing of the grid
  const double part = on_grid.mean / beside.mean;
  Estimate estimate;
  estimate.value = std::max(0.0, 1.0 - part);
  estimate.standard_error =
      std::hypot(on_grid.standard_error, part * beside.standard_error) / beside.mean;
  estimate.degrees = std::min(on_grid.degrees, beside.degrees);
  estimate.allowance = kAlike;
  return estimate;
}

/// What images show of what grows and of what lights it, each as (blue - red) / (blue + red) of pixels.
struct Tints {
  std::vector<double> plants;  ///< within 500 m
  std::vector<double> sky;
};

/// Of a camera whose white is the scene's.
/// returns  none of what is as dark as noise: its colours are those of the sensor
Tints tints_of(const Sequence& sequence, const View& view) {
  constexpr float kFarthest_m = 500.0F;
  const LoadedImage& image = *view.image;
  Tints tints;
  std::vector<double> sums_of_plants, sums_of_sky;
  const std::size_t num_pixels = image.segmentation.data().size();
  if (num_pixels == 0 || image.depth.data().size() != num_pixels ||
      image.color.data().size() != 3 * num_pixels || view.camera->imaging.white_balance != "scene")
    return tints;
  std::array<bool, 256> is_plant{};
  for (const auto& [index, name] : sequence.classes)
    if (name == "forest" || name == "shrubs" || name == "grass" || name == "crops")
      if (index >= 0 && index < 256) is_plant[static_cast<std::size_t>(index)] = true;
  for (std::size_t i = 0; i < num_pixels; ++i) {
    const double red = image.color.data()[3 * i], blue = image.color.data()[3 * i + 2];
    const float depth_m = image.depth.data()[i];
    const bool is_sky = std::isinf(depth_m);
    // What fills the sensor is white whatever its colour.
    constexpr std::uint8_t kFull = 255;
    const auto* channels = &image.color.data()[3 * i];
    if (red + blue == 0.0 || *std::max_element(channels, channels + 3) == kFull ||
        !(is_sky || (is_plant[image.segmentation.data()[i]] && depth_m < kFarthest_m)))
      continue;
    (is_sky ? tints.sky : tints.plants).push_back((blue - red) / (blue + red));
    (is_sky ? sums_of_sky : sums_of_plants).push_back(red + blue);
  }
  constexpr double kBright = 64.0;  // levels of both
  if (median(sums_of_plants) < kBright) tints.plants.clear();
  if (median(sums_of_sky) < kBright) tints.sky.clear();
  return tints;
}

class ColorsChecker : public Checker {
 public:
  explicit ColorsChecker(const ValidateOptions&) {}

  void frame(const FrameWindow& window, const std::vector<ViewPair>&) override {
    const auto num_cameras = window.sequence().cameras.size();
    std::vector<ImageMarks> marks(num_cameras);
    std::vector<std::string> places(num_cameras);
    plants_.resize(num_cameras);
    skies_.resize(num_cameras);
    core::parallel_for(static_cast<std::int64_t>(num_cameras), [&](std::int64_t camera) {
      const std::optional<View> view = window.view(static_cast<int>(camera), window.frame());
      if (!view || view->image->color.empty()) return;
      const auto index = static_cast<std::size_t>(camera);
      const bool is_fine = view->camera->imaging.has_fine_levels();
      num_coarse_ += is_fine ? 0 : 1;
      marks[index] = {is_fine ? unused_levels(view->image->color) : -1.0,
                      block_marks(view->image->color)};
      if (marks[index].block_marks) marks[index].block_marks->where = place_of(*view);
      places[index] = place_of(*view);
      Tints tints = tints_of(window.sequence(), *view);
      constexpr std::size_t kEnough = 2000;
      if (tints.plants.size() >= kEnough) plants_[index].push_back(median(tints.plants));
      if (tints.sky.size() >= kEnough) skies_[index].push_back(median(tints.sky));
    });
    for (std::size_t i = 0; i < num_cameras; ++i) {
      levels_.add(i, marks[i].unused_levels, places[i]);
      if (marks[i].block_marks) blocks_[i].push_back(*marks[i].block_marks);
    }
  }

  std::vector<CheckResult> finish(const Dataset&, const Sequence& sequence) override {
    CheckResult levels;
    levels.name = "colors_levels";
    levels.bound = 0.5;
    levels.unit = "share";
    levels.summary =
        "Levels that stand nowhere in an image, next to levels of 30 pixels and more; median of a "
        "camera's images.";
    levels.reason =
        "What light does between pixels is smooth: next to a level that many pixels have, none is "
        "left out; a brightening by two leaves out every second.";
    levels.detects = "colours of 6 bits or fewer, of a palette";
    if (num_coarse_ > 0)
      levels.summary +=
          fmt::format(" {} images are left out, whose sensor imaging.json states to have few bits.",
                      num_coarse_.load());
    return {levels_.result(std::move(levels)), blocks_result(), plants_result(sequence)};
  }

 private:
  /// Judges the median image of each camera; the images of a camera are much alike.
  CheckResult blocks_result() {
    CheckResult blocks;
    blocks.name = "colors_blocks";
    if (blocks_.empty()) return unseen_result(blocks.name, "no image has contrast enough");
    constexpr double kWorthFinding = 0.6;
    Estimates estimates(kWorthFinding);
    for (auto& [camera, images] : blocks_) {
      const auto middle = images.begin() + static_cast<std::ptrdiff_t>(images.size() / 2);
      std::nth_element(images.begin(), middle, images.end(),
                       [](const Estimate& a, const Estimate& b) { return a.value < b.value; });
      estimates.add(*middle);
    }
    estimates.judge(blocks);
    if (blocks.skipped) blocks.worst = "images have too few blocks with contrast: " + blocks.worst;
    blocks.unit = "share";
    blocks.summary =
        "By what share cosine coefficients of 8 x 8 blocks that are not 0 are fewer on JPEG's grid "
        "than beside it; the middle one of a camera's images.";
    blocks.reason =
        "Pixels of a scene know nothing of the grid: both are alike to a fifth, and to what as "
        "many blocks leave with a probability of 1e-9.";
    blocks.detects = "JPEG between rendering and export";
    return blocks;
  }

  /// Leaves throw back more red than blue of what light falls on them: of the sun's, which is white, of the sky's and of
  /// the haze's.
  CheckResult plants_result(const Sequence& sequence) {
    CheckResult plants;
    plants.name = "colors_plants";
    plants.unit = "of the colour";
    plants.value = -1.0;
    std::vector<double> skies;
    for (const std::vector<double>& sky : skies_) skies.insert(skies.end(), sky.begin(), sky.end());
    for (std::size_t camera = 0; camera < plants_.size(); ++camera)
      if (!plants_[camera].empty())
        note_worst(plants, median(plants_[camera]), sequence.cameras[camera].name);
    if (plants.worst.empty())
      return (sequence.classes.empty() ? skipped_result : unseen_result)(
          plants.name,
          sequence.classes.empty()
              ? "the dataset holds no classes"
              : "no image shows 2000 pixels of plants within 500 m, in the scene's white");
    const std::string sky =
        skies.empty()
            ? std::string("not seen")
            : fmt::format("{:.2g} to {:.2g}", *std::min_element(skies.begin(), skies.end()),
                          *std::max_element(skies.begin(), skies.end()));
    // Where no sky is seen, light through haze has been seen to leave plants 0.12.
    const double more_than_light = skies.empty() ? 0.2 : 0.1;
    skies.push_back(0.0);  // the sun's
    const auto [reddest, bluest] = std::minmax_element(skies.begin(), skies.end());
    plants.bound = *bluest + more_than_light;
    // Between these nature, imagery and swapped channels look alike.
    if (plants.value >= *reddest - more_than_light && plants.is_within_bound())
      return unseen_result(
          plants.name,
          fmt::format(
              "{}: plants' {:.2g}, the sky's {}: so are needles under a blue sky, leaves in haze, "
              "uncorrected imagery, and swapped channels",
              plants.worst, plants.value, sky));
    plants.ok = plants.is_within_bound();
    plants.summary = fmt::format(
        "(blue - red) / (blue + red) of pixels whose class is forest, shrubs, grass or crops: "
        "median of an image's, and of a camera's images. The sky's is {}.",
        sky);
    plants.reason =
        "Leaves throw back more red than blue: by 0.1 to 0.3 in sunlight, and as much of both in "
        "the blue light of the sky alone, where needles have up to 0.1 more blue. So plants are "
        "never bluer than the bluest of what lights them, white sun or sky, by more than 0.1; "
        "swapped, leaves in sunlight are.";
    plants.detects =
        "colours in the order blue, green, red in all images, of plants that are redder by 0.1";
    return plants;
  }

  struct Marks {
    std::map<std::size_t, std::vector<double>> values;  ///< by camera
    double worst = -1.0;
    std::string place;
    void add(std::size_t camera, double value, const std::string& where) {
      if (value < 0.0) return;
      values[camera].push_back(value);
      if (value <= worst) return;
      worst = value;
      place = where;
    }
    CheckResult result(CheckResult result) {
      if (values.empty()) return unseen_result(result.name, "no image has contrast enough");
      for (auto& [camera, list] : values) result.value = std::max(result.value, median(list));
      result.ok = result.is_within_bound();
      result.worst = fmt::format("{}: {:.3g}", place, worst);
      return result;
    }
  };
  Marks levels_;
  std::map<std::size_t, std::vector<Estimate>> blocks_;  ///< by camera
  std::vector<std::vector<double>> plants_, skies_;      ///< tints of each camera's images
  std::atomic<std::int64_t> num_coarse_ = 0;             ///< images of sensors of few bits
};

}  // namespace

std::unique_ptr<Checker> make_colors_check(const ValidateOptions& options) {
  return std::make_unique<ColorsChecker>(options);
}

}  // namespace terracast::validate
