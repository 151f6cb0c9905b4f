#include "validate/navigation.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "geo/atmosphere.h"
#include "geo/geodesy.h"
#include "geo/magnetic_field.h"
#include "geo/sun.h"
#include "tests/jobs/draws.h"
#include "tests/support/test_data.h"
#include "validate/check.h"
#include "validate/checks/checker.h"
#include "validate/dataset.h"

/// Receivers, barometers and magnetometers of right and wrong datasets, whose samples are written here from a motion of
/// waves by the renderer's own models.
namespace terracast::validate {

std::unique_ptr<Checker> make_navigation_check(const ValidateOptions& options);

namespace {

using Eigen::AngleAxisd;
using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr geo::Geodetic kOrigin{.lat_deg = 46.5, .lon_deg = 8.0, .height_m = 600.0};
constexpr const char* kUtc = "2026-03-01T12:00:00Z";

double undulation_m(double lat_deg, double lon_deg) {
  return 52.0 + 3.0 * (lat_deg - 46.5) - 2.0 * (lon_deg - 8.0);
}

/// Places and angles that are sums of sines.
class WaveFlight {
 public:
  explicit WaveFlight(std::uint64_t seed) {
    test::Draws draws(seed, "motion");
    for (auto& wave : waves_)
      wave = {draws.between(0.5, 1.0), draws.between(0.2, 0.5), draws.between(0.0, 6.0)};
    speed_ = {draws.between(5.0, 20.0), draws.between(-5.0, 5.0), draws.between(1.0, 2.0)};
  }
  Pose local_from_body(double t) const {
    const auto wave = [&](std::size_t i, double size) {
      return size * waves_[i][0] * std::sin(waves_[i][1] * t + waves_[i][2]);
    };
    const Matrix3d rotation =
        (AngleAxisd(wave(3, 2.0), Vector3d::UnitZ()) * AngleAxisd(wave(4, 0.3), Vector3d::UnitY()) *
         AngleAxisd(wave(5, 0.5), Vector3d::UnitX()))
            .toRotationMatrix();
    return {rotation, speed_ * t + Vector3d(wave(0, 30.0), wave(1, 20.0), 200.0 + wave(2, 5.0))};
  }

