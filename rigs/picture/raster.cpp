#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "rigs/picture/drawing.h"
#include "rigs/picture/stroke_font.h"

namespace terracast::rigs {
namespace {

/// Samples a pixel, each way.
constexpr int kSamples = 4;

/// Which samples of a part of the image are covered.
class Mask {
 public:
  Mask(int width, int height) : width_(width), height_(height) {}

  /// A polygon's inside by the even-odd rule, beside what is covered already.
  void cover(const Shape::Outline& polygon) {
    if (polygon.size() < 3) return;
    double top = std::numeric_limits<double>::infinity(), bottom = -top;
    for (const Eigen::Vector2d& p : polygon) {
      top = std::min(top, p.y());
      bottom = std::max(bottom, p.y());
    }
    const int first = std::max(0, static_cast<int>(std::floor(top * kSamples)));
    const int last =
        std::min(height_ * kSamples - 1, static_cast<int>(std::ceil(bottom * kSamples)));
    for (int row = first; row <= last; ++row) cover_row(polygon, row);
  }

  /// Covered samples of a pixel, of kSamples squared; nothing is covered afterwards.
  template <class Blend>
  void take(Blend&& blend) {
    for (const auto& [key, count] : counts_of_pixels()) blend(key % width_, key / width_, count);
    rows_.clear();
  }

 private:
  struct Span {
    int begin;
    int end;
  };

  void cover_row(const Shape::Outline& polygon, int row) {
    const double y = (row + 0.5) / kSamples;
    std::vector<double>& crossings = crossings_;
    crossings.clear();
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const Eigen::Vector2d& a = polygon[i];
      const Eigen::Vector2d& b = polygon[(i + 1) % polygon.size()];
      if ((a.y() <= y) == (b.y() <= y)) continue;
      crossings.push_back(a.x() + (y - a.y()) / (b.y() - a.y()) * (b.x() - a.x()));
    }
    std::sort(crossings.begin(), crossings.end());
    for (std::size_t i = 0; i + 1 < crossings.size(); i += 2) {
      const int begin = std::max(0, static_cast<int>(std::ceil(crossings[i] * kSamples - 0.5)));
      const int end = std::min(width_ * kSamples,
                               static_cast<int>(std::ceil(crossings[i + 1] * kSamples - 0.5)));
      if (begin < end) rows_.push_back({row, {begin, end}});
    }
  }

  /// Pixel y * width + x to its number of samples, ascending; samples covered twice count once.
  std::vector<std::pair<int, int>> counts_of_pixels() {
    std::sort(rows_.begin(), rows_.end(), [](const auto& a, const auto& b) {
      return a.first != b.first ? a.first < b.first : a.second.begin < b.second.begin;
    });
    std::vector<std::pair<int, int>> counts;
    std::vector<int> of_row(static_cast<std::size_t>(width_), 0);
    int reached = 0;
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      const auto& [row, span] = rows_[i];
      if (i == 0 || rows_[i - 1].first != row) reached = 0;
      for (int x = std::max(span.begin, reached); x < span.end; ++x)
        ++of_row[static_cast<std::size_t>(x / kSamples)];
      reached = std::max(reached, span.end);
      if (i + 1 < rows_.size() && rows_[i + 1].first / kSamples == row / kSamples) continue;
      for (int x = 0; x < width_; ++x) {
        int& count = of_row[static_cast<std::size_t>(x)];
        if (count > 0) counts.emplace_back(row / kSamples * width_ + x, count);
        count = 0;
      }
    }
    return counts;
  }

  int width_;
  int height_;
  std::vector<std::pair<int, Span>> rows_;
  std::vector<double> crossings_;
};

void blend(core::Image8& image, Mask& mask, const Color& color) {
  mask.take([&](int x, int y, int count) {
    const double weight = color.opacity * count / (kSamples * kSamples);
    const std::uint8_t parts[3] = {color.red, color.green, color.blue};
    for (int c = 0; c < 3; ++c) {
      std::uint8_t& value = image(x, y, c);
      value = static_cast<std::uint8_t>(std::lround(value + weight * (parts[c] - value)));
    }
  });
}

/// A line with round ends, as polygons.
void cover_line(Mask& mask, const Shape::Outline& line, bool is_closed, double width) {
  const double radius = 0.5 * width;
  const std::size_t num_segments = line.size() - (is_closed ? 0 : 1);
  for (std::size_t i = 0; i < num_segments; ++i) {
    const Eigen::Vector2d& a = line[i];
    const Eigen::Vector2d& b = line[(i + 1) % line.size()];
    const Eigen::Vector2d along = b - a;
    if (along.norm() == 0.0) continue;
    const Eigen::Vector2d side = Eigen::Vector2d(-along.y(), along.x()) * (radius / along.norm());
    mask.cover({a + side, b + side, b - side, a - side});
  }
  constexpr int kCorners = 12;
  for (const Eigen::Vector2d& point : line) {
    Shape::Outline disc;
    for (int k = 0; k < kCorners; ++k) {
      const double turn = 2.0 * std::numbers::pi * k / kCorners;
      disc.emplace_back(point + radius * Eigen::Vector2d(std::cos(turn), std::sin(turn)));
    }
    mask.cover(disc);
  }
}

void draw(core::Image8& image, Mask& mask, const Shape& shape) {
  if (shape.fill) {
    for (const Shape::Outline& outline : shape.outlines) mask.cover(outline);
    blend(image, mask, *shape.fill);
  }
  if (shape.stroke) {
    for (const Shape::Outline& outline : shape.outlines)
      if (!outline.empty()) cover_line(mask, outline, shape.is_closed, shape.stroke_width);
    blend(image, mask, *shape.stroke);
  }
}

void draw(core::Image8& image, Mask& mask, const Label& label) {
  constexpr double kWeight = 0.1;  // of a stroke to the size
  const StrokedText text = stroked_text(label.text, label.size);
  const double shift = label.anchor == Anchor::Start    ? 0.0
                       : label.anchor == Anchor::Middle ? -0.5 * text.width
                                                        : -text.width;
  for (Shape::Outline stroke : text.strokes) {
    for (Eigen::Vector2d& point : stroke) point += label.place + Eigen::Vector2d(shift, 0.0);
    cover_line(mask, stroke, false, kWeight * label.size);
  }
  blend(image, mask, label.color);
}

}  // namespace

core::Image8 Drawing::raster() const {
  core::Image8 image(width_, height_, 3, 255);
  Mask mask(width_, height_);
  for (const auto& item : items_)
    std::visit([&](const auto& drawn) { draw(image, mask, drawn); }, item);
  return image;
}

}  // namespace terracast::rigs
