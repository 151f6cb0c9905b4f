#include <cmath>

#include "core/atomic_file.h"
#include "core/error.h"
#include "geo/fixes/fix_format.h"
#include "geo/fixes/text.h"
#include "geo/units.h"

namespace terracast::geo {
namespace {

using core::ErrorKind;
using core::fail;

/// A subtitle: its lines between two blank ones, and the line where it begins.
struct Cue {
  std::size_t line;
  std::vector<std::string_view> lines;
};

std::vector<Cue> cues_of(std::string_view text) {
  std::vector<Cue> cues;
  bool is_open = false;
  std::size_t number = 0;
  for (const std::string_view line : lines_of_text(text)) {
    ++number;
    if (trimmed(line).empty()) {
      is_open = false;
      continue;
    }
    if (!is_open) cues.push_back({number, {}});
    is_open = true;
    cues.back().lines.push_back(line);
  }
  return cues;
}

/// "00:01:02,345" as seconds.
std::optional<double> seconds_of_clock(std::string_view text) {
  const std::string_view clock = trimmed(text);
  constexpr std::size_t kSize = 12;
  if (clock.size() != kSize || clock[2] != ':' || clock[5] != ':' ||
      (clock[8] != ',' && clock[8] != '.'))
    return std::nullopt;
  const auto hours = number_of(clock.substr(0, 2)), minutes = number_of(clock.substr(3, 2));
  const auto seconds = number_of(clock.substr(6, 2)), thousandths = number_of(clock.substr(9));
  if (!hours || !minutes || !seconds || !thousandths) return std::nullopt;
  return *hours * 3600.0 + *minutes * 60.0 + *seconds + *thousandths * 1e-3;
}

/// The number at the front of a text, without what follows ("-57.98m", "2.7 deg").
std::optional<double> leading_number(std::string_view text) {
  const std::string_view digits = trimmed(text);
  return number_of(
      digits.substr(0, std::min(digits.find_first_not_of("+-.0123456789"), digits.size())));
}

/// The numbers in the brackets after a word: GPS (-58.85, -34.23, 15). Empty: no such word.
std::vector<double> bracketed(std::string_view text, std::string_view word) {
  for (std::size_t at = text.find(word); at != std::string_view::npos;
       at = text.find(word, at + 1)) {
    const bool begins_word =
        at == 0 || std::string_view(" ,\t>").find(text[at - 1]) != std::string_view::npos;
    std::string_view rest = trimmed(text.substr(at + word.size()));
    if (!begins_word || rest.empty() || rest[0] != '(') continue;
    rest = rest.substr(1, rest.find(')') == std::string_view::npos ? 0 : rest.find(')') - 1);
    std::vector<double> values;
    while (!rest.empty()) {
      const std::size_t end = std::min(rest.find(','), rest.size());
      const auto value = leading_number(rest.substr(0, end));
      if (!value) return {};
      values.push_back(*value);
      rest.remove_prefix(std::min(end + 1, rest.size()));
    }
    return values;
  }
  return {};
}

/// The number after a name and a colon, as in [latitude : 31.45] or BAROMETER:1.9.
std::optional<double> named(std::string_view text, std::string_view name) {
  for (std::size_t at = text.find(name); at != std::string_view::npos;
       at = text.find(name, at + 1)) {
    const bool begins_word =
        at == 0 || std::string_view(" [,\t>").find(text[at - 1]) != std::string_view::npos;
    const std::string_view rest = trimmed(text.substr(at + name.size()));
    if (begins_word && !rest.empty() && rest[0] == ':') return leading_number(rest.substr(1));
  }
  return std::nullopt;
}

/// The number after a letter and a blank, as in "H 85.80m".
std::optional<double> lettered(std::string_view text, std::string_view start) {
  const std::size_t at = text.find(start);
  return at == std::string_view::npos ? std::nullopt
                                      : leading_number(text.substr(at + start.size()));
}

std::optional<double> first_of(std::initializer_list<std::optional<double>> candidates) {
  for (const auto& candidate : candidates)
    if (candidate) return candidate;
  return std::nullopt;
}

/// The subtitles that DJI's aircraft write beside a video. Three wordings: bracketed names
/// ([latitude : 31.45]), and GPS (a, b, …) with BAROMETER or with H for the height above take-off.
class SrtFixes final : public FixFormat {
 public:
  void describe(core::SchemaVisitor& visit) override {
    visit.key("order", order_,
              "Of the two numbers of GPS (…), which aircraft write both ways; files that name them "
              "need none.",
              core::one_of({"", "lon_lat", "lat_lon"}));
    visit.key("utc_offset_h", utc_offset_h_, "Hours by which the camera's clock is ahead of UTC.",
              core::between(-14.0, 14.0));
  }
  std::unique_ptr<FixFormat> clone() const override { return std::make_unique<SrtFixes>(*this); }

  FixTable read(const std::filesystem::path& file, const std::string& above) const override {
    constexpr std::size_t kMostBytes = std::size_t{1} << 28;
    const std::string text = core::read_text_file(file, kMostBytes);
    FixTable table;
    std::size_t num_dated = 0;
    for (const Cue& cue : cues_of(text)) {
      if (table.fixes.size() >= kMostFixes)
        fail(ErrorKind::Input, "{}: more than {} subtitles", file.string(), kMostFixes);
      const std::string where = fmt::format("{}, line {}", file.string(), cue.line);
      double start_s = 0.0;
      const std::string content = content_of(cue, where, start_s);
      Fix fix = fix_of(content, above, where);
      fix.line = cue.line;
      const auto date = date_in(content, where);
      fix.time_s = date.value_or(start_s);
      num_dated += date ? 1 : 0;
      if (const auto home = pair_of(bracketed(content, "HOME"), where);
          home && !table.home && !home->isZero(0.0))
        table.home = Geodetic{home->x(), home->y(), 0.0};
      table.fixes.push_back(std::move(fix));
    }
    if (num_dated != 0 && num_dated != table.fixes.size())
      fail(ErrorKind::Input, "{}: {} of {} subtitles have a date; all or none is expected",
           file.string(), num_dated, table.fixes.size());
    table.has_utc = num_dated > 0;
    return table;
  }

