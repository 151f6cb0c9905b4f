#include "tiler/box_index.h"

#include <algorithm>
#include <cmath>
#include <queue>

namespace terracast::tiler {
namespace {

using Eigen::Vector2d;

constexpr double kFinestCell_m = 48.0;
constexpr int kCellBits = 29;  ///< of a cell's column, and of its row
constexpr double kMiddleCell = 1 << (kCellBits - 1);

double side_m(int level) { return std::ldexp(kFinestCell_m, 2 * level); }

std::uint64_t column_at(double at_m, int level) {
  const double column = std::floor(at_m / side_m(level)) + kMiddleCell;
  return static_cast<std::uint64_t>(std::clamp(column, 0.0, 2.0 * kMiddleCell - 1.0));
}

/// The finest whose cells are as wide as a box.
int level_of(const Vector2d& lowest, const Vector2d& highest, int num_levels) {
  int level = 0;
  while (level + 1 < num_levels && side_m(level) < (highest - lowest).maxCoeff()) ++level;
  return level;
}

template <class Use>
void for_each_cell(int level, const Vector2d& lowest, const Vector2d& highest, const Use& use) {
  const std::uint64_t last_x = column_at(highest.x(), level);
  const std::uint64_t last_y = column_at(highest.y(), level);
  for (std::uint64_t y = column_at(lowest.y(), level); y <= last_y; ++y)
    for (std::uint64_t x = column_at(lowest.x(), level); x <= last_x; ++x)
      use(static_cast<std::uint64_t>(level) << (2 * kCellBits) | y << kCellBits | x);
}

}  // namespace

std::vector<std::uint64_t> BoxIndex::cells_of(const Vector2d& lowest, const Vector2d& highest) {
  std::vector<std::uint64_t> cells;
  for_each_cell(level_of(lowest, highest, kNumLevels), lowest, highest,
                [&](std::uint64_t cell) { cells.push_back(cell); });
  return cells;
}

void BoxIndex::add(std::uint32_t row, const Vector2d& lowest, const Vector2d& highest) {
  for (const std::uint64_t cell : cells_of(lowest, highest)) entries_.emplace_back(cell, row);
  Bounds& bounds = bounds_[static_cast<std::size_t>(level_of(lowest, highest, kNumLevels))];
  bounds.lowest = bounds.lowest.cwiseMin(lowest);
  bounds.highest = bounds.highest.cwiseMax(highest);
}

void BoxIndex::finish() { std::sort(entries_.begin(), entries_.end()); }

std::vector<BoxIndex::Span> BoxIndex::spans_in(const Vector2d& lowest, const Vector2d& highest,
                                               std::uint32_t before) const {
  using Entry = std::pair<std::uint64_t, std::uint32_t>;
  std::vector<Span> spans;
  for (int level = 0; level < kNumLevels; ++level) {
    const Bounds& bounds = bounds_[static_cast<std::size_t>(level)];
    const Vector2d from = lowest.cwiseMax(bounds.lowest);
    const Vector2d to = highest.cwiseMin(bounds.highest);
    if ((from.array() > to.array()).any()) continue;
    for_each_cell(level, from, to, [&](std::uint64_t cell) {
      const auto first = std::lower_bound(entries_.begin(), entries_.end(), Entry(cell, 0));
      const auto last = std::lower_bound(first, entries_.end(), Entry(cell, before));
      if (first != last)
        spans.emplace_back(static_cast<std::size_t>(first - entries_.begin()),
                           static_cast<std::size_t>(last - entries_.begin()));
    });
  }
  return spans;
}

std::vector<std::uint32_t> BoxIndex::rows_in(const Vector2d& lowest, const Vector2d& highest,
                                             std::uint32_t before) const {
  std::vector<std::uint32_t> rows;
  std::vector<std::size_t> ends = {0};  // of the cells' rows, which ascend
  for (const auto& [first, last] : spans_in(lowest, highest, before)) {
    for (std::size_t entry = first; entry < last; ++entry) rows.push_back(entries_[entry].second);
    ends.push_back(rows.size());
  }
  // Two by two: much faster than sorting where many lie in a few cells.
  const auto at = [&](std::size_t k) {
    return rows.begin() + static_cast<std::ptrdiff_t>(ends[std::min(k, ends.size() - 1)]);
  };
  for (std::size_t num = 1; num + 1 < ends.size(); num *= 2)
    for (std::size_t k = 0; k + num + 1 < ends.size(); k += 2 * num)
      std::inplace_merge(at(k), at(k + num), at(k + 2 * num));
  rows.erase(std::unique(rows.begin(), rows.end()), rows.end());
  return rows;
}

void BoxIndex::visit(const Vector2d& lowest, const Vector2d& highest, std::uint32_t before,
                     const std::function<bool(std::uint32_t row)>& visit) const {
  std::vector<Span> spans = spans_in(lowest, highest, before);
  if (spans.size() == 1) {
    for (std::size_t entry = spans[0].first; entry < spans[0].second; ++entry)
      if (!visit(entries_[entry].second)) return;
    return;
  }
  const auto row_of = [&](const Span& span) { return entries_[span.first].second; };
  const auto comes_later = [&](const Span& a, const Span& b) { return row_of(a) > row_of(b); };
  std::priority_queue<Span, std::vector<Span>, decltype(comes_later)> next(comes_later,
                                                                           std::move(spans));
  std::uint32_t last = kAll;
  while (!next.empty()) {
    Span span = next.top();
    next.pop();
    const std::uint32_t row = row_of(span);
    if (row != last && !visit(row)) return;
    last = row;
    if (++span.first < span.second) next.push(span);
  }
}

}  // namespace terracast::tiler
