#include "export/clouds/las.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "core/error.h"
#include "core/semantic_class.h"
#include "geo/sun.h"

namespace terracast::exporters {
namespace {

using core::SemanticClass;

static_assert(std::endian::native == std::endian::little);

constexpr std::size_t kHeaderBytes = 375;
constexpr std::size_t kRecordHeaderBytes = 54;
constexpr std::uint8_t kPointFormat = 6;
constexpr std::uint16_t kPointBytes = 30;
/// Adjusted standard GPS time, and the system of coordinates as WKT.
constexpr std::uint16_t kGlobalEncoding = 17;
constexpr double kAdjusted_s = 1e9;

/// Numbers one after the other.
class Bytes {
 public:
  template <class Number>
  Bytes& put(Number number) {
    const auto* at = reinterpret_cast<const std::byte*>(&number);
    bytes_.insert(bytes_.end(), at, at + sizeof(Number));
    return *this;
  }
  /// Filled up with zeros.
  Bytes& text(std::string_view words, std::size_t size) {
    for (std::size_t i = 0; i < size; ++i)
      bytes_.push_back(i < words.size() ? static_cast<std::byte>(words[i]) : std::byte{0});
    return *this;
  }
  std::size_t size() const { return bytes_.size(); }
  std::vector<std::byte> take() { return std::move(bytes_); }
  void add(const Bytes& other) {
    bytes_.insert(bytes_.end(), other.bytes_.begin(), other.bytes_.end());
  }

 private:
  std::vector<std::byte> bytes_;
};

/// A column of extra bytes: name, LAS's number of its type, size, words.
struct ExtraColumn {
  std::string_view name;
  std::uint8_t type;
  std::uint16_t size;
  std::string_view words;
};
constexpr ExtraColumn kExtras[] = {
    {"true_range_m", 10, 8, "range without noise"},
    {"incidence_rad", 9, 4, "between beam and normal"},
    {"instance_id", 5, 4, "as pixels have it"},
    {"class_id", 1, 1, "as pixels have it"},
};

std::uint16_t record_bytes() {
  std::uint16_t size = kPointBytes;
  for (const ExtraColumn& column : kExtras) size = static_cast<std::uint16_t>(size + column.size);
  return size;
}

Bytes record_header(std::string_view user, std::uint16_t id, std::size_t size,
                    std::string_view words) {
  Bytes bytes;
  bytes.put(std::uint16_t{0})
      .text(user, 16)
      .put(id)
      .put(static_cast<std::uint16_t>(size))
      .text(words, 32);
  return bytes;
}

/// The system of coordinates, and what extra bytes there are.
Bytes variable_records(const std::string& wkt) {
  // Ends with a zero.
  Bytes bytes = record_header("LASF_Projection", 2112, wkt.size() + 1, "OGC coordinate system WKT");
  bytes.text(wkt, wkt.size() + 1);
  bytes.add(record_header("LASF_Spec", 4, 192 * std::size(kExtras), "extra bytes"));
  for (const ExtraColumn& column : kExtras) {
    bytes.put(std::uint16_t{0}).put(column.type).put(std::uint8_t{0}).text(column.name, 32);
    bytes.text("", 4 + 3 * 24 + 24 + 24);  // unused, no data, least, most, scales, offsets
    bytes.text(column.words, 32);
  }
  return bytes;
}

/// The offset from which LAS counts coordinates in whole steps, and the bounds of what is counted.
struct Extent {
  std::array<double, 3> offset_m = {};
  std::array<std::int32_t, 3> least, most;

