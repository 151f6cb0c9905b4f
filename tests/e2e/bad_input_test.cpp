#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/mount.h>
#include <sys/stat.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "core/json.h"
#include "tests/e2e/tiny_job.h"
#include "tests/support/folder_compare.h"
#include "tests/support/run_program.h"
#include "tests/support/test_data.h"

namespace terracast::test {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;

constexpr int kUsageOrConfig = 2;
constexpr int kInput = 3;
constexpr int kIo = 4;

constexpr const char* kFractal =
    "kind = \"fractal\"\nvertical_datum = \"ellipsoid\"\nrelief_m = 300.0\n";

const std::string kDatum = "vertical_datum = \"ellipsoid\"\n";

/// A geographic ESRI ASCII grid of 0.1 degrees around the tiny world, gently sloped.
std::string grid_text(int num_rows = 60, const std::string& value_at_middle = "") {
  std::string text =
      "ncols 60\nnrows 60\nxllcorner 6.95\nyllcorner 45.95\ncellsize 0.0016666666667\nNODATA_value "
      "-9999\n";
  for (int row = 0; row < num_rows; ++row) {
    for (int column = 0; column < 60; ++column) {
      const bool is_middle = row == 30 && column == 30 && !value_at_middle.empty();
      text += is_middle ? value_at_middle : std::to_string(500 + row + 2 * column) + ".5";
      text += column == 59 ? "\n" : " ";
    }
  }
  return text;
}

constexpr const char* kWgs84Prj =
    "GEOGCS[\"WGS 84\",DATUM[\"WGS_1984\",SPHEROID[\"WGS "
    "84\",6378137,298.257223563]],PRIMEM[\"Greenwich\",0],"
    "UNIT[\"degree\",0.0174532925199433]]";

class BadInput : public testing::Test {
 protected:
  /// Runs the tiny job with one text of it replaced, and expects status and message. No finished
  /// result may appear.
  void expect_refusal(const std::string& what, const std::string& by, int status,
                      const testing::Matcher<const std::string&>& message) {
    const auto config = write_text(scratch_ / "job.toml", replaced(tiny_job_text(), what, by));
    const auto run =
        run_program({"run", config.string(), "--out", (scratch_ / "out").string(), "-q"});
    EXPECT_EQ(run.status, status) << run.output;
    EXPECT_THAT(run.output, AllOf(HasSubstr("error: "), message));
    EXPECT_FALSE(fs::exists(scratch_ / "out/export/colmap/dataset.json"));
    expect_no_half_files(scratch_ / "out");
  }

  /// The same with a raster as the source of heights.
  void expect_raster_refusal(const std::string& grid, const std::string& prj,
                             const std::string& keys, int status,
                             const testing::Matcher<const std::string&>& message) {
    write_text(scratch_ / "dem.asc", grid);
    fs::remove(scratch_ / "dem.prj");
    if (!prj.empty()) write_text(scratch_ / "dem.prj", prj);
    expect_refusal(kFractal, "kind = \"raster\"\nfiles = [\"dem.asc\"]\n" + keys, status, message);
  }

  /// A writer that was stopped by an error leaves nothing that could be taken for a result.
  static void expect_no_half_files(const fs::path& folder) {
    if (!fs::exists(folder)) return;
    for (const auto& [name, bytes] : folder_bytes(folder)) {
      EXPECT_EQ(name.find(".terracast-tmp-"), std::string::npos) << name;
      if (fs::path(name).extension() != ".json") continue;
      EXPECT_NO_THROW(core::Json::parse(bytes, name)) << name;
    }
  }

  /// The tiny job run to its end in scratch_ / "out".
  void run_tiny_job() {
    write_text(config_, tiny_job_text());
    const auto run = run_program({"run", config_.string(), "--out", out_.string(), "-q"});
    ASSERT_EQ(run.status, 0) << run.output;
  }