 private:
  std::array<std::array<double, 3>, 6> waves_;
  Vector3d speed_;
};

/// The columns of a sample, which a mistake changes.
using Row = std::vector<double>;

/// What the wrong dataset has instead.
struct Mistake {
  bool leaves_out_arm = false;  ///< of places and altitudes
  bool leaves_out_arm_of_speed = false;
  int late = 0;  ///< samples
  double years = 0.0;
  bool has_geometric_heights = false;
  std::function<void(Row&)> change = [](Row&) {};
};

const Pose kMount{AngleAxisd(0.7, Vector3d(1.0, -2.0, 1.0).normalized()).toRotationMatrix(),
                  {0.9, -0.4, 1.3}};

/// Truth at a time, by the renderer's models.
Row row_of(const std::string& kind, const WaveFlight& flight, double t, std::uint64_t seed,
           const Mistake& mistake) {
  const geo::WorldFrame frame(kOrigin);
  const auto arm_of = [](bool is_left_out) {
    return is_left_out ? Vector3d::Zero() : kMount.translation;
  };
  const auto place = [&](double at, bool without_arm) -> Vector3d {
    return flight.local_from_body(at) * arm_of(without_arm);
  };
  const Vector3d here = place(t, mistake.leaves_out_arm);
  const geo::Geodetic geodetic = frame.geodetic_from_world(here);
  const double altitude_m = geodetic.height_m - undulation_m(geodetic.lat_deg, geodetic.lon_deg);
  if (kind == "barometer") {
    const double height_m =
        mistake.has_geometric_heights ? altitude_m : geo::geopotential_height_m(altitude_m);
    const double pressure_pa =
        geo::air_pressure_pa(height_m, {.sea_level_pressure_pa = 100500.0, .warmer_k = 12.0});
    return {pressure_pa + 3.0, pressure_pa, altitude_m};
  }
  if (kind == "magnetometer") {
    const double year = geo::decimal_year(geo::unix_seconds_from_utc(kUtc) + t) + mistake.years;
    const Vector3d world = frame.ecef_from_world().rotation.conjugate() *
                           geo::magnetic_field_ecef_nt(frame.ecef_from_world() * here, year);
    const Vector3d b = (flight.local_from_body(t).rotation * kMount.rotation).transpose() * world;
    return {b.x() + 100.0, b.y(), b.z(), b.x(), b.y(), b.z()};
  }
  // Of waves below 0.5 rad/s differences of the eighth order leave 1e-10 m/s.
  constexpr double kStep_s = 0.05;
  const auto across = [&](int k) -> Vector3d {
    return place(t + k * kStep_s, mistake.leaves_out_arm_of_speed) -
           place(t - k * kStep_s, mistake.leaves_out_arm_of_speed);
  };
  const Vector3d velocity =
      (across(1) * (4.0 / 5.0) - across(2) / 5.0 + across(3) * (4.0 / 105.0) - across(4) / 280.0) /
      kStep_s;
  const Vector3d enu = frame.world_from_enu(here).transpose() * velocity;
  test::Draws draws(seed + static_cast<std::uint64_t>(std::llround(1e3 * t)), "errors");
  const double off_m = draws.both_ways(2.0);
  return {geodetic.lat_deg,
          geodetic.lon_deg,
          geodetic.height_m + off_m,
          altitude_m + off_m,
          enu.y() + draws.both_ways(0.2),
          enu.x(),
          -enu.z(),
          1.0,
          1.5,
          0.1,
          0.1,
          1.0,
          geodetic.lat_deg,
          geodetic.lon_deg,
          geodetic.height_m,
          altitude_m,
          enu.y(),
          enu.x(),
          -enu.z()};
}

std::string channels_of(const std::string& kind) {
  std::vector<std::pair<std::string, std::string>> names;
  if (kind == "barometer")
    names = {{"pressure_pa", "Pa"}, {"true_pressure_pa", "Pa"}, {"true_altitude_msl_m", "m"}};
  for (const char* before : {"", "true_"}) {
    if (kind == "magnetometer")
      for (const char* axis : {"x", "y", "z"})
        names.emplace_back(fmt::format("{}field_{}_nt", before, axis), "nT");
    if (kind != "gnss") continue;
    for (const auto& [name, unit] :
         std::vector<std::pair<std::string, std::string>>{{"lat_deg", "deg"},
                                                          {"lon_deg", "deg"},
                                                          {"height_m", "m"},
                                                          {"altitude_msl_m", "m"},
                                                          {"velocity_north_mps", "m/s"},
                                                          {"velocity_east_mps", "m/s"},
                                                          {"velocity_down_mps", "m/s"}})
      names.emplace_back(before + name, unit);
    if (names.size() == 7)
      names.insert(names.end(), {{"sigma_horizontal_m", "m"},
                                 {"sigma_vertical_m", "m"},
                                 {"sigma_velocity_horizontal_mps", "m/s"},
                                 {"sigma_velocity_vertical_mps", "m/s"},
                                 {"fix", ""}});
  }
  std::vector<std::string> texts;
  for (const auto& [name, unit] : names)
    texts.push_back(fmt::format(R"({{"name": "{}", "unit": "{}"}})", name, unit));
  return fmt::format("{}", fmt::join(texts, ", "));
}

std::vector<CheckResult> results_of(const std::string& kind, std::uint64_t seed, double rate_hz,
                                    const Mistake& mistake = {}) {
  const test::ScratchFolder folder;
  const WaveFlight flight(seed);
  const std::string channels = channels_of(kind);
  std::string text = "time_s";
  for (std::size_t at = channels.find("\"name\": \""); at != std::string::npos;
       at = channels.find("\"name\": \"", at + 1))
    text += "," + channels.substr(at + 9, channels.find('"', at + 9) - at - 9);
  text += "\n";
  for (int k = 0; k < static_cast<int>(8.0 * rate_hz); ++k) {
    Row row = row_of(kind, flight, (k - mistake.late) / rate_hz, seed, mistake);
    mistake.change(row);
    text += fmt::format("{:.17g},{:.17g}\n", k / rate_hz, fmt::join(row, ","));
  }
  const Eigen::Quaterniond q(kMount.rotation);
  const std::string mount = fmt::format(
      R"({{"quaternion_wxyz": [{:.17g}, {:.17g}, {:.17g}, {:.17g}], "translation_m": [{}, {}, {}]}})",
      q.w(), q.x(), q.y(), q.z(), kMount.translation.x(), kMount.translation.y(),
      kMount.translation.z());
  test::write_text(folder.path() / "P000/sensors/rig/one.csv", text);
  test::write_text(folder.path() / "P000/sensors.json",
                   fmt::format(R"({{"frames": "body, rig and sensor: x forward, y left, z up",
"sensors": [{{"rig": "rig", "name": "one", "kind": "{}", "file": "sensors/rig/one.csv", "rate_hz": {},
"channels": [{}], "body_from_sensor": {}, "rig_from_sensor": {},
"settings_toml": "sea_level_pressure_pa = 100500.0\nwarmer_k = 12.0\n"}}]}})",
                               kind, rate_hz, channels, mount, mount));
  Dataset dataset;
  dataset.format = "terracast";
  dataset.root = folder.path();
  dataset.files["P000/sensors.json"] = {};
  dataset.files["P000/sensors/rig/one.csv"] = {};
  Sequence sequence;
  sequence.path = "P000";
  sequence.utc_start = kUtc;
  sequence.num_frames = 40;
  sequence.rate_hz = 5.0;
  sequence.origin = {kOrigin.lat_deg, kOrigin.lon_deg, kOrigin.height_m};
  Camera& camera = sequence.cameras.emplace_back();
  camera.body_from_camera = Pose{Matrix3d::Identity(), Vector3d::Zero()};
  for (int i = 0; i < sequence.num_frames; ++i)
    camera.local_from_camera.emplace_back(flight.local_from_body(i / sequence.rate_hz));
  ValidateOptions options;
  options.undulation_m = undulation_m;
  return make_navigation_check(options)->finish(dataset, sequence);
}

