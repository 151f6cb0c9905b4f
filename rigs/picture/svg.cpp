#include <fmt/format.h>

#include <array>

#include "rigs/picture/drawing.h"

namespace terracast::rigs {
namespace {

/// A tenth of a pixel is finer than the eye.
std::string number(double value) {
  std::string text = fmt::format("{:.1f}", value);
  if (text.ends_with(".0")) text.resize(text.size() - 2);
  return text == "-0" ? "0" : text;
}

std::string paint(const char* what, const std::optional<Color>& color) {
  if (!color) return fmt::format(" {}=\"none\"", what);
  std::string text =
      fmt::format(" {}=\"#{:02x}{:02x}{:02x}\"", what, color->red, color->green, color->blue);
  if (color->opacity < 1.0) text += fmt::format(" {}-opacity=\"{:.2f}\"", what, color->opacity);
  return text;
}

std::string escaped(const std::string& text) {
  std::string safe;
  for (const char c : text) {
    if (c == '&')
      safe += "&amp;";
    else if (c == '<')
      safe += "&lt;";
    else
      safe += c;
  }
  return safe;
}

std::string element(const Shape& shape) {
  std::string text = "<path d=\"";
  for (const Shape::Outline& outline : shape.outlines) {
    std::string x, y;
    for (std::size_t i = 0; i < outline.size(); ++i) {
      const std::string next_x = number(outline[i].x()), next_y = number(outline[i].y());
      if (i == 0)
        text += fmt::format("M{} {}", next_x, next_y);
      else if (next_y == y)
        text += "H" + next_x;
      else if (next_x == x)
        text += "V" + next_y;
      else
        text += fmt::format("L{} {}", next_x, next_y);
      x = next_x;
      y = next_y;
    }
    if (shape.fill || shape.is_closed) text += "Z";
  }
  text += "\"" + paint("fill", shape.fill);
  if (shape.stroke)
    text += paint("stroke", shape.stroke) +
            fmt::format(" stroke-width=\"{}\"", number(shape.stroke_width));
  return text + "/>\n";
}

std::string element(const Label& label) {
  static constexpr std::array kAnchors = {"start", "middle", "end"};
  return fmt::format("<text x=\"{}\" y=\"{}\" font-size=\"{}\" text-anchor=\"{}\"{}>{}</text>\n",
                     number(label.place.x()), number(label.place.y()), number(label.size),
                     kAnchors[static_cast<std::size_t>(label.anchor)], paint("fill", label.color),
                     escaped(label.text));
}

}  // namespace

std::string Drawing::svg() const {
  std::string text = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}\" height=\"{1}\" viewBox=\"0 0 {0} "
      "{1}\" "
      "font-family=\"Helvetica, Arial, sans-serif\" stroke-linejoin=\"round\" "
      "stroke-linecap=\"round\">\n"
      "<rect width=\"{0}\" height=\"{1}\" fill=\"#ffffff\"/>\n",
      width_, height_);
  for (const auto& item : items_)
    text += std::visit([](const auto& drawn) { return element(drawn); }, item);
  return text + "</svg>\n";
}

}  // namespace terracast::rigs
