// TUM's RGB-D layout: lists, stamps, poses and depth, read as its users read them.

#include <cmath>
#include <sstream>

#include "core/atomic_file.h"
#include "core/image_io.h"
#include "core/json.h"
#include "tests/export/exported.h"
#include "tests/export/readers.h"

namespace terracast::test {
namespace {

namespace fs = std::filesystem;
using core::ErrorKind;
using core::Json;
using Eigen::Vector3d;

constexpr double kPeriod_s = 0.1;  // of the tiny capture

TinyCaptureOptions small() {
  TinyCaptureOptions options;
  options.num_frames = 3;
  options.has_tartan2 = false;
  options.utc_start = "2024-06-21T10:00:00.123456789Z";
  return options;
}

std::vector<std::string> lines_of(const fs::path& file) {
  std::istringstream text(core::read_text_file(file));
  std::vector<std::string> lines;
  for (std::string line; std::getline(text, line);) lines.push_back(line);
  return lines;
}

/// As the monocular examples of the ORB-SLAM family read a list: three lines are skipped, whatever they hold.
struct Listed {
  std::vector<std::string> stamps, files;
};
Listed read_as_orb_slam(const fs::path& list) {
  std::istringstream text(core::read_text_file(list));
  std::string line;
  for (int i = 0; i < 3; ++i) std::getline(text, line);
  Listed listed;
  for (std::string stamp, file; text >> stamp >> file;) {
    listed.stamps.push_back(stamp);
    listed.files.push_back(file);
  }
  return listed;
}

/// As evo reads a trajectory: lines that begin with # are comments, others have eight numbers parted by single blanks.
std::vector<std::vector<double>> read_as_evo(const fs::path& file) {
  std::vector<std::vector<double>> rows;
  for (const std::string& line : lines_of(file)) {
    if (line.starts_with("#")) continue;
    rows.emplace_back();
    std::istringstream cells(line);
    for (std::string cell; std::getline(cells, cell, ' ');) rows.back().push_back(std::stod(cell));
    EXPECT_EQ(rows.back().size(), 8U) << line;
  }
  return rows;
}

struct Tum : testing::Test {
  ScratchFolder scratch;

  fs::path run(const TinyCaptureOptions& options, const std::string& keys = "") {
    write_tiny_capture(scratch / "capture", options);
    run_export(scratch / "capture", "format = \"tum\"\n" + keys, scratch / "out");
    return scratch / "out/tum";
  }

