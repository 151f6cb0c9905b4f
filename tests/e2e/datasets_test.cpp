#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>

#include "core/json.h"
#include "core/log.h"
#include "geo/geodesy.h"
#include "geo/units.h"
#include "job/job.h"
#include "tests/e2e/tiny_job.h"
#include "tests/support/colmap_program.h"
#include "tests/support/record.h"
#include "tests/support/run_program.h"
#include "tests/support/test_data.h"

namespace terracast::test {
namespace {

namespace fs = std::filesystem;

const fs::path kConfigs = fs::path(TERRACAST_SOURCE_DIR) / "configs";

/// Every check of every format in a report holds, and the formats are those expected.
void expect_report_holds(const fs::path& report, const std::vector<std::string>& formats) {
  const core::Json json = core::Json::read(report / "report.json");
  EXPECT_TRUE(json.at("ok").boolean());
  for (const auto& format : formats) {
    int num_checks = 0;
    for (std::size_t i = 0; i < json.at("checks").size(); ++i) {
      const core::Json& check = json.at("checks").at(i);
      const std::string& name = check.at("name").string();
      if (name.rfind(format + "/", 0) != 0) continue;
      ++num_checks;
      EXPECT_TRUE(check.at("ok").boolean())
          << name << ": " << check.at("value").number() << " against " << check.at("bound").number()
          << " " << check.at("unit").string() << ", worst " << check.at("worst").string();
    }
    EXPECT_GE(num_checks, 4) << format;
    EXPECT_TRUE(fs::exists(report / format / "index.html"));
  }
  EXPECT_TRUE(fs::exists(report / "index.html"));
  EXPECT_TRUE(fs::exists(report / "map.png"));
}

/// Longitude and latitude on WGS84, as a .prj says it.
constexpr const char* kWgs84 =
    R"(GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563]],PRIMEM["Greenwich",0],UNIT["degree",0.0174532925199433]])";

const std::vector<std::string> kThreeFormats = {"tartanair", "kitti", "colmap"};
const std::vector<std::string> kAllFormats = {"tartanair", "tartanair_v1", "kitti", "kitti_raw",
                                              "colmap"};

/// Runs a shipped job and holds its formats against every check.
/// settings  of `--set`
void expect_job_holds(const std::string& config, const std::vector<std::string>& settings,
                      const fs::path& out, const std::vector<std::string>& formats,
                      double timeout_s) {
  std::vector<std::string> words = {"run", (kConfigs / config).string()};
  for (const std::string& setting : settings) words.insert(words.end(), {"--set", setting});
  words.insert(words.end(), {"--out", out.string(), "-q"});
  const auto run = run_program(words, {.timeout_s = timeout_s});
  ASSERT_EQ(run.status, 0) << run.output;
  expect_report_holds(out / "report", formats);
}

std::string data_setting() { return "data=" + shared_data().string(); }

/// Exports one rig of a captured job to COLMAP and asks the program COLMAP.
/// seeds  of free reconstructions
void expect_colmap_holds(const char* config, const fs::path& out, const std::string& rig,
                         const std::string& seeds, double timeout_s) {
  const auto exported = run_program(
      {"export", (kConfigs / config).string(), "--set", "data=" + shared_data().string(), "--set",
       fmt::format("exports.2.rigs=[\"{}\"]", rig), "--out", out.string(), "-q"},
      {.timeout_s = timeout_s});
  ASSERT_EQ(exported.status, 0) << exported.output;
  const auto validated = run_program(
      {"validate", (out / "export/colmap").string(), "--colmap", "sparse,georegister,free",
       "--colmap-seeds", seeds, "--report", (out / "report/colmap").string(), "-q"},
      {.timeout_s = timeout_s});
  EXPECT_EQ(validated.status, 0) << validated.output;
  for (const char* check :
       {"colmap_sparse_reprojection", "colmap_sparse_distance", "colmap_georegister_position",
        "colmap_free_ate", "colmap_free_rpe", "colmap_free_scale_drift", "colmap_free_registered"})
    EXPECT_NE(validated.output.find(fmt::format("ok      {}", check)), std::string::npos) << check;
}

TEST(Climb, TwoFramesPassEveryCheckInAllFormats) {
  const ScratchFolder scratch;
  expect_job_holds("all_formats.toml", {"trajectories.0.num_frames=2"}, scratch / "out",
                   kAllFormats, 2500.0);
}

TEST(ClimbFull, PassesEveryCheckInAllFormats) {
  TERRACAST_NEEDS_FULL();
  const ScratchFolder scratch;
  expect_job_holds("all_formats.toml", {}, scratch / "out", kAllFormats, 7000.0);
  record_job("all_formats", scratch / "out");
}

TEST(ClimbFull, PassesEveryCheckADegreeOfLatitudeFurtherNorth) {
  TERRACAST_NEEDS_FULL();
  const ScratchFolder scratch;
  expect_job_holds("all_formats.toml", {"world.origin_lat_deg=44.0"}, scratch / "out", kAllFormats,
                   7000.0);
  record_job("all_formats_44_north", scratch / "out");
}

// Two frames over coarse ground: laying out the country, all that stands on it included, takes most of the time.
TEST(Demo, TwoFramesPassEveryCheckInThreeFormats) {
  const ScratchFolder scratch;
  expect_job_holds(
      "demo.toml",
      {"trajectories.0.num_frames=2", "detail.cell_px=16", "detail.finest_spacing_m=8.0"},
      scratch / "out", kThreeFormats, 2500.0);
}

TEST(DemoFull, PassesEveryCheckInThreeFormats) {
  TERRACAST_NEEDS_FULL();
  const ScratchFolder scratch;
  expect_job_holds("demo.toml", {}, scratch / "out", kThreeFormats, 7000.0);
  record_job("demo", scratch / "out");
}

class PlaceFull : public testing::TestWithParam<std::string> {};

TEST_P(PlaceFull, PassesEveryCheckInAllFormats) {
  TERRACAST_NEEDS_FULL();
  TERRACAST_NEEDS_SHARED_DATA("andorra/andorra_dem_3s.tif");
  const ScratchFolder scratch;
  expect_job_holds("places/" + GetParam() + ".toml", {data_setting()}, scratch / "out", kAllFormats,
                   7000.0);
  record_job("places_" + GetParam(), scratch / "out");
}

/// The jobs of a folder of configs, by name.
std::vector<std::string> jobs_in(const char* folder) {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(kConfigs / folder))
    names.push_back(entry.path().stem().string());
  std::sort(names.begin(), names.end());
  return names;
}
INSTANTIATE_TEST_SUITE_P(Configs, PlaceFull, testing::ValuesIn(jobs_in("places")),
                         [](const auto& one) { return one.param; });

/// The worlds with towns, woods and water.
class SettledFull : public testing::TestWithParam<std::string> {};

TEST_P(SettledFull, PassesEveryCheckInAllFormats) {
  TERRACAST_NEEDS_FULL();
  TERRACAST_NEEDS_SHARED_DATA("andorra/andorra_dem_3s.tif");
  const ScratchFolder scratch;
  expect_job_holds("settled/" + GetParam() + ".toml", {data_setting()}, scratch / "out",
                   kAllFormats, 7000.0);
  record_job("settled_" + GetParam(), scratch / "out");
}
INSTANTIATE_TEST_SUITE_P(Configs, SettledFull, testing::ValuesIn(jobs_in("settled")),
                         [](const auto& one) { return one.param; });

/// What the 24 frames of a shipped job's only sequence show of its flight.
struct Flown {
  double turn_deg = 0.0, largest_bank_deg = 0.0, climb_m = 0.0;
  double lowest_agl_m = INFINITY, highest_agl_m = -INFINITY;
};

Flown flight_of(const char* config) {
  const core::Log log("test", core::LogLevel::Off);
  const job::Job job = job::prepare_job(job::load_run_config(kConfigs / config, {}), {.log = log});
  EXPECT_EQ(job.sequences.size(), 1u);
  const std::vector<geo::BodyState>& states = job.sequences.at(0).states;
  EXPECT_EQ(states.size(), 24u);
  const geo::WorldFrame& frame = job.ground->frame();
  Flown flown;
  double last_heading_deg = 0.0, first_height_m = 0.0;
  for (std::size_t i = 0; i < states.size(); ++i) {
    const geo::Rigid3d& world_from_body = states[i].world_from_body;
    const Eigen::Matrix3d enu_from_body =
        frame.world_from_enu(world_from_body.translation).transpose() *
        world_from_body.rotation.toRotationMatrix();
    const double heading_deg =
        geo::degrees_from_radians(std::atan2(enu_from_body(0, 0), enu_from_body(1, 0)));
    const double bank_deg =
        geo::degrees_from_radians(std::atan2(enu_from_body(2, 1), enu_from_body(2, 2)));
    const geo::Geodetic place = frame.geodetic_from_world(world_from_body.translation);
    const double agl_m =
        place.height_m - job.ground->measured_height_m(place.lat_deg, place.lon_deg).value();
    if (i == 0) first_height_m = place.height_m;
    if (i > 0) flown.turn_deg += std::remainder(heading_deg - last_heading_deg, 360.0);
    last_heading_deg = heading_deg;
    flown.largest_bank_deg = std::max(flown.largest_bank_deg, std::abs(bank_deg));
    flown.climb_m = place.height_m - first_height_m;
    flown.lowest_agl_m = std::min(flown.lowest_agl_m, agl_m);
    flown.highest_agl_m = std::max(flown.highest_agl_m, agl_m);
  }
  return flown;
}

TEST(Demo, TurnsBanksAndClimbsLowAboveTheTownAsItPromises) {
  const Flown flown = flight_of("demo.toml");
  EXPECT_GE(std::abs(flown.turn_deg), 90.0);
  EXPECT_GE(flown.largest_bank_deg, 15.0);
  EXPECT_GE(flown.climb_m, 200.0);
  EXPECT_GE(flown.lowest_agl_m, 100.0);
  EXPECT_LE(flown.highest_agl_m, 400.0) << "houses and boats are small from there";
}

TEST(Climb, TurnsBanksAndClimbsAsItPromises) {
  const Flown flown = flight_of("climb.toml");
  EXPECT_GE(std::abs(flown.turn_deg), 90.0);
  EXPECT_GE(flown.largest_bank_deg, 15.0);
  EXPECT_GE(flown.climb_m, 200.0);
}

TEST(SmallFormats, KittiRawAndTartanAirV1PassEveryCheck) {
  const ScratchFolder scratch;
  const fs::path config = write_text(
      scratch / "job.toml",
      replaced(tiny_job_text(), "format = \"colmap\"",
               "format = \"kitti_raw\"\nrig = \"pair\"\nleft = \"left\"\nright = \"right\"\n\n"
               "[[exports]]\nformat = \"tartanair_v1\"\n\n"
               "[[rigs]]\nmount_pitch_deg = 40.0\nextends = \"" +
                   (kConfigs / "rigs/tartan_v1.toml").string() + "\""));
  const auto run =
      run_program({"run", config.string(), "--set", "trajectories.0.num_frames=3", "--set",
                   "detail.finest_spacing_m=16.0", "--out", (scratch / "out").string(), "-q"});
  ASSERT_EQ(run.status, 0) << run.output;
  expect_report_holds(scratch / "out/report", {"kitti_raw", "tartanair_v1"});
}

// From 8 km the glitter of the sun goes along with the camera, over a sea that is marked by its gusts: frames 20 km apart
// look alike in the one, agree nowhere in the other, and tell no unit of depth by either.
TEST(OpenSea, GlitterIsNotTakenForDepthInAnotherUnit) {
  const ScratchFolder scratch;
  std::string raster =
      "ncols 40\nnrows 40\nxllcorner 6.0\nyllcorner 39.0\ncellsize 0.05\nNODATA_value -9999\n";
  for (int row = 0; row < 40; ++row) {
    for (int column = 0; column < 40; ++column) raster += "0 ";
    raster += "\n";
  }
  write_text(scratch / "sea.asc", raster);
  write_text(scratch / "sea.prj", kWgs84);
  const fs::path config = write_text(scratch / "job.toml", R"(name = "sea"
[world]
name = "sea"
origin_lat_deg = 40.0
origin_lon_deg = 7.0
size_m = 65536.0
outside = "sea"
[[world.elevation]]
files = ["sea.asc"]
sea = "below"
sea_min_km2 = 0.0
vertical_datum = "egm96"
[detail]
finest_spacing_m = 512.0
[[rigs]]
name = "one"
mount_pitch_deg = 60.0
[[rigs.cameras]]
name = "down"
width_px = 160
height_px = 120
fx_px = 120.0
fy_px = 120.0
[[trajectories]]
name = "P000"
kind = "waypoints"
speed_mps = 100.0
rate_hz = 0.005
num_frames = 3
min_agl_m = 100.0
waypoints = [
  {east_m = 0.0, north_m = -25000.0, height_m = 8000.0, above = "ellipsoid"},
  {east_m = 0.0, north_m = 0.0, height_m = 8000.0, above = "ellipsoid"},
  {east_m = 0.0, north_m = 25000.0, height_m = 8000.0, above = "ellipsoid"},
]
[conditions]
color_samples = 4
sun_azimuth_deg = 0.0
sun_elevation_deg = 60.0
[tracks]
num_points = 2000
[[exports]]
format = "colmap"
)");
  // No two images share ground: a COLMAP model has no points then, and nothing is wrong.
  const auto run = run_program({"run", config.string(), "--out", (scratch / "out").string(), "-q"});
  ASSERT_EQ(run.status, 0) << run.output;
  const core::Json checks = core::Json::read(scratch / "out/report/report.json").at("checks");
  std::set<std::string> unseen;
  double prominence = 1.0;
  for (std::size_t i = 0; i < checks.size(); ++i) {
    const core::Json& check = checks.at(i);
    if (check.at("unseen").boolean()) unseen.insert(check.at("name").string());
    if (check.at("name").string() == "colmap/depth_unit") prominence = check.at("value").number();
  }
  for (const char* name : {"colmap_reprojection", "colmap_points", "colmap_depth"})
    EXPECT_TRUE(unseen.contains(std::string("colmap/") + name)) << name;
  EXPECT_LT(prominence, 0.1);  // of a bound of 0.3
}

TEST(SplitRecording, GivesASequenceForEachPart) {
  // Two legs of 12 s and 20 s, a minute apart, over a plane.
  const ScratchFolder scratch;
  std::string fixes = "time_s,latitude_deg,longitude_deg,height_m\n";
  for (int i = 0; i <= 80; ++i)
    if (i <= 12 || i >= 60)
      fixes +=
          fmt::format("{},{:.7f},{:.7f},900\n", i, 46.0 + 1e-4 * (i % 60), i < 30 ? 7.0 : 7.002);
  write_text(scratch / "flight.csv", fixes);
  const std::string orbit = tiny_job_text().substr(tiny_job_text().find("kind = \"orbit\""));
  std::string text = replaced(tiny_job_text(), orbit.substr(0, orbit.find("rate_hz")),
                              "kind = \"recorded\"\nfile = \"flight.csv\"\nformat = \"csv\"\n"
                              "above = \"egm96\"\nsplit = true\n");
  text = replaced(text, "rate_hz = 1.0", "rate_hz = 0.25");
  text = replaced(text, "num_frames = 4", "num_frames = 0");
  const fs::path config = write_text(
      scratch / "job.toml", text + "[[labels]]\nkind = \"pairs\"\nframes_apart = [1, 4]\n");
  const std::string out = (scratch / "out").string();
  const auto run = run_program(
      {"run", config.string(), "--set", "detail.finest_spacing_m=16.0", "--out", out, "-q"});
  ASSERT_EQ(run.status, 0) << run.output;
  expect_report_holds(scratch / "out/report", {"colmap"});
  // What the shorter part does not have is told once, by the whole run and by the stage alone.
  const auto labelled = run_program(
      {"label", config.string(), "--set", "detail.finest_spacing_m=16.0", "--out", out, "-q"});
  ASSERT_EQ(labelled.status, 0) << labelled.output;
  for (const std::string& told : {run.output, labelled.output}) {
    const std::size_t first = told.find("frames_apart = 4: sequence P000_0 has 4 frames");
    EXPECT_NE(first, std::string::npos) << told;
    EXPECT_EQ(told.find("frames_apart = 4", first + 1), std::string::npos) << told;
  }
  // The stage alone finds the same sequences.
  fs::remove_all(scratch / "out/export");
  const auto exported = run_program(
      {"export", config.string(), "--set", "detail.finest_spacing_m=16.0", "--out", out, "-q"});
  EXPECT_EQ(exported.status, 0) << exported.output;
  for (const char* name : {"P000_0", "P000_1"}) {
    EXPECT_TRUE(fs::exists(scratch / "out/capture" / name)) << name;
    EXPECT_TRUE(fs::exists(scratch / "out/export/colmap" / name)) << name;
  }
  EXPECT_FALSE(fs::exists(scratch / "out/capture/P000"));
}

TEST(Andorra, ThreeFramesPassEveryCheckInThreeFormats) {
  TERRACAST_NEEDS_SHARED_DATA("andorra/andorra_dem_3s.tif");
  const ScratchFolder scratch;
  expect_job_holds("andorra_small.toml", {data_setting(), "trajectories.0.num_frames=3"},
                   scratch / "out", kThreeFormats, 2500.0);
}

TEST(AndorraFull, TwelveFramesPassEveryCheckInThreeFormatsAnd24ImagesInColmapItself) {
  TERRACAST_NEEDS_FULL();
  TERRACAST_NEEDS_SHARED_DATA("andorra/andorra_dem_3s.tif");
  const ScratchFolder scratch;
  expect_job_holds("andorra_small.toml", {data_setting()}, scratch / "out", kThreeFormats, 2500.0);
  TERRACAST_NEEDS_COLMAP();
  expect_colmap_holds("andorra_small.toml", scratch / "out", "tartan2", "1", 2500.0);
}

TEST(AndorraFull, AHundredFramesPassEveryCheckInThreeFormatsAndInColmapItself) {
  TERRACAST_NEEDS_FULL();
  TERRACAST_NEEDS_SHARED_DATA("andorra/andorra_dem_3s.tif");
  const ScratchFolder scratch;
  expect_job_holds("andorra.toml", {data_setting()}, scratch / "out", kThreeFormats, 7000.0);
  record_job("andorra", scratch / "out");
  TERRACAST_NEEDS_COLMAP();
  expect_colmap_holds("andorra.toml", scratch / "out", "mcs4", "3", 40000.0);
  record_results("colmap", "andorra", scratch / "out/report/colmap",
                 {"colmap_sparse_", "colmap_georegister_", "colmap_free_"});
  record_report("andorra_colmap", scratch / "out/report/colmap");
}

}  // namespace
}  // namespace terracast::test
