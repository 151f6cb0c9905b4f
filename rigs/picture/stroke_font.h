#pragma once

#include <string_view>
#include <vector>

#include "rigs/picture/drawing.h"

namespace terracast::rigs {

/// A text as lines, its base line along y = 0 from x = 0 on.
struct StrokedText {
  std::vector<Shape::Outline> strokes;
  double width = 0.0;
};

/// text   ASCII letters and digits, blank, . , : - + / ( ) = _ %, and the signs for degrees and times in UTF-8; what
///        the font lacks is a blank
/// size   height of the capitals and of their line, as a font's size
StrokedText stroked_text(std::string_view text, double size);

}  // namespace terracast::rigs
