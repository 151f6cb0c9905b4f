#include "validate/npy.h"

#include <zip.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <memory>
#include <string_view>
#include <tuple>
#include <utility>

#include "core/error.h"
#include "validate/text.h"

namespace terracast::validate {

namespace {

using core::ErrorKind;
using core::fail;

static_assert(std::endian::native == std::endian::little);

/// A depth image of 2^28 pixels has half as many.
constexpr std::size_t kMostBytes = std::size_t{1} << 31;
/// Of all arrays of an npz together; the flow of 640 x 640 pixels has 8 MB.
constexpr std::size_t kMostBytesOfArchive = std::size_t{1} << 28;

/// The text behind `'key':` in the dictionary of the header, up to the end of its value.
std::string_view header_value(std::string_view header, std::string_view key,
                              const std::string& name) {
  for (const char quote : {'\'', '"'}) {
    const std::string quoted = quote + std::string(key) + quote;
    std::size_t at = header.find(quoted);
    if (at == std::string_view::npos) continue;
    at = header.find(':', at + quoted.size());
    if (at == std::string_view::npos) break;
    std::string_view rest = trimmed(header.substr(at + 1));
    if (rest.empty()) break;
    const char closing = rest[0] == '(' ? ')' : rest[0] == '[' ? ']' : ',';
    return trimmed(rest.substr(0, std::min(rest.find(closing), rest.size())));
  }
  fail(ErrorKind::Input, "{}: the npy header has no '{}'", name, key);
}

/// Header and values of an npy.
struct NpyParts {
  std::string_view descr;
  std::vector<std::size_t> shape;
  std::size_t num_values = 0;
  std::span<const std::byte> values;
};

NpyParts parts_of(std::span<const std::byte> bytes, const std::string& name) {
  const auto byte_at = [&](std::size_t i) { return std::to_integer<std::size_t>(bytes[i]); };
  if (bytes.size() < 10 || std::memcmp(bytes.data(), "\x93NUMPY", 6) != 0)
    fail(ErrorKind::Input, "{}: not an npy file", name);
  const std::size_t version = byte_at(6);
  if (version < 1 || version > 3) fail(ErrorKind::Input, "{}: npy version {}", name, version);
  std::size_t start = 10;
  std::size_t header_size = byte_at(8) | byte_at(9) << 8;
  if (version > 1) {
    start = 12;
    if (bytes.size() < start) fail(ErrorKind::Input, "{}: truncated npy header", name);
    header_size |= byte_at(10) << 16 | byte_at(11) << 24;
  }
  if (header_size > bytes.size() - start) fail(ErrorKind::Input, "{}: truncated npy header", name);
  const std::string_view header(reinterpret_cast<const char*>(bytes.data()) + start, header_size);

  NpyParts parts;
  parts.descr = header_value(header, "descr", name);
  parts.num_values = 1;
  if (header_value(header, "fortran_order", name) != "False")
    fail(ErrorKind::Input, "{}: Fortran order; C order is right", name);
  std::string_view shape = header_value(header, "shape", name);
  if (!shape.starts_with('('))
    fail(ErrorKind::Input, "{}: shape {} where a tuple such as (480, 640) should be", name, shape);
  shape.remove_prefix(1);
  for (const std::string_view part : split_at(shape, ',')) {
    const std::string_view extent = trimmed(part);
    if (extent.empty()) continue;
    const std::int64_t count = parse_integer(extent, name + ": shape");
    if (count < 0 || (count > 0 && parts.num_values > kMostBytes / static_cast<std::size_t>(count)))
      fail(ErrorKind::Input, "{}: shape ({}) is too large", name, shape);
    parts.shape.push_back(static_cast<std::size_t>(count));
    parts.num_values *= static_cast<std::size_t>(count);
  }
  parts.values = bytes.subspan(start + header_size);
  return parts;
}

/// That there are as many values as the shape says.
void check_size(const NpyParts& parts, std::size_t item_size, const std::string& name) {
  if (parts.num_values > kMostBytes / item_size ||
      parts.values.size() != parts.num_values * item_size)
    fail(ErrorKind::Input, "{}: {} bytes of values where its shape needs {} of {} bytes", name,
         parts.values.size(), parts.num_values, item_size);
}

/// Kind and size of "<f4" and its like.
std::pair<char, std::size_t> type_of(std::string_view type, const std::string& name) {
  if (type.size() < 3) fail(ErrorKind::Input, "{}: npy type {}", name, type);
  const bool is_little = type[0] == '<' || type[0] == '|';
  const auto size = static_cast<std::size_t>(parse_integer(type.substr(2), name + ": item size"));
  if (!is_little || std::string_view("fiub").find(type[1]) == std::string_view::npos || size < 1 ||
      size > 8)
    fail(ErrorKind::Input, "{}: npy type \"{}\"; little-endian numbers are right", name, type);
  return {type[1], size};
}

std::string_view unquoted(std::string_view text, const std::string& name) {
  text = trimmed(text);
  if (text.size() < 2 || (text.front() != '\'' && text.front() != '"') ||
      text.back() != text.front())
    fail(ErrorKind::Input, "{}: {} in the npy header, where a word in quotes should be", name,
         text);
  return text.substr(1, text.size() - 2);
}

template <class Number>
double number_at(const std::byte* at) {
  Number number;
  std::memcpy(&number, at, sizeof(Number));
  return static_cast<double>(number);
}

struct ZipCloser {
  void operator()(zip_t* archive) const { zip_discard(archive); }
  void operator()(zip_file_t* file) const { zip_fclose(file); }
};

/// Name and size of an entry.
zip_stat_t entry_of(zip_t* archive, zip_int64_t index, const std::string& name) {
  zip_stat_t entry;
  if (zip_stat_index(archive, static_cast<zip_uint64_t>(index), 0, &entry) != 0 ||
      (entry.valid & (ZIP_STAT_NAME | ZIP_STAT_SIZE)) != (ZIP_STAT_NAME | ZIP_STAT_SIZE))
    fail(ErrorKind::Input, "{}: entry {} of the npz is damaged", name, index);
  return entry;
}

}  // namespace

std::size_t NpyArray::num_values() const {
  std::size_t count = 1;
  for (const std::size_t extent : shape) count *= extent;
  return count;
}

std::vector<float> NpyArray::floats(const std::string& name) const {
  if (kind != 'f' || item_size != 4)
    fail(ErrorKind::Input, "{}: values of type {}{} where float32 should be", name, kind,
         item_size);
  std::vector<float> values(num_values());
  std::memcpy(values.data(), bytes.data(), bytes.size());
  return values;
}

std::vector<std::uint8_t> NpyArray::flags(const std::string& name) const {
  if ((kind != 'b' && kind != 'u') || item_size != 1)
    fail(ErrorKind::Input, "{}: values of type {}{} where bool should be", name, kind, item_size);
  std::vector<std::uint8_t> values(num_values());
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = bytes[i] != std::byte{0} ? 1 : 0;
  return values;
}

NpyArray parse_npy(std::span<const std::byte> bytes, const std::string& name) {
  const NpyParts parts = parts_of(bytes, name);
  NpyArray array;
  std::tie(array.kind, array.item_size) = type_of(unquoted(parts.descr, name), name);
  check_size(parts, array.item_size, name);
  array.shape = parts.shape;
  array.bytes.assign(parts.values.begin(), parts.values.end());
  return array;
}

NpyTable parse_npy_table(std::span<const std::byte> bytes, const std::string& name) {
  const NpyParts parts = parts_of(bytes, name);
  if (!parts.descr.starts_with('[') || parts.shape.size() != 1)
    fail(ErrorKind::Input, "{}: not a structured array of one dimension", name);
  NpyTable table;
  std::string_view left = parts.descr.substr(1);
  for (std::size_t open = left.find('('); open != std::string_view::npos; open = left.find('(')) {
    const std::size_t close = left.find(')', open);
    if (close == std::string_view::npos)
      fail(ErrorKind::Input, "{}: a column of the npy header does not end", name);
    const auto words = split_at(left.substr(open + 1, close - open - 1), ',');
    if (words.size() != 2)
      fail(ErrorKind::Input, "{}: a column of {} words in the npy header, not of name and type",
           name, words.size());
    NpyTable::Column column{.name = std::string(unquoted(words[0], name))};
    std::tie(column.kind, column.item_size) = type_of(unquoted(words[1], name), name);
    const bool is_float = column.kind == 'f' && (column.item_size == 4 || column.item_size == 8);
    const bool is_count = column.kind == 'u' &&
                          (column.item_size == 1 || column.item_size == 2 || column.item_size == 4);
    if (!is_float && !is_count)
      fail(ErrorKind::Input, "{}: column {} is of type {}{}", name, column.name, column.kind,
           column.item_size);
    column.offset = table.row_bytes;
    table.row_bytes += column.item_size;
    table.columns.push_back(std::move(column));
    left = left.substr(close + 1);
  }
  if (table.columns.empty()) fail(ErrorKind::Input, "{}: an array without columns", name);
  check_size(parts, table.row_bytes, name);
  table.num_rows = parts.num_values;
  table.bytes.assign(parts.values.begin(), parts.values.end());
  return table;
}

const NpyTable::Column& NpyTable::column(std::string_view name, const std::string& file) const {
  const auto found = std::find_if(columns.begin(), columns.end(),
                                  [&](const Column& one) { return one.name == name; });
  if (found == columns.end()) fail(ErrorKind::Input, "{}: no column {}", file, name);
  return *found;
}

double NpyTable::number(const Column& of, std::size_t row) const {
  const std::byte* const at = bytes.data() + row * row_bytes + of.offset;
  if (of.kind == 'f') return of.item_size == 4 ? number_at<float>(at) : number_at<double>(at);
  if (of.item_size == 1) return number_at<std::uint8_t>(at);
  return of.item_size == 2 ? number_at<std::uint16_t>(at) : number_at<std::uint32_t>(at);
}

void NpyTable::set_number(const Column& of, std::size_t row, double value) {
  std::byte* const at = bytes.data() + row * row_bytes + of.offset;
  const auto put = [at](auto number) { std::memcpy(at, &number, sizeof(number)); };
  const double most = std::ldexp(1.0, 8 * static_cast<int>(of.item_size)) - 1.0;
  if (of.kind == 'f') {
    if (of.item_size == 4)
      put(static_cast<float>(value));
    else
      put(value);
    return;
  }
  const double count = value > 0.0 ? std::min(std::round(value), most) : 0.0;
  if (of.item_size == 1) put(static_cast<std::uint8_t>(count));
  if (of.item_size == 2) put(static_cast<std::uint16_t>(count));
  if (of.item_size == 4) put(static_cast<std::uint32_t>(count));
}

std::vector<double> NpyTable::numbers(std::string_view column_name, const std::string& file) const {
  const Column& one = column(column_name, file);
  std::vector<double> values(num_rows);
  for (std::size_t row = 0; row < num_rows; ++row) values[row] = number(one, row);
  return values;
}

std::map<std::string, NpyArray> parse_npz(std::span<const std::byte> bytes,
                                          const std::string& name) {
  zip_error_t error;
  zip_error_init(&error);
  zip_source_t* source = zip_source_buffer_create(bytes.data(), bytes.size(), 0, &error);
  if (source == nullptr) fail(ErrorKind::Input, "{}: {}", name, zip_error_strerror(&error));
  zip_t* opened = zip_open_from_source(source, ZIP_RDONLY | ZIP_CHECKCONS, &error);
  if (opened == nullptr) {
    zip_source_free(source);
    const std::string reason = zip_error_strerror(&error);
    zip_error_fini(&error);
    fail(ErrorKind::Input, "{}: not a sound npz: {}", name, reason);
  }
  const std::unique_ptr<zip_t, ZipCloser> archive(opened);
  std::map<std::string, NpyArray> arrays;
  const zip_int64_t num_entries = zip_get_num_entries(archive.get(), 0);
  constexpr zip_int64_t kMostEntries = 64;  // a flow file has six
  if (num_entries > kMostEntries)
    fail(ErrorKind::Input, "{}: an npz of {} arrays", name, num_entries);
  std::size_t num_bytes = 0;
  for (zip_int64_t i = 0; i < num_entries; ++i) {
    const std::size_t size = entry_of(archive.get(), i, name).size;
    if (size > kMostBytesOfArchive - num_bytes)
      fail(ErrorKind::Input, "{}: its arrays have more than {} bytes", name, kMostBytesOfArchive);
    num_bytes += size;
  }
  for (zip_int64_t i = 0; i < num_entries; ++i) {
    const zip_stat_t entry = entry_of(archive.get(), i, name);
    std::string array_name = entry.name;
    const std::unique_ptr<zip_file_t, ZipCloser> file(
        zip_fopen_index(archive.get(), static_cast<zip_uint64_t>(i), 0));
    if (!file) fail(ErrorKind::Input, "{}: entry {} of the npz is damaged", name, array_name);
    std::vector<std::byte> data(entry.size);
    std::size_t filled = 0;
    while (filled < data.size()) {
      const zip_int64_t got = zip_fread(file.get(), data.data() + filled, data.size() - filled);
      if (got <= 0) fail(ErrorKind::Input, "{}: entry {} is damaged", name, array_name);
      filled += static_cast<std::size_t>(got);
    }
    std::byte beyond;
    if (zip_fread(file.get(), &beyond, 1) != 0)  // this read also compares the CRC
      fail(ErrorKind::Input, "{}: entry {} is damaged", name, array_name);
    NpyArray array = parse_npy(data, name + "/" + array_name);
    if (array_name.ends_with(".npy")) array_name.resize(array_name.size() - 4);
    arrays.emplace(std::move(array_name), std::move(array));
  }
  return arrays;
}

}  // namespace terracast::validate
