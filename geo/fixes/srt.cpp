#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <span>

#include "core/error.h"
#include "core/stop.h"
#include "geo/fixes/fix_format.h"
#include "geo/fixes/srt_fields.h"
#include "geo/fixes/text.h"
#include "geo/fixes/times.h"
#include "geo/fixes/units.h"

namespace terracast::geo {
namespace {

using core::ErrorKind;
using core::fail;

constexpr std::size_t kLongestLine_bytes = 65536;

/// A subtitle: its lines between two blank ones, and the line where it begins.
struct Cue {
  std::size_t line;
  std::vector<std::string_view> lines;
};

/// A line like "00:00:01,000 --> 00:00:02,000".
bool is_timing(std::string_view line) { return line.find("-->") != std::string_view::npos; }

bool is_whole_number(std::string_view line) {
  return trimmed(line).find_first_not_of("0123456789") == std::string_view::npos;
}

std::vector<Cue> cues_of(std::string_view text, const std::string& file) {
  constexpr std::size_t kMostLines = 1000;  // of a subtitle, which has ten
  std::vector<Cue> cues;
  bool is_open = false;
  std::size_t number = 0;
  for (const std::string_view line : lines_of_text(text)) {
    ++number;
    if (trimmed(line).empty()) {
      is_open = false;
      continue;
    }
    // Where blank lines were lost, a second timing begins the next subtitle, the number before it being its own.
    if (is_open && is_timing(line) &&
        std::any_of(cues.back().lines.begin(), cues.back().lines.end(), is_timing)) {
      const std::string_view before = cues.back().lines.back();
      const bool is_number = is_whole_number(before);
      if (is_number) cues.back().lines.pop_back();
      cues.push_back({is_number ? number - 1 : number, {}});
    }
    if (!is_open) cues.push_back({number, {}});
    is_open = true;
    cues.back().lines.push_back(line);
    if (cues.size() > kMostFixes)
      fail(ErrorKind::Input, "{}: more than {} subtitles; cut the file into parts", file,
           kMostFixes);
    if (cues.back().lines.size() > kMostLines || line.size() > kLongestLine_bytes)
      fail(ErrorKind::Input,
           "{}, line {}: a subtitle of more than {} lines, or a line of more than {} bytes", file,
           number, kMostLines, kLongestLine_bytes);
  }
  return cues;
}

/// The fields of a subtitle by name; of several of one name the first.
using Fields = std::map<std::string, std::string>;

/// How a unit is written, and what one of it is in metres, m/s or degrees.
struct UnitName {
  std::string_view name;
  double factor;
};
constexpr std::array kLengths = {UnitName{"", 1.0}, UnitName{"m", 1.0},
                                 UnitName{"ft", metres_from_feet(1.0)}};
constexpr std::array kSpeeds = {UnitName{"", 1.0}, UnitName{"m/s", 1.0},
                                UnitName{"km/h", 1.0 / 3.6},
                                UnitName{"mph", kMetresPerSecondPerMileAnHour}};
constexpr std::array kAngles = {UnitName{"", 1.0}, UnitName{"\u00B0", 1.0}, UnitName{"deg", 1.0}};

/// A number with its unit: "85.80m", "0.3M", "281.5ft". Nothing where the unit is another.
std::optional<double> number_with_unit(std::string_view text, std::span<const UnitName> units) {
  const std::string_view whole = trimmed(text);
  const std::size_t end = std::min(whole.find_first_not_of("+-.0123456789"), whole.size());
  const auto value = number_of(whole.substr(0, end));
  const std::string unit = in_lower_case(trimmed(whole.substr(end)));
  for (const UnitName& one : units)
    if (value && unit == one.name) return *value * one.factor;
  return std::nullopt;
}

/// The numbers between commas; empty where one is none.
std::vector<double> numbers_of(std::string_view values) {
  std::vector<double> numbers;
  while (!values.empty()) {
    const std::size_t end = std::min(values.find(','), values.size());
    const auto value = leading_number(values.substr(0, end));
    if (!value) return {};
    numbers.push_back(*value);
    values.remove_prefix(std::min(end + 1, values.size()));
  }
  return numbers;
}

/// Latitude and longitude of "W: 97.62, N: 30.21": the letter is the sign, as a minus may be too.
std::optional<Eigen::Vector2d> lettered_pair(std::string_view values) {
  std::optional<double> latitude, longitude;
  for (int i = 0; i < 2 && !values.empty(); ++i) {
    const std::size_t end = std::min(values.find(','), values.size());
    const std::string_view one = trimmed(values.substr(0, end));
    const std::size_t colon = one.find(':');
    if (one.empty() || colon == std::string_view::npos) return std::nullopt;
    const auto value = leading_number(one.substr(colon + 1));
    const bool is_negative = one[0] == 'W' || one[0] == 'S';
    if (!value || (*value < 0.0 && !is_negative)) return std::nullopt;
    const double stated = is_negative ? -std::abs(*value) : *value;
    if (one[0] == 'N' || one[0] == 'S') latitude = stated;
    if (one[0] == 'E' || one[0] == 'W') longitude = stated;
    values.remove_prefix(std::min(end + 1, values.size()));
  }
  if (!latitude || !longitude) return std::nullopt;
  return Eigen::Vector2d(*latitude, *longitude);
}

bool is_lettered(std::string_view values) {
  const std::string_view first = trimmed(values);
  return !first.empty() && std::string_view("NSEW").find(first[0]) != std::string_view::npos;
}

/// The third of values between commas; empty: there are two.
std::string_view third_of(std::string_view values) {
  for (int i = 0; i < 2; ++i) {
    const std::size_t comma = values.find(',');
    if (comma == std::string_view::npos) return {};
    values.remove_prefix(comma + 1);
  }
  return trimmed(values);
}

constexpr std::array<const char*, 5> kAboveHome = {"rel_alt", "h", "barometer", "hb", "reh"};
constexpr std::array<const char*, 4> kOfItsOwn = {"abs_alt", "altitude", "absolute_altitude",
                                                  "gps[3] m"};

/// One file of subtitles.
class SrtReading {
 public:
  struct Options {
    std::string order;
    double utc_offset_h = 0.0;
    double degrees_per_unit = 1.0;
  };
  SrtReading(const std::filesystem::path& file, const std::string& above, const Options& options)
      : file_(file), above_(above), options_(options) {}

