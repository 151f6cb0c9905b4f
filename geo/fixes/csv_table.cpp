#include "geo/fixes/csv_table.h"

#include <algorithm>

#include "core/error.h"
#include "core/registry.h"
#include "geo/fixes/number_hint.h"
#include "geo/fixes/text.h"
#include "geo/fixes/times.h"

namespace terracast::geo {
namespace {

using core::ErrorKind;
using core::fail;

constexpr std::size_t kMostCells = 20000000;

/// Takes records off the front of a text.
class RecordReader {
 public:
  RecordReader(std::string_view text, char separator, const std::filesystem::path& file)
      : text_(text), separator_(separator), file_(file) {}

  bool is_at_end() const { return at_ >= text_.size(); }
  /// The next line begins with a #.
  bool is_at_comment() const {
    const std::size_t begin = text_.find_first_not_of(' ', at_);
    return begin != std::string_view::npos && text_[begin] == '#';
  }
  /// Line, counted from 1, where the next record begins.
  std::size_t line() const { return line_; }

  /// The fields of one line, whatever quotes stand in it.
  std::vector<std::string> next_line() {
    const std::size_t end = std::min(text_.find('\n', at_), text_.size());
    std::string_view line = trimmed(text_.substr(at_, end - at_));
    std::vector<std::string> fields;
    for (std::size_t begin = 0; begin <= line.size();) {
      const std::size_t stop = std::min(line.find(separator_, begin), line.size());
      fields.emplace_back(trimmed(line.substr(begin, stop - begin)));
      begin = stop + 1;
      refuse_if_too_many(fields, line_);
    }
    at_ = std::min(end + 1, text_.size());
    ++line_;
    return fields;
  }

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
        refuse_if_too_many(fields, first_line);
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
  void refuse_if_too_many(const std::vector<std::string>& fields, std::size_t line) const {
    constexpr std::size_t kMostFields = 10000;
    if (fields.size() > kMostFields)
      fail(ErrorKind::Input, "{}, line {}: more than {} fields", file_.string(), line, kMostFields);
  }

