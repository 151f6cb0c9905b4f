#include "validate/readers/nmea.h"

#include <fmt/format.h>

#include <cmath>

#include "core/error.h"
#include "validate/text.h"

namespace terracast::validate {
namespace {

using core::ErrorKind;
using core::fail;

/// The cells of a sentence.
class Sentence {
 public:
  /// name        "GPGGA"
  /// num_cells   behind the name
  Sentence(std::string_view line, std::string_view name, std::size_t num_cells, std::string where)
      : where_(std::move(where)) {
    if (line.size() < 4 || line.front() != '$' || line[line.size() - 3] != '*')
      wrong("no sentence of the form $…*CS");
    const std::string_view words = line.substr(1, line.size() - 4);
    unsigned sum = 0;
    for (const char letter : words) sum ^= static_cast<unsigned char>(letter);
    if (fmt::format("{:02X}", sum) != line.substr(line.size() - 2)) wrong("a wrong checksum");
    cells_ = split_at(words, ',');
    if (cells_.empty() || cells_.front() != name || cells_.size() != num_cells + 1)
      wrong(fmt::format("no {} with {} cells", name, num_cells));
  }
  [[noreturn]] void wrong(std::string_view why) const {
    fail(ErrorKind::Input, "{}: {}", where_, why);
  }
  std::string_view cell(std::size_t index) const { return cells_[index]; }
  double number(std::size_t index) const { return parse_number(cells_[index], where_); }

  /// Of a cell of degrees and minutes, and the letter of its half of the Earth behind it.
  double angle_deg(std::size_t index, std::size_t degree_digits, char positive,
                   char negative) const {
    const std::string_view text = cells_[index], half = cells_[index + 1];
    if (text.size() < degree_digits + 3 || half.size() != 1 ||
        (half[0] != positive && half[0] != negative))
      wrong("no angle of degrees and minutes");
    const auto degrees = static_cast<double>(parse_integer(text.substr(0, degree_digits), where_));
    const double minutes = parse_number(text.substr(degree_digits), where_);
    if (!(degrees >= 0.0) || !(minutes >= 0.0 && minutes < 60.0)) wrong("minutes beyond 60");
    const double deg = degrees + minutes / 60.0;
    return half[0] == negative ? -deg : deg;
  }

  /// UTC of "hhmmss.sss" of a day "ddmmyy".
  std::int64_t unix_ns(int century, std::string_view day, std::string_view time) const {
    if (day.size() != 6 || time.size() < 8 || time[6] != '.') wrong("no time of hhmmss.sss");
    return parse_utc_ns(
        fmt::format("{:02}{}-{}-{} {}:{}:{}", century, day.substr(4, 2), day.substr(2, 2),
                    day.substr(0, 2), time.substr(0, 2), time.substr(2, 2), time.substr(4)),
        where_);
  }

 private:
  std::string where_;
  std::vector<std::string_view> cells_;
};

}  // namespace

std::vector<NmeaFix> parse_nmea(std::string_view text, int century, const std::string& where) {
  const std::vector<TextLine> lines = split_lines(text);
  constexpr std::size_t kOfFix = 3;
  if (lines.size() % kOfFix != 0)
    fail(ErrorKind::Input, "{}: {} sentences, not RMC, GGA and GST of each fix", where,
         lines.size());
  std::vector<NmeaFix> fixes;
  for (std::size_t i = 0; i < lines.size(); i += kOfFix) {
    const auto place = [&](std::size_t k) {
      return fmt::format("{}:{}", where, lines[i + k].number);
    };
    const Sentence rmc(lines[i].text, "GPRMC", 12, place(0));
    const Sentence gga(lines[i + 1].text, "GPGGA", 14, place(1));
    const Sentence gst(lines[i + 2].text, "GPGST", 8, place(2));
    if (gga.cell(1) != rmc.cell(1) || gga.cell(1) != gst.cell(1))
      gga.wrong("another time than that of the fix's RMC or GST");
    for (std::size_t k = 0; k < 4; ++k)
      if (gga.cell(2 + k) != rmc.cell(3 + k)) gga.wrong("another place than that of the fix's RMC");
    if (rmc.cell(2) != "A" || rmc.cell(12).size() != 1) rmc.wrong("no valid fix");
    if (gga.cell(10) != "M" || gga.cell(12) != "M") gga.wrong("heights that are not in metres");
    constexpr double kKnot_mps = 1852.0 / 3600.0;
    fixes.push_back({.unix_ns = rmc.unix_ns(century, rmc.cell(9), rmc.cell(1)),
                     .lat_deg = gga.angle_deg(2, 2, 'N', 'S'),
                     .lon_deg = gga.angle_deg(4, 3, 'E', 'W'),
                     .altitude_msl_m = gga.number(9),
                     .undulation_m = gga.number(11),
                     .kind = static_cast<int>(parse_integer(gga.cell(6), place(1))),
                     .mode = rmc.cell(12)[0],
                     .speed_mps = rmc.number(7) * kKnot_mps,
                     .course_deg = rmc.number(8),
                     .sigma_lat_m = gst.number(6),
                     .sigma_lon_m = gst.number(7),
                     .sigma_height_m = gst.number(8)});
  }
  return fixes;
}

}  // namespace terracast::validate
