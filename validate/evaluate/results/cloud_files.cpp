#include "validate/evaluate/results/cloud_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <optional>

#include "core/atomic_file.h"
#include "core/error.h"
#include "validate/text.h"

namespace terracast::validate {

namespace {

namespace fs = std::filesystem;
using core::ErrorKind;
using core::fail;

static_assert(std::endian::native == std::endian::little);

constexpr std::size_t kMostCloudBytes = std::size_t{1} << 32;
constexpr std::int64_t kMostPoints = 30'000'000;

void check_point_count(std::uint64_t count, const std::string& name) {
  if (count > static_cast<std::uint64_t>(kMostPoints))
    fail(ErrorKind::Input, "{}: {} points; at most {} can be compared: thin the cloud", name, count,
         kMostPoints);
}

/// Adds a point, or counts it where the file marks it as none.
void add_point(const Eigen::Vector3d& point, const std::string& name, std::uint64_t index,
               PointCloud& cloud) {
  constexpr double kFarthest_m = 1e9;
  if (point.array().isNaN().any()) {
    ++cloud.num_invalid;
    return;
  }
  if (!(point.cwiseAbs().maxCoeff() < kFarthest_m))
    fail(ErrorKind::Input, "{}: point {}: ({}, {}, {}) m is no place", name, index, point.x(),
         point.y(), point.z());
  cloud.points.push_back(point);
}

template <class Number>
Number loaded(const std::byte* at, bool is_swapped) {
  std::array<std::byte, sizeof(Number)> bytes;
  std::memcpy(bytes.data(), at, bytes.size());
  if (is_swapped) std::reverse(bytes.begin(), bytes.end());
  return std::bit_cast<Number>(bytes);
}

/// A type of numbers: its size, and how a value is read.
struct NumberType {
  std::size_t size = 0;
  double (*read)(const std::byte*, bool) = nullptr;
};

template <class Number>
constexpr NumberType number_type() {
  return {sizeof(Number), [](const std::byte* at, bool is_swapped) {
            return static_cast<double>(loaded<Number>(at, is_swapped));
          }};
}

std::optional<NumberType> ply_type(std::string_view word) {
  static const std::map<std::string_view, NumberType> table{
      {"char", number_type<std::int8_t>()},     {"int8", number_type<std::int8_t>()},
      {"uchar", number_type<std::uint8_t>()},   {"uint8", number_type<std::uint8_t>()},
      {"short", number_type<std::int16_t>()},   {"int16", number_type<std::int16_t>()},
      {"ushort", number_type<std::uint16_t>()}, {"uint16", number_type<std::uint16_t>()},
      {"int", number_type<std::int32_t>()},     {"int32", number_type<std::int32_t>()},
      {"uint", number_type<std::uint32_t>()},   {"uint32", number_type<std::uint32_t>()},
      {"float", number_type<float>()},          {"float32", number_type<float>()},
      {"double", number_type<double>()},        {"float64", number_type<double>()}};
  const auto found = table.find(word);
  return found == table.end() ? std::nullopt : std::optional(found->second);
}

std::optional<NumberType> pcd_type(std::string_view type, std::string_view size) {
  static const std::map<std::string, NumberType> table{
      {"I1", number_type<std::int8_t>()},   {"I2", number_type<std::int16_t>()},
      {"I4", number_type<std::int32_t>()},  {"I8", number_type<std::int64_t>()},
      {"U1", number_type<std::uint8_t>()},  {"U2", number_type<std::uint16_t>()},
      {"U4", number_type<std::uint32_t>()}, {"U8", number_type<std::uint64_t>()},
      {"F4", number_type<float>()},         {"F8", number_type<double>()}};
  const auto found = table.find(std::string(type) + std::string(size));
  return found == table.end() ? std::nullopt : std::optional(found->second);
}

/// Columns of a table: at which word, or byte, x, y and z stand.
struct PlaceColumns {
  std::array<std::size_t, 3> words{}, offsets{};
  std::array<NumberType, 3> types{};
  std::array<bool, 3> is_there{};
  std::size_t num_words = 0;
  std::size_t row_bytes = 0;

