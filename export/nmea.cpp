#include "export/nmea.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>

#include "export/stream_columns.h"
#include "export/utc_stamps.h"

namespace terracast::exporters {
namespace {

/// "$…*CS\r\n": the checksum is all characters' exclusive or.
std::string sentence(const std::string& words) {
  unsigned sum = 0;
  for (const char letter : words) sum ^= static_cast<unsigned char>(letter);
  return fmt::format("${}*{:02X}\r\n", words, sum);
}

/// Degrees and minutes: "4229.9100000,N". Minutes are rounded as a whole, so that none is 60.
std::string angle(double deg, int degree_digits, const char* positive, const char* negative) {
  constexpr std::int64_t kPerMinute = 10'000'000;
  const std::int64_t parts = std::llround(std::abs(deg) * 60.0 * static_cast<double>(kPerMinute));
  const std::int64_t degrees = parts / (60 * kPerMinute);
  const std::int64_t minutes = parts % (60 * kPerMinute);
  return fmt::format("{:0{}}{:02}.{:07},{}", degrees, degree_digits, minutes / kPerMinute,
                     minutes % kPerMinute, deg < 0.0 ? negative : positive);
}

/// A fix as it is shown, and when.
struct Fix {
  std::string day;   ///< "210625"
  std::string time;  ///< "105958.123", UTC
  double lat_deg = 0.0, lon_deg = 0.0, height_m = 0.0, altitude_msl_m = 0.0;
  double north_mps = 0.0, east_mps = 0.0;
  double sigma_horizontal_m = 0.0, sigma_vertical_m = 0.0;
  int kind = 1;  ///< of GGA: 1 single, 4 fixed, 5 floating

  std::string place() const {
    return angle(lat_deg, 2, "N", "S") + "," + angle(lon_deg, 3, "E", "W");
  }
};

/// Day and time of "2025-06-21 10:59:58.123456789": milliseconds, or all nine decimals where they do not say it.
void stamp(const std::string& utc, Fix& fix) {
  fix.day = utc.substr(8, 2) + utc.substr(5, 2) + utc.substr(2, 2);
  const std::string decimals = utc.substr(20, 9);
  fix.time = utc.substr(11, 2) + utc.substr(14, 2) + utc.substr(17, 2) + "." +
             (decimals.ends_with("000000") ? decimals.substr(0, 3) : decimals);
}

std::string sentences(const Fix& fix) {
  constexpr double kKnot_mps = 1852.0 / 3600.0;
  const double speed_knots = std::hypot(fix.north_mps, fix.east_mps) / kKnot_mps;
  constexpr double kStep_deg = 1e-4;
  double course_deg = std::atan2(fix.east_mps, fix.north_mps) * 180.0 / std::numbers::pi;
  if (course_deg < 0.0) course_deg += 360.0;
  // None is 360, and none -0.
  if (!(course_deg > 0.0) || course_deg >= 360.0 - 0.5 * kStep_deg) course_deg = 0.0;
  // The day first, which readers want before a fix. Satellites and dilution are not modelled: their cells are empty.
  return sentence(fmt::format("GPRMC,{},A,{},{:.4f},{:.4f},{},,,{}", fix.time, fix.place(),
                              speed_knots, course_deg, fix.day,
                              fix.kind == 4   ? "R"
                              : fix.kind == 5 ? "F"
                                              : "A")) +
         sentence(fmt::format("GPGGA,{},{},{},,,{:.4f},M,{:.4f},M,,", fix.time, fix.place(),
                              fix.kind, fix.altitude_msl_m, fix.height_m - fix.altitude_msl_m)) +
         sentence(fmt::format("GPGST,{},,,,,{:.4f},{:.4f},{:.4f}", fix.time, fix.sigma_horizontal_m,
                              fix.sigma_horizontal_m, fix.sigma_vertical_m));
}

std::string nmea_text(const capture::StreamInfo& stream, const std::string& utc_start,
                      const capture::Samples& samples) {
  const StreamColumns columns(stream);
  const std::size_t lat = columns.at("lat_deg"), lon = columns.at("lon_deg"),
                    height = columns.at("height_m"), altitude = columns.at("altitude_msl_m"),
                    north = columns.at("velocity_north_mps"),
                    east = columns.at("velocity_east_mps"),
                    horizontal = columns.at("sigma_horizontal_m"),
                    vertical = columns.at("sigma_vertical_m"), kind = columns.at("fix");
  std::string text;
  for (std::size_t i = 0; i < samples.times_s.size(); ++i) {
    const double* row = &samples.values[i * stream.channels.size()];
    Fix fix{.day = {},
            .time = {},
            .lat_deg = row[lat],
            .lon_deg = row[lon],
            .height_m = row[height],
            .altitude_msl_m = row[altitude],
            .north_mps = row[north],
            .east_mps = row[east],
            .sigma_horizontal_m = row[horizontal],
            .sigma_vertical_m = row[vertical],
            .kind = static_cast<int>(row[kind])};
    stamp(utc_with_nanoseconds(utc_start, samples.times_s[i]), fix);
    text += sentences(fix);
  }
  return text;
}

}  // namespace

void write_fixes(DatasetWriter& writer, const std::string& folder,
                 const capture::SequenceReader& sequence) {
  for (std::size_t i = 0; i < sequence.info().streams.size(); ++i) {
    const capture::StreamInfo& stream = sequence.info().streams[i];
    if (stream.kind != "gnss") continue;
    writer.write_kept(fmt::format("{}/sensors/{}/{}.nmea", folder, stream.rig, stream.name), [&] {
      return nmea_text(stream, sequence.info().utc_start,
                       sequence.read_samples(static_cast<int>(i)));
    });
  }
}

}  // namespace terracast::exporters
