#include "tiler/objects/placement_list.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <fstream>
#include <limits>
#include <set>
#include <sstream>

#include "core/error.h"
#include "core/hash.h"
#include "core/random.h"
#include "tiler/objects/things.h"
#include "tiler/vector_source.h"

namespace terracast::tiler {
namespace {

using core::ErrorKind;
using core::fail;
using Eigen::Vector2d;

constexpr std::size_t kMostRows = 1'000'000;
constexpr std::uintmax_t kLargestFile_bytes = 256U << 20U;
/// Farther from the origin than any world reaches: nobody knows the ground there.
constexpr double kFarthest_m = 1e6;
constexpr std::array<std::string_view, 9> kColumns = {
    "thing", "lat", "lon", "x", "y", "heading_deg", "scale", "height_m", "variant"};
constexpr std::array<std::string_view, 4> kPlaceColumns = {"lat", "lon", "x",
                                                           "y"};  // of .csv alone

std::string_view trimmed(std::string_view text) {
  const auto is_blank = [](char c) { return c == ' ' || c == '\t' || c == '\r' || c == '"'; };
  while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_blank(text.back())) text.remove_suffix(1);
  return text;
}

std::vector<std::string_view> split(std::string_view line) {
  std::vector<std::string_view> fields;
  while (true) {
    const std::size_t comma = line.find(',');
    fields.push_back(trimmed(line.substr(0, comma)));
    if (comma == std::string_view::npos) return fields;
    line.remove_prefix(comma + 1);
  }
}

/// One row, whatever file it is of.
class RowReader {
 public:
  RowReader(const ThingByName& thing_by_name, PlacementList& list)
      : thing_by_name_(thing_by_name), list_(list) {}

  double number(const std::string& where, std::string_view column, std::string_view text,
                double lowest, double highest) const {
    double value = 0.0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value))
      fail(ErrorKind::Input, "{}: {} = \"{}\" is no number", where, column, text);
    if (value < lowest || value > highest)
      fail(ErrorKind::Input, "{}: {} = {} is outside {} to {}", where, column, text, lowest,
           highest);
    return value;
  }

  /// value         text of a column; empty: it is not given
  /// place_world   not finite: far beyond the world
  template <class Value>
  void add(const std::string& where, const Value& value, const Vector2d& place_world,
           std::uint64_t number_of_row) {
    const std::string_view thing = value("thing");
    const std::optional<std::uint32_t> row = thing_by_name_(thing);
    if (!row)
      fail(ErrorKind::Input,
           "{}: thing = \"{}\" is neither a built-in thing nor one of the layer's models; built in "
           "are {}",
           where, thing, fmt::join(thing_names(), ", "));
    const auto given = [&](std::string_view column, double otherwise, double lowest,
                           double highest) {
      const std::string_view text = value(column);
      return text.empty() ? otherwise : number(where, column, text, lowest, highest);
    };
    Candidate candidate{
        .rule = Rule::Placements, .footing = Footing::Any, .feature = number_of_row};
    candidate.thing = *row;
    candidate.place_world = place_world;
    candidate.heading = heading_of_compass(given("heading_deg", 0.0, -360.0, 360.0));
    candidate.scale =
        static_cast<std::uint16_t>(std::lround(4096.0 * given("scale", 1.0, 0.05, 15.0)));
    candidate.above_m = given("height_m", 0.0, -1000.0, 10000.0);
    std::string said =
        fmt::format("{} {:.3f} {:.3f} {} {} {:.3f}", thing, place_world.x(), place_world.y(),
                    candidate.heading, candidate.scale, candidate.above_m);
    if (!place_world.allFinite()) said += fmt::format(" {} {}", value("lat"), value("lon"));
    candidate.key = core::content_hash64(std::as_bytes(std::span(said)));
    const int num_variants = *row < all_things().size() ? all_things()[*row].num_variants : 1;
    const std::string_view variant = value("variant");
    candidate.variant = static_cast<std::uint8_t>(
        variant.empty() ? core::mix_bits(candidate.key) % static_cast<std::uint64_t>(num_variants)
                        : static_cast<std::uint64_t>(
                              number(where, "variant", variant, 0.0, num_variants - 1.0)));
    if (!known_.insert(candidate.key).second) {
      ++list_.num_repeated;
      return;
    }
    if (list_.candidates.size() >= kMostRows)
      fail(ErrorKind::Input, "{}: more than {} things are listed", where, kMostRows);
    list_.candidates.push_back(candidate);
  }

 private:
  const ThingByName& thing_by_name_;
  PlacementList& list_;
  std::set<std::uint64_t> known_;
};

