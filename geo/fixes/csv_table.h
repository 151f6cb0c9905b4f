#pragma once

#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "core/ledger.h"
#include "geo/fixes/fix.h"

namespace terracast::geo {

/// How a table is written.
struct CsvStyle {
  char separator = ',';
  char decimal_sign = '.';
  bool is_stated = false;  ///< by keys of the config, which messages then name
};

/// A table of text with a line of column names, as RFC 4180 has it: fields in double quotes may hold
/// separators, line ends and doubled quotes. Empty lines are skipped, and lines that begin with #; the last of these
/// before a first line of numbers holds the names. Fields beyond those that the header names are refused, unless they
/// are empty; the last ones of a row may be left out where they have no name.
class CsvTable {
 public:
  /// throws   Io: no such file; Input: no header, a row with another number of fields than the header,
  ///          a quote that is never closed, more cells than 20 million, as text_of_recording()
  CsvTable(const std::filesystem::path& file, const CsvStyle& style);
  CsvTable(const std::filesystem::path& file, char separator)
      : CsvTable(file, CsvStyle{.separator = separator}) {}

  std::size_t num_rows() const { return rows_.size(); }
  /// Lines that begin with #, but for the one that holds the names.
  std::size_t num_comments() const { return num_comments_; }
  /// By its name, or else by the one name that only upper case or a # in front tells from it.
  /// throws   Input: several columns have that name
  std::optional<std::size_t> find_column(std::string_view name) const;
  /// throws   Input: there is no such column; names the nearest and all others
  std::size_t column(std::string_view name) const;
  /// What to say where there is no such column.
  std::string message_without(std::string_view name) const;
  const std::vector<std::string>& column_names() const { return names_; }

  std::string_view cell(std::size_t row, std::size_t column) const;
  /// The cell states nothing: it is empty, or says NA, null or nan.
  bool is_empty(std::size_t row, std::size_t column) const;
  /// Nothing where the cell is empty, as is_empty() has it.
  /// throws   Input: neither a number nor empty, with the line
  std::optional<double> number(std::size_t row, std::size_t column) const;
  /// Line of the file where a row begins, counted from 1.
  std::size_t line(std::size_t row) const { return rows_[row].line; }
  /// "flight.csv, line 12"
  std::string where(std::size_t row) const;

  /// Counts the columns: those of `used` as used with their empty cells, others by `known`; and the comments.
  void count(const std::set<std::size_t>& used, std::span<const core::KnownName> known,
             FixTable& table) const;

 private:
  struct Row {
    std::size_t line;
    std::size_t first_cell;
  };
  void read(std::string_view text);
  void take_header(std::vector<std::string> fields);
  void take_row(std::vector<std::string> fields, std::size_t line);
  std::string hint_of_separator() const;

  std::filesystem::path file_;
  CsvStyle style_;
  std::vector<std::string> names_;
  std::vector<std::string> cells_;
  std::vector<Row> rows_;
  std::size_t num_comments_ = 0;
};

}  // namespace terracast::geo
