#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "core/image.h"

namespace terracast::rigs {

struct Color {
  std::uint8_t red = 0, green = 0, blue = 0;
  double opacity = 1.0;
};

/// Polygons or, without a fill, lines; x to the right, y down.
struct Shape {
  using Outline = std::vector<Eigen::Vector2d>;
  std::vector<Outline> outlines;
  std::optional<Color> fill = {};    ///< of each outline, closed
  std::optional<Color> stroke = {};  ///< along each outline
  double stroke_width = 1.0;
  bool is_closed = false;  ///< the stroke goes back to the outline's start
};

enum class Anchor { Start, Middle, End };

/// A line of text, of the characters that the stroke font has (rigs/picture/stroke_font.h).
struct Label {
  Eigen::Vector2d place;  ///< on the base line
  std::string text;
  double size = 12.0;
  Anchor anchor = Anchor::Start;
  Color color = {};
};

/// A picture as a list of shapes and labels, the first one undermost. SVG and PNG hold the same; letters differ: SVG
/// takes the viewer's sans-serif font, PNG a stroke font.
class Drawing {
 public:
  Drawing(int width, int height) : width_(width), height_(height) {}

  void add(Shape shape) { items_.emplace_back(std::move(shape)); }
  void add(Label label) { items_.emplace_back(std::move(label)); }

  std::string svg() const;
  core::Image8 raster() const;

 private:
  int width_;
  int height_;
  std::vector<std::variant<Shape, Label>> items_;
};

}  // namespace terracast::rigs
