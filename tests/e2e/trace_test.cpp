#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <set>
#include <string>

#include "capture/frame_reader.h"
#include "core/json.h"
#include "core/semantic_class.h"
#include "geo/geodesy.h"
#include "geo/geoid.h"
#include "tests/e2e/settled_job.h"
#include "tests/e2e/tiny_job.h"
#include "tests/support/run_program.h"
#include "tests/support/test_data.h"

namespace terracast::test {
namespace {

namespace fs = std::filesystem;
using core::Json;
using testing::HasSubstr;

/// A plane 700 m above the ellipsoid, with derived land cover.
std::string plane_job() {
  const std::string plane = replaced(
      tiny_job_text(), "kind = \"fractal\"\nvertical_datum = \"ellipsoid\"\nrelief_m = 300.0",
      "kind = \"plane\"\nheight_m = 700.0\nlicence = \"made up\"\naccuracy = \"exact\"");
  return replaced(plane, "[detail]",
                  "[[world.layer]]\nkind = \"land_cover\"\nname = \"cover\"\nsource = \"derived\"\n"
                  "licence = \"CC0\"\naccuracy = \"none\"\n\n[detail]");
}

class Trace : public testing::Test {
 protected:
  void SetUp() override {
    config_ = write_text(scratch_ / "job.toml", plane_job()).string();
    const auto run = run_program({"tile", config_, "--out", scratch_.path().string(), "-q"});
    ASSERT_EQ(run.status, 0) << run.output;
    world_ = (scratch_ / "world").string();
  }
  ProgramResult trace_of(std::vector<std::string> options) const {
    options.insert(options.begin(), {"world", "trace", world_});
    return run_program(options);
  }
  Json json_of(std::vector<std::string> options) const {
    options.emplace_back("--json");
    const auto run = trace_of(options);
    EXPECT_EQ(run.status, 0) << run.output;
    return Json::parse(run.output, "trace");
  }

