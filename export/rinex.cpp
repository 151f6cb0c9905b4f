#include "export/rinex.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <map>
#include <set>
#include <vector>

#include "export/georeference.h"
#include "export/stream_columns.h"
#include "export/utc_stamps.h"
#include "geo/gps_time.h"
#include "geo/satellites/gps_constellation.h"
#include "geo/satellites/signal_delays.h"
#include "geo/sun.h"

namespace terracast::exporters {
namespace {

constexpr std::int64_t kStepsPerSecond = 10'000'000;  ///< stamps have seven decimals
constexpr double kWavelength_m = geo::kLight_mps / geo::kGpsL1_hz;

/// A line of a header: 60 columns and a label.
std::string labelled(const std::string& content, const std::string& label) {
  return fmt::format("{:<60}{}\n", content, label);
}

/// GPS time in steps of 100 ns since 1980-01-06, as the calendar of GPS time has it.
struct Calendar {
  std::chrono::year_month_day date;
  std::int64_t hour, minute, steps;  ///< steps of the minute

  explicit Calendar(std::int64_t gps_steps) {
    constexpr std::int64_t kDay_s = 86400;
    const std::int64_t second = gps_steps / kStepsPerSecond;
    date =
        std::chrono::sys_days(std::chrono::year(1980) / 1 / 6) + std::chrono::days(second / kDay_s);
    hour = second % kDay_s / 3600;
    minute = second % 3600 / 60;
    steps = gps_steps % (60 * kStepsPerSecond);
  }
  int year() const { return static_cast<int>(date.year()); }
  unsigned month() const { return static_cast<unsigned>(date.month()); }
  unsigned day() const { return static_cast<unsigned>(date.day()); }
  /// "0.0000000", without rounding.
  std::string seconds(int width) const {
    return fmt::format(
        "{:>{}}", fmt::format("{}.{:07}", steps / kStepsPerSecond, steps % kStepsPerSecond), width);
  }
};

/// A satellite's signals at an epoch.
struct Observation {
  int prn = 0;
  double pseudorange_m = 0.0, carrier_cycles = 0.0, doppler_hz = 0.0;
};

/// Epochs of a receiver, in the order of time.
struct Observations {
  std::map<std::int64_t, std::vector<Observation>> by_stamp;  ///< in steps of GPS time
  std::set<std::int64_t> toes_s;
};

/// Start of a sequence in GPS time.
struct Start {
  std::int64_t steps = 0;
  double rest_s = 0.0;  ///< beyond them

