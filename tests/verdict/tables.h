#pragma once

#include <Eigen/Geometry>
#include <filesystem>
#include <string>
#include <vector>

#include "tests/jobs/draws.h"

/// Tables of numbers in exported datasets, whose single values change and all else keeps its text.
namespace terracast::test {

/// Rows of text between separators.
struct Table {
  std::filesystem::path file;
  char separator = ',';
  bool has_header = false;
  std::vector<std::vector<std::string>> rows;

  std::size_t num_rows() const { return rows.size() - (has_header ? 1 : 0); }
  /// One of the rows of numbers from `first` on.
  std::vector<std::string>& draw_row(Draws& draws, std::size_t first = 0);
  void write() const;
};

Table read_table(const std::filesystem::path& file, char separator, bool has_header);

double number_of(const std::string& text);
std::string text_of(double number);

/// A table of poses: where its rows have what.
struct PoseTable {
  Table table;
  std::vector<std::size_t> place;     ///< columns of x, y, z
  std::vector<std::size_t> attitude;  ///< of w, x, y, z, or of a matrix row by row
  std::size_t first_row = 0;          ///< the first that is not fixed by the format
};

/// All tables of poses of a dataset, of which COLMAP's binary files are none.
std::vector<PoseTable> pose_tables_of(const std::filesystem::path& dataset);
/// Its tables of places.
std::vector<PoseTable> place_tables_of(const std::filesystem::path& dataset);

/// A row's attitude followed by a turn about its own axes.
void turn_row(std::vector<std::string>& row, const PoseTable& poses, const Eigen::Quaterniond& by);

}  // namespace terracast::test
