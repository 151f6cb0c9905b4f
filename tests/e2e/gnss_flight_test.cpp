// Signals of satellites through the whole program: RTKLIB finds the antenna from the exported RINEX files, validate holds
// every row against the world and the orbits, and wrong rows are found.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <functional>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "core/atomic_file.h"
#include "core/json.h"
#include "tests/support/listed_files.h"
#include "tests/support/report_results.h"
#include "tests/support/run_program.h"
#include "tests/support/scan_table.h"
#include "tests/support/test_data.h"

namespace terracast::test {
namespace {

namespace fs = std::filesystem;
using core::Json;

/// In a valley of a rugged country, where ridges hide some satellites. Receivers: without errors and air, with a clock that
/// runs fast; with the air; with noise. The fix beside them has no errors and the same antenna.
constexpr const char* kJob = R"(name = "job"
world = {name = "job", seed = 5, origin_lat_deg = 42.5, origin_lon_deg = 1.5, size_m = 4096.0, elevation = [{kind = "procedural", relief_m = 2500.0, has_coast = false, landform = "valleys", vertical_datum = "egm96"}]}
detail.finest_spacing_m = 16.0
trajectories = [{name = "P000", kind = "orbit", centre = {east_m = 100.0, north_m = -200.0, height_m = 30.0, above = "ground"}, radius_m = 40.0, terrain_following = true, speed_mps = 12.0, rate_hz = 5.0, num_frames = 16, utc_start = "2025-06-21T10:59:58.123456789Z"}]
conditions.color_samples = 1

[[rigs]]
name = "down"
mount_pitch_deg = 60.0
cameras = [{name = "cam", width_px = 48, height_px = 36, fx_px = 45.0}]

[[rigs.sensors]]
name = "fix"
kind = "gnss"
rate_hz = 10.0
offset_mm = [300.0, -200.0, 700.0]

[[rigs.sensors]]
name = "bare"
kind = "gnss_observations"
rate_hz = 10.0
offset_mm = [300.0, -200.0, 700.0]
ionosphere = "none"
troposphere = "none"
clock_offset_us = 312.345
clock_drift_ppb = 250.0

[[rigs.sensors]]
name = "air"
kind = "gnss_observations"
rate_hz = 10.0
offset_mm = [300.0, -200.0, 700.0]
mask_deg = 10.0

[[rigs.sensors]]
name = "noisy"
kind = "gnss_observations"
rate_hz = 10.0
offset_mm = [300.0, -200.0, 700.0]
pseudorange_noise_m = 0.5
carrier_noise_mm = 2.0
doppler_noise_hz = 0.1

[[exports]]
format = "terracast"
)";

class GnssFlight : public testing::Test {
 protected:
  void SetUp() override {
    if (!fs::exists("/usr/share/proj/egm96_15.gtx"))
      GTEST_SKIP() << "no grid of EGM96: install proj-data";
    core::write_file(scratch_ / "job.toml", kJob);
    const ProgramResult run =
        run_program({"run", (scratch_ / "job.toml").string(), "--out", out().string(), "--quiet"});
    ASSERT_EQ(run.status, 0) << run.output;
  }
  fs::path out() const { return scratch_ / "out"; }
  fs::path dataset() const { return out() / "export/terracast"; }
  fs::path sensor(const std::string& name) const { return dataset() / "P000/sensors/down" / name; }
  const ScratchFolder& scratch() const { return scratch_; }