void read_csv(const core::Path& file, const std::string& text, RowReader& reader,
              const LayerInputs& inputs) {
  const VectorFrame frame = vector_frame(inputs);
  std::vector<std::string_view> columns;
  std::array<int, kColumns.size()> at{};
  at.fill(-1);
  std::string_view rest = text;
  if (rest.substr(0, 3) == "\xEF\xBB\xBF") rest.remove_prefix(3);
  for (std::size_t line_number = 1; !rest.empty(); ++line_number) {
    const std::size_t end = rest.find('\n');
    const std::string_view line = rest.substr(0, end);
    rest.remove_prefix(end == std::string_view::npos ? rest.size() : end + 1);
    if (trimmed(line).empty() || trimmed(line).front() == '#') continue;
    const std::string where = fmt::format("{}:{}", file.written, line_number);
    const std::vector<std::string_view> fields = split(line);
    if (columns.empty()) {
      columns = fields;
      for (std::size_t i = 0; i < columns.size(); ++i) {
        const auto found = std::find(kColumns.begin(), kColumns.end(), columns[i]);
        if (found == kColumns.end())
          fail(ErrorKind::Input, "{}: column \"{}\" is unknown; columns are {}", where, columns[i],
               fmt::join(kColumns, ", "));
        at[static_cast<std::size_t>(found - kColumns.begin())] = static_cast<int>(i);
      }
      const bool has_geographic = at[1] >= 0 && at[2] >= 0;
      const bool has_world = at[3] >= 0 && at[4] >= 0;
      if (at[0] < 0 || has_geographic == has_world)
        fail(ErrorKind::Input, "{}: the header needs thing, and either lat and lon or x and y",
             where);
      continue;
    }
    if (fields.size() != columns.size())
      fail(ErrorKind::Input, "{}: {} values, and the header has {} columns", where, fields.size(),
           columns.size());
    const auto value = [&](std::string_view column) -> std::string_view {
      const auto row = static_cast<std::size_t>(
          std::find(kColumns.begin(), kColumns.end(), column) - kColumns.begin());
      return at[row] < 0 ? std::string_view() : fields[static_cast<std::size_t>(at[row])];
    };
    Vector2d place;
    if (at[1] >= 0) {
      geo::Geodetic geodetic{.lat_deg = reader.number(where, "lat", value("lat"), -90.0, 90.0),
                             .lon_deg = reader.number(where, "lon", value("lon"), -360.0, 360.0),
                             .height_m = 0.0};
      place.setConstant(std::numeric_limits<double>::infinity());
      if (inputs.frame.world_from_geodetic(geodetic).norm() < kFarthest_m) {
        geodetic.height_m = frame.ground_height_m(geodetic);
        place = inputs.frame.world_from_geodetic(geodetic).head<2>();
      }
    } else {
      place = {reader.number(where, "x", value("x"), -kFarthest_m, kFarthest_m),
               reader.number(where, "y", value("y"), -kFarthest_m, kFarthest_m)};
    }
    reader.add(where, value, place, line_number);
  }
  if (columns.empty())
    fail(ErrorKind::Input, "{}: it is empty; its first line names the columns", file.written);
}

/// Fields of files of OGR's may be anything; a column that is misspelt is one of them.
void warn_of_unknown_fields(const VectorData& data, const LayerInputs& inputs) {
  constexpr std::size_t kMostTold = 10;
  std::vector<std::string_view> known;
  for (const std::string_view column : kColumns)
    if (std::find(kPlaceColumns.begin(), kPlaceColumns.end(), column) == kPlaceColumns.end())
      known.push_back(column);
  std::set<std::string_view> unknown;
  for (const VectorFeature& feature : data.features)
    for (const auto& [key, value] : feature.tags.all())
      if (unknown.size() <= kMostTold && std::find(known.begin(), known.end(), key) == known.end())
        unknown.insert(key);
  if (unknown.empty()) return;
  const bool are_more = unknown.size() > kMostTold;
  if (are_more) unknown.erase(std::prev(unknown.end()));
  inputs.context.log.warn("{}: nothing is made of its fields {}{}; those it may have are {}",
                          data.file_name, fmt::join(unknown, ", "), are_more ? ", …" : "",
                          fmt::join(known, ", "));
}

}  // namespace

PlacementList read_placements(const core::Path& file, const ThingByName& thing_by_name,
                              const LayerInputs& inputs) {
  PlacementList list;
  list.name = file.resolved.filename().string();
  RowReader reader(thing_by_name, list);
  std::string extension = file.resolved.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(), [](char c) {
    return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  });
  if (extension != ".csv") {
    const VectorData data =
        read_vectors(file, {.lines = false, .areas = false}, vector_frame(inputs));
    list.content_hash = data.content_hash;
    for (const std::string& warning : data.warnings)
      inputs.context.log.warn("{}: {}", data.file_name, warning);
    list.counts = data.left_out();
    warn_of_unknown_fields(data, inputs);
    for (const VectorFeature& feature : data.features)
      for (const auto& part : feature.parts_world)
        for (const PointsWorld& points : part)
          for (const Vector2d& point : points)
            reader.add(
                fmt::format("{}: feature {}", file.written, feature.number),
                [&](std::string_view column) { return feature.tags.value(column); }, point,
                feature.number);
    return list;
  }
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(file.resolved, error);
  if (error || !std::filesystem::is_regular_file(file.resolved, error))
    fail(ErrorKind::Io, "{}: no such file of placements", file.resolved.string());
  if (size > kLargestFile_bytes)
    fail(ErrorKind::Input, "{}: {} bytes, and a list has at most {}", file.written, size,
         kLargestFile_bytes);
  std::ifstream stream(file.resolved, std::ios::binary);
  std::stringstream text;
  text << stream.rdbuf();
  if (!stream) fail(ErrorKind::Io, "{}: cannot be read", file.resolved.string());
  const std::string all = text.str();
  list.content_hash = core::content_hash(all);
  read_csv(file, all, reader, inputs);
  const double half_m = 0.5 * inputs.size_m;
  if (!list.candidates.empty() &&
      std::none_of(list.candidates.begin(), list.candidates.end(), [&](const Candidate& one) {
        return one.place_world.cwiseAbs().maxCoeff() <= half_m;
      }))
    inputs.context.log.warn(
        "{}: none of its {} things lies in the world's square; are lat and lon, or x and y, the "
        "right way round?",
        file.written, list.candidates.size());
  return list;
}

}  // namespace terracast::tiler