  void add(std::string_view column, const NumberType& type, std::size_t count,
           const std::string& name) {
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (column == std::array{"x", "y", "z"}[axis]) {
        if (is_there[axis]) fail(ErrorKind::Input, "{}: two columns are called {}", name, column);
        is_there[axis] = true;
        words[axis] = num_words;
        offsets[axis] = row_bytes;
        types[axis] = type;
      }
    num_words += count;
    row_bytes += count * type.size;
    constexpr std::size_t kMostRowBytes = 1 << 20;
    if (count > kMostRowBytes || row_bytes > kMostRowBytes)
      fail(ErrorKind::Input, "{}: rows of more than {} bytes", name, kMostRowBytes);
  }
  void check(const std::string& name) const {
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (!is_there[axis])
        fail(ErrorKind::Input, "{}: no column {} among its points'", name,
             std::array{"x", "y", "z"}[axis]);
  }
};

/// A number of a text of points; "nan" marks an invalid point.
double place_number(std::string_view word, const std::string& where) {
  if (word == "nan" || word == "NaN" || word == "-nan" || word == "NAN")
    return std::numeric_limits<double>::quiet_NaN();
  return parse_number(word, where);
}

/// Refuses a file whose header counts fewer points than it holds.
void check_all_is_taken(std::size_t num_bytes_left, std::uint64_t num_points,
                        const std::string& name) {
  if (num_bytes_left > 0)
    fail(ErrorKind::Input, "{}: {} bytes behind the {} points that its header counts", name,
         num_bytes_left, num_points);
}

/// Takes rows; returns the bytes behind them, blanks not counted.
std::size_t take_text_rows(std::string_view text, const PlaceColumns& columns,
                           std::uint64_t num_rows, const std::string& name, PointCloud& cloud) {
  std::uint64_t row = 0;
  while (row < num_rows) {
    const std::size_t end = text.find('\n');
    if (text.empty()) fail(ErrorKind::Input, "{}: truncated: {} rows of {}", name, row, num_rows);
    const auto words = split_blanks(trimmed(text.substr(0, end)));
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    if (words.empty()) continue;
    const std::string where = fmt::format("{}: point {}", name, row);
    if (words.size() != columns.num_words)
      fail(ErrorKind::Input, "{}: {} values where {} should be", where, words.size(),
           columns.num_words);
    add_point(
        {place_number(words[columns.words[0]], where), place_number(words[columns.words[1]], where),
         place_number(words[columns.words[2]], where)},
        name, row, cloud);
    ++row;
  }
  const std::size_t behind = text.find_first_not_of(" \t\r\n");
  return behind == std::string_view::npos ? 0 : text.size() - behind;
}

/// Takes rows; returns the bytes behind them.
std::size_t take_binary_rows(std::span<const std::byte> bytes, const PlaceColumns& columns,
                             std::uint64_t num_rows, bool is_swapped, const std::string& name,
                             PointCloud& cloud) {
  if (columns.row_bytes == 0 || num_rows > bytes.size() / columns.row_bytes)
    fail(ErrorKind::Input, "{}: truncated: {} bytes for {} points of {} bytes", name, bytes.size(),
         num_rows, columns.row_bytes);
  cloud.points.reserve(num_rows);
  for (std::uint64_t row = 0; row < num_rows; ++row) {
    const std::byte* const at = bytes.data() + row * columns.row_bytes;
    Eigen::Vector3d point;
    for (std::size_t axis = 0; axis < 3; ++axis)
      point[static_cast<Eigen::Index>(axis)] =
          columns.types[axis].read(at + columns.offsets[axis], is_swapped);
    add_point(point, name, row, cloud);
  }
  return bytes.size() - num_rows * columns.row_bytes;
}

std::string_view text_of(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

std::uint64_t header_count(std::string_view word, const std::string& name) {
  const std::int64_t count = parse_integer(word, name + ": number of points");
  if (count < 0) fail(ErrorKind::Input, "{}: {} points", name, count);
  return static_cast<std::uint64_t>(count);
}

/// Lines of a header, one at a time; what follows stays in `rest`.
struct HeaderLines {
  std::string_view rest;
  std::size_t num_lines = 0;

  std::string_view next(const std::string& name) {
    constexpr std::size_t kMostLines = 10'000, kLongest = 4096;
    const std::size_t end = rest.substr(0, kLongest).find('\n');
    if (end == std::string_view::npos || ++num_lines > kMostLines)
      fail(ErrorKind::Input, "{}: its header does not end", name);
    const std::string_view line = trimmed(rest.substr(0, end));
    rest.remove_prefix(end + 1);
    return line;
  }
};

PointCloud ply_cloud(std::span<const std::byte> bytes, const std::string& name) {
  HeaderLines header{.rest = text_of(bytes)};
  if (header.next(name) != "ply") fail(ErrorKind::Input, "{}: not a PLY", name);
  PointCloud cloud{.form = "PLY"};
  PlaceColumns columns;
  std::string format, element;
  std::uint64_t num_points = 0;
  bool has_points = false;
  for (;;) {
    const std::string_view line = header.next(name);
    const auto words = split_blanks(line);
    if (words.empty() || words[0] == "comment" || words[0] == "obj_info") continue;
    if (words[0] == "end_header") break;
    if (words[0] == "format" && words.size() == 3) {
      format = words[1];
    } else if (words[0] == "element" && words.size() == 3) {
      element = words[1];
      const std::uint64_t count = header_count(words[2], name);
      if (element != "vertex") {
        // Rows before the vertices would have to be skipped; no program writes them.
        if (!has_points)
          fail(ErrorKind::Input, "{}: its element {} stands before vertex", name, element);
        if (count > 0) cloud.unused.push_back(fmt::format("{} of {}", count, element));
      } else {
        if (has_points) fail(ErrorKind::Input, "{}: two elements vertex", name);
        has_points = true;
        num_points = count;
      }
    } else if (words[0] == "property" && element == "vertex") {
      const auto type = words.size() == 3 ? ply_type(words[1]) : std::nullopt;
      if (!type)
        fail(ErrorKind::Input, "{}: \"{}\" is no property of a point", name, line.substr(0, 80));
      columns.add(words[2], *type, 1, name);
    } else if (words[0] != "property" || element.empty()) {
      fail(ErrorKind::Input, "{}: \"{}\" in its header", name, line.substr(0, 80));
    }
  }
  if (!has_points) fail(ErrorKind::Input, "{}: no element vertex", name);
  check_point_count(num_points, name);
  columns.check(name);
  std::size_t num_left = 0;
  if (format == "ascii")
    num_left = take_text_rows(header.rest, columns, num_points, name, cloud);
  else if (format == "binary_little_endian" || format == "binary_big_endian")
    num_left = take_binary_rows(bytes.last(header.rest.size()), columns, num_points,
                                format == "binary_big_endian", name, cloud);
  else
    fail(ErrorKind::Input, "{}: its format is \"{}\", not ascii or binary", name, format);
  // Rows of further elements stand behind the points.
  if (cloud.unused.empty()) check_all_is_taken(num_left, num_points, name);
  return cloud;
}

PointCloud pcd_cloud(std::span<const std::byte> bytes, const std::string& name) {
  HeaderLines header{.rest = text_of(bytes)};
  PointCloud cloud{.form = "PCD"};
  std::map<std::string, std::vector<std::string_view>, std::less<>> parts;
  std::string data;
  while (data.empty()) {
    const auto words = split_blanks(header.next(name));
    if (words.empty() || words[0].starts_with('#')) continue;
    if (words.size() < 2) fail(ErrorKind::Input, "{}: {} has no value", name, words[0]);
    if (words[0] == "DATA") data = words[1];
    parts[std::string(words[0])] = {words.begin() + 1, words.end()};
  }
  const auto part = [&](const char* key) -> const std::vector<std::string_view>& {
    const auto found = parts.find(key);
    if (found == parts.end()) fail(ErrorKind::Input, "{}: not a PCD with {}", name, key);
    return found->second;
  };
  const auto &fields = part("FIELDS"), &sizes = part("SIZE"), &types = part("TYPE");
  if (sizes.size() != fields.size() || types.size() != fields.size() ||
      (parts.contains("COUNT") && part("COUNT").size() != fields.size()))
    fail(ErrorKind::Input, "{}: FIELDS, SIZE, TYPE and COUNT are not of one length", name);
  PlaceColumns columns;
  for (std::size_t k = 0; k < fields.size(); ++k) {
    const auto type = pcd_type(types[k], sizes[k]);
    if (!type)
      fail(ErrorKind::Input, "{}: field {} of type {}{}", name, fields[k], types[k], sizes[k]);
    columns.add(fields[k], *type,
                parts.contains("COUNT") ? header_count(part("COUNT")[k], name) : 1, name);
  }
  columns.check(name);
  const std::uint64_t num_points = header_count(part("POINTS").front(), name);
  check_point_count(num_points, name);
  if (parts.contains("WIDTH") && parts.contains("HEIGHT")) {
    const std::uint64_t width = header_count(part("WIDTH").front(), name),
                        height = header_count(part("HEIGHT").front(), name);
    if (height == 0 ? num_points > 0 : num_points / height != width || num_points % height != 0)
      fail(ErrorKind::Input, "{}: {} points, but WIDTH {} and HEIGHT {}", name, num_points, width,
           height);
  }
  std::size_t num_left = 0;
  if (data == "ascii")
    num_left = take_text_rows(header.rest, columns, num_points, name, cloud);
  else if (data == "binary")
    num_left =
        take_binary_rows(bytes.last(header.rest.size()), columns, num_points, false, name, cloud);
  else
    fail(ErrorKind::Input,
         "{}: DATA {}; ascii and binary are read: pcl_convert_pcd_ascii_binary "
         "writes them",
         name, data);
  check_all_is_taken(num_left, num_points, name);
  return cloud;
}

PointCloud las_cloud(std::span<const std::byte> bytes, const std::string& name) {
  constexpr std::size_t kLeastHeader = 227, kHeader14 = 255;
  if (bytes.size() < kLeastHeader || !text_of(bytes).starts_with("LASF"))
    fail(ErrorKind::Input, "{}: not LAS", name);
  const auto at = [&]<class Number>(std::size_t offset, Number) {
    return loaded<Number>(bytes.data() + offset, false);
  };
  const int minor = at(25, std::uint8_t{});
  const int format = at(104, std::uint8_t{});
  if (at(24, std::uint8_t{}) != 1 || minor > 4)
    fail(ErrorKind::Input, "{}: LAS {}.{}; 1.0 to 1.4 are read", name, at(24, std::uint8_t{}),
         minor);
  if (format > 10)
    fail(ErrorKind::Input,
         "{}: point format {}: packed as LAZ; unpack it (pdal translate, las2las)", name, format);
  const std::uint64_t begin = at(96, std::uint32_t{});
  const std::size_t row_bytes = at(105, std::uint16_t{});
  std::uint64_t num_points = at(107, std::uint32_t{});
  if (minor >= 4) {
    if (bytes.size() < kHeader14) fail(ErrorKind::Input, "{}: truncated in its header", name);
    const std::uint64_t num_long = at(247, std::uint64_t{});
    if (num_long > 0) num_points = num_long;
  }
  check_point_count(num_points, name);
  // Bytes of a point of formats 0 to 10, by LAS 1.4.
  static constexpr std::array<std::size_t, 11> kLeastRow{20, 28, 26, 34, 57, 63,
                                                         30, 36, 38, 59, 67};
  if (begin > bytes.size() || row_bytes < kLeastRow[static_cast<std::size_t>(format)])
    fail(ErrorKind::Input,
         "{}: its points begin at byte {} of {}, {} bytes each; those of format {} have {}", name,
         begin, bytes.size(), row_bytes, format, kLeastRow[static_cast<std::size_t>(format)]);
  if (num_points > (bytes.size() - begin) / row_bytes)
    fail(ErrorKind::Input, "{}: truncated: {} bytes for {} points of {} bytes", name,
         bytes.size() - begin, num_points, row_bytes);
  PointCloud cloud{.form = "LAS"};
  cloud.points.reserve(num_points);
  Eigen::Vector3d scale, offset;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    scale[axis] = at(131 + 8 * static_cast<std::size_t>(axis), double{});
    offset[axis] = at(155 + 8 * static_cast<std::size_t>(axis), double{});
  }
  if (!scale.allFinite() || !offset.allFinite() || (scale.array() == 0.0).any())
    fail(ErrorKind::Input, "{}: scales ({}, {}, {}) or offsets are not right", name, scale.x(),
         scale.y(), scale.z());
  // The bit "withheld" of byte 15; LAS 1.0 knows no such bit.
  const int withheld = format >= 6 ? 0x04 : minor >= 1 ? 0x80 : 0;
  for (std::uint64_t i = 0; i < num_points; ++i) {
    if ((at(begin + i * row_bytes + 15, std::uint8_t{}) & withheld) != 0) {
      ++cloud.num_withheld;
      continue;
    }
    Eigen::Vector3d point;
    for (Eigen::Index axis = 0; axis < 3; ++axis)
      point[axis] = at(begin + i * row_bytes + 4 * static_cast<std::size_t>(axis), std::int32_t{}) *
                        scale[axis] +
                    offset[axis];
    add_point(point, name, i, cloud);
  }
  return cloud;
}

/// points3D.bin: id, place, colour, error and track of each point.
PointCloud colmap_binary_cloud(std::span<const std::byte> bytes, const std::string& name) {
  constexpr std::size_t kPoint = 51;
  PointCloud cloud{.form = "COLMAP"};
  if (bytes.size() < 8) fail(ErrorKind::Input, "{}: truncated", name);
  const auto num_points = loaded<std::uint64_t>(bytes.data(), false);
  check_point_count(num_points, name);
  std::size_t at = 8;
  for (std::uint64_t i = 0; i < num_points; ++i) {
    if (bytes.size() - at < kPoint)
      fail(ErrorKind::Input, "{}: truncated: it ends in point {} of {}", name, i, num_points);
    const std::byte* const point = bytes.data() + at;
    add_point({loaded<double>(point + 8, false), loaded<double>(point + 16, false),
               loaded<double>(point + 24, false)},
              name, i, cloud);
    const auto track = loaded<std::uint64_t>(point + 43, false);
    at += kPoint;
    if (track > (bytes.size() - at) / 8)
      fail(ErrorKind::Input, "{}: truncated: it ends in the track of point {}", name, i);
    at += 8 * static_cast<std::size_t>(track);
  }
  if (at != bytes.size())
    fail(ErrorKind::Input, "{}: {} bytes behind its {} points", name, bytes.size() - at,
         num_points);
  return cloud;
}

/// What parts the cells of a text, as its first row shows.
char separator_of(std::string_view row) {
  for (const char separator : {';', ','})
    if (row.find(separator) != std::string_view::npos) return separator;
  return ' ';
}

std::vector<std::string_view> cells_of(std::string_view row, char separator) {
  if (separator == ' ') return split_blanks(row);
  std::vector<std::string_view> cells = split_at(row, separator);
  for (std::string_view& cell : cells) cell = trimmed(cell);
  return cells;
}

/// Rows of text whose places begin at a cell. A first row of names is a head.
/// is_table  all rows have as many cells
PointCloud text_cloud(std::span<const std::byte> bytes, std::size_t first_cell, bool is_table,
                      const char* form, const std::string& name) {
  PointCloud cloud{.form = form};
  std::string_view text = text_of(bytes);
  std::uint64_t number = 0;
  std::size_t num_cells = 0;
  char separator = '\0';
  while (!text.empty()) {
    const std::size_t end = text.find('\n');
    const std::string_view line = trimmed(text.substr(0, end));
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    ++number;
    if (line.empty() || line.starts_with('#') || line.starts_with("//")) continue;
    const bool is_first = separator == '\0';
    if (is_first) separator = is_table ? separator_of(line) : ' ';
    const std::vector<std::string_view> cells = cells_of(line, separator);
    if (is_first && !cells.empty() && (cells[0] == "x" || cells[0] == "X")) continue;
    const std::string where = fmt::format("{}:{}", name, number);
    if (cells.size() < first_cell + 3)
      fail(ErrorKind::Input, "{}: {} values where x, y, z should be", where, cells.size());
    if (num_cells == 0) num_cells = cells.size();
    if (is_table && cells.size() != num_cells)
      fail(ErrorKind::Input, "{}: {} values; the rows before it have {}", where, cells.size(),
           num_cells);
    check_point_count(cloud.points.size() + 1, name);
    add_point({place_number(cells[first_cell], where), place_number(cells[first_cell + 1], where),
               place_number(cells[first_cell + 2], where)},
              name, cloud.points.size(), cloud);
  }
  return cloud;
}

PointCloud cloud_by_name(std::span<const std::byte> bytes, const std::string& name) {
  const fs::path path(name);
  std::string end = path.extension().string();
  std::transform(end.begin(), end.end(), end.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (path.filename() == "points3D.bin") return colmap_binary_cloud(bytes, name);
  if (path.filename() == "points3D.txt") return text_cloud(bytes, 1, false, "COLMAP", name);
  if (end == ".ply") return ply_cloud(bytes, name);
  if (end == ".pcd") return pcd_cloud(bytes, name);
  if (end == ".las") return las_cloud(bytes, name);
  if (end == ".xyz" || end == ".txt" || end == ".csv" || end == ".asc")
    return text_cloud(bytes, 0, true, "xyz", name);
  fail(ErrorKind::Input,
       "{}: clouds are .ply, .pcd, .las, .xyz, .txt, .csv, .asc, or COLMAP's points3D.txt and "
       "points3D.bin{}",
       name, end == ".laz" ? "; unpack .laz first (pdal translate, las2las)" : "");
}

}  // namespace

PointCloud parse_point_cloud(std::span<const std::byte> bytes, const std::string& name) {
  PointCloud cloud = cloud_by_name(bytes, name);
  if (cloud.points.empty()) fail(ErrorKind::Input, "{}: no points in it", name);
  return cloud;
}

PointCloud read_point_cloud(const fs::path& file) {
  return parse_point_cloud(core::read_file(file, kMostCloudBytes), file.string());
}

}  // namespace terracast::validate
