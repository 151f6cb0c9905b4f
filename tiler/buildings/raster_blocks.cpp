#include "tiler/buildings/raster_blocks.h"

#include <algorithm>
#include <cmath>

namespace terracast::tiler {
namespace {

constexpr std::int32_t kNone = 0;
constexpr std::int32_t kPending = -1;  ///< of a building, in no piece yet

/// Cells by their rows' order, and what lies beside them.
class BlockFinder {
 public:
  BlockFinder(const Grid<float>& heights_m, const BlockRules& rules)
      : heights_m_(heights_m), rules_(rules), root_(heights_m.values.size(), -1) {
    blocks_.piece = Grid<std::int32_t>(heights_m.width, heights_m.height, kNone);
    for (std::size_t k = 0; k < heights_m.values.size(); ++k)
      if (static_cast<double>(heights_m.values[k]) >= rules.least_height_m) {  // NaN is not
        blocks_.piece.values[k] = kPending;
        ++blocks_.num_cells;
      }
  }

  RasterBlocks find() {
    std::vector<std::uint8_t> is_seen(root_.size(), 0);
    for (std::size_t k = 0; k < root_.size(); ++k)
      if (blocks_.piece.values[k] == kPending && is_seen[k] == 0) take_block(k, is_seen);
    number_by_first_cell();
    return std::move(blocks_);
  }

 private:
  struct Step {
    float rise_m;
    std::int32_t from, to;
  };
  struct Range {
    float lowest_m, highest_m;
  };

  template <class Visit>
  void visit_beside(std::size_t cell, const Visit& visit) const {
    const auto width = static_cast<std::size_t>(blocks_.piece.width);
    const std::size_t column = cell % width;
    if (cell >= width) visit(cell - width);
    if (column > 0) visit(cell - 1);
    if (column + 1 < width) visit(cell + 1);
    if (cell + width < root_.size()) visit(cell + width);
  }
  std::int32_t& piece_of(std::size_t cell) { return blocks_.piece.values[cell]; }
  double height_of(std::size_t cell) const { return static_cast<double>(heights_m_.values[cell]); }

  void take_block(std::size_t first, std::vector<std::uint8_t>& is_seen) {
    std::vector<std::size_t> cells = {first};
    is_seen[first] = 1;
    for (std::size_t k = 0; k < cells.size(); ++k)
      visit_beside(cells[k], [&](std::size_t beside) {
        if (piece_of(beside) != kPending || is_seen[beside] != 0) return;
        is_seen[beside] = 1;
        cells.push_back(beside);
      });
    if (static_cast<std::int64_t>(cells.size()) < rules_.least_cells) {
      ++blocks_.num_specks;
      blocks_.num_speck_cells += static_cast<std::int64_t>(cells.size());
      for (const std::size_t cell : cells) piece_of(cell) = kNone;
      return;
    }
    ++blocks_.num_blocks;
    std::sort(cells.begin(), cells.end());
    join_alike(cells);
    keep_pieces(cells);
    give_rest_to_pieces(std::move(cells));
  }

  std::size_t root_of(std::size_t cell) {
    while (static_cast<std::size_t>(root_[cell]) != cell) {
      root_[cell] = root_[static_cast<std::size_t>(root_[cell])];
      cell = static_cast<std::size_t>(root_[cell]);
    }
    return cell;
  }

  /// Least steps first.
  void join_alike(const std::vector<std::size_t>& cells) {
    std::vector<Step> steps;
    ranges_.clear();
    ranges_.reserve(cells.size());
    slot_of_.resize(root_.size());
    const auto width = static_cast<std::size_t>(blocks_.piece.width);
    for (const std::size_t cell : cells) {
      root_[cell] = static_cast<std::int32_t>(cell);
      slot_of_[cell] = static_cast<std::int32_t>(ranges_.size());
      ranges_.push_back({heights_m_.values[cell], heights_m_.values[cell]});
      const auto add = [&](std::size_t to) {
        if (piece_of(to) == kPending)
          steps.push_back({std::abs(heights_m_.values[cell] - heights_m_.values[to]),
                           static_cast<std::int32_t>(cell), static_cast<std::int32_t>(to)});
      };
      if (cell % width + 1 < width) add(cell + 1);
      if (cell + width < root_.size()) add(cell + width);
    }
    std::stable_sort(steps.begin(), steps.end(),
                     [](const Step& a, const Step& b) { return a.rise_m < b.rise_m; });
    for (const Step& step : steps) {
      const std::size_t a = root_of(static_cast<std::size_t>(step.from));
      const std::size_t b = root_of(static_cast<std::size_t>(step.to));
      if (a == b) continue;
      Range& range = ranges_[static_cast<std::size_t>(slot_of_[std::min(a, b)])];
      const Range& other = ranges_[static_cast<std::size_t>(slot_of_[std::max(a, b)])];
      const Range both{std::min(range.lowest_m, other.lowest_m),
                       std::max(range.highest_m, other.highest_m)};
      if (static_cast<double>(both.highest_m - both.lowest_m) > rules_.height_class_m) continue;
      range = both;
      root_[std::max(a, b)] = static_cast<std::int32_t>(std::min(a, b));
    }
  }

  /// Whether it is a corner of four cells of one piece.
  bool is_wide(std::size_t cell) {
    const auto width = static_cast<std::size_t>(blocks_.piece.width);
    const std::size_t column = cell % width;
    const std::size_t root = root_of(cell);
    const auto is_in = [&](std::size_t at) {
      return piece_of(at) == kPending && root_of(at) == root;
    };
    for (const bool up : {true, false})
      for (const bool left : {true, false}) {
        if ((up && cell < width) || (!up && cell + width >= root_.size()) ||
            (left && column == 0) || (!left && column + 1 >= width))
          continue;
        const std::size_t row = up ? cell - width : cell + width;
        if (is_in(row) && is_in(left ? cell - 1 : cell + 1) && is_in(left ? row - 1 : row + 1))
          return true;
      }
    return false;
  }

