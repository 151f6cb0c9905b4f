#include <algorithm>
#include <array>
#include <limits>
#include <pugixml.hpp>

#include "core/atomic_file.h"
#include "core/error.h"
#include "geo/fixes/fix_format.h"
#include "geo/fixes/gpx_names.h"
#include "geo/fixes/number_hint.h"
#include "geo/fixes/text.h"
#include "geo/fixes/times.h"

namespace terracast::geo {
namespace {

using core::ErrorKind;
using core::fail;

constexpr std::size_t kMostBytes = std::size_t{1} << 28;

std::size_t line_at(const std::string& text, std::ptrdiff_t offset) {
  const auto end =
      std::min(static_cast<std::size_t>(std::max<std::ptrdiff_t>(offset, 0)), text.size());
  return 1 + static_cast<std::size_t>(
                 std::count(text.begin(), text.begin() + static_cast<long>(end), '\n'));
}

/// The points of one file, each kind in its own way.
class GpxReading {
 public:
  GpxReading(const std::filesystem::path& file, const std::string& text, const pugi::xml_node& gpx,
             bool has_heights, FixTable& table)
      : file_(file), text_(text), gpx_(gpx), names_(gpx), has_heights_(has_heights), table_(table) {
    names_.count_attributes(gpx, "gpx", table.ledger);
  }

  /// What there is of tracks, routes, waypoints in the order of kKinds; what the file says beside is counted.
  std::array<std::size_t, 3> count_kinds() {
    std::array<std::size_t, 3> counts{};
    for (const pugi::xml_node& child : gpx_.children()) {
      if (child.type() != pugi::node_element) continue;
      bool is_kind = false;
      for (std::size_t kind = 0; kind < kKinds.size(); ++kind)
        if (names_.is(child, kKinds[kind].element)) {
          counts[kind] += num_points(child, kKinds[kind].point);
          is_kind = true;
        }
      if (is_kind) continue;
      if (names_.is(child, "extensions"))
        names_.count_extensions(child, "gpx/extensions", table_.ledger);
      else
        table_.ledger.count(names_.name_of(child), known_gpx_names());
    }
    return counts;
  }

  /// Reads the elements of one kind, and counts the others as left out.
  void read(std::size_t wanted) {
    bool is_first = true;
    for (const pugi::xml_node& child : gpx_.children()) {
      for (std::size_t kind = 0; kind < kKinds.size(); ++kind) {
        if (!names_.is(child, kKinds[kind].element)) continue;
        if (kind != wanted) {
          table_.ledger.ignore(
              kKinds[kind].element,
              fmt::format("the {} are flown; points chooses others", kKinds[wanted].words));
          continue;
        }
        if (std::string_view(kKinds[kind].element) == "wpt") {
          table_.ledger.count("wpt", known_gpx_names());
          add_point(child, is_first);
          is_first = false;
        } else {
          table_.ledger.count(kKinds[kind].element, known_gpx_names());
          read_part(child, kKinds[kind].element);
        }
      }
    }
  }

  struct Kind {
    const char* element;
    const char* point;
    const char* words;
  };
  static constexpr std::array<Kind, 3> kKinds = {Kind{"trk", "trkpt", "tracks"},
                                                 Kind{"rte", "rtept", "routes"},
                                                 Kind{"wpt", "wpt", "waypoints"}};

  std::size_t num_without_zone() const { return num_without_zone_; }

 private:
  std::size_t num_points(const pugi::xml_node& element, std::string_view point) const {
    if (names_.is(element, point)) return 1;
    std::size_t count = 0;
    for (const pugi::xml_node& child : element.children()) {
      if (names_.is(child, point)) ++count;
      for (const pugi::xml_node& grandchild : child.children())
        if (names_.is(grandchild, point)) ++count;
    }
    return count;
  }