  std::int32_t steps(int axis, double value_m) const {
    const double steps =
        std::round((value_m - offset_m[static_cast<std::size_t>(axis)]) / kLasStep_m);
    if (!(std::abs(steps) <= std::numeric_limits<std::int32_t>::max()))
      core::fail(
          core::ErrorKind::Input,
          "a point is farther than 214 km from the first of its file, which LAS cannot hold at "
          "steps of 0.1 mm; shorten most_range_m or the sequence");
    return static_cast<std::int32_t>(steps);
  }
  std::array<std::int32_t, 3> steps(const LasPoint& point) const {
    return {steps(0, point.easting_m), steps(1, point.northing_m), steps(2, point.height_m)};
  }
};

Extent extent_of(std::span<const LasPoint> points) {
  Extent extent;
  if (!points.empty())
    extent.offset_m = {std::round(points.front().easting_m), std::round(points.front().northing_m),
                       std::round(points.front().height_m)};
  extent.least.fill(points.empty() ? 0 : std::numeric_limits<std::int32_t>::max());
  extent.most.fill(points.empty() ? 0 : std::numeric_limits<std::int32_t>::min());
  for (const LasPoint& point : points) {
    const std::array<std::int32_t, 3> steps = extent.steps(point);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      extent.least[axis] = std::min(extent.least[axis], steps[axis]);
      extent.most[axis] = std::max(extent.most[axis], steps[axis]);
    }
  }
  return extent;
}

/// Day of the year, from 1.
std::uint16_t day_of_year(const std::string& created) {
  const double day_s = geo::unix_seconds_from_utc(created.substr(0, 10) + "T00:00:00Z");
  const double year_s = geo::unix_seconds_from_utc(created.substr(0, 4) + "-01-01T00:00:00Z");
  return static_cast<std::uint16_t>(std::lround((day_s - year_s) / 86400.0) + 1);
}

void put_header(std::span<const LasPoint> points, const Extent& extent, std::size_t records_bytes,
                const std::string& created, std::uint16_t source_id, Bytes& bytes) {
  std::array<std::uint64_t, 15> by_return{};
  for (const LasPoint& point : points)
    ++by_return[static_cast<std::size_t>(std::clamp<int>(point.return_number, 1, 15)) - 1];
  bytes.text("LASF", 4).put(source_id).put(kGlobalEncoding).text("", 16);  // no GUID
  bytes.put(std::uint8_t{1}).put(std::uint8_t{4});
  bytes.text("terracast", 32).text("terracast", 32);
  bytes.put(day_of_year(created));
  bytes.put(static_cast<std::uint16_t>(std::stoi(created.substr(0, 4))));
  bytes.put(static_cast<std::uint16_t>(kHeaderBytes));
  bytes.put(static_cast<std::uint32_t>(kHeaderBytes + records_bytes));
  bytes.put(std::uint32_t{2}).put(kPointFormat).put(record_bytes());
  bytes.text("", 4 + 5 * 4);  // counts of older versions
  for (int axis = 0; axis < 3; ++axis) bytes.put(kLasStep_m);
  for (const double offset_m : extent.offset_m) bytes.put(offset_m);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    bytes.put(extent.most[axis] * kLasStep_m + extent.offset_m[axis]);
    bytes.put(extent.least[axis] * kLasStep_m + extent.offset_m[axis]);
  }
  bytes.put(std::uint64_t{0})
      .put(std::uint64_t{0})
      .put(std::uint32_t{0});  // no waveforms, no more records
  bytes.put(static_cast<std::uint64_t>(points.size()));
  for (const std::uint64_t count : by_return) bytes.put(count);
}

void put_point(const LasPoint& point, const Extent& extent, std::uint16_t source_id, Bytes& bytes) {
  for (const std::int32_t steps : extent.steps(point)) bytes.put(steps);
  bytes.put(
      static_cast<std::uint16_t>(std::lround(65535.0 * std::clamp(point.reflectance, 0.0, 1.0))));
  bytes.put(static_cast<std::uint8_t>(std::min<int>(point.return_number, 15) |
                                      std::min<int>(point.num_returns, 15) << 4));
  bytes.put(std::uint8_t{0}).put(point.classification).put(std::uint8_t{0});
  constexpr double kAngleStep_deg = 0.006;
  bytes.put(static_cast<std::int16_t>(std::lround(point.scan_angle_deg / kAngleStep_deg)));
  bytes.put(source_id).put(point.gps_s - kAdjusted_s);
  bytes.put(point.true_range_m).put(point.incidence_rad).put(point.instance_id).put(point.class_id);
}

}  // namespace