TEST(Navigation, ModelsAreThoseOfTheRenderer) {
  test::Draws draws(3, "places");
  for (int i = 0; i < 300; ++i) {
    const geo::Geodetic place{draws.both_ways(89.9), draws.both_ways(180.0),
                              draws.between(-400.0, 5e4)};
    const Vector3d ecef = geo::ecef_from_geodetic(place);
    const double year = draws.between(2015.0, 2030.0);
    EXPECT_LT((magnetic_field_ecef_nt(ecef, year) - geo::magnetic_field_ecef_nt(ecef, year)).norm(),
              1e-7);
    const double altitude_m = draws.between(-4000.0, 78000.0), warmer_k = draws.both_ways(30.0);
    const double pressure_pa =
        geo::air_pressure_pa(geo::geopotential_height_m(altitude_m),
                             {.sea_level_pressure_pa = 101000.0, .warmer_k = warmer_k});
    EXPECT_NEAR(standard_pressure_pa(altitude_m, 101000.0, warmer_k) / pressure_pa, 1.0, 1e-12);
    const double unix_s = draws.between(-1e9, 3e9);
    EXPECT_NEAR(decimal_year(unix_s), geo::decimal_year(unix_s), 1e-9);
  }
  EXPECT_TRUE(std::isnan(magnetic_field_ecef_nt({0.0, 0.0, 6.4e6}, 2030.0).x()));
}

TEST(Navigation, HoldsOfRightDatasets) {
  for (const char* kind : {"gnss", "barometer", "magnetometer"})
    for (std::uint64_t seed = 1; seed <= 8; ++seed)
      for (const double rate_hz : {5.0, 10.0, 25.0, 100.0}) {
        const std::vector<CheckResult> results = results_of(kind, seed, rate_hz);
        EXPECT_EQ(results.size(), kind == std::string("gnss")        ? 4U
                                  : kind == std::string("barometer") ? 2U
                                                                     : 1U);
        for (const CheckResult& result : results) {
          EXPECT_TRUE(result.ok) << seed << ", " << rate_hz << " Hz: " << result.name << " "
                                 << result.value << ", " << result.worst;
          EXPECT_FALSE(result.is_unseen) << kind << ", " << rate_hz << " Hz: " << result.name;
        }
      }
}