  FixTable read() {
    const std::string text = text_of_recording(file_);
    for (const Cue& cue : cues_of(text, file_.string())) {
      core::throw_if_stop_asked();
      where_ = fmt::format("{}, line {}", file_.string(), cue.line);
      add(cue);
    }
    choose_times();
    refuse_if_without_places();
    refuse_if_without_heights();
    return std::move(table_);
  }

 private:
  void add(const Cue& cue) {
    std::optional<double> start_s;
    const Fields fields = fields_of(cue, start_s);
    const auto date = fields.find(kSrtDate);
    if (!start_s && date == fields.end())
      fail(ErrorKind::Input,
           "{}: no subtitle: its first lines are to be a number and 00:00:01,000 --> 00:00:02,000, "
           "or "
           "a date is to stand in it",
           where_);
    Fix fix = fix_of(fields);
    fix.line = cue.line;
    starts_s_.push_back(start_s);
    dates_s_.emplace_back();
    if (date != fields.end()) {
      const auto time = stated_time(date->second, options_.utc_offset_h);
      TERRACAST_CHECK(time, "srt_fields() takes {} for a date", date->second);
      dates_s_.back() = time->unix_s;
      num_without_zone_ += time->has_zone ? 0 : 1;
    }
    if (!table_.home) table_.home = home_of(fields);
    table_.fixes.push_back(std::move(fix));
  }

  /// A cue's fields, counted; of its first two lines those that number and time it are none.
  Fields fields_of(const Cue& cue, std::optional<double>& start_s) {
    std::size_t first = 0;
    for (std::size_t i = 0; i < cue.lines.size() && i < 2; ++i) {
      if (!is_timing(cue.lines[i])) continue;
      start_s = seconds_of_clock(cue.lines[i].substr(0, cue.lines[i].find("-->")));
      if (start_s) first = i + 1;
    }
    if (first == 0 && is_whole_number(cue.lines[0])) first = 1;
    const std::string text = srt_text(fmt::format(
        "{}", fmt::join(cue.lines.begin() + static_cast<long>(first), cue.lines.end(), "\n")));
    Fields fields;
    for (SrtField& field : srt_fields(text)) {
      table_.ledger.count(field.name, known_srt_fields());
      const bool is_known = core::find_known(known_srt_fields(), field.name) != nullptr;
      if (is_known && field.value.empty()) ++table_.empty[field.name];
      if (!field.value.empty()) fields.emplace(std::move(field.name), std::move(field.value));
    }
    return fields;
  }

  /// The number of a field; one that is none, or is in a unit that is not known, is counted.
  std::optional<double> number(const Fields& fields, const char* name,
                               std::span<const UnitName> units) {
    const auto found = fields.find(name);
    if (found == fields.end()) return std::nullopt;
    const auto value = number_with_unit(found->second, units);
    if (!value) table_.ledger.misunderstand(name, found->second);
    return value;
  }

