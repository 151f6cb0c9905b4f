#include "geo/fixes/csv_table.h"

#include <algorithm>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/registry.h"
#include "geo/fixes/fix.h"
#include "geo/fixes/text.h"

namespace terracast::geo {
namespace {

using core::ErrorKind;
using core::fail;

constexpr std::size_t kMostBytes = std::size_t{1} << 28;
constexpr std::size_t kMostCells = 20000000;

/// Takes records off the front of a text.
class RecordReader {
 public:
  RecordReader(std::string_view text, char separator, const std::filesystem::path& file)
      : text_(text), separator_(separator), file_(file) {}

  bool is_at_end() const { return at_ >= text_.size(); }
  /// Line, counted from 1, where the next record begins.
  std::size_t line() const { return line_; }

  std::vector<std::string> next() {
    std::vector<std::string> fields(1);
    const std::size_t first_line = line_;
    bool is_quoted = false;
    while (at_ < text_.size()) {
      const char c = text_[at_++];
      if (c == '\n') ++line_;
      if (is_quoted) {
        if (c != '"') {
          fields.back() += c;
        } else if (at_ < text_.size() && text_[at_] == '"') {
          fields.back() += text_[at_++];
        } else {
          is_quoted = false;
        }
      } else if (c == '"' && fields.back().empty()) {
        is_quoted = true;
      } else if (c == separator_) {
        fields.emplace_back();
      } else if (c == '\n') {
        break;
      } else if (c != '\r' || (at_ < text_.size() && text_[at_] != '\n')) {
        fields.back() += c;
      }
    }
    if (is_quoted)
      fail(ErrorKind::Input, "{}, line {}: a double quote is opened and never closed",
           file_.string(), first_line);
    return fields;
  }

 private:
  std::string_view text_;
  char separator_;
  const std::filesystem::path& file_;
  std::size_t at_ = 0;
  std::size_t line_ = 1;
};

bool is_empty_line(const std::vector<std::string>& fields) {
  return fields.size() == 1 && trimmed(fields[0]).empty();
}

}  // namespace

CsvTable::CsvTable(const std::filesystem::path& file, char separator) : file_(file) {
  const std::string text = core::read_text_file(file, kMostBytes);
  std::string_view content = text;
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  if (content.starts_with(kByteOrderMark)) content.remove_prefix(kByteOrderMark.size());
  RecordReader reader(content, separator, file_);
  while (!reader.is_at_end()) {
    const std::size_t line = reader.line();
    std::vector<std::string> fields = reader.next();
    if (is_empty_line(fields)) continue;
    if (names_.empty()) {
      for (std::string& name : fields) names_.emplace_back(trimmed(name));
      continue;
    }
    if (fields.size() != names_.size())
      fail(ErrorKind::Input, "{}, line {}: {} fields; the header names {} columns", file_.string(),
           line, fields.size(), names_.size());
    if (cells_.size() + fields.size() > kMostCells || rows_.size() >= kMostFixes)
      fail(ErrorKind::Input, "{}: more than {} rows or {} cells; cut the table into parts",
           file_.string(), kMostFixes, kMostCells);
    rows_.push_back({line, cells_.size()});
    std::move(fields.begin(), fields.end(), std::back_inserter(cells_));
  }
  if (names_.empty())
    fail(ErrorKind::Input, "{}: the file is empty; its first line names the columns",
         file_.string());
}

std::optional<std::size_t> CsvTable::find_column(std::string_view name) const {
  const auto found = std::find(names_.begin(), names_.end(), name);
  if (found == names_.end()) return std::nullopt;
  return static_cast<std::size_t>(found - names_.begin());
}

std::size_t CsvTable::column(std::string_view name) const {
  if (const auto found = find_column(name)) return *found;
  fail(ErrorKind::Input, "{}: {}", file_.string(),
       core::unknown_name_message("column", name, names_));
}

std::string_view CsvTable::cell(std::size_t row, std::size_t column) const {
  return cells_[rows_[row].first_cell + column];
}

std::optional<double> CsvTable::number(std::size_t row, std::size_t column) const {
  const std::string_view text = trimmed(cell(row, column));
  if (text.empty() || text == "NA" || text == "null") return std::nullopt;
  if (const auto value = number_of(text)) return value;
  fail(ErrorKind::Input,
       "{}: {} = \"{}\" is no number; a cell of what is not known is empty, NA or null", where(row),
       names_[column], text);
}

std::string CsvTable::where(std::size_t row) const {
  return fmt::format("{}, line {}", file_.string(), rows_[row].line);
}

}  // namespace terracast::geo