  /// Holds the images of depth against the scene itself.
  void expect_depth_of_scene(double factor, const std::string& keys) {
    const fs::path root = run(small(), keys);
    const TinyScene scene;
    std::int64_t num_pixels = 0, num_left_out = 0;
    double farthest_m = 0.0;
    for (const capture::CameraCalibration& camera : tiny_sequence(small()).cameras) {
      const fs::path folder = root / "valley" / camera.rig / camera.name;
      const Listed depth = read_as_orb_slam(folder / "depth.txt");
      ASSERT_EQ(depth.files.size(), 3U);
      for (int frame = 0; frame < 3; ++frame) {
        const auto image = std::get<core::Image16>(core::decode_png(
            core::read_file(folder / depth.files[static_cast<std::size_t>(frame)]), "depth"));
        const geo::Rigid3d world_from_camera = tiny_world_from_camera(small(), frame, camera);
        for (int y = 0; y < image.height(); ++y)
          for (int x = 0; x < image.width(); ++x) {
            const Vector3d ray = tiny_ray(camera, x + 0.5, y + 0.5);
            const double along =
                scene.cast(world_from_camera.translation, world_from_camera.rotation * ray).range_m;
            const double depth_m = along * ray.z() / ray.norm();
            const auto found = static_cast<double>(image(x, y));
            if (!std::isfinite(depth_m)) {
              ASSERT_EQ(found, 0.0);
              continue;
            }
            ++num_pixels;
            farthest_m = std::max(farthest_m, depth_m);
            if (depth_m * factor > 65535.5) {
              ++num_left_out;
              ASSERT_EQ(found, 0.0) << depth_m;
            } else {
              ASSERT_NEAR(found, depth_m * factor, 0.52) << depth_m;
            }
          }
      }
    }
    EXPECT_GT(num_left_out, 0);
    const Json told = Json::read(root / "dataset.json").at("depth_images");
    EXPECT_EQ(told.at("factor").number(), factor);
    EXPECT_EQ(told.at("pixels").integer(), num_pixels);
    EXPECT_EQ(told.at("left_out").integer(), num_left_out);
    EXPECT_EQ(told.at("too_far").integer(), num_left_out);
    EXPECT_EQ(told.at("behind").integer(), 0);
    EXPECT_NEAR(told.at("reach_m").number(), 65535.0 / factor, 1e-9);
  }
};

TEST_F(Tum, ListsNameFilesByTheirWholeNanoseconds) {
  const fs::path folder = run(small()) / "valley/mcs4/cam1";
  const Listed rgb = read_as_orb_slam(folder / "rgb.txt"),
               depth = read_as_orb_slam(folder / "depth.txt");
  const std::vector<std::string> stamps = {"1718964000.123456789", "1718964000.223456789",
                                           "1718964000.323456789"};
  EXPECT_EQ(rgb.stamps, stamps);
  EXPECT_EQ(depth.stamps, stamps);
  EXPECT_EQ(lines_of(folder / "depth.txt").at(1), "# depth_factor: 5000");
  const std::vector<std::string> both = lines_of(folder / "associations.txt");
  ASSERT_EQ(both.size(), 3U);
  for (std::size_t f = 0; f < 3; ++f) {
    EXPECT_EQ(rgb.files[f], "rgb/" + stamps[f] + ".png");
    EXPECT_EQ(depth.files[f], "depth/" + stamps[f] + ".png");
    EXPECT_EQ(both[f], fmt::format("{0} {1} {0} {2}", stamps[f], rgb.files[f], depth.files[f]));
    const auto color = core::decode_png(core::read_file(folder / rgb.files[f]), "color");
    EXPECT_EQ(std::get<core::Image8>(color).channels(), 3);
    EXPECT_TRUE(fs::exists(folder / "range" / (stamps[f] + ".npy")));
  }
  for (const char* list : {"rgb.txt", "depth.txt", "groundtruth.txt"}) {
    const std::vector<std::string> lines = lines_of(folder / list);
    for (std::size_t i = 0; i < lines.size(); ++i)
      EXPECT_EQ(lines[i].starts_with("# "), i < 3) << list << ": " << lines[i];
  }
}

TEST_F(Tum, PosesAreThoseOfTheFlight) {
  const fs::path root = run(small()) / "valley";
  const auto cameras = tiny_sequence(small()).cameras;
  const auto expect_same_ways = [&](const fs::path& file, const auto& world_from_source) {
    const auto rows = read_as_evo(file);
    ASSERT_EQ(rows.size(), 3U) << file;
    const auto pose = [&](std::size_t i) {
      return geo::Rigid3d{{rows[i][7], rows[i][4], rows[i][5], rows[i][6]},
                          {rows[i][1], rows[i][2], rows[i][3]}};
    };
    for (const std::size_t i : {1U, 2U}) {
      EXPECT_NEAR(rows[i][0] - rows[i - 1][0], kPeriod_s, 1e-6);
      const geo::Rigid3d way = pose(0).inverse() * pose(i);
      const geo::Rigid3d right =
          world_from_source(0).inverse() * world_from_source(static_cast<int>(i));
      EXPECT_LT((way.translation - right.translation).norm(), 1e-7) << file;
      EXPECT_LT(way.rotation.angularDistance(right.rotation), 1e-12) << file;
    }
  };
  for (const capture::CameraCalibration& camera : cameras)
    expect_same_ways(root / camera.rig / camera.name / "groundtruth.txt",
                     [&](int frame) { return tiny_world_from_camera(small(), frame, camera); });
  expect_same_ways(root / "trajectories/body.txt",
                   [&](int frame) { return tiny_world_from_body(small(), frame); });
}

TEST_F(Tum, DepthIsTheNearestCountAndZeroBeyondItsReach) {
  expect_depth_of_scene(300.0, "depth_factor = 300.0\n");
}

TEST_F(Tum, TheBenchmarksOwnFactorLeavesOutWhatIsFar) {
  expect_depth_of_scene(5000.0, "range = false\n");
  EXPECT_FALSE(fs::exists(scratch / "out/tum/valley/mcs4/cam0/range"));
}

TEST_F(Tum, LensesOfOpenCvAreHeldAndOthersRefused) {
  auto cameras = tiny_sequence(small()).cameras;
  const auto check = [&] { export_options("format = \"tum\"").exporter().check(cameras); };
  for (const char* model : {"pinhole", "simple_radial", "radial", "opencv", "opencv_fisheye"}) {
    cameras[0].intrinsics.model = model;
    EXPECT_NO_THROW(check());
  }
  cameras[0].intrinsics.model = "double_sphere";
  expect_error(ErrorKind::Config,
               {"tum", "mcs4/cam0", "double_sphere", "opencv_fisheye", "terracast rig export"},
               check);
}

TEST_F(Tum, FramesBefore1970AreRefused) {
  TinyCaptureOptions options = small();
  options.utc_start = "1969-12-31T23:59:59Z";
  expect_error(ErrorKind::Config, {"tum", "frame 0 of sequence valley", "before 1970"},
               [&] { run(options); });
}

}  // namespace
}  // namespace terracast::test