  template <std::size_t kCount>
  std::optional<double> first_of(const Fields& fields, const std::array<const char*, kCount>& names,
                                 std::span<const UnitName> units) {
    for (const char* name : names)
      if (const auto value = number(fields, name, units)) return value;
    return std::nullopt;
  }

  /// Latitude and longitude in the brackets of GPS, RTK or HOME.
  std::optional<Eigen::Vector2d> pair_of(const Fields& fields, const char* name) {
    const auto found = fields.find(name);
    if (found == fields.end()) return std::nullopt;
    const std::string& values = found->second;
    if (is_lettered(values)) {
      const auto pair = lettered_pair(values);
      if (!pair) table_.ledger.misunderstand(name, values);
      return pair;
    }
    const std::vector<double> numbers = numbers_of(values);
    if (numbers.size() < 2) {
      table_.ledger.misunderstand(name, values);
      return std::nullopt;
    }
    if (options_.order.empty())
      fail(ErrorKind::Config,
           "{}: {} ({}, {}) may be longitude and latitude or the other way round; say order = "
           "\"lon_lat\" (as most aircraft write, a Phantom 4 RTK too) or \"lat_lon\" (as a Matrice "
           "300)",
           where_, name, numbers[0], numbers[1]);
    const bool is_lon_first = options_.order == "lon_lat";
    return Eigen::Vector2d(numbers[is_lon_first ? 1 : 0], numbers[is_lon_first ? 0 : 1]);
  }

  /// The third value: a height where letters tell the first two apart and it is in metres.
  void take_third(Fields& fields, const char* name) {
    const auto found = fields.find(name);
    if (found == fields.end()) return;
    const std::string third(third_of(found->second));
    if (third.empty()) return;
    const bool is_height = is_lettered(found->second) && third.ends_with('m');
    const std::string known = fmt::format("{}[3]{}", name, is_height ? " m" : "");
    table_.ledger.count(known, known_srt_fields());
    fields.emplace(known, third);
  }

  std::optional<Geodetic> home_of(const Fields& fields) {
    const auto home = pair_of(fields, "home");
    if (!home || home->isZero(0.0)) return std::nullopt;
    const Eigen::Vector2d place = *home * options_.degrees_per_unit;
    return Geodetic{place.x(), place.y(), 0.0};
  }

  Fix fix_of(Fields fields) {
    for (const char* name : {"gps", "rtk", "home"}) take_third(fields, name);
    Fix fix;
    const auto latitude = number(fields, "latitude", kAngles);
    const auto longitude = first_of(fields, std::array{"longitude", "longtitude"}, kAngles);
    std::optional<Eigen::Vector2d> pair;
    if (latitude && longitude) pair = Eigen::Vector2d(*latitude, *longitude);
    for (const char* name : {"gps", "rtk"})
      if (!pair) pair = pair_of(fields, name);
    // Zeros stand where the receiver has no place yet.
    if (pair && pair->isZero(0.0)) pair.reset();
    if (pair) fix.place.head<2>() = *pair * options_.degrees_per_unit;
    const auto above_home = first_of(fields, kAboveHome, kLengths),
               of_its_own = first_of(fields, kOfItsOwn, kLengths);
    num_above_home_ += pair && above_home ? 1 : 0;
    num_of_their_own_ += pair && of_its_own ? 1 : 0;
    const auto height = above_ == "home" ? above_home : of_its_own;
    if (height && !is_without_heights()) fix.place.z() = *height;
    fix.attitude = angles_of(fields, "f.pry");
    fix.gimbal = angles_of(fields, "g.pry");
    const auto yaw = number(fields, "gb_yaw", kAngles), pitch = number(fields, "gb_pitch", kAngles),
               roll = number(fields, "gb_roll", kAngles);
    if (yaw && pitch && roll) fix.gimbal = attitude_of({*pitch, *roll, *yaw});
    fix.speed_mps = number(fields, "h.s", kSpeeds);
    return fix;
  }

  std::optional<Eigen::Quaterniond> angles_of(const Fields& fields, const char* name) {
    const auto found = fields.find(name);
    if (found == fields.end()) return std::nullopt;
    const std::vector<double> angles = numbers_of(found->second);
    if (angles.size() == 3) return attitude_of(angles);
    table_.ledger.misunderstand(name, found->second);
    return std::nullopt;
  }

  /// Of pitch, roll, yaw in degrees, about north-east-down.
  static Eigen::Quaterniond attitude_of(const std::vector<double>& pitch_roll_yaw_deg) {
    return enu_from_body_by_ned_angles(radians_from_degrees(pitch_roll_yaw_deg[2]),
                                       radians_from_degrees(pitch_roll_yaw_deg[0]),
                                       radians_from_degrees(pitch_roll_yaw_deg[1]));
  }

