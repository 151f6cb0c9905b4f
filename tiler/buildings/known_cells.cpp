#include "tiler/buildings/known_cells.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <utility>

namespace terracast::tiler {
namespace {

using Known = Grid<std::uint8_t>;

Known known_cells(const Grid<float>& heights) {
  Known known(heights.width, heights.height, 0);
  for (std::size_t k = 0; k < heights.values.size(); ++k)
    known.values[k] = std::isnan(heights.values[k]) ? 0 : 1;
  return known;
}

/// Two by two; the last ones may be of less.
Known halved(const Known& known) {
  Known half((known.width + 1) / 2, (known.height + 1) / 2, 1);
  for (int j = 0; j < known.height; ++j)
    for (int i = 0; i < known.width; ++i) half(i / 2, j / 2) &= known(i, j);
  return half;
}

/// The known squares of a part of a row that lie beside each other, from left to right.
std::vector<CellBox> runs_of(const Known& known, const CellBox& part, int row) {
  std::vector<CellBox> runs;
  for (int i = part.first_column; i < part.end_column; ++i) {
    if (known(i, row) == 0) continue;
    if (runs.empty() || runs.back().end_column != i) runs.push_back({i, row, i, row + 1});
    runs.back().end_column = i + 1;
  }
  return runs;
}

/// Equal runs below each other are one box.
void add_boxes(const Known& known, const CellBox& part, std::vector<CellBox>& boxes) {
  std::vector<CellBox> open;  // those that reach down to the row at hand
  for (int row = part.first_row; row < part.end_row; ++row) {
    std::vector<CellBox> runs = runs_of(known, part, row);
    for (CellBox& run : runs) {
      const auto above = std::find_if(open.begin(), open.end(), [&](const CellBox& box) {
        return box.first_column == run.first_column && box.end_column == run.end_column;
      });
      if (above == open.end()) continue;
      run.first_row = above->first_row;
      open.erase(above);
    }
    boxes.insert(boxes.end(), open.begin(), open.end());
    open = std::move(runs);
  }
  boxes.insert(boxes.end(), open.begin(), open.end());
}

/// In cells; nothing where it takes too many.
std::optional<std::vector<CellBox>> boxes_of(const Known& known, int side, int width, int height,
                                             std::size_t most) {
  std::vector<CellBox> boxes;
  const int step = std::max(kMostBoxCells / side, 1);
  for (int j = 0; j < known.height; j += step)
    for (int i = 0; i < known.width; i += step) {
      add_boxes(known, {i, j, std::min(i + step, known.width), std::min(j + step, known.height)},
                boxes);
      if (boxes.size() > most) return std::nullopt;
    }
  for (CellBox& box : boxes)
    box = {box.first_column * side, box.first_row * side, std::min(box.end_column * side, width),
           std::min(box.end_row * side, height)};
  return boxes;
}

}  // namespace

std::vector<CellBox> boxes_of_known(const Grid<float>& heights, std::size_t most) {
  Known known = known_cells(heights);
  for (int side = 1; side <= kMostBoxCells; side *= 2) {
    if (auto boxes = boxes_of(known, side, heights.width, heights.height, most)) return *boxes;
    known = halved(known);
  }
  return {};
}

}  // namespace terracast::tiler