  /// Numbers the joined cells that make a piece; others stay pending.
  void keep_pieces(const std::vector<std::size_t>& cells) {
    std::vector<std::int64_t> num(cells.size(), 0);
    std::vector<std::int64_t> num_wide(cells.size(), 0);
    const auto slot = [&](std::size_t cell) {
      return static_cast<std::size_t>(slot_of_[root_of(cell)]);
    };
    for (const std::size_t cell : cells) {
      ++num[slot(cell)];
      num_wide[slot(cell)] += is_wide(cell) ? 1 : 0;
    }
    const auto is_piece = [&](std::size_t at) {
      return num[at] >= rules_.least_cells && 2 * num_wide[at] >= num[at];
    };
    std::vector<std::int32_t> number(cells.size(), kPending);
    std::vector<std::vector<float>> heights;
    bool has_piece = false;
    for (std::size_t k = 0; k < cells.size(); ++k) has_piece = has_piece || is_piece(k);
    const auto first_new = static_cast<std::int32_t>(blocks_.pieces.size()) + 1;
    for (const std::size_t cell : cells) {
      const std::size_t at = has_piece ? slot(cell) : 0;
      if (has_piece && !is_piece(at)) continue;
      if (number[at] == kPending) {
        heights.emplace_back();
        number[at] = first_new + static_cast<std::int32_t>(heights.size()) - 1;
      }
      heights[static_cast<std::size_t>(number[at] - first_new)].push_back(heights_m_.values[cell]);
      numbered_.emplace_back(cell, number[at]);
    }
    for (const auto& [cell, piece] : numbered_) piece_of(cell) = piece;
    numbered_.clear();
    for (std::vector<float>& of_piece : heights) add_piece(of_piece);
  }

  void add_piece(std::vector<float>& heights) {
    const auto at_share = [&](double share) {
      const auto middle =
          heights.begin() +
          static_cast<std::ptrdiff_t>(share * static_cast<double>(heights.size() - 1) + 0.5);
      std::nth_element(heights.begin(), middle, heights.end());
      return static_cast<double>(*middle);
    };
    BlockPiece piece;
    piece.median_m = at_share(0.5);
    piece.spread_m = at_share(0.9) - at_share(0.1);
    blocks_.pieces.push_back(piece);
  }

  /// In rounds, each by what the rounds before it left, so that no order of the cells matters.
  void give_rest_to_pieces(std::vector<std::size_t> rest) {
    // Each time those beside a piece, so that a cell is looked at as often as it has neighbours.
    std::erase_if(rest, [&](std::size_t cell) {
      bool is_beside_piece = false;
      visit_beside(cell, [&](std::size_t beside) { is_beside_piece |= piece_of(beside) > 0; });
      return piece_of(cell) != kPending || !is_beside_piece;
    });
    while (!rest.empty()) {
      for (const std::size_t cell : rest) numbered_.emplace_back(cell, nearest_piece(cell));
      for (const auto& [cell, piece] : numbered_) piece_of(cell) = piece;
      rest.clear();
      for (const auto& [cell, piece] : numbered_)
        visit_beside(cell, [&](std::size_t beside) {
          if (piece_of(beside) == kPending) rest.push_back(beside);
        });
      numbered_.clear();
      std::sort(rest.begin(), rest.end());
      rest.erase(std::unique(rest.begin(), rest.end()), rest.end());
    }
  }

  /// Of those beside a cell the one that is as high.
  std::int32_t nearest_piece(std::size_t cell) {
    std::int32_t best = kPending;
    double least_m = 0.0;
    visit_beside(cell, [&](std::size_t beside) {
      const std::int32_t piece = piece_of(beside);
      if (piece <= 0) return;
      const double off_m =
          std::abs(height_of(cell) - blocks_.pieces[static_cast<std::size_t>(piece - 1)].median_m);
      if (best == kPending || off_m < least_m || (off_m == least_m && piece < best)) {
        best = piece;
        least_m = off_m;
      }
    });
    return best;
  }

  void number_by_first_cell() {
    std::vector<std::int32_t> number(blocks_.pieces.size(), 0);
    std::vector<BlockPiece> pieces;
    const auto width = static_cast<std::size_t>(blocks_.piece.width);
    for (std::size_t cell = 0; cell < root_.size(); ++cell) {
      std::int32_t& piece = piece_of(cell);
      if (piece == kNone) continue;
      const auto old = static_cast<std::size_t>(piece - 1);
      if (number[old] == 0) {
        pieces.push_back(blocks_.pieces[old]);
        pieces.back().first_column = static_cast<int>(cell % width);
        pieces.back().first_row = static_cast<int>(cell / width);
        number[old] = static_cast<std::int32_t>(pieces.size());
      }
      piece = number[old];
      ++pieces[static_cast<std::size_t>(piece - 1)].num_cells;
    }
    blocks_.pieces = std::move(pieces);
  }

  const Grid<float>& heights_m_;
  BlockRules rules_;
  RasterBlocks blocks_;
  std::vector<std::int32_t> root_;     ///< of each cell of a block: a cell of the same piece
  std::vector<std::int32_t> slot_of_;  ///< of each cell of the block at hand: its row in ranges_
  std::vector<Range> ranges_;
  std::vector<std::pair<std::size_t, std::int32_t>> numbered_;
};

}  // namespace

RasterBlocks find_blocks(const Grid<float>& heights_m, const BlockRules& rules) {
  return BlockFinder(heights_m, rules).find();
}

}  // namespace terracast::tiler