  /// A track, a segment, a route.
  void read_part(const pugi::xml_node& part, std::string_view name) {
    bool is_first = true;
    for (const pugi::xml_node& child : part.children()) {
      if (child.type() != pugi::node_element) continue;
      const std::string path = fmt::format("{}/{}", name, names_.name_of(child));
      if (names_.is(child, "extensions")) {
        names_.count_extensions(child, fmt::format("{}/extensions", name), table_.ledger);
        continue;
      }
      table_.ledger.count(path, known_gpx_names());
      if (name == "trk" && names_.is(child, "trkseg")) read_part(child, "trkseg");
      if (!names_.is(child, name == "rte" ? "rtept" : "trkpt")) continue;
      add_point(child, is_first);
      is_first = false;
    }
  }

  void add_point(const pugi::xml_node& point, bool is_first) {
    if (table_.fixes.size() >= kMostFixes)
      fail(ErrorKind::Input, "{}: more than {} points; cut the file into parts", file_.string(),
           kMostFixes);
    names_.count_attributes(point, "point", table_.ledger);
    Fix fix;
    fix.starts_part = is_first;
    fix.place.x() = coordinate(point, "lat");
    fix.place.y() = coordinate(point, "lon");
    for (const pugi::xml_node& child : point.children()) {
      if (child.type() != pugi::node_element) continue;
      const std::string name = fmt::format("point/{}", names_.name_of(child));
      if (name == "point/ele" && !has_heights_) {
        table_.ledger.ignore(name, kNoHeightsWanted);
        continue;
      }
      table_.ledger.count(name, known_gpx_names());
      take(point, child, name, fix);
    }
    table_.fixes.push_back(std::move(fix));
  }

  void take(const pugi::xml_node& point, const pugi::xml_node& child, const std::string& name,
            Fix& fix) {
    if (names_.is(child, "extensions")) {
      names_.count_extensions(child, "extensions", table_.ledger);
      take_speed(point, child, fix);
      return;
    }
    const bool is_own = names_.is(child, local_name(child.name()));
    if (!is_own || (name != "point/ele" && name != "point/time" && name != "point/speed")) return;
    const std::string_view text = trimmed(child.text().get());
    if (text.empty()) {
      ++table_.empty[name];
    } else if (name == "point/time") {
      const auto time = stated_time(text, 0.0);
      if (!time) unix_seconds_from_text(text, 0.0, where(point));  // says why not
      fix.time_s = time->unix_s;
      num_without_zone_ += time->has_zone ? 0 : 1;
    } else if (name == "point/ele") {
      fix.place.z() = number(text, "ele", point);
    } else {
      fix.speed_mps = number(text, "speed", point);
    }
  }

  /// Of the first <speed> in m/s anywhere in the extensions.
  void take_speed(const pugi::xml_node& point, const pugi::xml_node& extensions, Fix& fix) {
    const auto is_speed = [&](const pugi::xml_node& node) {
      return node.type() == pugi::node_element && names_.name_of(node) == "speed";
    };
    pugi::xml_node speed;
    for (const pugi::xml_node& child : extensions.children()) {
      if (!speed && is_speed(child)) speed = child;
      for (const pugi::xml_node& grandchild : child.children())
        if (!speed && is_speed(grandchild)) speed = grandchild;
    }
    if (!speed) return;
    const std::string_view text = trimmed(speed.text().get());
    if (text.empty())
      ++table_.empty["extensions/speed"];
    else
      fix.speed_mps = number(text, "speed", point);
  }

  /// Not a number where the attribute is empty.
  double coordinate(const pugi::xml_node& point, const char* name) {
    const pugi::xml_attribute attribute = point.attribute(name);
    const bool is_empty = attribute && trimmed(attribute.value()).empty();
    if (!is_empty) return number(attribute.value(), name, point);
    ++table_.empty[fmt::format("point@{}", name)];
    return std::numeric_limits<double>::quiet_NaN();
  }

  double number(std::string_view text, const char* what, const pugi::xml_node& point) const {
    if (const auto value = number_of(text)) return *value;
    fail(ErrorKind::Input, "{}: {} = \"{}\" is no number{}", where(point), what, text.substr(0, 80),
         number_hint(text, "GPX writes decimal degrees and metres with a point"));
  }

  std::string where(const pugi::xml_node& point) const {
    return fmt::format("{}, line {}, point {} (counted from 0)", file_.string(),
                       line_at(text_, point.offset_debug()), table_.fixes.size());
  }