TEST(Navigation, FindsEachMistake) {
  struct Case {
    const char* name;
    const char* kind;
    const char* result;
    Mistake mistake;
  };
  Mistake arm, arm_of_speed, late, early, msl, enu, radians, up, shown_msl, sigma, fix, hecto,
      ellipsoidal, geometric, tomorrow, micro, swapped, negated;
  arm.leaves_out_arm = true;
  arm_of_speed.leaves_out_arm_of_speed = true;
  late.late = 1;
  early.late = -1;
  msl.change = [](Row& row) { row[14] = row[15]; };
  enu.change = [](Row& row) {
    std::swap(row[16], row[17]);
    row[18] = -row[18];
  };
  radians.change = [](Row& row) {
    for (const std::size_t i : {12U, 13U}) row[i] *= std::numbers::pi / 180.0;
  };
  up.change = [](Row& row) { row[18] = -row[18]; };
  shown_msl.change = [](Row& row) { row[2] = row[3]; };
  sigma.change = [](Row& row) { row[8] *= 0.1; };
  fix.change = [](Row& row) { row[11] = 2.0; };
  hecto.change = [](Row& row) { row[1] *= 0.01; };
  ellipsoidal.change = [](Row& row) { row[2] += 52.0; };
  geometric.has_geometric_heights = true;
  tomorrow.years = 1.0 / 365.0;
  micro.change = [](Row& row) {
    for (const std::size_t i : {3U, 4U, 5U}) row[i] *= 1e-3;
  };
  swapped.change = [](Row& row) { std::swap(row[3], row[4]); };
  negated.change = [](Row& row) { row[5] = -row[5]; };
  const std::vector<Case> cases = {
      {"no lever arm", "gnss", "navigation_position", arm},
      {"a sample late", "gnss", "navigation_position", late},
      {"a sample early", "gnss", "navigation_position", early},
      {"heights above the geoid", "gnss", "navigation_position", msl},
      {"radians", "gnss", "navigation_position", radians},
      {"no lever arm of velocities", "gnss", "navigation_velocity", arm_of_speed},
      {"east, north and up", "gnss", "navigation_velocity", enu},
      {"up for down", "gnss", "navigation_velocity", up},
      {"shown heights above the geoid", "gnss", "navigation_fixes", shown_msl},
      {"deviations too small", "gnss", "navigation_fixes", sigma},
      {"a fix that is none", "gnss", "navigation_fixes", fix},
      {"no lever arm", "gnss", "navigation_sea_level", arm},
      {"hectopascals", "barometer", "navigation_pressure", hecto},
      {"geometric heights", "barometer", "navigation_pressure", geometric},
      {"heights above the ellipsoid", "barometer", "navigation_sea_level", ellipsoidal},
      {"no lever arm", "barometer", "navigation_sea_level", arm},
      {"a sample late", "barometer", "navigation_sea_level", late},
      {"a day late", "magnetometer", "navigation_field", tomorrow},
      {"microtesla", "magnetometer", "navigation_field", micro},
      {"axes exchanged", "magnetometer", "navigation_field", swapped},
      {"a sign", "magnetometer", "navigation_field", negated},
      {"a sample late", "magnetometer", "navigation_field", late}};
  for (const Case& one : cases)
    for (std::uint64_t seed = 21; seed <= 23; ++seed)
      for (const double rate_hz : {10.0, 25.0}) {
        bool is_found = false;
        for (const CheckResult& result : results_of(one.kind, seed, rate_hz, one.mistake))
          is_found = is_found || (result.name == one.result && !result.ok);
        EXPECT_TRUE(is_found) << one.kind << ": " << one.name << ", " << seed << ", " << rate_hz
                              << " Hz";
      }
}

// Fields of another century have no model; of a sequence without poses nothing is seen.
TEST(Navigation, SaysWhatItCannotSee) {
  for (const CheckResult& result : results_of("gnss", 1, 5.0))
    EXPECT_FALSE(result.detects.empty()) << result.name;
  for (const CheckResult& result : results_of("gnss", 1, 0.7))
    EXPECT_TRUE(result.ok || result.is_unseen) << result.name << ", " << result.worst;
}

}  // namespace
}  // namespace terracast::validate
