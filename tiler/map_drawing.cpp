#include "tiler/map_drawing.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace terracast::tiler {
namespace {

constexpr int kGlyphWidth = 5;
constexpr int kGlyphHeight = 7;

/// Rows of a letter from the top; bit 4 is the leftmost dot.
struct Glyph {
  char letter;
  std::array<std::uint8_t, kGlyphHeight> rows;
};

constexpr Glyph kGlyphs[] = {
    {'0', {14, 17, 19, 21, 25, 17, 14}}, {'1', {4, 12, 4, 4, 4, 4, 14}},
    {'2', {14, 17, 1, 6, 8, 16, 31}},    {'3', {14, 17, 1, 6, 1, 17, 14}},
    {'4', {2, 6, 10, 18, 31, 2, 2}},     {'5', {31, 16, 30, 1, 1, 17, 14}},
    {'6', {6, 8, 16, 30, 17, 17, 14}},   {'7', {31, 1, 2, 4, 8, 8, 8}},
    {'8', {14, 17, 17, 14, 17, 17, 14}}, {'9', {14, 17, 17, 15, 1, 2, 12}},
    {'A', {4, 10, 17, 17, 31, 17, 17}},  {'B', {30, 17, 17, 30, 17, 17, 30}},
    {'C', {14, 17, 16, 16, 16, 17, 14}}, {'D', {28, 18, 17, 17, 17, 18, 28}},
    {'E', {31, 16, 16, 30, 16, 16, 31}}, {'F', {31, 16, 16, 30, 16, 16, 16}},
    {'G', {14, 17, 16, 23, 17, 17, 15}}, {'H', {17, 17, 17, 31, 17, 17, 17}},
    {'I', {14, 4, 4, 4, 4, 4, 14}},      {'J', {7, 2, 2, 2, 2, 18, 12}},
    {'K', {17, 18, 20, 24, 20, 18, 17}}, {'L', {16, 16, 16, 16, 16, 16, 31}},
    {'M', {17, 27, 21, 21, 17, 17, 17}}, {'N', {17, 25, 21, 19, 17, 17, 17}},
    {'O', {14, 17, 17, 17, 17, 17, 14}}, {'P', {30, 17, 17, 30, 16, 16, 16}},
    {'Q', {14, 17, 17, 17, 21, 18, 13}}, {'R', {30, 17, 17, 30, 20, 18, 17}},
    {'S', {15, 16, 16, 14, 1, 1, 30}},   {'T', {31, 4, 4, 4, 4, 4, 4}},
    {'U', {17, 17, 17, 17, 17, 17, 14}}, {'V', {17, 17, 17, 17, 17, 10, 4}},
    {'W', {17, 17, 17, 21, 21, 27, 17}}, {'X', {17, 17, 10, 4, 10, 17, 17}},
    {'Y', {17, 17, 10, 4, 4, 4, 4}},     {'Z', {31, 1, 2, 4, 8, 16, 31}},
    {'-', {0, 0, 0, 14, 0, 0, 0}},       {'.', {0, 0, 0, 0, 0, 12, 12}},
    {',', {0, 0, 0, 0, 12, 4, 8}},       {':', {0, 12, 12, 0, 12, 12, 0}},
    {'/', {1, 1, 2, 4, 8, 16, 16}},      {'_', {0, 0, 0, 0, 0, 0, 31}},
    {'+', {0, 4, 4, 31, 4, 4, 0}},       {'(', {2, 4, 8, 8, 8, 4, 2}},
    {')', {8, 4, 2, 2, 2, 4, 8}},        {'%', {24, 25, 2, 4, 8, 19, 3}},
    {' ', {0, 0, 0, 0, 0, 0, 0}},
};

const Glyph& glyph_of(char letter) {
  if (letter >= 'a' && letter <= 'z') letter = static_cast<char>(letter - 'a' + 'A');
  const auto* found = std::find_if(std::begin(kGlyphs), std::end(kGlyphs),
                                   [&](const Glyph& glyph) { return glyph.letter == letter; });
  static constexpr Glyph kUnknown = {'?', {31, 17, 17, 17, 17, 17, 31}};
  return found == std::end(kGlyphs) ? kUnknown : *found;
}

}  // namespace

