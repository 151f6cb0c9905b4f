#include "validate/readers/rinex.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "core/error.h"
#include "core/printable.h"
#include "validate/text.h"

namespace terracast::validate {
namespace {

using core::ErrorKind;
using core::fail;

constexpr std::int64_t kSteps = 10'000'000;
constexpr std::int64_t kDay_s = 86400;

/// Lines of a file, one after the other.
class Lines {
 public:
  Lines(std::string_view text, std::string where)
      : lines_(split_lines(text)), where_(std::move(where)) {}

  bool is_at_end() const { return next_ >= lines_.size(); }
  std::string_view take() {
    if (is_at_end()) fail(ErrorKind::Input, "{}: it ends in the middle of a record", where_);
    return lines_[next_++].text;
  }
  /// Of the line that was taken last.
  std::string where() const { return fmt::format("{}:{}", where_, next_); }
  [[noreturn]] void wrong(std::string_view why) const {
    fail(ErrorKind::Input, "{}: {}", where(), why);
  }

  std::string_view cell(std::string_view line, std::size_t begin, std::size_t width) const {
    return line.size() <= begin ? std::string_view() : line.substr(begin, width);
  }
  double number(std::string_view line, std::size_t begin, std::size_t width) const {
    std::string text(trimmed(cell(line, begin, width)));
    std::replace(text.begin(), text.end(), 'D', 'e');
    return parse_number(text, where());
  }
  std::int64_t integer(std::string_view line, std::size_t begin, std::size_t width) const {
    return parse_integer(trimmed(cell(line, begin, width)), where());
  }