  const std::filesystem::path& file_;
  const std::string& text_;
  const pugi::xml_node& gpx_;
  GpxNames names_;
  bool has_heights_;  ///< they are wanted
  FixTable& table_;
  std::size_t num_without_zone_ = 0;
};

/// Tracks of GPX 1.0 and 1.1, whose segments start anew; or routes, or waypoints. Points without an elevation or a
/// time stay without one.
class GpxFixes final : public FixFormat {
 public:
  void describe(core::SchemaVisitor& visit) override {
    visit.key("points", points_,
              "What is flown of the file: its tracks, its routes, or its waypoints in their order; "
              "empty: the tracks, or the routes where there are no tracks.",
              core::one_of({"", "tracks", "routes", "waypoints"}));
  }
  std::unique_ptr<FixFormat> clone() const override { return std::make_unique<GpxFixes>(*this); }

  FixTable read(const std::filesystem::path& file, const std::string& above) const override {
    refuse_if_too_large(file);
    const std::string text = core::read_text_file(file, kMostBytes);
    pugi::xml_document document;
    const pugi::xml_parse_result parsed = document.load_buffer(text.data(), text.size());
    if (!parsed)
      fail(ErrorKind::Input, "{}, line {}: not XML: {}", file.string(),
           line_at(text, parsed.offset), parsed.description());
    const pugi::xml_node gpx = document.document_element();
    if (local_name(gpx.name()) != "gpx")
      fail(ErrorKind::Input, "{}: there is no <gpx> at the top but <{}>; this is no GPX file",
           file.string(), gpx.name());
    FixTable table;
    table.zero_unix_s = 0.0;
    GpxReading reading(file, text, gpx, above != "none", table);
    reading.read(chosen(reading.count_kinds(), file, table));
    if (reading.num_without_zone() > 0)
      table.remarks.push_back(
          fmt::format("{} times state no zone; they are in UTC, as GPX defines them",
                      reading.num_without_zone()));
    return table;
  }

 private:
  /// Which of tracks (0), routes (1), waypoints (2).
  std::size_t chosen(const std::array<std::size_t, 3>& counts, const std::filesystem::path& file,
                     FixTable& table) const {
    const auto& kinds = GpxReading::kKinds;
    std::size_t wanted = counts[0] == 0 && counts[1] > 0 ? 1 : 0;
    for (std::size_t kind = 0; kind < kinds.size(); ++kind)
      if (points_ == kinds[kind].words) wanted = kind;
    std::string held, others;
    for (std::size_t kind = 0; kind < kinds.size(); ++kind) {
      if (counts[kind] == 0) continue;
      held += fmt::format("{}{} points of {}", held.empty() ? "" : ", ", counts[kind],
                          kinds[kind].words);
      others += fmt::format("{}points = \"{}\"", others.empty() ? "" : " or ", kinds[kind].words);
    }
    if (counts[wanted] == 0 && !others.empty())
      fail(ErrorKind::Input, "{}: there are no {} in it; it holds {}, which {} flies",
           file.string(), kinds[wanted].words, held, others);
    if (counts[wanted] == 0)
      fail(ErrorKind::Input, "{}: there are no points of tracks, routes or waypoints in it",
           file.string());
    if (points_.empty() && held.find(',') != std::string::npos)
      table.remarks.push_back(fmt::format(
          "it holds {}; the {} are flown, and points chooses others", held, kinds[wanted].words));
    if (points_.empty() && wanted == 1 && counts[2] == 0)
      table.remarks.push_back("there are no tracks; the routes are flown");
    return wanted;
  }

  std::string points_;
};

}  // namespace

FixFormatInfo gpx_fixes() {
  static const std::array tables = {
      core::KnownTable{"gpx", "elements and attributes", known_gpx_names()}};
  return {.name = "gpx",
          .summary = "Tracks, routes or waypoints of a GPX file; each segment is a part.",
          .make = [] { return std::unique_ptr<FixFormat>(new GpxFixes); },
          .known = tables};
}

}  // namespace terracast::geo