  std::string_view text_;
  char separator_;
  const std::filesystem::path& file_;
  std::size_t at_ = 0;
  std::size_t line_ = 1;
};

bool is_empty_line(const std::vector<std::string>& fields) {
  return fields.size() == 1 && trimmed(fields[0]).empty();
}

/// Whether fields are those of a row, not names: one of them is a number, a date or an angle.
bool are_values(const std::vector<std::string>& fields) {
  return std::any_of(fields.begin(), fields.end(), [](const std::string& field) {
    return number_of(field) || is_number_with_comma(trimmed(field)) || stated_time(field, 0.0) ||
           is_angle_text(field);
  });
}

std::string_view without_mark(std::string_view name) {
  return name.starts_with('#') ? trimmed(name.substr(1)) : name;
}

}  // namespace

CsvTable::CsvTable(const std::filesystem::path& file, const CsvStyle& style)
    : file_(file), style_(style) {
  read(text_of_recording(file));
  if (names_.empty())
    fail(ErrorKind::Input, "{}: the file is empty; its first line names the columns",
         file_.string());
}

void CsvTable::read(std::string_view text) {
  RecordReader reader(text, style_.separator, file_);
  std::vector<std::string> last_comment;
  while (!reader.is_at_end()) {
    const std::size_t line = reader.line();
    const bool is_comment = reader.is_at_comment();
    std::vector<std::string> fields = is_comment ? reader.next_line() : reader.next();
    if (is_empty_line(fields)) continue;
    if (is_comment) {
      ++num_comments_;
      if (names_.empty()) last_comment = std::move(fields);
    } else if (!names_.empty()) {
      take_row(std::move(fields), line);
    } else if (last_comment.size() == fields.size() && are_values(fields)) {
      --num_comments_;
      take_header(std::move(last_comment));
      take_row(std::move(fields), line);
    } else {
      take_header(std::move(fields));
    }
  }
  // A header behind a # and no row.
  if (names_.empty() && last_comment.size() > 1) take_header(std::move(last_comment));
}

void CsvTable::take_header(std::vector<std::string> fields) {
  for (std::string& name : fields) names_.emplace_back(trimmed(name));
}

void CsvTable::take_row(std::vector<std::string> fields, std::size_t line) {
  while (fields.size() > names_.size() && trimmed(fields.back()).empty()) fields.pop_back();
  while (fields.size() < names_.size() && names_[fields.size()].empty()) fields.emplace_back();
  if (fields.size() != names_.size()) {
    const std::string hint = hint_of_separator();
    const bool has_more = fields.size() > names_.size();
    fail(ErrorKind::Input, "{}, line {}: {} fields; the header names {} columns{}", file_.string(),
         line, fields.size(), names_.size(),
         !hint.empty() ? hint
         : has_more    ? "; a text that holds a separator, or a number with a decimal comma, is to "
                         "stand in double quotes"
                       : "");
  }
  if (cells_.size() + fields.size() > kMostCells || rows_.size() >= kMostFixes)
    fail(ErrorKind::Input, "{}: more than {} rows or {} cells; cut the table into parts",
         file_.string(), kMostFixes, kMostCells);
  rows_.push_back({line, cells_.size()});
  std::move(fields.begin(), fields.end(), std::back_inserter(cells_));
}

std::optional<std::size_t> CsvTable::find_column(std::string_view name) const {
  const auto only_one = [&](const auto& is_it) -> std::optional<std::size_t> {
    std::optional<std::size_t> found;
    for (std::size_t column = 0; column < names_.size(); ++column) {
      if (!is_it(names_[column])) continue;
      if (found)
        fail(ErrorKind::Input,
             "{}: columns {} and {} (counted from 1) are both called \"{}\"; give them names of "
             "their own",
             file_.string(), *found + 1, column + 1, names_[column]);
      found = column;
    }
    return found;
  };
  if (const auto found = only_one([&](const std::string& one) { return one == name; }))
    return found;
  const std::string wanted = in_lower_case(without_mark(name));
  return only_one(
      [&](const std::string& one) { return in_lower_case(without_mark(one)) == wanted; });
}

std::size_t CsvTable::column(std::string_view name) const {
  if (const auto found = find_column(name)) return *found;
  fail(ErrorKind::Input, "{}", message_without(name));
}

std::string CsvTable::message_without(std::string_view name) const {
  return fmt::format("{}: {}{}", file_.string(), core::unknown_name_message("column", name, names_),
                     hint_of_separator());
}

/// The header is one name that holds another separator.
std::string CsvTable::hint_of_separator() const {
  if (names_.size() > 1) return "";
  struct Separator {
    char sign;
    const char* word;
  };
  for (const Separator& other : {Separator{';', ";"}, Separator{'\t', "tab"}, Separator{',', ","}})
    if (other.sign != style_.separator && names_[0].find(other.sign) != std::string::npos)
      return style_.is_stated
                 ? fmt::format("; its fields seem to be parted otherwise: separator = \"{}\"",
                               other.word)
                 : fmt::format("; format = \"csv\" reads other separators, by separator = \"{}\"",
                               other.word);
  return "";
}

std::string_view CsvTable::cell(std::size_t row, std::size_t column) const {
  return cells_[rows_[row].first_cell + column];
}

bool CsvTable::is_empty(std::size_t row, std::size_t column) const {
  const std::string_view text = trimmed(cell(row, column));
  if (text.empty() || text == "NA" || text == "null") return true;
  const std::string lower = in_lower_case(text);
  return lower == "nan" || lower == "-nan" || lower == "n/a";
}

std::optional<double> CsvTable::number(std::size_t row, std::size_t column) const {
  if (is_empty(row, column)) return std::nullopt;
  const std::string_view text = trimmed(cell(row, column));
  if (style_.decimal_sign == ',' && text.find('.') == std::string_view::npos) {
    std::string with_point(text);
    std::replace(with_point.begin(), with_point.end(), ',', '.');
    if (const auto value = number_of(with_point)) return value;
  } else if (style_.decimal_sign != ',') {
    if (const auto value = number_of(text)) return value;
  } else {
    fail(ErrorKind::Input,
         "{}: {} = \"{}\" has a point, where decimal_sign = \",\"; a point there may part "
         "thousands: "
         "write the number without it",
         where(row), names_[column], text.substr(0, 80));
  }
  const char* way_out =
      is_number_with_comma(text) ? "decimal_sign = \",\"" : "angle_unit = \"dms\"";
  fail(ErrorKind::Input,
       "{}: {} = \"{}\" is no number; a cell of what is not known is empty, NA, null or nan{}",
       where(row), names_[column], text.substr(0, 80),
       number_hint(text, style_.is_stated
                             ? fmt::format("{} reads it", way_out)
                             : fmt::format("format = \"csv\" reads it by {}", way_out)));
}

std::string CsvTable::where(std::size_t row) const {
  return fmt::format("{}, line {}", file_.string(), rows_[row].line);
}

void CsvTable::count(const std::set<std::size_t>& used, std::span<const core::KnownName> known,
                     FixTable& table) const {
  const auto num_rows = static_cast<std::int64_t>(rows_.size());
  for (std::size_t column = 0; column < names_.size(); ++column) {
    std::int64_t num_empty = 0;
    for (std::size_t row = 0; row < rows_.size(); ++row) num_empty += is_empty(row, column) ? 1 : 0;
    const std::string name =
        names_[column].empty()
            ? fmt::format("column {} (counted from 1), without a name", column + 1)
            : names_[column];
    if (used.contains(column)) {
      table.ledger.use(name, num_rows);
      if (num_empty > 0) table.empty[name] += static_cast<std::size_t>(num_empty);
    } else if (!names_[column].empty() || num_empty < num_rows) {
      const core::KnownName* found = core::find_known(known, name);
      if (found == nullptr) found = core::find_known(known, in_lower_case(name));
      if (found != nullptr)
        table.ledger.ignore(name, found->is_used ? "another column is taken for it" : found->words,
                            std::max<std::int64_t>(num_rows, 1));
      else
        table.ledger.miss(name, std::max<std::int64_t>(num_rows, 1));
    }
  }
  if (num_comments_ > 0)
    table.ledger.ignore("# comments", "notes of the writer",
                        static_cast<std::int64_t>(num_comments_));
}

}  // namespace terracast::geo
