#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <utility>
#include <vector>

namespace terracast::tiler {

/// Rows of a table, such as one of buildings, by where their boxes lie. Cells are 48 m wide, and
/// four times as wide from level to level: a row stands in cells of the first level where they are
/// as wide as its box, in four at most.
///
/// memory    16 B for each row in each of its cells
/// threads   safe, once finished
class BoxIndex {
 public:
  static constexpr std::uint32_t kAll = std::numeric_limits<std::uint32_t>::max();

  /// Cells in which a box stands.
  static std::vector<std::uint64_t> cells_of(const Eigen::Vector2d& lowest,
                                             const Eigen::Vector2d& highest);

  void add(std::uint32_t row, const Eigen::Vector2d& lowest, const Eigen::Vector2d& highest);
  void finish();

  /// All that may lie in a box and come before a row, each once, ascending.
  std::vector<std::uint32_t> rows_in(const Eigen::Vector2d& lowest, const Eigen::Vector2d& highest,
                                     std::uint32_t before = kAll) const;
  /// The same one by one, until `visit` returns false; what comes after costs nothing.
  void visit(const Eigen::Vector2d& lowest, const Eigen::Vector2d& highest, std::uint32_t before,
             const std::function<bool(std::uint32_t row)>& visit) const;

 private:
  static constexpr int kNumLevels = 8;
  /// Of a level's boxes.
  struct Bounds {
    Eigen::Vector2d lowest = Eigen::Vector2d::Constant(1e18);
    Eigen::Vector2d highest = Eigen::Vector2d::Constant(-1e18);
  };
  /// Rows of a cell, ascending: from one entry to before another.
  using Span = std::pair<std::size_t, std::size_t>;
  std::vector<Span> spans_in(const Eigen::Vector2d& lowest, const Eigen::Vector2d& highest,
                             std::uint32_t before) const;

  std::vector<std::pair<std::uint64_t, std::uint32_t>> entries_;  ///< cell and row, sorted
  std::array<Bounds, kNumLevels> bounds_;
};

}  // namespace terracast::tiler
