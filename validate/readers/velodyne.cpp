#include "validate/readers/velodyne.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <string_view>

#include "core/error.h"
#include "core/semantic_class.h"
#include "validate/text.h"

namespace terracast::validate {

namespace {

using core::ErrorKind;
using core::fail;

static_assert(std::endian::native == std::endian::little);

template <class Number>
Number scan_number(std::span<const std::byte> bytes, std::size_t index) {
  Number number;
  std::memcpy(&number, bytes.data() + index * sizeof(Number), sizeof(Number));
  return number;
}

/// A row of semantic-kitti.yaml that has classes of ours.
struct SemanticRow {
  std::uint16_t label, moving;
  std::string_view ours;  ///< names, parted by blanks
};
constexpr std::array kSemanticRows = {
    SemanticRow{10, 252, "car van"},
    SemanticRow{13, 257, "bus"},
    SemanticRow{16, 256, "train"},
    SemanticRow{18, 258, "truck"},
    SemanticRow{20, 259, "aircraft helicopter ship boat drone"},
    SemanticRow{30, 254, "person"},
    SemanticRow{40, 40, "road"},
    SemanticRow{44, 44, "parking"},
    SemanticRow{48, 48, "path"},
    SemanticRow{49, 49, "built_up railway runway taxiway apron"},
    SemanticRow{50, 50, "building warehouse hangar"},
    SemanticRow{51, 51, "wall"},
    SemanticRow{60, 60, "road_marking"},
    SemanticRow{70, 70, "shrubland tree bush plant"},
    SemanticRow{72, 72, "scree grass soil sand forest_floor cropland wetland"},
    SemanticRow{80, 80, "street_lamp"},
    SemanticRow{99, 99, "stone container crane pylon power_line wind_turbine object"}};

bool lists(std::string_view words, std::string_view word) {
  const std::vector<std::string_view> parts = split_at(words, ' ');
  return std::find(parts.begin(), parts.end(), word) != parts.end();
}

std::uint16_t count16(std::string_view text, const std::string& where) {
  const std::int64_t count = parse_integer(text, where);
  if (count < 0 || count > 65535) fail(ErrorKind::Input, "{}: {} is no uint16", where, count);
  return static_cast<std::uint16_t>(count);
}

}  // namespace

std::vector<ScanPoint> parse_velodyne(std::span<const std::byte> bytes, const std::string& name) {
  constexpr std::size_t kPoint = 4 * sizeof(float);
  if (bytes.size() % kPoint != 0)
    fail(ErrorKind::Input, "{}: {} bytes are no whole number of points of {}", name, bytes.size(),
         kPoint);
  std::vector<ScanPoint> points(bytes.size() / kPoint);
  for (std::size_t i = 0; i < points.size(); ++i) {
    std::array<double, 4> numbers{};
    for (std::size_t k = 0; k < 4; ++k) {
      numbers[k] = static_cast<double>(scan_number<float>(bytes, 4 * i + k));
      if (!std::isfinite(numbers[k]))
        fail(ErrorKind::Input, "{}: point {} holds {}, which is not finite", name, i, numbers[k]);
    }
    points[i] = {.place = {numbers[0], numbers[1], numbers[2]}, .reflectance = numbers[3]};
  }
  return points;
}

std::vector<ScanPoint> parse_velodyne_float64(std::span<const std::byte> bytes) {
  constexpr std::size_t kPoint = 4 * sizeof(double);
  if (bytes.size() % kPoint != 0) return {};
  std::vector<ScanPoint> points(bytes.size() / kPoint);
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (int axis = 0; axis < 3; ++axis)
      points[i].place[axis] = scan_number<double>(bytes, 4 * i + static_cast<std::size_t>(axis));
    points[i].reflectance = scan_number<double>(bytes, 4 * i + 3);
    if (!points[i].place.allFinite() || !std::isfinite(points[i].reflectance)) return {};
  }
  return points;
}

