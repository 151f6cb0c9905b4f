#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string_view>
#include <vector>

#include "core/image.h"

namespace terracast::tiler {

using Colour = std::array<std::uint8_t, 3>;

/// Lines, discs and small text on an 8-bit RGB picture; what falls outside is left out. Places are
/// pixels, centres at +0.5.
class Canvas {
 public:
  explicit Canvas(core::Image8& image) : image_(image) {}

  void fill(int x, int y, int width, int height, const Colour& colour);
  void disc(const Eigen::Vector2d& centre, double radius_px, const Colour& colour);
  void line(const Eigen::Vector2d& from, const Eigen::Vector2d& to, double width_px,
            const Colour& colour);
  void polyline(const std::vector<Eigen::Vector2d>& places, double width_px, const Colour& colour);

  /// Capitals of 5 x 7 dots, each `scale` pixels; small letters are drawn as capitals.
  /// x, y   of the top left corner
  void text(int x, int y, std::string_view words, int scale, const Colour& colour);
  static int text_width_px(std::string_view words, int scale);

 private:
  void blend(int x, int y, double share, const Colour& colour);
  core::Image8& image_;
};

/// 1, 2 or 5 times a power of ten that is at most `length`.
double round_length(double length);

/// A bar of a round length, with its length in words below.
/// x, y         of the top left corner; 18 rows of `scale` pixels are taken
/// longest_px   the bar is at most this long
/// returns      its length, px
int draw_scale_bar(Canvas& canvas, int x, int y, int scale, double metres_per_px, double longest_px,
                   const Colour& colour);

}  // namespace terracast::tiler