  /// The dates, where there are any; else the times of the video.
  void choose_times() {
    std::size_t num_dated = 0;
    for (const auto& date : dates_s_) num_dated += date ? 1 : 0;
    if (num_dated > 0) table_.zero_unix_s = 0.0;
    for (std::size_t i = 0; i < table_.fixes.size(); ++i) {
      const auto& time = table_.has_utc() ? dates_s_[i] : starts_s_[i];
      if (time) table_.fixes[i].time_s = *time;
    }
    if (num_dated > 0 && num_dated < table_.fixes.size())
      table_.remarks.push_back(
          fmt::format("{} of {} subtitles have no date, and count as without a time",
                      table_.fixes.size() - num_dated, table_.fixes.size()));
    if (num_without_zone_ > 0)
      table_.remarks.push_back(fmt::format(
          "{} dates state no zone; the camera's clock is taken to be {}", num_without_zone_,
          options_.utc_offset_h == 0.0 ? "UTC, and utc_offset_h would say otherwise"
                                       : fmt::format("{} h ahead of UTC", options_.utc_offset_h)));
  }

  void refuse_if_without_places() const {
    for (const Fix& fix : table_.fixes)
      if (fix.has_level_place()) return;
    if (table_.fixes.empty())
      fail(ErrorKind::Input, "{}: there are no subtitles in it", file_.string());
    std::string names;
    for (const auto& [name, entry] : table_.ledger.entries())
      if (names.size() < 300) names += fmt::format("{}{}", names.empty() ? "" : ", ", name);
    fail(
        ErrorKind::Input,
        "{}: none of {} subtitles states a place other than 0, 0, as latitude and longitude or GPS "
        "(…) do; there are the fields {}",
        file_.string(), table_.fixes.size(), names.empty() ? "(none)" : names);
  }

  void refuse_if_without_heights() {
    const bool is_home = above_ == "home";
    if (is_without_heights()) {
      if (num_above_home_ + num_of_their_own_ > 0)
        table_.remarks.push_back(fmt::format(
            "its heights are not above the ground, and not read with above = \"{}\"", above_));
      return;
    }
    if ((is_home ? num_above_home_ : num_of_their_own_) > 0) return;
    const bool has_other = (is_home ? num_of_their_own_ : num_above_home_) > 0;
    fail(ErrorKind::Config, "{}: no subtitle states a height {}; {}{}", file_.string(),
         is_home ? "above home" : "of its own",
         !has_other ? ""
         : is_home  ? "above = \"ellipsoid\" or \"egm96\" takes its altitude, whichever of them "
                      "that is above; or "
                    : "above = \"home\" takes the height above take-off; or ",
         kNoHeightsWayOut);
  }

  bool is_without_heights() const { return above_ == "ground" || above_ == "none"; }

  const std::filesystem::path& file_;
  const std::string& above_;
  const Options& options_;
  std::string where_;
  FixTable table_;
  std::vector<std::optional<double>> starts_s_, dates_s_;
  std::size_t num_without_zone_ = 0;
  std::size_t num_above_home_ = 0, num_of_their_own_ = 0;
};

/// The subtitles that DJI's and Autel's aircraft write beside a video, in all their wordings (see srt_fields()).
class SrtFixes final : public FixFormat {
 public:
  void describe(core::SchemaVisitor& visit) override {
    visit.key("order", options_.order,
              "Of the two numbers of GPS (…), which aircraft write both ways; files that name them "
              "need none.",
              core::one_of({"", "lon_lat", "lat_lon"}));
    visit.key("angle_unit", angle_unit_,
              "Of latitude and longitude: a Mavic Air 2 wrote radians for a time.",
              core::one_of({"deg", "rad"}));
    visit.key("utc_offset_h", options_.utc_offset_h,
              "Hours by which the camera's clock is ahead of UTC.", core::between(-14.0, 14.0));
  }
  std::unique_ptr<FixFormat> clone() const override { return std::make_unique<SrtFixes>(*this); }

  FixTable read(const std::filesystem::path& file, const std::string& above) const override {
    SrtReading::Options options = options_;
    options.degrees_per_unit = degrees_per(angle_unit_);
    return SrtReading(file, above, options).read();
  }

 private:
  SrtReading::Options options_;
  std::string angle_unit_ = "deg";
};

}  // namespace

FixFormatInfo srt_fixes() {
  static const std::array tables = {
      core::KnownTable{"srt", "fields of a subtitle, in lower case", known_srt_fields()}};
  return {.name = "srt",
          .summary = "The subtitles that DJI's and Autel's aircraft write beside a video.",
          .make = [] { return std::unique_ptr<FixFormat>(new SrtFixes); },
          .known = tables};
}

}  // namespace terracast::geo
