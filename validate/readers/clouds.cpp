#include "validate/readers/clouds.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <map>
#include <string_view>

#include "core/error.h"
#include "validate/text.h"

namespace terracast::validate {

namespace {

using core::ErrorKind;
using core::fail;

static_assert(std::endian::native == std::endian::little);

template <class Number>
double number_at(const std::byte* at) {
  Number number;
  std::memcpy(&number, at, sizeof(Number));
  return static_cast<double>(number);
}

/// A column of a row of numbers.
struct Column {
  std::size_t offset = 0;
  double (*read)(const std::byte*) = nullptr;
};

/// Rows of numbers by columns' names.
struct Rows {
  std::map<std::string, Column, std::less<>> columns;
  std::size_t row_bytes = 0;
  std::size_t num_rows = 0;
  std::span<const std::byte> bytes;

  void add(const std::string& column, std::size_t size, double (*read)(const std::byte*),
           const std::string& name) {
    if (!columns.emplace(column, Column{row_bytes, read}).second)
      fail(ErrorKind::Input, "{}: two columns are called {}", name, column);
    row_bytes += size;
  }
  void check_size(const std::string& name) const {
    if (row_bytes == 0 || num_rows > bytes.size() / row_bytes ||
        bytes.size() != num_rows * row_bytes)
      fail(ErrorKind::Input, "{}: {} bytes of points, where {} of {} bytes should be", name,
           bytes.size(), num_rows, row_bytes);
  }
  double at(std::string_view column, std::size_t row, const std::string& name) const {
    const auto found = columns.find(column);
    if (found == columns.end()) fail(ErrorKind::Input, "{}: no column {}", name, column);
    return found->second.read(bytes.data() + row * row_bytes + found->second.offset);
  }
};

/// Of what PLY and PCD have in common.
Cloud cloud_of(const Rows& rows, const std::string& name) {
  rows.check_size(name);
  Cloud cloud;
  cloud.rows.reserve(rows.num_rows);
  for (std::size_t i = 0; i < rows.num_rows; ++i) {
    const auto at = [&](std::string_view column) { return rows.at(column, i, name); };
    cloud.rows.push_back({.place = {at("x"), at("y"), at("z")},
                          .time_s = at("time"),
                          .intensity = at("intensity"),
                          .return_number = static_cast<std::int64_t>(at("return_number")),
                          .num_returns = static_cast<std::int64_t>(at("num_returns")),
                          .class_id = static_cast<std::int64_t>(at("class_id")),
                          .instance_id = static_cast<std::int64_t>(at("instance_id"))});
  }
  return cloud;
}

/// The lines of a header up to the one that ends it, and where the rest begins.
struct TextHeader {
  std::vector<TextLine> lines;
  std::size_t size = 0;
};
TextHeader header_of(std::span<const std::byte> bytes, std::string_view last,
                     const std::string& name) {
  constexpr std::size_t kLongest = 65536;
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()),
                              std::min(bytes.size(), kLongest));
  const std::size_t at = text.find(last);
  if (at == std::string_view::npos)
    fail(ErrorKind::Input, "{}: its header has no line \"{}\"", name, trimmed(last));
  const std::size_t end = at + last.size();
  return {.lines = split_lines(text.substr(0, end)), .size = end};
}

std::size_t count_of(std::string_view text, const std::string& name) {
  const std::int64_t count = parse_integer(text, name + ": number of points");
  if (count < 0) fail(ErrorKind::Input, "{}: {} points", name, count);
  return static_cast<std::size_t>(count);
}

/// Of the header of LAS, from an offset.
template <class Number>
Number header_number(std::span<const std::byte> bytes, std::size_t offset) {
  Number number;
  std::memcpy(&number, bytes.data() + offset, sizeof(Number));
  return number;
}

std::string zero_ended(std::span<const std::byte> bytes) {
  const std::string text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  return text.substr(0, text.find('\0'));
}

constexpr std::size_t kLasHeader = 375;
constexpr std::size_t kLasRecordHeader = 54;
constexpr std::size_t kLasPoint = 30;

/// Columns of extra bytes by the record that describes them.
void add_extra_columns(std::span<const std::byte> record, Rows& rows, const std::string& name) {
  constexpr std::size_t kDescription = 192;
  if (record.size() % kDescription != 0)
    fail(ErrorKind::Input, "{}: descriptions of extra bytes of {} bytes", name, record.size());
  for (std::size_t at = 0; at < record.size(); at += kDescription) {
    const auto type = std::to_integer<int>(record[at + 2]);
    const std::string column = zero_ended(record.subspan(at + 4, 32));
    switch (type) {
      case 1:
        rows.add(column, 1, &number_at<std::uint8_t>, name);
        break;
      case 5:
        rows.add(column, 4, &number_at<std::uint32_t>, name);
        break;
      case 9:
        rows.add(column, 4, &number_at<float>, name);
        break;
      case 10:
        rows.add(column, 8, &number_at<double>, name);
        break;
      default:
        fail(ErrorKind::Input, "{}: extra bytes {} of type {}", name, column, type);
    }
  }
}

}  // namespace