  explicit Start(const std::string& utc_start) {
    const double unix_s = geo::unix_seconds_from_utc(utc_start);
    const double gps_minus_unix_s = std::round(geo::gps_seconds_from_unix(unix_s) - unix_s);
    const std::int64_t unix_ns = unix_nanoseconds(utc_start, 0.0);
    steps = unix_ns / 100 + static_cast<std::int64_t>(gps_minus_unix_s) * kStepsPerSecond;
    rest_s = 1e-9 * static_cast<double>(unix_ns % 100);
  }
};

Observations observations_of(const capture::SequenceReader& sequence, int stream_index) {
  const capture::StreamInfo& stream =
      sequence.info().streams[static_cast<std::size_t>(stream_index)];
  const StreamColumns columns(stream);
  const std::size_t prn = columns.at("prn"), visible = columns.at("is_visible"),
                    pseudorange = columns.at("pseudorange_m"),
                    carrier = columns.at("carrier_cycles"), doppler = columns.at("doppler_hz"),
                    clock = columns.at("receiver_clock_s");
  const Start start(sequence.info().utc_start);
  Observations all;
  for (int frame = 0; frame < sequence.info().num_frames; ++frame) {
    const capture::Samples rows = sequence.read_samples(stream_index, frame);
    for (std::size_t row = 0; row < rows.times_s.size(); ++row) {
      const double* values = &rows.values[row * stream.channels.size()];
      const double time_s = rows.times_s[row];
      all.toes_s.insert(static_cast<std::int64_t>(
          geo::toe_of(static_cast<double>(start.steps) / kStepsPerSecond + time_s)));
      // What the receiver's clock shows, in whole steps; what is left over goes out of the ranges.
      const double shown_s = start.rest_s + time_s + values[clock];
      const std::int64_t steps = std::llround(shown_s * static_cast<double>(kStepsPerSecond));
      const double left_m =
          geo::kLight_mps * (shown_s - static_cast<double>(steps) / kStepsPerSecond);
      // Of an epoch without satellites there is an entry too: what it had tracked is lost.
      std::vector<Observation>& epoch = all.by_stamp[start.steps + steps];
      if (values[visible] == 0.0) continue;
      epoch.push_back(
          {.prn = static_cast<int>(values[prn]),
           .pseudorange_m = values[pseudorange] - left_m,
           .carrier_cycles = values[carrier] - left_m / kWavelength_m,
           .doppler_hz = values[doppler]});
    }
  }
  return all;
}

std::string heads(const std::string& kind, const std::string& utc_start) {
  std::string day = utc_start.substr(0, 19);
  std::erase_if(day, [](char c) { return c == '-' || c == ':'; });
  std::replace(day.begin(), day.end(), 'T', ' ');
  return labelled(fmt::format("{:9.2f}{:11}{:<20}{}", 3.04, "", kind, "G: GPS"),
                  "RINEX VERSION / TYPE") +
         labelled(fmt::format("{:<20}{:<20}{} UTC", "terracast", "", day), "PGM / RUN BY / DATE");
}

std::string observations_text(const Observations& all, const capture::SequenceReader& sequence,
                              const capture::StreamInfo& stream) {
  const Eigen::Vector3d about = geo::ecef_from_geodetic(local_frame(sequence).origin);
  const auto seen = std::find_if(all.by_stamp.begin(), all.by_stamp.end(),
                                 [](const auto& epoch) { return !epoch.second.empty(); });
  const Calendar first(seen == all.by_stamp.end() ? Start(sequence.info().utc_start).steps
                                                  : seen->first);
  std::string text = heads("OBSERVATION DATA", sequence.info().utc_start);
  text += labelled("synthetic: a simulated receiver among simulated satellites", "COMMENT");
  text += labelled(stream.name.substr(0, 60), "MARKER NAME");
  text += labelled("NON_GEODETIC", "MARKER TYPE");
  text += labelled(fmt::format("{:<20}{:<40}", "terracast", "terracast"), "OBSERVER / AGENCY");
  text += labelled(fmt::format("{:<20}{:<20}{:<20}", "1", "terracast", "1"), "REC # / TYPE / VERS");
  text += labelled(fmt::format("{:<20}{:<20}", "1", "NONE"), "ANT # / TYPE");
  text += labelled(fmt::format("{:14.4f}{:14.4f}{:14.4f}", about.x(), about.y(), about.z()),
                   "APPROX POSITION XYZ");
  text += labelled(fmt::format("{:14.4f}{:14.4f}{:14.4f}", 0.0, 0.0, 0.0), "ANTENNA: DELTA H/E/N");
  text += labelled("G    3 C1C L1C D1C", "SYS / # / OBS TYPES");
  text += labelled(fmt::format("{:10.3f}", 1.0 / stream.rate_hz), "INTERVAL");
  text += labelled(fmt::format("{:6}{:6}{:6}{:6}{:6}{}     GPS", first.year(), first.month(),
                               first.day(), first.hour, first.minute, first.seconds(13)),
                   "TIME OF FIRST OBS");
  text += labelled("G L1C", "SYS / PHASE SHIFT");
  text += labelled("", "END OF HEADER");

  std::set<int> tracked;  // in the epoch before
  for (const auto& [stamp, satellites] : all.by_stamp) {
    if (satellites.empty()) {
      tracked.clear();
      continue;
    }
    const Calendar at(stamp);
    text += fmt::format("> {:4} {:02} {:02} {:02} {:02}{}  0{:3}\n", at.year(), at.month(),
                        at.day(), at.hour, at.minute, at.seconds(11), satellites.size());
    std::set<int> here;
    for (const Observation& one : satellites) {
      // A satellite that comes back has been lost: its whole number of waves is to be sought anew.
      const bool is_new = !tracked.contains(one.prn);
      text += fmt::format("G{:02}{:14.3f}  {:14.3f}{} {:14.3f}\n", one.prn, one.pseudorange_m,
                          one.carrier_cycles, is_new ? '1' : ' ', one.doppler_hz);
      here.insert(one.prn);
    }
    tracked = std::move(here);
  }
  return text;
}

/// A number of 19 columns, as Fortran writes it.
std::string d19(double value) {
  std::string text = fmt::format("{:19.12e}", value);
  std::replace(text.begin(), text.end(), 'e', 'D');
  return text;
}

std::string orbit_text(const geo::BroadcastOrbit& orbit) {
  const auto toe_s = static_cast<std::int64_t>(orbit.toe_gps_s);
  const Calendar at(toe_s * kStepsPerSecond);
  const double in_week_s = std::fmod(orbit.toe_gps_s, geo::kGpsWeek_s);
  const double week = std::floor(orbit.toe_gps_s / geo::kGpsWeek_s);
  constexpr double kFit_h = 4.0;
  constexpr double kAccuracy_m = 2.0;
  // Issues of data have eight bits.
  const double issue =
      static_cast<double>(toe_s / static_cast<std::int64_t>(geo::kOrbitInterval_s) % 256);
  std::string text =
      fmt::format("G{:02} {:4} {:02} {:02} {:02} {:02} {:02}", orbit.prn, at.year(), at.month(),
                  at.day(), at.hour, at.minute, at.steps / kStepsPerSecond) +
      d19(orbit.af0_s) + d19(orbit.af1) + d19(orbit.af2_per_s) + "\n";
  for (const auto& row :
       {std::array{issue, orbit.crs_m, orbit.delta_n_radps, orbit.m0_rad},
        std::array{orbit.cuc_rad, orbit.eccentricity, orbit.cus_rad, orbit.sqrt_a},
        std::array{in_week_s, orbit.cic_rad, orbit.omega0_rad, orbit.cis_rad},
        std::array{orbit.i0_rad, orbit.crc_m, orbit.omega_rad, orbit.omega_dot_radps},
        std::array{orbit.idot_radps, 0.0, week, 0.0}, std::array{kAccuracy_m, 0.0, 0.0, issue},
        std::array{in_week_s - 0.5 * geo::kOrbitInterval_s, kFit_h, 0.0, 0.0}}) {
    text += "    ";
    for (const double value : row) text += d19(value);
    text += "\n";
  }
  return text;
}

std::string navigation_text(const Observations& all, const capture::SequenceReader& sequence) {
  const geo::KlobucharModel model = geo::klobuchar_of_2004();
  const double unix_s = geo::unix_seconds_from_utc(sequence.info().utc_start);
  std::string text = heads("N: GNSS NAV DATA", sequence.info().utc_start);
  for (const auto& [name, numbers] : {std::pair{"GPSA", model.alpha}, {"GPSB", model.beta}}) {
    std::string line = fmt::format("{} ", name);
    for (const double number : numbers) line += fmt::format("{:12.4e}", number);
    std::replace(line.begin() + 4, line.end(), 'e', 'D');
    text += labelled(line, "IONOSPHERIC CORR");
  }
  text +=
      labelled(fmt::format("{:6}", static_cast<int>(geo::gps_minus_utc_s(unix_s))), "LEAP SECONDS");
  text += labelled("", "END OF HEADER");
  for (const std::int64_t toe_s : all.toes_s)
    for (const geo::BroadcastOrbit& orbit : geo::baseline_constellation(static_cast<double>(toe_s)))
      text += orbit_text(orbit);
  return text;
}

}  // namespace

void write_observations(DatasetWriter& writer, const std::string& folder,
                        const capture::SequenceReader& sequence) {
  for (std::size_t i = 0; i < sequence.info().streams.size(); ++i) {
    const capture::StreamInfo& stream = sequence.info().streams[i];
    if (stream.kind != "gnss_observations") continue;
    const std::string path = fmt::format("{}/sensors/{}/{}", folder, stream.rig, stream.name);
    const Observations all = observations_of(sequence, static_cast<int>(i));
    writer.write_kept(path + "/observations.rnx",
                      [&] { return observations_text(all, sequence, stream); });
    writer.write_kept(path + "/navigation.rnx", [&] { return navigation_text(all, sequence); });
  }
}

}  // namespace terracast::exporters
