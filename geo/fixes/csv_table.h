#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace terracast::geo {

/// A table of text with a line of column names, as RFC 4180 has it: fields in double quotes may hold
/// separators, line ends and doubled quotes. Empty lines are skipped.
class CsvTable {
 public:
  /// throws   Io: no such file; Input: no header, a row with another number of fields than the header,
  ///          a quote that is never closed, more cells than 20 million
  CsvTable(const std::filesystem::path& file, char separator);

  std::size_t num_rows() const { return rows_.size(); }
  std::optional<std::size_t> find_column(std::string_view name) const;
  /// throws   Input: there is no such column; names the nearest and all others
  std::size_t column(std::string_view name) const;
  const std::vector<std::string>& column_names() const { return names_; }

  std::string_view cell(std::size_t row, std::size_t column) const;
  /// Nothing where the cell is empty or says nan.
  /// throws   Input: neither a number nor empty, with the line
  std::optional<double> number(std::size_t row, std::size_t column) const;
  /// Line of the file where a row begins, counted from 1.
  std::size_t line(std::size_t row) const { return rows_[row].line; }
  /// "flight.csv, line 12"
  std::string where(std::size_t row) const;

 private:
  struct Row {
    std::size_t line;
    std::size_t first_cell;
  };
  std::filesystem::path file_;
  std::vector<std::string> names_;
  std::vector<std::string> cells_;
  std::vector<Row> rows_;
};

}  // namespace terracast::geo