std::vector<ScanPoint> parse_lidar_ply(std::span<const std::byte> bytes, const std::string& name) {
  constexpr std::size_t kLongestHeader = 4096;
  constexpr std::string_view kEnd = "end_header\n";
  const std::string_view start(reinterpret_cast<const char*>(bytes.data()),
                               std::min(bytes.size(), kLongestHeader));
  const std::size_t end = start.find(kEnd);
  if (end == std::string_view::npos)
    fail(ErrorKind::Input, "{}: its header has no line \"end_header\"", name);
  std::vector<std::string> properties;
  std::int64_t num_points = -1;
  const std::vector<TextLine> lines = split_lines(start.substr(0, end));
  if (lines.size() < 2 || lines[0].text != "ply" ||
      lines[1].text != "format binary_little_endian 1.0")
    fail(ErrorKind::Input, "{}: not a binary, little-endian PLY", name);
  for (const TextLine& line : lines) {
    const std::vector<std::string_view> words = split_blanks(line.text);
    if (words.size() == 3 && words[0] == "element" && words[1] == "vertex")
      num_points = parse_integer(words[2], name + ": number of points");
    if (words.size() == 3 && words[0] == "property")
      properties.push_back(std::string(words[1]) + " " + std::string(words[2]));
  }
  if (properties != std::vector<std::string>{"float x", "float y", "float z"})
    fail(ErrorKind::Input, "{}: other properties than float x, y, z; readers expect three", name);
  const std::span<const std::byte> rows = bytes.subspan(end + kEnd.size());
  constexpr std::size_t kPoint = 3 * sizeof(float);
  if (num_points < 0 || rows.size() % kPoint != 0 ||
      static_cast<std::uint64_t>(num_points) != rows.size() / kPoint)
    fail(ErrorKind::Input, "{}: {} bytes, where {} points of {} should be", name, rows.size(),
         num_points, kPoint);
  std::vector<ScanPoint> points(rows.size() / kPoint);
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (int axis = 0; axis < 3; ++axis)
      points[i].place[axis] =
          static_cast<double>(scan_number<float>(rows, 3 * i + static_cast<std::size_t>(axis)));
    if (!points[i].place.allFinite()) fail(ErrorKind::Input, "{}: point {} is not finite", name, i);
  }
  return points;
}

std::vector<ScanLabel> parse_labels(std::span<const std::byte> bytes, const std::string& name) {
  if (bytes.size() % sizeof(std::uint32_t) != 0)
    fail(ErrorKind::Input, "{}: {} bytes are no whole number of labels of 4", name, bytes.size());
  std::vector<ScanLabel> labels(bytes.size() / sizeof(std::uint32_t));
  for (std::size_t i = 0; i < labels.size(); ++i) {
    const auto bits = scan_number<std::uint32_t>(bytes, i);
    labels[i] = {.label = static_cast<std::uint16_t>(bits & 0xFFFFU),
                 .instance = static_cast<std::uint16_t>(bits >> 16U)};
  }
  return labels;
}

bool is_semantic_kitti_label(std::uint16_t label) {
  constexpr std::array<std::uint16_t, 34> kLabels = {
      0,  1,  10, 11, 13, 15, 16, 18, 20, 30,  31,  32,  40,  44,  48,  49,  50,
      51, 52, 60, 70, 71, 72, 80, 81, 99, 252, 253, 254, 255, 256, 257, 258, 259};
  return std::binary_search(kLabels.begin(), kLabels.end(), label);
}

std::uint16_t semantic_kitti_of(std::size_t class_id, bool is_moving) {
  const auto names = core::semantic_class_names();
  if (class_id >= names.size()) return 0;
  for (const SemanticRow& row : kSemanticRows)
    if (lists(row.ours, names[class_id])) return is_moving ? row.moving : row.label;
  return 0;
}

bool has_instances(std::uint16_t label) {
  return (label >= 10 && label <= 32) || (label >= 252 && label <= 259);
}

InstanceIds parse_instances(const std::string& text, const std::string& name) {
  const std::vector<TextLine> lines = split_lines(text);
  if (lines.empty() || lines[0].text != "label,instance,instance_id")
    fail(ErrorKind::Input, "{}:1: another header than label,instance,instance_id", name);
  InstanceIds ids;
  for (std::size_t i = 1; i < lines.size(); ++i) {
    const std::string where = fmt::format("{}:{}", name, lines[i].number);
    const std::vector<std::string_view> cells = split_at(lines[i].text, ',');
    if (cells.size() != 3) fail(ErrorKind::Input, "{}: {} columns, not 3", where, cells.size());
    if (!ids.emplace(std::pair{count16(cells[0], where), count16(cells[1], where)},
                     parse_integer(cells[2], where))
             .second)
      fail(ErrorKind::Input, "{}: label {} has instance {} twice", where, cells[0], cells[1]);
  }
  return ids;
}

}  // namespace terracast::validate
