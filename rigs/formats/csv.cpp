#include <fmt/format.h>

#include <algorithm>

#include "core/atomic_file.h"
#include "geo/fixes/csv_table.h"
#include "rigs/rig_table.h"

namespace terracast::rigs {
namespace {

/// Of comma, semicolon and tab, the one that the heading line holds most of.
char separator_of(const std::filesystem::path& file) {
  constexpr std::size_t kMostBytes = std::size_t{1} << 22;
  const std::string text = core::read_text_file(file, kMostBytes);
  const std::string heading = text.substr(0, text.find('\n'));
  char best = ',';
  for (const char separator : {';', '\t'})
    if (std::count(heading.begin(), heading.end(), separator) >
        std::count(heading.begin(), heading.end(), best))
      best = separator;
  return best;
}

std::string field(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"') quoted += '"';
    quoted += c;
  }
  return quoted + '"';
}

std::string line_of(const std::vector<std::string>& cells) {
  std::vector<std::string> fields;
  for (const std::string& cell : cells) fields.push_back(field(cell));
  return fmt::format("{}\n", fmt::join(fields, ","));
}

ImportedRig read_csv(const std::filesystem::path& path, const ReadOptions& options) {
  const geo::CsvTable table(path, separator_of(path));
  Sheet sheet{.file = path, .headings = table.column_names(), .rows = {}, .row_numbers = {}};
  for (std::size_t row = 0; row < table.num_rows(); ++row) {
    std::vector<std::string>& cells = sheet.rows.emplace_back();
    for (std::size_t column = 0; column < sheet.headings.size(); ++column)
      cells.emplace_back(table.cell(row, column));
    sheet.row_numbers.push_back(table.line(row));
  }
  return rig_of_sheet(sheet, options);
}

void write_csv(const rigs::RigOptions& rig, const std::filesystem::path& path) {
  const Sheet sheet = sheet_of_rig(rig);
  std::string text = line_of(sheet.headings);
  for (const std::vector<std::string>& row : sheet.rows) text += line_of(row);
  core::write_file(path, text);
}

}  // namespace

RigFormatInfo csv_rigs() {
  return {
      .name = "csv",
      .summary = "A table with a row a camera, separated by commas, semicolons or tabs.",
      .is_table = true,
      .recognises = [](const std::filesystem::path& path,
                       std::string_view) { return path.extension() == ".csv"; },
      .read = read_csv,
      .write = write_csv,
      .known =
          [] {
            return std::vector<core::KnownTable>{{"csv", "headings of a table", known_headings()}};
          }};
}

}  // namespace terracast::rigs