Cloud parse_ply(std::span<const std::byte> bytes, const std::string& name) {
  const TextHeader header = header_of(bytes, "end_header\n", name);
  if (header.lines.size() < 3 || header.lines[0].text != "ply" ||
      header.lines[1].text != "format binary_little_endian 1.0")
    fail(ErrorKind::Input, "{}: not a binary, little-endian PLY", name);
  Rows rows;
  for (const TextLine& line : header.lines) {
    const std::vector<std::string_view> words = split_blanks(line.text);
    if (words.size() == 3 && words[0] == "element") {
      if (words[1] != "vertex") fail(ErrorKind::Input, "{}: an element {}", name, words[1]);
      rows.num_rows = count_of(words[2], name);
    }
    if (words.empty() || words[0] != "property") continue;
    if (words.size() != 3) fail(ErrorKind::Input, "{}: \"{}\"", name, line.text);
    const std::string column(words[2]);
    if (words[1] == "double")
      rows.add(column, 8, &number_at<double>, name);
    else if (words[1] == "float")
      rows.add(column, 4, &number_at<float>, name);
    else if (words[1] == "uint")
      rows.add(column, 4, &number_at<std::uint32_t>, name);
    else if (words[1] == "ushort")
      rows.add(column, 2, &number_at<std::uint16_t>, name);
    else if (words[1] == "uchar")
      rows.add(column, 1, &number_at<std::uint8_t>, name);
    else
      fail(ErrorKind::Input, "{}: a property of type {}", name, words[1]);
  }
  rows.bytes = bytes.subspan(header.size);
  return cloud_of(rows, name);
}

Cloud parse_pcd(std::span<const std::byte> bytes, const std::string& name) {
  const TextHeader header = header_of(bytes, "DATA binary\n", name);
  std::map<std::string, std::vector<std::string_view>, std::less<>> words;
  for (const TextLine& line : header.lines) {
    std::vector<std::string_view> parts = split_blanks(line.text);
    if (parts.size() < 2 || parts[0].starts_with('#')) continue;
    words[std::string(parts[0])] = {parts.begin() + 1, parts.end()};
  }
  const auto part = [&](const char* key) {
    const auto found = words.find(key);
    if (found == words.end()) fail(ErrorKind::Input, "{}: its header has no {}", name, key);
    return found->second;
  };
  const auto fields = part("FIELDS"), sizes = part("SIZE"), types = part("TYPE");
  if (sizes.size() != fields.size() || types.size() != fields.size())
    fail(ErrorKind::Input, "{}: {} fields, {} sizes and {} types", name, fields.size(),
         sizes.size(), types.size());
  Rows rows;
  for (std::size_t k = 0; k < fields.size(); ++k) {
    const std::string type = std::string(types[k]) + std::string(sizes[k]);
    const std::string column(fields[k]);
    if (type == "F4")
      rows.add(column, 4, &number_at<float>, name);
    else if (type == "F8")
      rows.add(column, 8, &number_at<double>, name);
    else if (type == "U4")
      rows.add(column, 4, &number_at<std::uint32_t>, name);
    else if (type == "U2")
      rows.add(column, 2, &number_at<std::uint16_t>, name);
    else if (type == "U1")
      rows.add(column, 1, &number_at<std::uint8_t>, name);
    else
      fail(ErrorKind::Input, "{}: a field of type {}", name, type);
  }
  rows.num_rows = count_of(part("POINTS").front(), name);
  if (count_of(part("WIDTH").front(), name) != rows.num_rows || part("HEIGHT").front() != "1")
    fail(ErrorKind::Input, "{}: width and height are others than {} and 1", name, rows.num_rows);
  rows.bytes = bytes.subspan(header.size);
  return cloud_of(rows, name);
}