  const ScratchFolder scratch_;
  const fs::path config_ = scratch_ / "job.toml";
  const fs::path out_ = scratch_ / "out";
};

void flip_byte(const fs::path& path) {
  std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
  const auto middle = static_cast<std::streamoff>(fs::file_size(path) / 2);
  file.seekg(middle);
  const char byte = static_cast<char>(file.get() ^ 0x10);
  file.seekp(middle);
  file.put(byte);
}

TEST_F(BadInput, TheTinyJobItselfIsRight) {
  const auto config = write_text(scratch_ / "job.toml", tiny_job_text());
  const auto run =
      run_program({"run", config.string(), "--out", (scratch_ / "out").string(), "-q"});
  EXPECT_EQ(run.status, 0) << run.output;
}

TEST_F(BadInput, TheTinyRasterItselfIsRight) {
  write_text(scratch_ / "dem.asc", grid_text());
  write_text(scratch_ / "dem.prj", kWgs84Prj);
  const auto config = write_text(
      scratch_ / "job.toml",
      replaced(tiny_job_text(), kFractal, "kind = \"raster\"\nfiles = [\"dem.asc\"]\n" + kDatum));
  const auto run =
      run_program({"tile", config.string(), "--out", (scratch_ / "out").string(), "-q"});
  EXPECT_EQ(run.status, 0) << run.output;
}

TEST_F(BadInput, MissingRasterIsNamed) {
  expect_refusal(kFractal, "kind = \"raster\"\nfiles = [\"nowhere.tif\"]\n" + kDatum, kIo,
                 HasSubstr("nowhere.tif"));
}

TEST_F(BadInput, UnreadableRasterIsNamed) {
  write_text(scratch_ / "dem.tif", "this is no raster");
  expect_refusal(kFractal, "kind = \"raster\"\nfiles = [\"dem.tif\"]\n" + kDatum, kInput,
                 HasSubstr("dem.tif"));
}

TEST_F(BadInput, TruncatedRasterIsNamed) {
  expect_raster_refusal(grid_text(20), kWgs84Prj, kDatum, kInput, HasSubstr("dem.asc"));
}

TEST_F(BadInput, RasterWithoutCoordinateSystemIsRefused) {
  expect_raster_refusal(grid_text(), "", kDatum, kInput,
                        AllOf(HasSubstr("dem.asc"), HasSubstr("coordinate")));
}

TEST_F(BadInput, RasterWithoutVerticalDatumIsRefused) {
  expect_raster_refusal(grid_text(), kWgs84Prj, "", kUsageOrConfig, HasSubstr("vertical_datum"));
}

TEST_F(BadInput, FillsThatNothingDeclaresAreRefused) {
  expect_raster_refusal(grid_text(60, "-32768"), kWgs84Prj, kDatum, kInput,
                        AllOf(HasSubstr("dem.asc"), HasSubstr("nodata = \"-9999, -32768\"")));
}

TEST_F(BadInput, HeightsThatCannotBeMetresAreRefused) {
  expect_raster_refusal(grid_text(60, "99999"), kWgs84Prj, kDatum, kInput,
                        AllOf(HasSubstr("dem.asc"), HasSubstr("99999")));
}

TEST_F(BadInput, MissingCoverageNamesTheArea) {
  write_text(scratch_ / "dem.asc", replaced(grid_text(), "xllcorner 6.95", "xllcorner 7.01"));
  write_text(scratch_ / "dem.prj", kWgs84Prj);
  const auto text =
      replaced(tiny_job_text(), kFractal, "kind = \"raster\"\nfiles = [\"dem.asc\"]\n" + kDatum);
  const auto config = write_text(scratch_ / "job.toml",
                                 replaced(text, "outside = \"extend\"", "outside = \"error\""));
  const auto run =
      run_program({"tile", config.string(), "--out", (scratch_ / "out").string(), "-q"});
  EXPECT_EQ(run.status, kInput) << run.output;
  EXPECT_THAT(run.output, AllOf(HasSubstr("km2"), HasSubstr("outside")));
}

TEST_F(BadInput, UnknownKeyIsPlacedAndTheNearestNamed) {
  expect_refusal(
      "num_frames = 4", "number_frames = 4", kUsageOrConfig,
      AllOf(HasSubstr("job.toml:44:"), HasSubstr("number_frames"), HasSubstr("num_frames")));
}

TEST_F(BadInput, WrongTypeIsPlaced) {
  expect_refusal("rate_hz = 1.0", "rate_hz = \"fast\"", kUsageOrConfig,
                 AllOf(HasSubstr("job.toml:43:11"), HasSubstr("rate_hz")));
}

TEST_F(BadInput, WrongUnitIsRefused) {
  expect_refusal("relief_m = 300.0", "relief_m = 300.0\nunit = \"furlong\"", kUsageOrConfig,
                 AllOf(HasSubstr("furlong"), HasSubstr("us_ft")));
}

TEST_F(BadInput, ValueOutsideItsRangeIsRefused) {
  expect_refusal("size_m = 4096.0", "size_m = 1e9", kUsageOrConfig,
                 AllOf(HasSubstr("size_m"), HasSubstr("200000")));
}

TEST_F(BadInput, RigWithoutCameraIsRefused) {
  const std::string text = tiny_job_text();
  const auto first = text.find("[[rigs.cameras]]");
  const auto end = text.find("[[trajectories]]");
  expect_refusal(text.substr(first, end - first), "", kUsageOrConfig,
                 AllOf(HasSubstr("pair"), HasSubstr("camera")));
}

TEST_F(BadInput, TrajectoryUnderGroundIsRefused) {
  expect_refusal("height_m = 250.0, above = \"ground\"",
                 "height_m = -2000.0, above = \"ellipsoid\"", kInput,
                 AllOf(HasSubstr("P000"), HasSubstr("ground")));
}

TEST_F(BadInput, TrajectoryOutsideTheWorldIsRefused) {
  expect_refusal("east_m = 0.0", "east_m = 5000.0", kInput,
                 AllOf(HasSubstr("P000"), HasSubstr("the world has no ground at")));
}

TEST_F(BadInput, RecordingsThatCannotBeFlownAreRefused) {
  const std::string text = tiny_job_text();
  const std::size_t begin = text.find("kind = \"orbit\""), end = text.find("rate_hz = 1.0");
  const auto expect_recording_refused = [&](const std::string& recording, const std::string& keys,
                                            int status,
                                            const testing::Matcher<const std::string&>& message) {
    write_text(scratch_ / "flight.csv", recording);
    expect_refusal(text.substr(begin, end - begin),
                   "kind = \"recorded\"\nfile = \"flight.csv\"\nformat = \"csv\"\n" + keys, status,
                   message);
  };
  const std::string header = "time_s,latitude_deg,longitude_deg,height_m\n";
  const std::string good = header + "0,46,7,2000\n1,46.0002,7,2000\n2,46.0004,7,2000\n";
  const std::string ellipsoid = "above = \"ellipsoid\"\n";
  expect_recording_refused(good, "", kUsageOrConfig, HasSubstr("above is not given"));
  expect_recording_refused(good, "above = \"pressure\"\n", kUsageOrConfig,
                           HasSubstr("pressure_offset_m"));
  expect_recording_refused(header + "0,46,7,2000\n1,north,7,2000\n", ellipsoid, kInput,
                           AllOf(HasSubstr("flight.csv, line 3"), HasSubstr("north")));
  expect_recording_refused(header + "0,46,7,2000\n", ellipsoid, kInput,
                           HasSubstr("no part of the recording has 3 fixes"));
  expect_recording_refused(header + "0,46,7,-9000\n1,46.0002,7,-9000\n2,46.0004,7,-9000\n",
                           ellipsoid, kInput, HasSubstr("below the ground at t = "));
  expect_recording_refused(header + "0,47,7,2000\n1,47.0002,7,2000\n2,47.0004,7,2000\n", ellipsoid,
                           kInput, HasSubstr("outside = \"clip\""));
  expect_refusal(text.substr(begin, end - begin),
                 "kind = \"recorded\"\nfile = \"none.gpx\"\nformat = \"gpx\"\n" + ellipsoid, kIo,
                 HasSubstr("none.gpx"));
}

TEST_F(BadInput, MoreFramesThanTheMotionHoldsIsRefused) {
  expect_refusal("num_frames = 4", "num_frames = 4000000", kUsageOrConfig,
                 AllOf(HasSubstr("4000000 frames"), HasSubstr("holds 63")));
}

TEST_F(BadInput, ConfigsThatExtendEachOtherInALoopAreRefused) {
  write_text(scratch_ / "a.toml", "extends = \"b.toml\"\n");
  write_text(scratch_ / "b.toml", "extends = \"a.toml\"\n");
  const auto run =
      run_program({"run", (scratch_ / "a.toml").string(), "--out", (scratch_ / "out").string()});
  EXPECT_EQ(run.status, kUsageOrConfig);
  EXPECT_THAT(run.output, AllOf(HasSubstr("a.toml"), HasSubstr("b.toml"), HasSubstr("loop")));
}

TEST_F(BadInput, MissingConfigIsAnIoError) {
  const auto run =
      run_program({"run", (scratch_ / "none.toml").string(), "--out", (scratch_ / "out").string()});
  EXPECT_EQ(run.status, kIo);
  EXPECT_THAT(run.output, HasSubstr("none.toml"));
}

TEST_F(BadInput, ExporterThatCannotHoldTheRigRefusesBeforeRendering) {
  expect_refusal("format = \"colmap\"",
                 "format = \"tartanair\"\nrig = \"pair\"\nleft = \"left\"\nright = \"right\"",
                 kUsageOrConfig, AllOf(HasSubstr("tartanair"), HasSubstr("640")));
  EXPECT_FALSE(fs::exists(scratch_ / "out/capture"));
}

TEST_F(BadInput, OutputFolderOfAnotherConfigIsLeftAlone) {
  const auto config = write_text(scratch_ / "job.toml", tiny_job_text());
  const auto out = (scratch_ / "out").string();
  ASSERT_EQ(run_program({"run", config.string(), "--out", out, "-q"}).status, 0);
  const auto before = folder_bytes(scratch_ / "out");

  const auto other_world =
      run_program({"run", config.string(), "--out", out, "-q", "--set", "world.seed=5"});
  EXPECT_EQ(other_world.status, kUsageOrConfig) << other_world.output;
  EXPECT_THAT(other_world.output, HasSubstr("--out"));
  const auto other_frames =
      run_program({"run", config.string(), "--out", out, "-q", "--set", "seed=5"});
  EXPECT_EQ(other_frames.status, kUsageOrConfig) << other_frames.output;
  EXPECT_THAT(other_frames.output, HasSubstr("--out"));

  // Another flight draws another map, and may need other tiles.
  const auto other_flight = run_program(
      {"run", config.string(), "--out", out, "-q", "--set", "trajectories.0.start_s=0.5"});
  EXPECT_EQ(other_flight.status, kUsageOrConfig) << other_flight.output;
  EXPECT_THAT(other_flight.output, AllOf(HasSubstr("--out"), HasSubstr("start_s")));

  auto after = folder_bytes(scratch_ / "out");
  after["events.jsonl"] = before.at("events.jsonl");
  EXPECT_TRUE(before == after) << "a refused run changed the folder";
}

TEST_F(BadInput, WorldThatWasTiledForCoarserImagesIsRefused) {
  const auto config = write_text(scratch_ / "job.toml", tiny_job_text());
  const auto out = (scratch_ / "out").string();
  ASSERT_EQ(run_program({"tile", config.string(), "--out", out, "-q", "--set", "detail.cell_px=64"})
                .status,
            0);
  const auto render = run_program({"render", config.string(), "--out", out, "-q"});
  EXPECT_EQ(render.status, kInput) << render.output;
  EXPECT_THAT(render.output, AllOf(HasSubstr("not tiled for sequence"), HasSubstr("cells of")));
  EXPECT_FALSE(fs::exists(scratch_ / "out/capture"));
}

TEST_F(BadInput, TileWithAFlippedBitIsFound) {
  const auto config = write_text(scratch_ / "job.toml", tiny_job_text());
  const auto out = (scratch_ / "out").string();
  ASSERT_EQ(run_program({"tile", config.string(), "--out", out, "-q"}).status, 0);
  const auto is_tile = [](const fs::path& path) { return path.extension() == ".tile"; };
  for (const auto& entry : fs::recursive_directory_iterator(scratch_ / "out/world"))
    if (is_tile(entry.path())) flip_byte(entry.path());
  const auto render = run_program({"render", config.string(), "--out", out, "-q"});
  EXPECT_EQ(render.status, kInput) << render.output;
  EXPECT_THAT(render.output, AllOf(HasSubstr(".tile"), HasSubstr("damaged")));
  EXPECT_FALSE(fs::exists(scratch_ / "out/capture/P000/manifest.json"));
}

// Seen in 2026: a finished result that was damaged stayed so, whatever was run again.
TEST_F(BadInput, DamagedCapturesAndExportsAreMadeAgain) {
  run_tiny_job();
  const auto before = folder_bytes(out_);
  const fs::path sequence = out_ / "capture/P000";
  flip_byte(sequence / "pair/left/000002.exr");
  flip_byte(sequence / "frames/000003.json");
  fs::remove(sequence / "pair/right/000001.png");
  fs::remove_all(out_ / "export");
  const auto exported = run_program({"export", config_.string(), "--out", out_.string(), "-q"});
  EXPECT_EQ(exported.status, kInput) << exported.output;
  EXPECT_THAT(exported.output, HasSubstr("run the render stage again"));

  run_tiny_job();
  flip_byte(out_ / "export/colmap/P000/images/pair/left/000000.png");
  run_tiny_job();
  auto after = folder_bytes(out_);
  // What tells how long the stages took.
  for (const char* timed : {"events.jsonl", "report/index.html", "report/colmap/page/data.js"})
    after[timed] = before.at(timed);
  EXPECT_TRUE(before == after);
}

// Seen in 2026: whatever lay in the capture's folder was exported, under any config.
TEST_F(BadInput, ExportsAreOfTheConfigsOwnSequences) {
  run_tiny_job();
  const auto other = run_program({"export", config_.string(), "--out", out_.string(), "-q", "--set",
                                  "trajectories.0.radius_m=400"});
  EXPECT_EQ(other.status, kUsageOrConfig) << other.output;
  EXPECT_THAT(other.output, AllOf(HasSubstr("radius_m = 300"), HasSubstr("radius_m = 400"),
                                  HasSubstr("another config")));
  const auto missing = run_program({"export", config_.string(), "--out", out_.string(), "-q",
                                    "--set", "trajectories.0.name=B000"});
  EXPECT_EQ(missing.status, kInput) << missing.output;
  EXPECT_THAT(missing.output, HasSubstr("run the render stage first"));
  const auto renamed = run_program(
      {"run", config_.string(), "--out", out_.string(), "-q", "--set", "trajectories.0.name=B000"});
  EXPECT_EQ(renamed.status, 0) << renamed.output;
  EXPECT_THAT(renamed.output, HasSubstr("P000: not exported"));
  EXPECT_TRUE(fs::exists(out_ / "export/colmap/B000"));
  EXPECT_FALSE(fs::exists(out_ / "export/colmap/P000"));

  const auto nothing =
      run_program({"run", config_.string(), "--out", out_.string(), "-q", "--set", "exports=[]"});
  EXPECT_EQ(nothing.status, 0) << nothing.output;
  EXPECT_THAT(nothing.output, HasSubstr("not exported"));

  const auto other_format = run_program(
      {"run", config_.string(), "--out", out_.string(), "-q", "--set",
       "exports=[{format = \"kitti\", rig = \"pair\", left = \"left\", right = \"right\"}]"});
  EXPECT_EQ(other_format.status, 0) << other_format.output;
  EXPECT_THAT(other_format.output, HasSubstr("colmap: the config does not export this format"));
  EXPECT_TRUE(fs::exists(out_ / "export/colmap/dataset.json"));

  // A map shows the paths of the world's own job alone, and is a PNG.
  const auto map = (scratch_ / "map.png").string();
  const auto elsewhere =
      run_program({"world", "preview", (out_ / "world").string(), "-o", map, "--config",
                   config_.string(), "--set", "world.origin_lat_deg=45.5"});
  EXPECT_EQ(elsewhere.status, kUsageOrConfig) << elsewhere.output;
  EXPECT_THAT(elsewhere.output, AllOf(HasSubstr("latitude 45.5, "), HasSubstr(" at 46, ")));
  EXPECT_FALSE(fs::exists(map));
  const auto jpeg = run_program(
      {"world", "preview", (out_ / "world").string(), "-o", (scratch_ / "map.jpg").string()});
  EXPECT_EQ(jpeg.status, kUsageOrConfig) << jpeg.output;
  EXPECT_THAT(jpeg.output, HasSubstr(".png"));
}

TEST_F(BadInput, AnExportNeedsNoSourceOfHeights) {
  write_text(scratch_ / "dem.asc", grid_text());
  write_text(scratch_ / "dem.prj", kWgs84Prj);
  write_text(config_, replaced(tiny_job_text(), kFractal,
                               "kind = \"raster\"\nfiles = [\"dem.asc\"]\n" + kDatum));
  const auto run = run_program({"run", config_.string(), "--out", out_.string(), "-q"});
  ASSERT_EQ(run.status, 0) << run.output;
  fs::remove(scratch_ / "dem.asc");
  fs::remove_all(out_ / "export");
  const auto exported = run_program({"export", config_.string(), "--out", out_.string(), "-q"});
  EXPECT_EQ(exported.status, 0) << exported.output;
  EXPECT_TRUE(fs::exists(out_ / "export/colmap/dataset.json"));
}

TEST_F(BadInput, WhatALaterStageWouldRefuseIsRefusedBeforeTheFirst) {
  expect_refusal("num_frames = 4", "num_frames = 1", kUsageOrConfig,
                 AllOf(HasSubstr("P000"), HasSubstr("2 or more")));
  expect_refusal("[tracks]", "[tracing]\nembree_profile = \"isa=foo\"\n\n[tracks]", kUsageOrConfig,
                 HasSubstr("isa=foo"));
  EXPECT_FALSE(fs::exists(out_ / "world"));
}

TEST_F(BadInput, AMissingDataFolderIsNamed) {
  write_text(scratch_ / "dem.prj", kWgs84Prj);
  write_text(config_, "data = \"nowhere\"\n" +
                          replaced(tiny_job_text(), kFractal,
                                   "kind = \"raster\"\nfiles = [\"${data}/dem.asc\"]\n" + kDatum));
  const auto missing = run_program({"tile", config_.string(), "--out", out_.string(), "-q"});
  EXPECT_EQ(missing.status, kIo) << missing.output;
  EXPECT_THAT(missing.output, AllOf(HasSubstr((scratch_ / "nowhere/dem.asc").string()),
                                    HasSubstr("--set data=FOLDER")));
  fs::create_directory(scratch_ / "nowhere");
  const auto no_file = run_program({"tile", config_.string(), "--out", out_.string(), "-q"});
  EXPECT_EQ(no_file.status, kIo) << no_file.output;
  EXPECT_THAT(no_file.output, HasSubstr("${data} is " + (scratch_ / "nowhere").string()));
}

TEST_F(BadInput, APipeIsNoConfigAndNoPicture) {
  const auto pipe = scratch_ / "pipe";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  const auto read = run_program({"run", pipe.string(), "--out", out_.string()});
  EXPECT_EQ(read.status, kInput) << read.output;
  EXPECT_THAT(read.output, HasSubstr("pipe"));
  const auto written = run_program({"docs", "-o", pipe.string()});
  EXPECT_EQ(written.status, kIo) << written.output;
  EXPECT_TRUE(fs::is_fifo(pipe));
}

TEST_F(BadInput, FullDiskIsAnIoErrorAndTheRunGoesOnLater) {
  const auto disk = scratch_ / "disk";
  fs::create_directories(disk);
  if (::mount("tmpfs", disk.c_str(), "tmpfs", 0, "size=1m") != 0)
    GTEST_SKIP() << "skipped: a file system of 1 MB cannot be mounted here";
  const auto config = write_text(scratch_ / "job.toml", tiny_job_text());
  const auto full = run_program({"run", config.string(), "--out", disk.string(), "-q"});
  EXPECT_EQ(full.status, kIo) << full.output;
  EXPECT_THAT(full.output, HasSubstr("No space left on device"));
  ASSERT_EQ(::mount("tmpfs", disk.c_str(), "tmpfs", MS_REMOUNT, "size=500m"), 0);
  const auto resumed = run_program({"run", config.string(), "--out", disk.string(), "-q"});
  EXPECT_EQ(resumed.status, 0) << resumed.output;
  ASSERT_EQ(::umount(disk.c_str()), 0);
}

TEST(CommandLine, WrongUseEndsWithStatusTwo) {
  for (const std::vector<std::string>& wrong :
       {std::vector<std::string>{},
        {"fly"},
        {"run"},
        {"render", "x.toml", "--out", "o", "--shard", "3/3"},
        {"render", "x.toml", "--out", "o", "--shard", "-1/3"},
        {"run", "x.toml", "--out", ""},
        {"list", "camera"},
        {"config", "explain", "no_such_key"}}) {
    const auto run = run_program(wrong);
    EXPECT_EQ(run.status, kUsageOrConfig) << run.output;
    EXPECT_FALSE(run.output.empty());
  }
}

TEST(CommandLine, AResultThatCannotBePrintedIsAnIoError) {
  for (const char* what : {" list cameras", " --help", " config explain"}) {
    const std::string command = TERRACAST_PROGRAM + std::string(what) + " >/dev/full 2>/dev/null";
    EXPECT_EQ(WEXITSTATUS(std::system(command.c_str())), kIo) << command;
  }
}

TEST(CommandLine, ListsAndExplainsWhatItKnows) {
  for (const char* what :
       {"cameras", "checks", "exporters", "layers", "recordings", "trajectories"}) {
    const auto run = run_program({"list", what});
    EXPECT_EQ(run.status, 0);
    EXPECT_FALSE(run.output.empty()) << what;
  }
  const auto explained = run_program({"config", "explain", "size_m"});
  EXPECT_EQ(explained.status, 0);
  EXPECT_THAT(explained.output,
              AllOf(HasSubstr("world.size_m"), HasSubstr("256 to 200000"), HasSubstr("51200")));
  EXPECT_EQ(run_program({"--help"}).status, 0);
  EXPECT_EQ(run_program({"run", "--help"}).status, 0);
}

}  // namespace
}  // namespace terracast::test
