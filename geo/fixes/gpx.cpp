#include <algorithm>
#include <pugixml.hpp>

#include "core/atomic_file.h"
#include "core/error.h"
#include "geo/fixes/fix_format.h"
#include "geo/fixes/text.h"

namespace terracast::geo {
namespace {

using core::ErrorKind;
using core::fail;

constexpr std::size_t kMostBytes = std::size_t{1} << 28;

/// Tracks of GPX 1.0 and 1.1; each segment starts anew. Points without an elevation or a time stay
/// without one.
class GpxFixes final : public FixFormat {
 public:
  std::unique_ptr<FixFormat> clone() const override { return std::make_unique<GpxFixes>(*this); }

  FixTable read(const std::filesystem::path& file, const std::string&) const override {
    const std::string text = core::read_text_file(file, kMostBytes);
    pugi::xml_document document;
    const pugi::xml_parse_result parsed = document.load_buffer(text.data(), text.size());
    if (!parsed)
      fail(ErrorKind::Input, "{}, line {}: not XML: {}", file.string(),
           line_at(text, parsed.offset), parsed.description());
    const pugi::xml_node gpx = document.child("gpx");
    if (!gpx)
      fail(ErrorKind::Input, "{}: there is no <gpx> at the top; this is no GPX file",
           file.string());
    FixTable table;
    table.has_utc = true;
    for (const pugi::xml_node& track : gpx.children("trk"))
      for (const pugi::xml_node& segment : track.children("trkseg")) {
        bool is_first = true;
        for (const pugi::xml_node& point : segment.children("trkpt")) {
          if (table.fixes.size() >= kMostFixes)
            fail(ErrorKind::Input, "{}: more than {} points", file.string(), kMostFixes);
          Fix fix = fix_of(point, fmt::format("{}, point {} (counted from 0)", file.string(),
                                              table.fixes.size()));
          fix.starts_part = is_first;
          is_first = false;
          table.fixes.push_back(std::move(fix));
        }
      }
    return table;
  }

 private:
  static std::size_t line_at(const std::string& text, std::ptrdiff_t offset) {
    const auto end =
        std::min(static_cast<std::size_t>(std::max<std::ptrdiff_t>(offset, 0)), text.size());
    return 1 + static_cast<std::size_t>(
                   std::count(text.begin(), text.begin() + static_cast<long>(end), '\n'));
  }

  static double number(std::string_view text, const char* what, const std::string& where) {
    if (const auto value = number_of(text)) return *value;
    fail(ErrorKind::Input, "{}: {} = \"{}\" is no number", where, what, text);
  }

  static Fix fix_of(const pugi::xml_node& point, const std::string& where) {
    Fix fix;
    if (const pugi::xml_node elevation = point.child("ele")) {
      fix.place = {number(point.attribute("lat").value(), "lat", where),
                   number(point.attribute("lon").value(), "lon", where),
                   number(elevation.text().get(), "ele", where)};
    }
    if (const pugi::xml_node time = point.child("time"))
      fix.time_s = unix_seconds_from_text(time.text().get(), 0.0, where);
    return fix;
  }
};

}  // namespace

FixFormatInfo gpx_fixes() {
  return {.name = "gpx", .summary = "Tracks of a GPX file; each segment is a part.", .make = [] {
            return std::unique_ptr<FixFormat>(new GpxFixes);
          }};
}

}  // namespace terracast::geo