 private:
  /// A cue's text after its number and its times.
  static std::string content_of(const Cue& cue, const std::string& where, double& start_s) {
    constexpr std::string_view kArrow = "-->";
    for (std::size_t i = 0; i < cue.lines.size() && i < 2; ++i) {
      const std::size_t arrow = cue.lines[i].find(kArrow);
      if (arrow == std::string_view::npos) continue;
      const auto start = seconds_of_clock(cue.lines[i].substr(0, arrow));
      if (!start) break;
      start_s = *start;
      return fmt::format(
          "{}", fmt::join(cue.lines.begin() + static_cast<long>(i) + 1, cue.lines.end(), " "));
    }
    fail(ErrorKind::Input,
         "{}: no subtitle: its first lines are to be a number and 00:00:01,000 --> 00:00:02,000",
         where);
  }

  /// A date with a time of day somewhere in the text.
  std::optional<double> date_in(std::string_view text, const std::string& where) const {
    constexpr std::string_view kShape = "0000-00-00 00:00:00";
    const auto fits = [&](std::size_t at) {
      for (std::size_t i = 0; i < kShape.size(); ++i) {
        const char c = text[at + i];
        const bool is_digit = c >= '0' && c <= '9';
        if (kShape[i] == '0' ? !is_digit : c != kShape[i] && !(kShape[i] == '-' && c == '.'))
          return false;
      }
      return true;
    };
    for (std::size_t at = 0; at + kShape.size() <= text.size(); ++at) {
      if (!fits(at)) continue;
      const std::size_t end = text.find_first_not_of("0123456789.,", at + kShape.size());
      std::string_view date = text.substr(at, end - at);
      while (date.back() == ',' || date.back() == '.') date.remove_suffix(1);
      return unix_seconds_from_text(date, utc_offset_h_, where);
    }
    return std::nullopt;
  }

  /// Latitude and longitude of the first two numbers.
  std::optional<Eigen::Vector2d> pair_of(const std::vector<double>& values,
                                         const std::string& where) const {
    if (values.size() < 2) return std::nullopt;
    if (order_.empty())
      fail(ErrorKind::Config,
           "{}: GPS ({}, {}) may be longitude and latitude or the other way round; say order = "
           "\"lon_lat\" (as a Phantom 4 RTK writes) or \"lat_lon\"",
           where, values[0], values[1]);
    const bool is_lon_first = order_ == "lon_lat";
    return Eigen::Vector2d(values[is_lon_first ? 1 : 0], values[is_lon_first ? 0 : 1]);
  }

  Fix fix_of(std::string_view text, const std::string& above, const std::string& where) const {
    Fix fix;
    const std::vector<double> gps = bracketed(text, "GPS");
    const auto named_lat = named(text, "latitude");
    const auto named_lon = first_of({named(text, "longitude"), named(text, "longtitude")});
    std::optional<Eigen::Vector2d> pair = pair_of(gps, where);
    if (named_lat && named_lon) pair = Eigen::Vector2d(*named_lat, *named_lon);
    // Zeros stand where the receiver has no place yet.
    if (pair && pair->isZero(0.0)) pair.reset();
    const auto height =
        above == "home"
            ? first_of({named(text, "rel_alt"), lettered(text, ", H "), named(text, "BAROMETER")})
            : first_of({named(text, "abs_alt"), named(text, "altitude"),
                        named(text, "absolute_altitude")});
    if (pair && height) fix.place = {pair->x(), pair->y(), *height};
    if (pair && !height)
      fail(ErrorKind::Config, "{}: there is no height {} in \"{}\"; {}", where,
           above == "home" ? "above home" : "of its own", std::string(text.substr(0, 160)),
           above == "home"
               ? "say what its altitude is above: ellipsoid or egm96"
               : "above = \"home\" takes the height above take-off, where there is one");
    fix.attitude = angles_of(bracketed(text, "F.PRY"));
    fix.gimbal = angles_of(bracketed(text, "G.PRY"));
    const auto yaw = named(text, "gb_yaw"), pitch = named(text, "gb_pitch"),
               roll = named(text, "gb_roll");
    if (yaw && pitch && roll) fix.gimbal = angles_of({*pitch, *roll, *yaw});
    fix.speed_mps = lettered(text, "H.S ");
    return fix;
  }

  /// Of pitch, roll, yaw in degrees, about north-east-down.
  static std::optional<Eigen::Quaterniond> angles_of(
      const std::vector<double>& pitch_roll_yaw_deg) {
    if (pitch_roll_yaw_deg.size() != 3) return std::nullopt;
    return enu_from_body_by_ned_angles(radians_from_degrees(pitch_roll_yaw_deg[2]),
                                       radians_from_degrees(pitch_roll_yaw_deg[0]),
                                       radians_from_degrees(pitch_roll_yaw_deg[1]));
  }

  std::string order_;
  double utc_offset_h_ = 0.0;
};

}  // namespace

FixFormatInfo srt_fixes() {
  return {.name = "srt",
          .summary = "The subtitles that DJI's aircraft write beside a video.",
          .make = [] { return std::unique_ptr<FixFormat>(new SrtFixes); }};
}

}  // namespace terracast::geo