std::uint8_t las_classification(std::uint8_t class_id) {
  switch (static_cast<SemanticClass>(class_id)) {
    case SemanticClass::Outside:
    case SemanticClass::Rock:
    case SemanticClass::Scree:
    case SemanticClass::Soil:
    case SemanticClass::Sand:
    case SemanticClass::Snow:
    case SemanticClass::ForestFloor:
    case SemanticClass::Grass:
    case SemanticClass::Cropland:
    case SemanticClass::Wetland:
    case SemanticClass::BuiltUp:
    case SemanticClass::Shrubland:
      return 2;  // the ground's own surface, whatever grows on it
    case SemanticClass::Plant:
      return 3;
    case SemanticClass::Bush:
      return 4;
    case SemanticClass::Tree:
      return 5;
    case SemanticClass::Building:
    case SemanticClass::Warehouse:
    case SemanticClass::Hangar:
      return 6;
    case SemanticClass::Sea:
    case SemanticClass::Lake:
    case SemanticClass::River:
      return 9;
    case SemanticClass::Railway:
      return 10;
    case SemanticClass::Road:
    case SemanticClass::RoadMarking:
    case SemanticClass::Path:
    case SemanticClass::Runway:
    case SemanticClass::Taxiway:
    case SemanticClass::Apron:
    case SemanticClass::Parking:
      return 11;
    case SemanticClass::PowerLine:
      return 14;
    case SemanticClass::Pylon:
      return 15;
    case SemanticClass::Bridge:
      return 17;
    default:
      return static_cast<std::uint8_t>(64 + class_id);
  }
}

std::string utm_egm96_wkt(int epsg, double central_meridian_deg, bool is_north) {
  const int zone = epsg % 100;
  const char half = is_north ? 'N' : 'S';
  return fmt::format(
      "COMPD_CS[\"WGS 84 / UTM zone {0}{1} + EGM96 height\","
      "PROJCS[\"WGS 84 / UTM zone {0}{1}\",GEOGCS[\"WGS 84\",DATUM[\"WGS_1984\","
      "SPHEROID[\"WGS 84\",6378137,298.257223563,AUTHORITY[\"EPSG\",\"7030\"]],"
      "AUTHORITY[\"EPSG\",\"6326\"]],PRIMEM[\"Greenwich\",0,AUTHORITY[\"EPSG\",\"8901\"]],"
      "UNIT[\"degree\",0.0174532925199433,AUTHORITY[\"EPSG\",\"9122\"]],"
      "AUTHORITY[\"EPSG\",\"4326\"]],PROJECTION[\"Transverse_Mercator\"],"
      "PARAMETER[\"latitude_of_origin\",0],PARAMETER[\"central_meridian\",{2:.0f}],"
      "PARAMETER[\"scale_factor\",0.9996],PARAMETER[\"false_easting\",500000],"
      "PARAMETER[\"false_northing\",{3}],UNIT[\"metre\",1,AUTHORITY[\"EPSG\",\"9001\"]],"
      "AXIS[\"Easting\",EAST],AXIS[\"Northing\",NORTH],AUTHORITY[\"EPSG\",\"{4}\"]],"
      "VERT_CS[\"EGM96 height\",VERT_DATUM[\"EGM96 geoid\",2005,AUTHORITY[\"EPSG\",\"5171\"]],"
      "UNIT[\"metre\",1,AUTHORITY[\"EPSG\",\"9001\"]],AXIS[\"Gravity-related height\",UP],"
      "AUTHORITY[\"EPSG\",\"5773\"]]]",
      zone, half, central_meridian_deg, is_north ? 0 : 10000000, epsg);
}

std::vector<std::byte> las_bytes(std::span<const LasPoint> points, const std::string& wkt,
                                 const std::string& created, std::uint16_t source_id) {
  const Extent extent = extent_of(points);
  const Bytes records = variable_records(wkt);
  Bytes bytes;
  put_header(points, extent, records.size(), created, source_id, bytes);
  TERRACAST_CHECK(bytes.size() == kHeaderBytes, "a header of {} bytes", bytes.size());
  bytes.add(records);
  for (const LasPoint& point : points) put_point(point, extent, source_id, bytes);
  return bytes.take();
}

}  // namespace terracast::exporters
