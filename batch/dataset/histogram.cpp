#include "batch/dataset/histogram.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <utility>

#include "batch/dataset/plot_style.h"
#include "core/error.h"
#include "tiler/map_drawing.h"

namespace terracast::batch {

namespace {

using tiler::Canvas;

constexpr int kScale = 2;
constexpr int kWidth_px = 960;
constexpr int kHeight_px = 420;
constexpr int kLeft_px = 110;
constexpr int kRight_px = 30;
constexpr int kTop_px = 50;
constexpr int kBottom_px = 64;

std::size_t index_of(Split split) { return static_cast<std::size_t>(split); }

/// Numbers along an axis: round steps, or the decades with their 2 and 5 where few are shown.
std::vector<double> ticks(double least, double greatest, bool is_logarithmic) {
  std::vector<double> values;
  if (!is_logarithmic) {
    const double step = tiler::round_length((greatest - least) / 4.0);
    const auto first = static_cast<std::int64_t>(std::ceil(least / step - 1e-9));
    const auto last = static_cast<std::int64_t>(std::floor(greatest / step + 1e-9));
    for (std::int64_t i = first; i <= last; ++i) values.push_back(static_cast<double>(i) * step);
    return values;
  }
  const bool has_few = greatest < 2000.0 * least;
  for (double decade = std::pow(10.0, std::floor(std::log10(least))); decade <= greatest * 1.000001;
       decade *= 10.0)
    for (const double factor : {1.0, 2.0, 5.0})
      if ((factor == 1.0 || has_few) && factor * decade >= least * 0.999999 &&
          factor * decade <= greatest * 1.000001)
        values.push_back(factor * decade);
  return values;
}

}  // namespace

Histogram::Histogram(Axis axis) : axis_(std::move(axis)) {
  TERRACAST_CHECK(axis_.num_bins > 0 && axis_.least < axis_.greatest &&
                      (!axis_.is_logarithmic || axis_.least > 0.0),
                  "{} bins from {} to {}", axis_.num_bins, axis_.least, axis_.greatest);
  for (std::vector<double>& weights : weights_)
    weights.resize(static_cast<std::size_t>(axis_.num_bins));
}

double Histogram::edge(int index) const {
  const double share = static_cast<double>(index) / axis_.num_bins;
  if (!axis_.is_logarithmic) return axis_.least + share * (axis_.greatest - axis_.least);
  return axis_.least * std::pow(axis_.greatest / axis_.least, share);
}

void Histogram::add(double value, Split split, double weight) {
  const double share =
      axis_.is_logarithmic
          ? (value > 0.0 ? std::log(value / axis_.least) / std::log(axis_.greatest / axis_.least)
                         : -1.0)
          : (value - axis_.least) / (axis_.greatest - axis_.least);
  if (!(share >= 0.0 && share <= 1.0)) {
    outside_[index_of(split)] += weight;
    return;
  }
  const int bin = std::min(static_cast<int>(share * axis_.num_bins), axis_.num_bins - 1);
  weights_[index_of(split)][static_cast<std::size_t>(bin)] += weight;
}

double Histogram::weight(int bin, Split split) const {
  return weights_[index_of(split)].at(static_cast<std::size_t>(bin));
}

double Histogram::weight_outside(Split split) const { return outside_[index_of(split)]; }

core::Json Histogram::json() const {
  std::vector<double> edges;
  for (int i = 0; i <= axis_.num_bins; ++i) edges.push_back(edge(i));
  core::Json json = core::Json::object()
                        .set("title", axis_.title)
                        .set("unit", axis_.unit)
                        .set("logarithmic", axis_.is_logarithmic)
                        .set("edges", core::Json::array_of(edges));
  core::Json outside = core::Json::object();
  for (std::size_t k = 0; k < kSplitNames.size(); ++k) {
    json.set(kSplitNames[k], core::Json::array_of(weights_[k]));
    outside.set(kSplitNames[k], outside_[k]);
  }
  return json.set("outside", outside);
}

core::Image8 Histogram::draw() const {
  core::Image8 image(kWidth_px, kHeight_px, 3, 255);
  Canvas canvas(image);
  const int width = kWidth_px - kLeft_px - kRight_px;
  const int height = kHeight_px - kTop_px - kBottom_px;
  const int bottom = kTop_px + height;

  double sum = std::accumulate(outside_.begin(), outside_.end(), 0.0);
  std::vector<double> heights(static_cast<std::size_t>(axis_.num_bins));
  for (const std::vector<double>& weights : weights_)
    for (std::size_t i = 0; i < heights.size(); ++i) {
      heights[i] += weights[i];
      sum += weights[i];
    }
  const double highest = *std::max_element(heights.begin(), heights.end());
  const double top_share = sum > 0.0 && highest > 0.0 ? 1.08 * highest / sum : 1.0;
  const auto y_of = [&](double share) {
    return bottom - static_cast<int>(std::lround(height * share / top_share));
  };
  const auto x_of = [&](double value) {
    const double share =
        axis_.is_logarithmic
            ? std::log(value / axis_.least) / std::log(axis_.greatest / axis_.least)
            : (value - axis_.least) / (axis_.greatest - axis_.least);
    return kLeft_px + static_cast<int>(std::lround(width * share));
  };

  for (const double share : ticks(0.0, top_share, false)) {
    canvas.fill(kLeft_px, y_of(share), width, 1, plot::kGrid);
    const std::string label = fmt::format("{:g} %", 100.0 * share);
    canvas.text(kLeft_px - 10 - Canvas::text_width_px(label, kScale), y_of(share) - 7, label,
                kScale, plot::kInk);
  }
  for (int bin = 0; bin < axis_.num_bins; ++bin) {
    const int left = kLeft_px + width * bin / axis_.num_bins;
    const int right = kLeft_px + width * (bin + 1) / axis_.num_bins;
    double below = 0.0;
    for (std::size_t k = 0; k < kSplitNames.size() && sum > 0.0; ++k) {
      const double above = below + weights_[k][static_cast<std::size_t>(bin)] / sum;
      canvas.fill(left, y_of(above), right - left - 1, y_of(below) - y_of(above),
                  plot::colour_of(static_cast<Split>(k)));
      below = above;
    }
  }
  canvas.fill(kLeft_px, bottom, width, 2, plot::kInk);
  int free_from = 0;
  for (const double value : ticks(axis_.least, axis_.greatest, axis_.is_logarithmic)) {
    canvas.fill(x_of(value), bottom, 2, 7, plot::kInk);
    const std::string label = fmt::format("{:g}", value);
    const int label_px = Canvas::text_width_px(label, kScale);
    const int left = std::min(x_of(value) - label_px / 2, kWidth_px - label_px);
    if (left < free_from) continue;
    canvas.text(left, bottom + 12, label, kScale, plot::kInk);
    free_from = left + label_px + 8;
  }
  const std::string title =
      axis_.unit.empty() ? axis_.title : fmt::format("{} ({})", axis_.title, axis_.unit);
  canvas.text(kLeft_px, bottom + 38, plot::fitting(title, width, kScale), kScale, plot::kInk);

  int x = kLeft_px;
  for (std::size_t k = 0; k < kSplitNames.size(); ++k) {
    const double share =
        sum > 0.0 ? std::accumulate(weights_[k].begin(), weights_[k].end(), outside_[k]) / sum
                  : 0.0;
    if (share == 0.0) continue;
    const std::string words = fmt::format("{} {:.3g} %", kSplitNames[k], 100.0 * share);
    canvas.fill(x, 18, 24, 10, plot::colour_of(static_cast<Split>(k)));
    canvas.text(x + 32, 16, words, kScale, plot::kInk);
    x += 32 + Canvas::text_width_px(words, kScale) + 24;
  }
  return image;
}

}  // namespace terracast::batch