void Canvas::blend(int x, int y, double share, const Colour& colour) {
  if (x < 0 || y < 0 || x >= image_.width() || y >= image_.height()) return;
  for (int channel = 0; channel < 3; ++channel) {
    std::uint8_t& value = image_(x, y, channel);
    value = static_cast<std::uint8_t>(
        std::lround(value + share * (colour[static_cast<std::size_t>(channel)] - value)));
  }
}

void Canvas::fill(int x, int y, int width, int height, const Colour& colour) {
  for (int j = y; j < y + height; ++j)
    for (int i = x; i < x + width; ++i) blend(i, j, 1.0, colour);
}

void Canvas::disc(const Eigen::Vector2d& centre, double radius_px, const Colour& colour) {
  line(centre, centre, 2.0 * radius_px, colour);
}

void Canvas::line(const Eigen::Vector2d& from, const Eigen::Vector2d& to, double width_px,
                  const Colour& colour) {
  const double reach = 0.5 * width_px + 1.0;
  const Eigen::Vector2d picture(image_.width(), image_.height());
  const Eigen::Vector2d low =
      (from.cwiseMin(to).array() - reach).floor().matrix().cwiseMax(0.0).cwiseMin(picture);
  const Eigen::Vector2d high =
      (from.cwiseMax(to).array() + reach).ceil().matrix().cwiseMax(0.0).cwiseMin(picture);
  const Eigen::Vector2d along = to - from;
  const double length2 = along.squaredNorm();
  for (int y = static_cast<int>(low.y()); y < static_cast<int>(high.y()); ++y)
    for (int x = static_cast<int>(low.x()); x < static_cast<int>(high.x()); ++x) {
      const Eigen::Vector2d at(x + 0.5, y + 0.5);
      const double t = length2 > 0.0 ? std::clamp((at - from).dot(along) / length2, 0.0, 1.0) : 0.0;
      const double distance = (at - from - t * along).norm();
      const double share = std::clamp(0.5 * width_px + 0.5 - distance, 0.0, 1.0);
      if (share > 0.0) blend(x, y, share, colour);
    }
}

void Canvas::polyline(const std::vector<Eigen::Vector2d>& places, double width_px,
                      const Colour& colour) {
  for (std::size_t i = 1; i < places.size(); ++i) line(places[i - 1], places[i], width_px, colour);
}

void Canvas::text(int x, int y, std::string_view words, int scale, const Colour& colour) {
  for (const char letter : words) {
    const Glyph& glyph = glyph_of(letter);
    for (int row = 0; row < kGlyphHeight; ++row)
      for (int column = 0; column < kGlyphWidth; ++column)
        if ((glyph.rows[static_cast<std::size_t>(row)] >> (kGlyphWidth - 1 - column) & 1) != 0)
          fill(x + column * scale, y + row * scale, scale, scale, colour);
    x += (kGlyphWidth + 1) * scale;
  }
}

int Canvas::text_width_px(std::string_view words, int scale) {
  return static_cast<int>(words.size()) * (kGlyphWidth + 1) * scale;
}

double round_length(double length) {
  const double decade = std::pow(10.0, std::floor(std::log10(length)));
  for (const double factor : {5.0, 2.0})
    if (factor * decade <= length) return factor * decade;
  return decade;
}

int draw_scale_bar(Canvas& canvas, int x, int y, int scale, double metres_per_px, double longest_px,
                   const Colour& colour) {
  const double bar_m = round_length(longest_px * metres_per_px);
  const int bar_px = static_cast<int>(std::lround(bar_m / metres_per_px));
  canvas.fill(x, y + 2 * scale, bar_px, 2 * scale, colour);
  canvas.fill(x, y, scale, 6 * scale, colour);
  canvas.fill(x + bar_px - scale, y, scale, 6 * scale, colour);
  canvas.text(
      x, y + 11 * scale,
      bar_m >= 1000.0 ? fmt::format("{:g} km", bar_m / 1000.0) : fmt::format("{:g} m", bar_m),
      scale, colour);
  return bar_px;
}

}  // namespace terracast::tiler