Cloud parse_las(std::span<const std::byte> bytes, const std::string& name) {
  if (bytes.size() < kLasHeader || std::memcmp(bytes.data(), "LASF", 4) != 0)
    fail(ErrorKind::Input, "{}: not LAS", name);
  const auto version = header_number<std::uint16_t>(bytes, 24);
  const auto format = header_number<std::uint8_t>(bytes, 104);
  if (version != 0x0401 || format != 6)
    fail(ErrorKind::Input, "{}: not LAS 1.4 of point format 6", name);
  constexpr std::uint16_t kGpsTimeAndWkt = 17;
  if (header_number<std::uint16_t>(bytes, 6) != kGpsTimeAndWkt)
    fail(ErrorKind::Input, "{}: its times are not adjusted GPS time, or its system no WKT", name);
  const auto points_at = header_number<std::uint32_t>(bytes, 96);
  const auto num_records = header_number<std::uint32_t>(bytes, 100);
  if (points_at > bytes.size()) fail(ErrorKind::Input, "{}: truncated", name);
  Rows rows;
  rows.row_bytes = kLasPoint;
  rows.columns["x"] = {0, &number_at<std::int32_t>};
  rows.columns["y"] = {4, &number_at<std::int32_t>};
  rows.columns["z"] = {8, &number_at<std::int32_t>};
  rows.columns["intensity"] = {12, &number_at<std::uint16_t>};
  rows.columns["returns"] = {14, &number_at<std::uint8_t>};
  rows.columns["angle"] = {18, &number_at<std::int16_t>};
  rows.columns["time"] = {22, &number_at<double>};
  Cloud cloud;
  std::size_t at = kLasHeader;
  for (std::uint32_t i = 0; i < num_records; ++i) {
    if (at + kLasRecordHeader > points_at)
      fail(ErrorKind::Input, "{}: its records reach into its points", name);
    const std::string user = zero_ended(bytes.subspan(at + 2, 16));
    const auto id = header_number<std::uint16_t>(bytes, at + 18);
    const auto size = header_number<std::uint16_t>(bytes, at + 20);
    if (at + kLasRecordHeader + size > points_at)
      fail(ErrorKind::Input, "{}: its records reach into its points", name);
    const std::span<const std::byte> record = bytes.subspan(at + kLasRecordHeader, size);
    if (user == "LASF_Projection" && id == 2112) cloud.wkt = zero_ended(record);
    if (user == "LASF_Spec" && id == 4) add_extra_columns(record, rows, name);
    at += kLasRecordHeader + size;
  }
  rows.num_rows = static_cast<std::size_t>(header_number<std::uint64_t>(bytes, 247));
  if (header_number<std::uint16_t>(bytes, 105) != rows.row_bytes)
    fail(ErrorKind::Input, "{}: points of {} bytes, where its columns have {}", name,
         header_number<std::uint16_t>(bytes, 105), rows.row_bytes);
  rows.bytes = bytes.subspan(points_at);
  rows.check_size(name);
  std::array<double, 3> scale{}, offset{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    scale[axis] = header_number<double>(bytes, 131 + 8 * axis);
    offset[axis] = header_number<double>(bytes, 155 + 8 * axis);
  }
  cloud.step_m = *std::max_element(scale.begin(), scale.end());
  std::array<std::uint64_t, 15> by_return{};
  Eigen::AlignedBox3d box;
  cloud.rows.reserve(rows.num_rows);
  for (std::size_t i = 0; i < rows.num_rows; ++i) {
    const auto value = [&](std::string_view column) { return rows.at(column, i, name); };
    const auto returns = static_cast<unsigned>(value("returns"));
    CloudRow row{.place = {value("x") * scale[0] + offset[0], value("y") * scale[1] + offset[1],
                           value("z") * scale[2] + offset[2]},
                 .time_s = value("time") + 1e9,
                 .intensity = value("intensity") / 65535.0,
                 .return_number = returns & 15U,
                 .num_returns = returns >> 4U,
                 .class_id = static_cast<std::int64_t>(value("class_id")),
                 .instance_id = static_cast<std::int64_t>(value("instance_id")),
                 .scan_angle_deg = 0.006 * value("angle")};
    if (row.return_number >= 1) ++by_return[static_cast<std::size_t>(row.return_number) - 1];
    box.extend(row.place);
    cloud.rows.push_back(std::move(row));
  }
  for (std::size_t k = 0; k < by_return.size(); ++k)
    if (header_number<std::uint64_t>(bytes, 255 + 8 * k) != by_return[k])
      fail(ErrorKind::Input, "{}: its header counts {} returns of number {}, its points {}", name,
           header_number<std::uint64_t>(bytes, 255 + 8 * k), k + 1, by_return[k]);
  for (int axis = 0; axis < 3 && !box.isEmpty(); ++axis) {
    const auto header_at = 179 + 16 * static_cast<std::size_t>(axis);
    constexpr double kRounding_m = 1e-6;
    if (!(std::abs(header_number<double>(bytes, header_at) - box.max()[axis]) <= kRounding_m) ||
        !(std::abs(header_number<double>(bytes, header_at + 8) - box.min()[axis]) <= kRounding_m))
      fail(ErrorKind::Input, "{}: its header's bounds are others than its points'", name);
  }
  return cloud;
}

}  // namespace terracast::validate