 private:
  std::vector<TextLine> lines_;
  std::string where_;
  std::size_t next_ = 0;
};

/// Reads the header up to its end.
/// kind       that the first line must have at column 20
/// observed   the line of the types of observations; empty: none is wanted
void read_header(Lines& lines, char kind, std::string_view observed,
                 RinexNavigation* navigation = nullptr) {
  const std::string_view first = lines.take();
  if (lines.cell(first, 60, 20) != "RINEX VERSION / TYPE" || lines.number(first, 0, 9) != 3.04 ||
      lines.cell(first, 20, 1) != std::string_view(&kind, 1) || lines.cell(first, 40, 1) != "G")
    lines.wrong("no first line of RINEX 3.04 of GPS and this kind");
  bool has_types = observed.empty();
  for (;;) {
    const std::string_view line = lines.take();
    const std::string_view label = trimmed(lines.cell(line, 60, 20));
    if (label == "END OF HEADER") break;
    if (label == "IONOSPHERIC CORR" && navigation != nullptr) {
      const std::string_view name = lines.cell(line, 0, 4);
      if (name != "GPSA" && name != "GPSB") lines.wrong("no numbers of Klobuchar's model");
      for (std::size_t k = 0; k < 4; ++k)
        (name == "GPSA" ? navigation->alpha : navigation->beta)[k] =
            lines.number(line, 5 + 12 * k, 12);
    }
    if (label != "SYS / # / OBS TYPES") continue;
    if (has_types || trimmed(lines.cell(line, 0, 60)) != observed)
      lines.wrong("other observations than C1C, L1C and D1C");
    has_types = true;
  }
  if (!has_types) lines.wrong("no types of observations are stated");
}

/// Days since 1970 of a date of the proleptic calendar.
std::int64_t days_from_civil(std::int64_t year, std::int64_t month, std::int64_t day) {
  const std::int64_t y = month > 2 ? year : year - 1;
  const std::int64_t era = y / 400, of_era = y - era * 400;
  const std::int64_t of_year = (153 * (month + (month > 2 ? -3 : 9)) + 2) / 5 + day - 1;
  return era * 146097 + of_era * 365 + of_era / 4 - of_era / 100 + of_year - 719468;
}

/// Seconds of GPS time of a date and a time to the minute.
std::int64_t gps_seconds(const Lines& lines, std::int64_t year, std::int64_t month,
                         std::int64_t day, std::int64_t hour, std::int64_t minute) {
  if (year < 1980 || year > 9999 || month < 1 || month > 12 || day < 1 || day > 31 || hour < 0 ||
      hour > 23 || minute < 0 || minute > 59)
    lines.wrong("no such time");
  constexpr std::int64_t kGpsEpoch_days = 3657;  // 1980-01-06
  return (days_from_civil(year, month, day) - kGpsEpoch_days) * kDay_s + hour * 3600 + minute * 60;
}

int prn_of(const Lines& lines, std::string_view line) {
  const std::int64_t prn = lines.integer(line, 1, 2);
  if (lines.cell(line, 0, 1) != "G" || prn < 1 || prn > 32) lines.wrong("no satellite of GPS");
  return static_cast<int>(prn);
}

}  // namespace

std::vector<RinexEpoch> parse_rinex_observations(std::string_view text, const std::string& where) {
  Lines lines(text, where);
  read_header(lines, 'O', "G    3 C1C L1C D1C");
  std::vector<RinexEpoch> epochs;
  while (!lines.is_at_end()) {
    const std::string_view head = lines.take();
    if (lines.cell(head, 0, 2) != "> ") lines.wrong("no epoch begins");
    RinexEpoch epoch;
    const std::int64_t minutes_s = gps_seconds(
        lines, lines.integer(head, 2, 4), lines.integer(head, 7, 2), lines.integer(head, 10, 2),
        lines.integer(head, 13, 2), lines.integer(head, 16, 2));
    // Seven decimals, which a double of GPS time does not hold.
    const std::int64_t second = lines.integer(head, 18, 3), part = lines.integer(head, 22, 7);
    if (lines.cell(head, 21, 1) != "." || second < 0 || second > 59 || part < 0)
      lines.wrong("seconds are not of the form 00.0000000");
    epoch.gps_steps = (minutes_s + second) * kSteps + part;
    if (lines.integer(head, 29, 3) != 0) lines.wrong("an epoch's flag is not 0");
    const std::int64_t count = lines.integer(head, 32, 3);
    if (count < 1 || count > 32) lines.wrong("an epoch has no satellite, or more than 32");
    for (std::int64_t k = 0; k < count; ++k) {
      const std::string_view line = lines.take();
      RinexObservation one{.prn = prn_of(lines, line)};
      one.pseudorange_m = lines.number(line, 3, 14);
      one.carrier_cycles = lines.number(line, 19, 14);
      const std::string_view indicator = lines.cell(line, 33, 1);
      if (indicator != " " && indicator != "1") lines.wrong("an indicator of loss that is not 1");
      one.is_new = indicator == "1";
      one.doppler_hz = lines.number(line, 35, 14);
      epoch.satellites.push_back(one);
    }
    epochs.push_back(std::move(epoch));
  }
  return epochs;
}

RinexNavigation parse_rinex_navigation(std::string_view text, const std::string& where) {
  Lines lines(text, where);
  RinexNavigation navigation;
  read_header(lines, 'N', "", &navigation);
  while (!lines.is_at_end()) {
    const std::string_view head = lines.take();
    NavigationRecord record{.prn = prn_of(lines, head)};
    const std::int64_t second = lines.integer(head, 21, 2);
    const std::int64_t toc_s = gps_seconds(lines, lines.integer(head, 4, 4),
                                           lines.integer(head, 9, 2), lines.integer(head, 12, 2),
                                           lines.integer(head, 15, 2), lines.integer(head, 18, 2)) +
                               second;
    record.af0 = lines.number(head, 23, 19);
    record.af1 = lines.number(head, 42, 19);
    record.af2 = lines.number(head, 61, 19);
    std::array<std::array<double, 4>, 7> rows{};
    for (std::array<double, 4>& row : rows) {
      const std::string_view line = lines.take();
      for (std::size_t k = 0; k < 4; ++k) row[k] = lines.number(line, 4 + 19 * k, 19);
    }
    record.crs = rows[0][1], record.delta_n = rows[0][2], record.m0 = rows[0][3];
    record.cuc = rows[1][0], record.e = rows[1][1], record.cus = rows[1][2],
    record.sqrt_a = rows[1][3];
    record.toe_s = rows[2][0], record.cic = rows[2][1], record.omega0 = rows[2][2],
    record.cis = rows[2][3];
    record.i0 = rows[3][0], record.crc = rows[3][1], record.omega = rows[3][2],
    record.omega_dot = rows[3][3];
    record.idot = rows[4][0], record.week = rows[4][2];
    if (!(record.e >= 0.0 && record.e < 0.5) || !(record.sqrt_a > 1000.0 && record.sqrt_a < 1e4))
      lines.wrong("an orbit that no satellite has");
    if (record.toe_gps_s() != static_cast<double>(toc_s))
      lines.wrong("the time of the clock is another than that of the orbit");
    navigation.records.push_back(record);
  }
  return navigation;
}

}  // namespace terracast::validate
