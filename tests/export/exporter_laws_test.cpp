// What every exporter keeps to, whichever there are.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <fstream>
#include <limits>
#include <sstream>

#include "core/atomic_file.h"
#include "core/json.h"
#include "core/registry.h"
#include "core/schema_writer.h"
#include "tests/export/exported.h"
#include "tests/export/readers.h"

namespace terracast::test {
namespace {

namespace fs = std::filesystem;
using core::ErrorKind;
using core::Json;
using Eigen::Vector3d;

const TinyCaptureOptions kAll{.num_frames = 2, .has_tartan_v1 = true, .has_sensor = true};

/// The capture is drawn once for all tests of a process.
struct ExporterLaws : testing::Test {
  static inline std::unique_ptr<ScratchFolder> folder;
  void SetUp() override {
    if (folder) return;
    folder = std::make_unique<ScratchFolder>();
    write_tiny_capture(*folder / "capture", kAll);
  }
  static void TearDownTestSuite() { folder.reset(); }

  static std::vector<std::string> names() { return core::registry_names(exporters::exporters()); }
  static std::string toml(const std::string& name) { return "format = \"" + name + "\"\n"; }
  static fs::path capture() { return *folder / "capture"; }
};

TEST_F(ExporterLaws, TheTableIsInAlphabeticalOrderAndSaysWhatEachIs) {
  const std::vector<std::string> sorted = names();
  EXPECT_TRUE(std::is_sorted(sorted.begin(), sorted.end()));
  for (const exporters::ExporterInfo& info : exporters::exporters())
    EXPECT_FALSE(info.summary.empty());
}

TEST_F(ExporterLaws, OptionsReadBackAndCopiesAreTheirOwn) {
  for (const std::string& name : names()) {
    SCOPED_TRACE(name);
    const exporters::ExportOptions options = export_options(toml(name));
    const std::string text = core::toml_text(options);
    EXPECT_THAT(text, testing::HasSubstr("format = \"" + name + "\""));
    EXPECT_EQ(core::toml_text(export_options(text)), text);
    exporters::ExportOptions copy = options;
    copy = copy;
    EXPECT_EQ(core::toml_text(copy), text);
    EXPECT_NE(&copy.exporter(), &options.exporter());
  }
  expect_error(ErrorKind::Config, {"tartanare", "tartanair"},
               [] { export_options(toml("tartanare")); });
  expect_error(ErrorKind::Config, {"format"}, [] { export_options(""); });
  expect_error(ErrorKind::Config, {"rigg"}, [] { export_options(toml("kitti") + "rigg = \"a\""); });
}

TEST_F(ExporterLaws, SameBytesWithOneOrTwoThreads) {
  for (const std::string& name : names()) {
    SCOPED_TRACE(name);
    run_export(capture(), toml(name), *folder / "one", 1);
    run_export(capture(), toml(name), *folder / "two", 2);
    EXPECT_EQ(file_hashes(*folder / "one" / name), file_hashes(*folder / "two" / name));
  }
}

TEST_F(ExporterLaws, TheFilesListedAreExactlyThoseOnDisk) {
  for (const std::string& name : names()) {
    SCOPED_TRACE(name);
    run_export(capture(), toml(name), *folder / "out");
    auto on_disk = file_hashes(*folder / "out" / name);
    EXPECT_EQ(on_disk.erase("dataset.json"), 1U);
    std::map<std::string, std::string> listed;
    const Json dataset = Json::read(*folder / "out" / name / "dataset.json");
    for (const auto& [path, record] : dataset.at("files").members()) {
      listed[path] = record.at("xxh3_128").string();
      EXPECT_EQ(static_cast<std::uintmax_t>(record.at("bytes").integer()),
                fs::file_size(*folder / "out" / name / path));
    }
    EXPECT_EQ(listed, on_disk);
    EXPECT_EQ(dataset.at("format").string(), name);
    EXPECT_EQ(dataset.at("world").at("name").string(), "TinyWorld");
    EXPECT_EQ(dataset.at("licences").strings(), tiny_sequence(kAll).licences);
    for (const char* sentence : {"pixel_center", "world_frame", "pose", "depth", "sky"})
      EXPECT_FALSE(dataset.at("conventions").at(sentence).string().empty());
  }
}

// Truth by WGS84's definition: every camera's place and attitude on the globe.
// Rows as they are written down here from the samples' own formula; numbers come back to the bit.
TEST_F(ExporterLaws, SamplesOfSensorsAreTables) {
  for (const std::string& name : names()) {
    SCOPED_TRACE(name);
    run_export(capture(), toml(name), *folder / "out");
    int num_tables = 0;
    for (const auto& entry : fs::recursive_directory_iterator(*folder / "out" / name)) {
      if (entry.path().filename() != "laser.csv") continue;
      ++num_tables;
      std::istringstream lines(core::read_text_file(entry.path()));
      std::string line;
      std::getline(lines, line);
      EXPECT_EQ(line, "time_s,range_m,shape");
      int tick = 0;
      for (; std::getline(lines, line); ++tick) {
        const double time_s = tick / 25.0;
        double values[3];
        ASSERT_EQ(std::sscanf(line.c_str(), "%lf,%lf,%lf", &values[0], &values[1], &values[2]), 3);
        EXPECT_EQ(values[0], time_s);
        EXPECT_EQ(values[1], 100.0 / 3.0 + time_s);
        EXPECT_EQ(values[2], time_s < 0.1 ? std::numeric_limits<double>::infinity() : -1e-9);
      }
      // Two frames at 10 Hz: up to the last one's time.
      EXPECT_EQ(tick, 3);
      const Json record =
          Json::read(entry.path().parent_path().parent_path().parent_path() / "sensors.json");
      const Json& sensor = record.at("sensors").at(0);
      EXPECT_EQ(sensor.at("kind").string(), "rangefinder");
      EXPECT_EQ(sensor.at("file").string(), "sensors/mcs4/laser.csv");
      EXPECT_EQ(sensor.at("channels").at(0).at("unit").string(), "m");
      EXPECT_EQ(sensor.at("body_from_sensor").at("translation_m").numbers(),
                (std::vector<double>{0.1, -0.2, 0.3}));
      EXPECT_EQ(sensor.at("body_from_sensor").at("quaternion_wxyz").numbers(),
                (std::vector<double>{0.8, 0.0, 0.6, 0.0}));
    }
    EXPECT_EQ(num_tables, 1);
  }
}

TEST_F(ExporterLaws, GeoreferencesAreTheFlights) {
  const TinyScene scene;
  for (const std::string& name : names()) {
    SCOPED_TRACE(name);
    run_export(capture(), toml(name), *folder / "out");
    const fs::path root = *folder / "out" / name;
    const Json sequence = Json::read(root / "dataset.json").at("sequences").at(std::size_t{0});
    EXPECT_EQ(sequence.at("num_frames").integer(), 2);
    EXPECT_EQ(sequence.at("utc_start").string(), "2024-06-21T10:00:00Z");
    EXPECT_TRUE(fs::is_directory(root / sequence.at("path").string()));
    const capture::SequenceInfo info = tiny_sequence(kAll);
    std::map<std::string, const capture::CameraCalibration*> calibrations;
    for (std::size_t i = 0; i < sequence.at("cameras").size(); ++i) {
      const Json& camera = sequence.at("cameras").at(i);
      const int index = info.camera_index(camera.at("rig").string(), camera.at("camera").string());
      ASSERT_GE(index, 0);
      const auto& truth = info.cameras[static_cast<std::size_t>(index)];
      calibrations[camera.at("name").string()] = &truth;
      EXPECT_EQ(camera.at("fx_px").number(), truth.intrinsics.parameters[0]);
      EXPECT_EQ(camera.at("cy_px").number(), truth.intrinsics.parameters[3]);
      const std::vector<double> t = camera.at("body_from_camera").at("translation_m").numbers();
      EXPECT_LE((Vector3d(t[0], t[1], t[2]) - truth.body_from_camera().translation).norm(), 1e-15);
    }
    std::istringstream lines(slurp(root / sequence.at("georeference").string()));
    std::string line;
    std::getline(lines, line);
    EXPECT_EQ(line, "frame,camera,time_s,lat_deg,lon_deg,height_m,qw,qx,qy,qz");
    std::size_t num_rows = 0;
    while (std::getline(lines, line)) {
      ++num_rows;
      for (char& c : line)
        if (c == ',') c = ' ';
      std::istringstream words(line);
      int frame;
      std::string camera;
      double time_s, lat_deg, lon_deg, height_m, w, x, y, z;
      ASSERT_TRUE(words >> frame >> camera >> time_s >> lat_deg >> lon_deg >> height_m >> w >> x >>
                  y >> z);
      EXPECT_NEAR(time_s, 0.1 * frame, 1e-9);
      const geo::Rigid3d truth = tiny_world_from_camera(kAll, frame, *calibrations.at(camera));
      const geo::Geodetic here{lat_deg, lon_deg, height_m};
      // The camera's centre is the origin of its own east-north-up; the text has 1e-6 m of height.
      const TangentChange enu_from_world = tangent_change(scene.origin, here);
      EXPECT_LE(enu_from_world(truth.translation).norm(), 1e-6);
      const Eigen::Matrix3d attitude = enu_from_world.rotation * truth.rotation.toRotationMatrix();
      EXPECT_LE((Eigen::Quaterniond(w, x, y, z).toRotationMatrix() - attitude).norm(), 1e-12);
    }
    EXPECT_EQ(num_rows, 2 * calibrations.size());
  }
}

/// Empty: NaN.
std::vector<double> numbers_of(const std::string& line) {
  std::vector<double> numbers;
  std::istringstream cells(line);
  for (std::string cell; std::getline(cells, cell, ',');)
    numbers.push_back(cell.empty() ? std::nan("") : std::strtod(cell.c_str(), nullptr));
  return numbers;
}

// Three digits, rounded up: no more than a per cent above, never below.
TEST_F(ExporterLaws, BoundsAreThoseOfTheCapture) {
  const capture::SequenceInfo info = tiny_sequence(kAll);
  for (const std::string& name : names()) {
    SCOPED_TRACE(name);
    run_export(capture(), toml(name), *folder / "out");
    const fs::path root = *folder / "out" / name;
    const Json sequence = Json::read(root / "dataset.json").at("sequences").at(std::size_t{0});
    std::map<std::string, int> indices;
    for (std::size_t i = 0; i < sequence.at("cameras").size(); ++i) {
      const Json& camera = sequence.at("cameras").at(i);
      indices[camera.at("name").string()] =
          info.camera_index(camera.at("rig").string(), camera.at("camera").string());
    }
    std::istringstream lines(slurp(root / sequence.at("bounds").string()));
    std::string line;
    std::getline(lines, line);
    EXPECT_EQ(line,
              "frame,camera,depth_error_mm,depth_rounding_mm,flow_error_px,flow_rounding_px,"
              "left_out,pixels");
    std::size_t num_rows = 0;
    while (std::getline(lines, line)) {
      ++num_rows;
      const std::size_t comma = line.find(','), next = line.find(',', comma + 1);
      const int frame = std::atoi(line.c_str());
      const int camera = indices.at(line.substr(comma + 1, next - comma - 1));
      const std::vector<double> cells = numbers_of(line.substr(next + 1));
      ASSERT_EQ(cells.size(), 6u) << line;
      const capture::LabelBounds truth = tiny_bounds(frame, camera);
      const auto expect_cell = [&](std::size_t i, double value) {
        EXPECT_GE(cells[i], value) << line;
        EXPECT_LE(cells[i], 1.01 * value) << line;
      };
      EXPECT_EQ(std::isnan(cells[0]), !truth.depth_m) << line;
      if (truth.depth_m) {
        expect_cell(0, 1e3 * truth.depth_m->arithmetic);
        expect_cell(1, 1e3 * truth.depth_m->rounding);
      }
      // The larger of the two directions, figure by figure.
      expect_cell(2, truth.flow_next_px->arithmetic);
      expect_cell(3, truth.flow_previous_px ? truth.flow_previous_px->rounding
                                            : truth.flow_next_px->rounding);
      EXPECT_EQ(cells[4], static_cast<double>(truth.num_left_out));
      const auto& image = info.cameras[static_cast<std::size_t>(camera)].intrinsics;
      EXPECT_EQ(cells[5], static_cast<double>(image.width_px) * image.height_px);
    }
    EXPECT_EQ(num_rows, 2 * indices.size());
  }
}

TEST_F(ExporterLaws, AFinishedDatasetIsKept) {
  for (const std::string& name : names()) {
    SCOPED_TRACE(name);
    run_export(capture(), toml(name), *folder / "out");
    const fs::path root = *folder / "out" / name;
    std::map<std::string, fs::file_time_type> times;
    for (const auto& [path, hash] : file_hashes(root))
      times[path] = fs::last_write_time(root / path);
    run_export(capture(), toml(name), *folder / "out");
    for (const auto& [path, time] : times)
      EXPECT_EQ(fs::last_write_time(root / path), time) << path;
  }
}

/// As a kill leaves an export: no dataset.json, and the journal of what was or was to be written.
void unfinish(const fs::path& root) {
  const Json dataset = Json::read(root / "dataset.json");
  std::string journal = Json::object()
                            .set("format", dataset.at("format").string())
                            .set("source_hash", dataset.at("source_hash").string())
                            .text(-1) +
                        "\n";
  for (const auto& [path, file] : dataset.at("files").members())
    journal += Json(file).set("path", path).text(-1) + "\n";
  core::write_file(root / "export.partial.jsonl", journal + "{\"bytes\": 12, \"xxh3_1");
  fs::remove(root / "dataset.json");
}

void flip_byte(const fs::path& file) {
  std::vector<std::byte> bytes = core::read_file(file);
  bytes[bytes.size() / 2] ^= std::byte{1};
  core::write_file(file, bytes);
}

TEST_F(ExporterLaws, AKilledExportIsTakenUp) {
  for (const std::string& name : names()) {
    SCOPED_TRACE(name);
    const fs::path root = *folder / "killed" / name;
    run_export(capture(), toml(name), *folder / "killed");
    const auto whole = file_hashes(root);
    unfinish(root);
    std::size_t i = 0;
    fs::path kept;
    for (const auto& [path, unused] : whole) {
      if (path == "dataset.json") continue;
      if (++i % 2 == 0)
        fs::remove(root / path);
      else if (fs::path(path).extension() == ".png")
        kept = root / path;
    }
    const bool has_images = !kept.empty();  // as files of their own; a bag is one file of all
    const auto time = has_images ? fs::last_write_time(kept) : fs::file_time_type();
    run_export(capture(), toml(name), *folder / "killed");
    EXPECT_EQ(file_hashes(root), whole);
    if (has_images) {
      EXPECT_EQ(fs::last_write_time(kept), time);  // what was finished is not made again
    }
  }
}

// Seen in 2026: whatever lay in the folder of a killed export was hashed and listed as right.
TEST_F(ExporterLaws, AKilledExportKeepsOnlyWhatItsRecordSays) {
  for (const std::string& name : names()) {
    SCOPED_TRACE(name);
    const fs::path root = *folder / "spoiled" / name;
    run_export(capture(), toml(name), *folder / "spoiled");
    const auto whole = file_hashes(root);
    unfinish(root);
    for (const auto& [path, unused] : whole)
      if (path != "dataset.json") flip_byte(root / path);
    run_export(capture(), toml(name), *folder / "spoiled");
    EXPECT_EQ(file_hashes(root), whole);
  }
}

// As between the moment at which the journal is there and that at which dataset.json is gone.
TEST_F(ExporterLaws, AKillAtAnyMomentOfTheClearingIsTakenUp) {
  for (const std::string& name : names()) {
    SCOPED_TRACE(name);
    const fs::path root = *folder / "between" / name;
    run_export(capture(), toml(name), *folder / "between");
    const auto whole = file_hashes(root);
    const std::string dataset = core::read_text_file(root / "dataset.json");
    const std::string hash = Json::parse(dataset, "x").at("source_hash").string();
    for (const bool is_of_others : {false, true}) {
      unfinish(root);
      std::string old = dataset;
      if (is_of_others) old.replace(old.find(hash), 4, "ffff");
      core::write_file(root / "dataset.json", old);
      run_export(capture(), toml(name), *folder / "between");
      EXPECT_EQ(file_hashes(root), whole);
      // And half way through the removal of what other sources made.
      core::write_file(root / "dataset.json", old);
      for (const auto& [path, unused] : whole)
        if (path != "dataset.json") {
          fs::remove(root / path);
          break;
        }
      run_export(capture(), toml(name), *folder / "between");
      EXPECT_EQ(file_hashes(root), whole);
    }
  }
}

TEST_F(ExporterLaws, DamagedFilesAreMadeAgain) {
  for (const std::string& name : names()) {
    SCOPED_TRACE(name);
    const fs::path root = *folder / "damaged" / name;
    run_export(capture(), toml(name), *folder / "damaged");
    const auto whole = file_hashes(root);
    std::size_t i = 0;
    for (const auto& [path, unused] : whole) {
      if (path == "dataset.json" || ++i % 3 != 0) continue;
      if (i % 9 == 0)
        fs::remove(root / path);
      else if (i % 9 == 3)
        fs::resize_file(root / path, 3);
      else
        flip_byte(root / path);
    }
    run_export(capture(), toml(name), *folder / "damaged");
    EXPECT_EQ(file_hashes(root), whole);
    // Nothing but one bit.
    flip_byte(root /
              (whole.rbegin()->first == "dataset.json" ? std::next(whole.rbegin()) : whole.rbegin())
                  ->first);
    run_export(capture(), toml(name), *folder / "damaged");
    EXPECT_EQ(file_hashes(root), whole);
  }
}

TEST_F(ExporterLaws, OtherSourcesReplaceTheDataset) {
  TinyCaptureOptions shorter = kAll;
  shorter.num_frames = 1;
  shorter.input_hash = "another";
  shorter.name = "other";
  write_tiny_capture(*folder / "capture2", kAll);
  write_tiny_capture(*folder / "capture3", shorter);
  for (const std::string& name : names()) {
    SCOPED_TRACE(name);
    run_export(*folder / "capture2", toml(name), *folder / "changed");
    run_export(*folder / "capture3", toml(name), *folder / "changed");
    run_export(*folder / "capture3", toml(name), *folder / "fresh");
    EXPECT_EQ(file_hashes(*folder / "changed" / name), file_hashes(*folder / "fresh" / name));
    // And what was left half done by other sources.
    unfinish(*folder / "changed" / name);
    run_export(*folder / "capture2", toml(name), *folder / "changed");
    unfinish(*folder / "changed" / name);
    run_export(*folder / "capture3", toml(name), *folder / "changed");
    EXPECT_EQ(file_hashes(*folder / "changed" / name), file_hashes(*folder / "fresh" / name));
  }
}

TEST_F(ExporterLaws, ForeignFilesAreNeverTouched) {
  for (const std::string& name : names()) {
    SCOPED_TRACE(name);
    const fs::path root = *folder / "foreign" / name;
    core::write_file(root / "thesis.txt", "years of work");
    expect_error(ErrorKind::Config, {"thesis.txt", "--out", name},
                 [&] { run_export(capture(), toml(name), *folder / "foreign"); });
    EXPECT_EQ(core::read_text_file(root / "thesis.txt"), "years of work");
    EXPECT_EQ(file_hashes(root).size(), 1U);
    // Beside a dataset of other sources, finished, under way, or of unknown ones.
    const fs::path beside = *folder / "beside" / name;
    run_export(capture(), toml(name), *folder / "beside");
    core::write_file(beside / "thesis.txt", "years of work");
    std::string dataset = core::read_text_file(beside / "dataset.json");
    const std::string hash = Json::parse(dataset, "x").at("source_hash").string();
    core::write_file(beside / "dataset.json", dataset.replace(dataset.find(hash), 4, "ffff"));
    const auto before = file_hashes(beside);
    expect_error(ErrorKind::Config, {"thesis.txt"},
                 [&] { run_export(capture(), toml(name), *folder / "beside"); });
    EXPECT_EQ(file_hashes(beside), before);
    unfinish(beside);
    expect_error(ErrorKind::Config, {"thesis.txt"},
                 [&] { run_export(capture(), toml(name), *folder / "beside"); });
    core::write_file(beside / "export.partial.jsonl", "damaged");
    expect_error(ErrorKind::Config, {"no export of terracast is known"},
                 [&] { run_export(capture(), toml(name), *folder / "beside"); });
    EXPECT_EQ(file_hashes(beside).size(), before.size());
  }
}

TEST_F(ExporterLaws, AForgedListDeletesNothingOutside) {
  for (const std::string& name : names()) {
    SCOPED_TRACE(name);
    const fs::path root = *folder / "forged" / name;
    run_export(capture(), toml(name), *folder / "forged");
    const std::string right = Json::read(root / "dataset.json").at("source_hash").string();
    fs::remove_all(root);
    core::write_file(*folder / "forged" / "victim" / "precious.txt", "keep");
    core::make_folder(root);
    fs::create_directory_symlink("../victim", root / "link");
    for (const std::string& hash : {right, std::string("old")}) {
      for (const std::string& path : std::vector<std::string>{
               "../victim/precious.txt", "../victim", "a/../../victim", "link/precious.txt",
               (*folder / "forged" / "victim").string(), ".", "./.", "link/", ""}) {
        SCOPED_TRACE(path);
        Json files = Json::object();
        files.set(path, Json::object().set("bytes", 4).set("xxh3_128", "0"));
        Json::object()
            .set("format", name)
            .set("source_hash", hash)
            .set("files", std::move(files))
            .write(root / "dataset.json");
        const auto expect_refusal = [&] {
          expect_error(ErrorKind::Input, {"\"" + path + "\"", "leaves"},
                       [&] { run_export(capture(), toml(name), *folder / "forged"); });
        };
        expect_refusal();
        unfinish(root);
        expect_refusal();
        fs::remove(root / "export.partial.jsonl");
        EXPECT_TRUE(fs::exists(*folder / "forged" / "victim" / "precious.txt"));
      }
    }
  }
}

// A dataset's image may have been replaced by a link to a copy elsewhere: that copy is not ours.
TEST_F(ExporterLaws, ALinkIsReplacedNotFollowed) {
  for (const std::string& name : names()) {
    SCOPED_TRACE(name);
    const fs::path root = *folder / "linked" / name;
    run_export(capture(), toml(name), *folder / "linked");
    const auto whole = file_hashes(root);
    core::write_file(*folder / "linked" / "elsewhere", "not ours");
    for (const auto& [path, unused] : whole) {
      if (path == "dataset.json") continue;
      fs::remove(root / path);
      fs::create_symlink(*folder / "linked" / "elsewhere", root / path);
    }
    run_export(capture(), toml(name), *folder / "linked");
    EXPECT_EQ(file_hashes(root), whole);
    EXPECT_EQ(core::read_text_file(*folder / "linked" / "elsewhere"), "not ours");
  }
}

TEST_F(ExporterLaws, ARigThatCannotFitIsRefusedBeforeAnythingIsWritten) {
  TinyCaptureOptions options = kAll;
  for (const std::string& name : names()) {
    SCOPED_TRACE(name);
    auto cameras = tiny_sequence(options).cameras;
    EXPECT_NO_THROW(export_options(toml(name)).exporter().check(cameras));
    // A rolling shutter is held where the format's own rules stay true.
    for (auto& camera : cameras) camera.shutter.line_time_s = 3e-5;
    const auto check = [&] { export_options(toml(name)).exporter().check(cameras); };
    // Images and their pixels alone; and tables of rays.
    const bool holds_any_camera = name == "coco" || name == "terracast";
    const bool has_pair = name != "colmap" && name != "euroc" && name != "mcap" && name != "tum" &&
                          !holds_any_camera && name != "kitti_object";
    if (name == "kitti_object") {
      expect_error(ErrorKind::Config, {name, "rolling shutter", "line_time_us = 30"}, check);
    } else {
      EXPECT_NO_THROW(check());
      for (auto& camera : cameras) camera.shutter.readout = geo::Readout::Right;
      if (has_pair)
        expect_error(ErrorKind::Config, {name, "by columns", "readout = \"right\"", "disparity"},
                     check);
      else
        EXPECT_NO_THROW(check());
      for (auto& camera : cameras) camera.shutter.readout = geo::Readout::Down;
      for (auto& camera : cameras)
        if (camera.name == "cam3" || camera.name == "rcam_front" || camera.name == "right")
          camera.shutter.line_time_s = 6e-5;
      if (has_pair)
        expect_error(ErrorKind::Config, {name, "other rolling shutters", "line_time_us = 60"},
                     check);
      else
        EXPECT_NO_THROW(check());
    }
    for (auto& camera : cameras) camera.shutter = {.exposure_s = 0.01};
    EXPECT_NO_THROW(export_options(toml(name)).exporter().check(cameras));
    for (auto& camera : cameras) camera.intrinsics.model = "equirectangular";
    if (holds_any_camera)
      EXPECT_NO_THROW(export_options(toml(name)).exporter().check(cameras));
    else
      expect_error(ErrorKind::Config, {name, "equirectangular", "pinhole"},
                   [&] { export_options(toml(name)).exporter().check(cameras); });
    expect_error(ErrorKind::Config, {}, [&] { export_options(toml(name)).exporter().check({}); });
  }
}

// Bodies may carry different rigs: a format is of those that carry the rig that it names, as if no others were there.
TEST_F(ExporterLaws, SequencesWithoutTheRigAreLeftOut) {
  const auto write = [](const fs::path& captures, const std::string& name, bool has_mcs4,
                        bool has_tartan) {
    write_tiny_capture(captures, {.name = name,
                                  .num_frames = 2,
                                  .has_tartan2 = has_tartan,
                                  .has_mcs4 = has_mcs4,
                                  .has_tartan_v1 = has_tartan});
  };
  const fs::path fleet = *folder / "fleet";
  write(fleet, "both", true, true);
  write(fleet, "first", true, false);
  write(fleet, "second", false, true);
  for (const std::string& name : names()) {
    SCOPED_TRACE(name);
    const bool is_of_all = export_options(toml(name)).exporter().rigs().empty();
    const std::string keys = name == "coco" ? "rig = \"mcs4\"\n"
                             : is_of_all    ? "rigs = [\"mcs4\"]\n"
                                            : "";
    const std::string rig = export_options(toml(name) + keys).exporter().rigs().at(0);
    const fs::path own = *folder / ("fleet_of_" + std::string(rig == "mcs4" ? rig : "tartan"));
    if (fs::create_directories(own))
      for (const char* each : {"both", rig == "mcs4" ? "first" : "second"})
        fs::copy(fleet / each, own / each, fs::copy_options::recursive);
    run_export(fleet, toml(name) + keys, *folder / "fleet_out");
    run_export(own, toml(name) + keys, *folder / "own_out");
    EXPECT_EQ(file_hashes(*folder / "fleet_out" / name), file_hashes(*folder / "own_out" / name));
    const Json dataset = Json::read(*folder / "fleet_out" / name / "dataset.json");
    EXPECT_EQ(dataset.at("sequences").size(), 2U);
    const std::string unknown =
        name == "coco" || !is_of_all ? "rig = \"mcs5\"\n" : "rigs = [\"mcs4\", \"mcs5\"]\n";
    expect_error(ErrorKind::Config, {"mcs5", "mcs4", "tartan2", name},
                 [&] { run_export(fleet, toml(name) + unknown, *folder / "fleet_out"); });
  }
  // Of two rigs each has what it has.
  run_export(fleet, toml("terracast") + "rigs = [\"mcs4\", \"tartan_v1\"]\n", *folder / "two_rigs");
  const fs::path root = *folder / "two_rigs/terracast";
  for (const char* name : {"both", "first", "second"}) {
    EXPECT_EQ(fs::exists(root / name / "mcs4"), std::string(name) != "second") << name;
    EXPECT_EQ(fs::exists(root / name / "tartan_v1"), std::string(name) != "first") << name;
    EXPECT_FALSE(fs::exists(root / name / "tartan2")) << name;
  }
}

TEST_F(ExporterLaws, ADamagedCaptureEndsTheExport) {
  write_tiny_capture(*folder / "capture4", kAll);
  for (const char* file :
       {"tartan2/lcam_front/000001.exr", "tartan_v1/left/000001.exr", "mcs4/cam0/000001.exr"})
    flip_byte(*folder / "capture4" / "valley" / file);
  for (const std::string& name : names()) {
    SCOPED_TRACE(name);
    expect_error(ErrorKind::Input, {"000001.exr", "damaged", "exporting " + name},
                 [&] { run_export(*folder / "capture4", toml(name), *folder / "out4"); });
    EXPECT_FALSE(fs::exists(*folder / "out4" / name / "dataset.json"));
  }
}

TEST_F(ExporterLaws, AFolderThatCannotBeWrittenIsAnIoError) {
  for (const std::string& name : names()) {
    SCOPED_TRACE(name);
    core::write_file(*folder / "blocked" / name, "a file where the folder should be");
    expect_error(ErrorKind::Io, {name},
                 [&] { run_export(capture(), toml(name), *folder / "blocked"); });
  }
}

TEST_F(ExporterLaws, OneFormatIsExportedOnce) {
  const core::Log log("export", core::LogLevel::Off);
  expect_error(ErrorKind::Config, {"two exports", "kitti"}, [&] {
    exporters::run_export_stage(open_all(capture()),
                                {export_options(toml("kitti")), export_options(toml("kitti"))},
                                *folder / "twice", {.log = log});
  });
}

}  // namespace
}  // namespace terracast::test