  const ScratchFolder scratch_;
  std::string config_, world_;
};

TEST_F(Trace, APlaceHasItsHeightItsSourcesAndTheirLicences) {
  const Json trace = json_of({"--lat", "46.005", "--lon", "7.01"});
  const Json& place = trace.at("place");
  EXPECT_NEAR(place.at("lat_deg").number(), 46.005, 1e-9);
  EXPECT_NEAR(place.at("lon_deg").number(), 7.01, 1e-9);
  // Heights are whole steps of a millimetre; between samples the plane's bend is less.
  EXPECT_NEAR(place.at("height_m").number(), 700.0, 2e-3);
  if (!place.at("altitude_msl_m").is_null()) {
    EXPECT_NEAR(place.at("altitude_msl_m").number(),
                700.0 - geo::Geoid::egm96()->undulation_m(46.005, 7.01), 2e-3);
  }
  const std::vector<double> point = place.at("point_world").numbers();
  const geo::WorldFrame frame({.lat_deg = 46.0, .lon_deg = 7.0});
  const Eigen::Vector3d truth =
      frame.world_from_geodetic({.lat_deg = 46.005, .lon_deg = 7.01, .height_m = 700.0});
  EXPECT_LT((Eigen::Vector3d(point[0], point[1], point[2]) - truth).norm(), 2e-3);
  EXPECT_EQ(trace.at("surface").string(), "ground");
  EXPECT_EQ(trace.at("instance_id").integer(), 0);
  EXPECT_EQ(trace.at("elevation").at("source").string(), "plane");
  EXPECT_EQ(trace.at("elevation").at("licence").string(), "made up");
  EXPECT_EQ(trace.at("elevation").at("accuracy").string(), "exact");
  const Json& cover = trace.at("cover");
  ASSERT_EQ(cover.at("layers").size(), 1u) << cover.text();
  EXPECT_EQ(cover.at("layers").at(0).at("name").string(), "cover");
  EXPECT_EQ(cover.at("layers").at(0).at("licence").string(), "CC0");
  EXPECT_EQ(cover.at("layers").at(0).at("accuracy").string(), "none");
  const auto id = static_cast<std::size_t>(trace.at("class").at("id").integer());
  EXPECT_EQ(trace.at("class").at("name").string(), core::semantic_class_names()[id]);

  // The same from world x and y, but for the digits that were typed.
  const Json other =
      json_of({"--x", fmt::format("{:.6f}", point[0]), "--y", fmt::format("{:.6f}", point[1])});
  EXPECT_NEAR(other.at("place").at("lat_deg").number(), 46.005, 1e-9);
  EXPECT_EQ(other.at("cover").text(), cover.text());

  const std::string lines = trace_of({"--lat", "46.005", "--lon", "7.01"}).output;
  EXPECT_THAT(lines, HasSubstr("latitude 46.0050000, longitude 7.0100000"));
  EXPECT_THAT(lines, HasSubstr("licence: made up"));
}

TEST_F(Trace, APixelIsTracedThroughItsRangeAndPose) {
  const auto run = run_program({"render", config_, "--out", scratch_.path().string(), "-q"});
  ASSERT_EQ(run.status, 0) << run.output;
  const std::string captures = (scratch_ / "capture").string();
  const Json trace = json_of(
      {"--capture", captures, "--camera", "pair/right", "--frame", "2", "--pixel", "31,97"});
  const Json& place = trace.at("place");
  // The range is a float of a few hundred metres.
  EXPECT_NEAR(place.at("height_m").number(), 700.0, 3e-3);
  const auto sequence = capture::SequenceReader::open(fs::path(captures) / "P000");
  const geo::Rigid3d world_from_camera = sequence.world_from_camera(2, 1);
  const std::vector<double> point = place.at("point_world").numbers();
  const Eigen::Vector3d point_camera =
      world_from_camera.inverse() * Eigen::Vector3d(point[0], point[1], point[2]);
  EXPECT_NEAR(point_camera.norm(), trace.at("range_m").number(), 1e-9);
  // A pinhole with a focal length of 120 px in the middle of 160 x 120.
  EXPECT_NEAR(80.0 + 120.0 * point_camera.x() / point_camera.z(), 31.5, 1e-6);
  EXPECT_NEAR(60.0 + 120.0 * point_camera.y() / point_camera.z(), 97.5, 1e-6);
  const auto facts = sequence.read_camera(2, 1, capture::SequenceReader::kFacts);
  EXPECT_EQ(trace.at("class").at("id").integer(), facts.semantic_id(31, 97));
  EXPECT_EQ(trace.at("elevation").at("source").string(), "plane");

  const auto refuse = [&](std::vector<std::string> options, int status, const std::string& words) {
    options.insert(options.begin(), {"--capture", captures});
    const auto refused = trace_of(options);
    EXPECT_EQ(refused.status, status) << refused.output;
    EXPECT_THAT(refused.output, HasSubstr(words));
  };
  refuse({"--frame", "2", "--pixel", "3,3"}, 2, "pair/left, pair/right");
  refuse({"--sequence", "P001", "--frame", "2", "--pixel", "3,3"}, 2, "nearest: \"P000\"");
  refuse({"--camera", "pair/left", "--frame", "4", "--pixel", "3,3"}, 2, "frames 0 to 3");
  refuse({"--camera", "pair/left", "--frame", "0", "--pixel", "160,3"}, 2, "160 x 120 pixels");
  refuse({"--frame", "0"}, 2, "--pixel");

  // Another world is not taken for the capture's.
  write_text(scratch_ / "other.toml",
             replaced(plane_job(), "height_m = 700.0", "height_m = 710.0"));
  const auto other = run_program(
      {"tile", (scratch_ / "other.toml").string(), "--out", (scratch_ / "other").string(), "-q"});
  ASSERT_EQ(other.status, 0) << other.output;
  const auto refused =
      run_program({"world", "trace", (scratch_ / "other/world").string(), "--capture", captures,
                   "--camera", "pair/left", "--frame", "0", "--pixel", "3,3"});
  EXPECT_EQ(refused.status, 3) << refused.output;
  EXPECT_THAT(refused.output, HasSubstr("that the capture was rendered from"));
}

TEST_F(Trace, PlacesBeyondTheTilesAndHalfQuestionsAreRefused) {
  const auto refuse = [&](const std::vector<std::string>& options, int status,
                          const std::string& words) {
    const auto refused = trace_of(options);
    EXPECT_EQ(refused.status, status) << refused.output;
    EXPECT_THAT(refused.output, HasSubstr(words));
  };
  refuse({"--lat", "-46", "--lon", "187"}, 3, "lies outside the tiles");  // the antipode
  refuse({"--lat", "50", "--lon", "7"}, 3, "lies outside the tiles");
  refuse({"--lat", "95", "--lon", "7"}, 3, "latitude");
  refuse({"--lat", "46"}, 2, "--lon");
  refuse({}, 2, "one place");
  refuse({"--lat", "46", "--lon", "7", "--x", "1", "--y", "2"}, 2, "one place");
}

/// A camera 3 m below the sea, beside a pier: the first pixel of each class that it shows.
TEST(TraceUnderWater, PixelsOfTheBedOfPilesAndOfTheSurfaceFromBelowAreTraced) {
  const ScratchFolder scratch;
  const fs::path config = write_settled_job(scratch / "job");
  for (const char* stage : {"tile", "render"}) {
    const auto run = run_program({stage, config.string(), "--out", scratch.path().string(), "-q"});
    ASSERT_EQ(run.status, 0) << run.output;
  }
  const auto sequence = capture::SequenceReader::open(scratch / "capture/P001");
  const int camera = 2;  // tartan_v1/left
  const auto facts = sequence.read_camera(1, camera, capture::SequenceReader::kFacts);
  const Eigen::Vector3d center_world = sequence.world_from_camera(1, camera).translation;
  std::set<std::string> shown;
  for (int y = 3; y < 480; y += 7)
    for (int x = 3; x < 640; x += 7) {
      const std::string name(core::semantic_class_names()[facts.semantic_id(x, y)]);
      if (!shown.insert(name).second) continue;
      const auto run = run_program({"world", "trace", (scratch / "world").string(), "--capture",
                                    (scratch / "capture").string(), "--sequence", "P001",
                                    "--camera", "tartan_v1/left", "--frame", "1", "--pixel",
                                    fmt::format("{},{}", x, y), "--json"});
      ASSERT_EQ(run.status, 0) << run.output;
      const Json trace = Json::parse(run.output, "trace");
      EXPECT_EQ(trace.at("class").at("name").string(), name);
      EXPECT_EQ(trace.at("instance_id").integer(), facts.instance_id(x, y));
      const std::vector<double> point = trace.at("place").at("point_world").numbers();
      EXPECT_NEAR((Eigen::Vector3d(point[0], point[1], point[2]) - center_world).norm(),
                  trace.at("range_m").number(), 1e-6);
      const double altitude_m = trace.at("place").at("altitude_msl_m").number();
      // The sea's surface is the geoid to 2 cm, and its bed is below it.
      if (name == "sea") {
        EXPECT_NEAR(altitude_m, 0.0, 0.02);
      }
      if (name == "seabed") {
        EXPECT_LT(altitude_m, 0.0);
        EXPECT_EQ(trace.at("cover").at("name").string(), "seabed");
        EXPECT_FALSE(trace.at("cover").has("layers")) << trace.text();
      }
      EXPECT_EQ(trace.has("feature"), name == "pier" || name == "boat") << trace.text();
    }
  for (const char* name : {"sea", "seabed", "pier"}) EXPECT_TRUE(shown.contains(name)) << name;
}

}  // namespace
}  // namespace terracast::test
