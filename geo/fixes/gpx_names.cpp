#include "geo/fixes/gpx_names.h"

#include <fmt/format.h>

#include <array>

namespace terracast::geo {
namespace {

constexpr std::string_view kOfTheFile = "about the file, not about the way";
constexpr std::string_view kOfAName = "a name or a note";
constexpr std::string_view kOfQuality = "how good the fix is; sigma_m says that of all";
constexpr std::string_view kOfAPerson = "of the person or the device, not of the motion";
constexpr std::string_view kOfACourse = "follows from the way that is flown";

constexpr std::string_view kOfAMap = "how a map draws it";

// By GPX 1.0 and 1.1 (topografix.com), and Garmin's TrackPointExtension 1 and 2.
constexpr std::array kKnown = {
    core::KnownName{"trk", "a track, whose segments are parts"},
    core::KnownName{"trk/trkseg", "a part"},
    core::KnownName{"trkseg/trkpt", "a fix"},
    core::KnownName{"trk/trkpt", "a fix of a track that was written without segments"},
    core::KnownName{"rte", "a route: a part, where points says so, or there are no tracks"},
    core::KnownName{"rte/rtept", "a fix of a route"},
    core::KnownName{"wpt", "a fix, where points says so"},
    core::KnownName{"point@lat", "latitude in degrees"},
    core::KnownName{"point@lon", "longitude in degrees"},
    core::KnownName{"point/ele", "height in metres"},
    core::KnownName{"point/time", "time, UTC unless it says otherwise"},
    core::KnownName{"point/speed", "speed in m/s, which the motion is compared with"},
    core::KnownName{"extensions/speed", "speed in m/s, which the motion is compared with"},
    core::KnownName{"point/extensions", "what others add to a fix"},
    core::KnownName{"extensions/TrackPointExtension", "what Garmin adds to a fix"},

    core::KnownName{"gpx@version", kOfTheFile, false},
    core::KnownName{"gpx@creator", kOfTheFile, false},
    core::KnownName{"gpx@schemaLocation", kOfTheFile, false},
    core::KnownName{"metadata", kOfTheFile, false},
    core::KnownName{"time", "when the file was written", false},
    core::KnownName{"bounds", "follows from the fixes", false},
    core::KnownName{"name", kOfTheFile, false},
    core::KnownName{"desc", kOfTheFile, false},
    core::KnownName{"author", kOfTheFile, false},
    core::KnownName{"email", kOfTheFile, false},
    core::KnownName{"url", kOfTheFile, false},
    core::KnownName{"urlname", kOfTheFile, false},
    core::KnownName{"keywords", kOfTheFile, false},
    core::KnownName{"point/course", kOfACourse, false},
    core::KnownName{"point/magvar", "north is the true one", false},
    core::KnownName{"point/geoidheight", "above = \"egm96\" has a geoid of its own", false},
    core::KnownName{"point/fix", kOfQuality, false},
    core::KnownName{"point/sat", kOfQuality, false},
    core::KnownName{"point/hdop", kOfQuality, false},
    core::KnownName{"point/vdop", kOfQuality, false},
    core::KnownName{"point/pdop", kOfQuality, false},
    core::KnownName{"point/ageofdgpsdata", kOfQuality, false},
    core::KnownName{"point/dgpsid", kOfQuality, false},
    core::KnownName{"extensions/course", kOfACourse, false},
    core::KnownName{"extensions/bearing", "which way the device was held, not the aircraft", false},
    core::KnownName{"extensions/hr", kOfAPerson, false},
    core::KnownName{"extensions/cad", kOfAPerson, false},
    core::KnownName{"extensions/power", kOfAPerson, false},
    core::KnownName{"extensions/atemp", "the air's temperature there", false},
    core::KnownName{"extensions/wtemp", "the water's temperature there", false},
    core::KnownName{"extensions/depth", "of a diver", false},
    core::KnownName{"trk/extensions/TrackExtension", kOfAMap, false},
    core::KnownName{"trk/extensions/DisplayColor", kOfAMap, false},
    core::KnownName{"trk/extensions/line", kOfAMap, false},
    core::KnownName{"trk/extensions/color", kOfAMap, false},
    core::KnownName{"trk/extensions/opacity", kOfAMap, false},
    core::KnownName{"trk/extensions/width", kOfAMap, false},
};

constexpr std::array<std::string_view, 10> kOfAnyPart = {
    "name", "cmt", "desc", "src", "link", "number", "type", "sym", "url", "urlname"};

/// The namespaces of extensions whose names are known without their prefix.
bool is_known_extension(std::string_view address) {
  return address.find("garmin.com/xmlschemas/") != std::string_view::npos ||
         address.find("osmand.net") != std::string_view::npos;
}

std::vector<core::KnownName> all_known() {
  static std::vector<std::string> names;  // what the views of the table look at
  std::vector<core::KnownName> known(kKnown.begin(), kKnown.end());
  for (const char* part : {"trk", "rte", "point"})
    for (const std::string_view name : kOfAnyPart)
      names.push_back(fmt::format("{}/{}", part, name));
  for (const std::string& name : names) known.push_back({name, kOfAName, false});
  return known;
}

std::string_view prefix_of(std::string_view qualified) {
  const std::size_t colon = qualified.find(':');
  return colon == std::string_view::npos ? std::string_view{} : qualified.substr(0, colon);
}

/// The value of an attribute; nullptr: the element has none of that name among its first thousand, more than which no
/// program writes and every look would take its time.
const char* find_attribute(const pugi::xml_node& element, const std::string& name) {
  int left = 1000;
  for (const pugi::xml_attribute& attribute : element.attributes()) {
    if (name == attribute.name()) return attribute.value();
    if (--left == 0) break;
  }
  return nullptr;
}

}  // namespace

std::span<const core::KnownName> known_gpx_names() {
  static const std::vector<core::KnownName> known = all_known();
  return known;
}

std::string_view local_name(std::string_view qualified) {
  return qualified.substr(qualified.find(':') + 1);
}

std::string namespace_of(const pugi::xml_node& element) {
  const std::string_view prefix = prefix_of(element.name());
  const std::string wanted = prefix.empty() ? "xmlns" : fmt::format("xmlns:{}", prefix);
  // Deeper down than any file of its own accord only the declarations of the top count: else a file could make each
  // look as long as it is deep.
  constexpr int kMostLevels = 32;
  pugi::xml_node at = element;
  for (int level = 0; at && level < kMostLevels; ++level, at = at.parent())
    if (const char* declared = find_attribute(at, wanted)) return declared;
  if (at)
    if (const char* declared = find_attribute(element.root().first_child(), wanted))
      return declared;
  return prefix.empty() ? "" : fmt::format("{}:", prefix);
}

GpxNames::GpxNames(const pugi::xml_node& gpx) : namespace_(namespace_of(gpx)) {}

bool GpxNames::is(const pugi::xml_node& element, std::string_view name) const {
  return local_name(element.name()) == name && namespace_of(element) == namespace_;
}

std::string GpxNames::name_of(const pugi::xml_node& element) const {
  const std::string address = namespace_of(element);
  if (address == namespace_ || is_known_extension(address))
    return std::string(local_name(element.name()));
  return element.name();
}

void GpxNames::count_attributes(const pugi::xml_node& element, std::string_view name,
                                core::Ledger& ledger) const {
  for (const pugi::xml_attribute& attribute : element.attributes()) {
    const std::string_view qualified = attribute.name();
    if (qualified == "xmlns" || qualified.starts_with("xmlns:")) continue;
    ledger.count(fmt::format("{}@{}", name, local_name(qualified)), known_gpx_names());
  }
}

void GpxNames::count_extensions(const pugi::xml_node& extensions, std::string_view path,
                                core::Ledger& ledger) const {
  // Depth first without recursion, which a hostile file could make as deep as it likes.
  pugi::xml_node at = extensions.first_child();
  while (at && at != extensions) {
    if (at.type() == pugi::node_element) {
      const std::string name = fmt::format("{}/{}", path, name_of(at));
      ledger.count(name, known_gpx_names());
      count_attributes(at, name, ledger);
    }
    if (at.first_child()) {
      at = at.first_child();
      continue;
    }
    while (at != extensions && !at.next_sibling()) at = at.parent();
    if (at != extensions) at = at.next_sibling();
  }
}

}  // namespace terracast::geo