 private:
  ScratchFolder scratch_;
};

/// Coordinates of WGS84 by its defining numbers.
Eigen::Vector3d ecef_of(double lat_deg, double lon_deg, double height_m) {
  const double lat = lat_deg * std::acos(-1.0) / 180.0, lon = lon_deg * std::acos(-1.0) / 180.0;
  const double e2 = (2.0 - 1.0 / 298.257223563) / 298.257223563;
  const double n = 6378137.0 / std::sqrt(1.0 - e2 * std::pow(std::sin(lat), 2));
  return {(n + height_m) * std::cos(lat) * std::cos(lon),
          (n + height_m) * std::cos(lat) * std::sin(lon),
          (n * (1.0 - e2) + height_m) * std::sin(lat)};
}

/// True places of the antenna by tenths of a second, from the fixes' table.
std::map<int, Eigen::Vector3d> true_places(const fs::path& csv) {
  std::istringstream lines(core::read_text_file(csv));
  std::string line, cell;
  std::getline(lines, line);
  std::vector<std::string> names;
  for (std::istringstream cells(line); std::getline(cells, cell, ',');) names.push_back(cell);
  std::map<int, Eigen::Vector3d> places;
  while (std::getline(lines, line)) {
    std::map<std::string, double> row;
    std::size_t k = 0;
    for (std::istringstream cells(line); std::getline(cells, cell, ',');)
      row[names[k++]] = std::stod(cell);
    places[static_cast<int>(std::lround(10.0 * row["time_s"]))] =
        ecef_of(row["true_lat_deg"], row["true_lon_deg"], row["true_height_m"]);
  }
  return places;
}

/// Fixes that RTKLIB finds from the code alone, by tenths of a second since the sequence's start.
std::map<int, Eigen::Vector3d> rtklib_places(const fs::path& folder, const fs::path& work,
                                             const std::string& air) {
  core::write_file(work / "rtklib.conf",
                   "pos1-posmode=single\npos1-frequency=l1\npos1-elmask=5\npos1-sateph=brdc\n"
                   "pos1-navsys=1\nout-solformat=xyz\nout-outhead=off\nout-outopt=off\n"
                   "out-timesys=gpst\nout-timeform=tow\nout-timendec=7\n" +
                       air);
  const fs::path solution = work / "solution.pos";
  const ProgramResult run = run_command(
      "rnx2rtkp", {"-k", (work / "rtklib.conf").string(), "-o", solution.string(),
                   (folder / "observations.rnx").string(), (folder / "navigation.rnx").string()});
  EXPECT_EQ(run.status, 0) << run.output;
  std::map<int, Eigen::Vector3d> places;
  std::istringstream lines(core::read_text_file(solution));
  double week, tow_s, x, y, z;
  for (std::string line; std::getline(lines, line);) {
    if (line.empty() || line[0] == '%') continue;
    std::istringstream cells(line);
    if (!(cells >> week >> tow_s >> x >> y >> z)) continue;
    // 2025-06-21T10:59:58.123456789Z is a Saturday's, and GPS time is 18 s ahead.
    constexpr double kStart_s = 6 * 86400.0 + 10 * 3600.0 + 59 * 60.0 + 58.123456789 + 18.0;
    const double tenths = 10.0 * (tow_s - kStart_s);
    EXPECT_EQ(week, 2371.0);
    // It states times of the Earth: the receiver's clock is taken off, to the format's 100 ns.
    EXPECT_NEAR(tenths, std::round(tenths), 1e-5);
    places[static_cast<int>(std::lround(tenths))] = {x, y, z};
  }
  return places;
}

double worst_m(const std::map<int, Eigen::Vector3d>& found,
               const std::map<int, Eigen::Vector3d>& truth) {
  double worst = 0.0;
  for (const auto& [tenth, place] : found)
    worst = std::max(worst, truth.contains(tenth) ? (place - truth.at(tenth)).norm() : 1e9);
  return worst;
}

TEST_F(GnssFlight, RtklibFindsTheAntenna) {
  if (run_command("sh", {"-c", "command -v rnx2rtkp"}).status != 0)
    GTEST_SKIP() << "no rnx2rtkp: install rtklib";
  const std::map<int, Eigen::Vector3d> truth = true_places(sensor("fix.csv"));
  ASSERT_GE(truth.size(), 31U);
  // Pseudoranges of whole millimetres, and RTKLIB's own terms of the Earth's turn (0.4 mm).
  const auto bare =
      rtklib_places(sensor("bare"), scratch().path(), "pos1-ionoopt=off\npos1-tropopt=off\n");
  EXPECT_GE(bare.size(), 31U);
  EXPECT_LT(worst_m(bare, truth), 0.01);
  // Its troposphere takes heights above the ellipsoid for altitudes: 50 m, 14 mm at the zenith.
  const auto air =
      rtklib_places(sensor("air"), scratch().path(), "pos1-ionoopt=brdc\npos1-tropopt=saas\n");
  EXPECT_GE(air.size(), 31U);
  EXPECT_LT(worst_m(air, truth), 0.1);
  // The air matters: without its models the fix is metres off.
  EXPECT_GT(worst_m(rtklib_places(sensor("air"), scratch().path(),
                                  "pos1-ionoopt=off\npos1-tropopt=off\n"),
                    truth),
            1.0);
}

TEST_F(GnssFlight, RtklibReadsTheFixes) {
  if (run_command("sh", {"-c", "command -v pos2kml"}).status != 0)
    GTEST_SKIP() << "no pos2kml: install rtklib";
  const fs::path kml = scratch() / "fix.kml";
  const ProgramResult run =
      run_command("pos2kml", {"-a", "-o", kml.string(), sensor("fix.nmea").string()});
  ASSERT_EQ(run.status, 0) << run.output;
  std::istringstream lines(core::read_text_file(kml));
  std::string line;
  std::vector<Eigen::Vector3d> places;
  while (std::getline(lines, line) && line.find("<coordinates>") == std::string::npos) {
  }
  double lon, lat, height;
  while (std::getline(lines, line) &&
         std::sscanf(line.c_str(), "%lf,%lf,%lf", &lon, &lat, &height) == 3)
    places.push_back(ecef_of(lat, lon, height));
  const std::map<int, Eigen::Vector3d> truth = true_places(sensor("fix.csv"));
  // It leaves out fixes at one place; these are all apart. Nine decimals of a degree, three of a metre.
  ASSERT_EQ(places.size(), truth.size());
  for (std::size_t k = 0; k < places.size(); ++k)
    EXPECT_LT((places[k] - truth.at(static_cast<int>(k))).norm(), 1e-3) << k;
}

TEST_F(GnssFlight, HoldsAndWrongRowsAreFound) {
  const std::vector<std::string> results = {
      "signals",        "signals_observables", "signals_range",  "signals_range_rate",
      "signals_orbits", "signals_rinex",       "signals_hidden", "navigation_nmea",
      "signals_air"};
  for (const std::string& name : results) {
    const Json result = result_in(out() / "report/terracast", name);
    EXPECT_TRUE(result.at("ok").boolean()) << name << ": " << result.at("worst").string();
    EXPECT_FALSE(result.at("skipped").boolean()) << name;
  }
  // The valley hides some satellites and leaves others.
  double visible = 0.0, hidden = 0.0;
  const ScanTable rows(sensor("bare/000000.npy"));
  for (std::size_t row = 0; row < rows.size(); ++row)
    (rows.get("is_visible", row) == 1.0 ? visible : hidden) += 1.0;
  EXPECT_GT(visible, 0.0);
  EXPECT_GT(hidden, 0.0);

  struct Mistake {
    std::string result, name;
    std::function<void(const fs::path& folder)> spoil;
  };
  const auto in_rows = [](const std::string& column,
                          const std::function<double(std::size_t, double)>& change) {
    return [=](const fs::path& folder) {
      for (int frame = 0; frame < 16; ++frame)
        ScanTable(folder / fmt::format("{:06}.npy", frame)).map(column, change);
    };
  };
  // The first place behind some words.
  const auto in_text = [](const std::string& file, const std::string& behind,
                          const std::string& from, const std::string& to) {
    return [=](const fs::path& folder) {
      std::string text = core::read_text_file(folder / file);
      const std::size_t at = text.find(from, text.find(behind));
      ASSERT_NE(at, std::string::npos);
      core::write_file(folder / file, text.replace(at, from.size(), to));
    };
  };
  constexpr double kRadian = 57.29577951308232;
  const std::vector<Mistake> mistakes = {{"signals_observables", "a metre in the code",
                                          in_rows("pseudorange_m",
                                                  [](std::size_t, double m) { return m + 1.0; })},
                                         {"signals_observables", "metres for cycles",
                                          in_rows("carrier_cycles",
                                                  [](std::size_t, double n) {
                                                    return n * 0.1902936728;
                                                  })},
                                         {"signals_observables", "half a cycle",
                                          in_rows("carrier_cycles",
                                                  [](std::size_t row, double n) {
                                                    return row % 2 == 1 ? n + 0.5 : n;
                                                  })},
                                         {"signals_observables", "Doppler of the other sign",
                                          in_rows("doppler_hz",
                                                  [](std::size_t, double hz) { return -hz; })},
                                         {"signals_range", "directions from the east",
                                          in_rows(
                                              "azimuth_deg",
                                              [](std::size_t, double deg) { return 90.0 - deg; })},
                                         {"signals_range", "radians",
                                          in_rows("elevation_deg",
                                                  [](std::size_t, double deg) {
                                                    return deg / kRadian;
                                                  })},
                                         {"signals_range_rate",
                                          "a rate without the receiver's speed",
                                          in_rows(
                                              "true_range_rate_mps",
                                              [](std::size_t, double mps) { return mps + 3.0; })},
                                         {"signals_orbits", "a satellite's clock",
                                          in_rows("satellite_clock_s",
                                                  [](std::size_t, double s) { return s + 1e-9; })},
                                         {"signals",
                                          "a clock that gains less than its settings say",
                                          in_rows("receiver_clock_s",
                                                  [](std::size_t, double s) {
                                                    return s * (1.0 - 1e-6);
                                                  })},
                                         {"signals_air", "an ionosphere where there is none",
                                          in_rows("ionosphere_m",
                                                  [](std::size_t, double m) { return m + 1e-3; })},
                                         {"signals_hidden", "other things hide satellites",
                                          in_rows("blocked_by_instance_id",
                                                  [](std::size_t, double id) { return id + 1.0; })},
                                         {"signals_hidden", "everything is visible",
                                          in_rows("is_visible",
                                                  [](std::size_t, double) { return 1.0; })},
                                         {"signals", "dilution of four decimals",
                                          in_rows("pdop", [](std::size_t,
                                                             double dop) { return dop * 1.001; })},
                                         {"signals_orbits", "another node",
                                          in_text("navigation.rnx", "G10", "D-09", "D-08")},
                                         {"navigation_nmea", "a place without its checksum",
                                          in_text("../fix.nmea", "$GPGGA", "$GPGGA", "$GPGGB")},
                                         {"signals_rinex", "a loss that was none",
                                          [](const fs::path& folder) {
                                            std::string text =
                                                core::read_text_file(folder / "observations.rnx");
                                            // Behind the carrier of the first satellite.
                                            char& indicator =
                                                text[text.find("\nG", text.find("\n> ")) + 1 + 33];
                                            EXPECT_EQ(indicator, '1');
                                            indicator = ' ';
                                            core::write_file(folder / "observations.rnx", text);
                                          }},
                                         {"signals_rinex", "another system of satellites",
                                          in_text("observations.rnx", "> ", "G", "R")}};
  for (const Mistake& mistake : mistakes) {
    const fs::path copy = scratch() / "copy";
    fs::remove_all(copy);
    fs::copy(dataset(), copy, fs::copy_options::recursive);
    mistake.spoil(copy / "P000/sensors/down/bare");
    list_files_again(copy);
    const ProgramResult validated =
        run_program({"validate", copy.string(), "--world", (out() / "world").string(), "--report",
                     (scratch() / "report").string(), "--quiet"});
    EXPECT_EQ(validated.status, 1) << mistake.name << ": " << validated.output;
    EXPECT_FALSE(result_in(scratch() / "report", mistake.result).at("ok").boolean())
        << mistake.name;
  }
}

}  // namespace
}  // namespace terracast::test
