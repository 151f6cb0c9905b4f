// Vehicles that see each other and carry different rigs, from the config to the reports on datasets in which every bound
// holds; and as a batch.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <sstream>

#include "capture/frame_reader.h"
#include "core/atomic_file.h"
#include "core/image_io.h"
#include "core/instance_id.h"
#include "core/json.h"
#include "tests/e2e/tiny_job.h"
#include "tests/support/run_program.h"
#include "tests/support/test_data.h"

namespace terracast::test {
namespace {

namespace fs = std::filesystem;
using core::Json;
using Eigen::Vector2d;
using Eigen::Vector3d;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

/// Two drones behind each other, of which the second looks back by a fisheye, and an aeroplane above them, whose camera
/// looks down on both and is not quite where it is believed to be. The drones have the form of trucks: nothing of these
/// is thinner than the pixels of such small images, where masks cannot be held against each other.
/// first   what the first drone carries beside the tiny job's pair of pinholes
std::string fleet_text(const std::string& first_rigs, const std::string& more) {
  std::string text = tiny_job_text(R"([[exports]]
format = "kitti"
rig = "pair"
left = "left"
right = "right"
disparity = "off"

[[exports]]
format = "terracast"
rigs = ["eye", "down"]

[[rigs]]
name = "eye"
mount_yaw_deg = 180.0
mount_pitch_deg = 30.0

[[rigs.cameras]]
name = "cam"
model = "opencv_fisheye"
width_px = 128
height_px = 120
fx_px = 60.0
fy_px = 61.0
k1 = 0.02
k2 = -0.01

[[rigs]]
name = "down"
mount_pitch_deg = 90.0

[rigs.errors]
azimuth_sd_deg = 0.2
offset_sd_mm = [5.0, 5.0, 5.0]

[[rigs.cameras]]
name = "cam"
width_px = 160
height_px = 100
fx_px = 70.0
fy_px = 70.0

[[trajectories]]
name = "drone2"
rigs = ["eye"]
kind = "orbit"
centre = {east_m = 0.0, north_m = 0.0, height_m = 248.0, above = "ground"}
radius_m = 300.0
speed_mps = 30.0
start_azimuth_deg = 87.0
rate_hz = 1.0
num_frames = 4
shown_as = "box_truck"

[[trajectories]]
name = "plane"
rigs = ["down"]
kind = "orbit"
centre = {east_m = 0.0, north_m = 0.0, height_m = 290.0, above = "ground"}
radius_m = 300.0
speed_mps = 30.0
start_azimuth_deg = 88.0
rate_hz = 1.0
num_frames = 4
shown_as = "light_aircraft"

)" + more);
  text = replaced(text, "name = \"P000\"\nkind = \"orbit\"\n",
                  "name = \"drone1\"\nrigs = [" + first_rigs +
                      "]\nshown_as = \"box_truck\"\nkind = \"orbit\"\nstart_azimuth_deg = 90.0\n");
  text = replaced(text, "num_frames = 4", "num_frames = 3");  // of the first drone
  text = replaced(text, "finest_spacing_m = 4.0", "finest_spacing_m = 16.0");
  text = replaced(text, "format = \"colmap\"\n",
                  "format = \"colmap\"\nrigs = [\"pair\", \"eye\", \"down\"]\n");
  text = replaced(text, "name = \"tiny\"\n\n", "name = \"tiny\"\nshared_geometry = true\n\n");
  return replaced(text, "mount_pitch_deg = 40.0", "mount_pitch_deg = 15.0");
}

constexpr const char* kTartan = R"([[exports]]
format = "tartanair"
rig = "tartan"
left = "left"
right = "right"

[[rigs]]
name = "tartan"
mount_pitch_deg = 15.0

[[rigs.cameras]]
name = "left"
width_px = 640
height_px = 640
fx_px = 320.0
fy_px = 320.0

[[rigs.cameras]]
name = "right"
width_px = 640
height_px = 640
fx_px = 320.0
fy_px = 320.0
offset_mm = [0.0, -250.0, 0.0]

[[labels]]
kind = "pairs"
cameras = ["pair/left pair/right", "drone1/pair/left drone2/eye/cam", "drone2/eye/cam drone1/pair/right", "plane/down/cam drone2/eye/cam"]
)";

std::vector<std::string> cameras_of(const capture::SequenceReader& sequence) {
  std::vector<std::string> names;
  for (const capture::CameraCalibration& camera : sequence.info().cameras)
    names.push_back(camera.rig + "/" + camera.name);
  return names;
}

/// The bodies that a camera of a sequence shows in any frame.
std::set<std::string> bodies_shown(const capture::SequenceReader& sequence, int camera) {
  std::set<std::string> names;
  for (int frame = 0; frame < sequence.info().num_frames; ++frame) {
    const auto facts = sequence.read_camera(frame, camera, capture::SequenceReader::kFacts);
    for (const capture::MovingBody& body : sequence.info().moving)
      for (const std::uint32_t id : facts.instance_id.data())
        if (id == body.instance_id && !body.is_part()) names.insert(body.name);
  }
  return names;
}

/// Where the fisheye shows a point of its camera's frame, by the model's publication (Kannala and Brandt 2006, as OpenCV
/// writes it); nothing: not in its image, which ends before 86 degrees off the axis.
std::optional<Vector2d> eye_pixel(const Vector3d& point) {
  const double r = std::hypot(point.x(), point.y());
  const double a = std::atan2(r, point.z());
  if (a > 1.5) return std::nullopt;
  const double bent = a * (1.0 + 0.02 * std::pow(a, 2) - 0.01 * std::pow(a, 4));
  const Vector2d at(64.0 + 60.0 * bent * point.x() / r, 60.0 + 61.0 * bent * point.y() / r);
  const bool is_inside = at.x() > 0.0 && at.y() > 0.0 && at.x() < 128.0 && at.y() < 120.0;
  return is_inside ? std::optional(at) : std::nullopt;
}

/// Holds the flow from the plane's pinhole, as it is, to the second drone's fisheye against the ranges and poses of
/// both.
/// returns   how many pixels show what stands still and is in the other image
int check_pair(const capture::SequenceReader& plane, const capture::SequenceReader& drone2) {
  const fs::path file = plane.folder() / "labels/pairs/down/cam/drone2/eye/cam/000001_000001.exr";
  const auto pair = core::decode_exr(core::read_file(file), file.string()).at(0);
  const auto facts = plane.read_camera(1, 0, capture::SequenceReader::kFacts);
  const geo::Rigid3d eye_from_down =
      drone2.world_from_camera(1, 0).inverse() * plane.world_from_camera(1, 0);
  // Ranges of 400 m and flows of 200 px are floats, and the other camera is 30 m or more away.
  constexpr double kTolerance_px = 2e-4;
  int num_checked = 0, num_beyond = 0;
  for (int y = 0; y < 100; ++y)
    for (int x = 0; x < 160; ++x) {
      const float range_m = facts.range_m(x, y);
      if (!std::isfinite(range_m) || facts.instance_id(x, y) >= core::kFirstMovingId) continue;
      const Vector3d ray((x + 0.5 - 80.0) / 70.0, (y + 0.5 - 50.0) / 70.0, 1.0);
      const auto there = eye_pixel(eye_from_down * (double{range_m} * ray.normalized()));
      const std::uint32_t sight = pair.uint_channels.at("sight")(x, y);
      constexpr std::uint32_t kHidden = 1, kSeen = 2, kOutOfView = 3;
      bool is_right = there ? sight == kHidden || sight == kSeen : sight == kOutOfView;
      if (!there) {
        ++num_beyond;
      } else {
        ++num_checked;
        const Vector2d found(x + 0.5 + double{pair.float_channels.at("flow.x")(x, y)},
                             y + 0.5 + double{pair.float_channels.at("flow.y")(x, y)});
        is_right &= (found - *there).cwiseAbs().maxCoeff() <= kTolerance_px;
      }
      if (!is_right) {
        ADD_FAILURE() << "at " << x << " " << y << ", sight " << sight;
        return num_checked;
      }
    }
  EXPECT_GT(num_beyond, 100);
  return num_checked;
}

std::set<std::string> pairs_of(const fs::path& labels) {
  std::set<std::string> names;
  const Json index = Json::read(labels / "pairs/pairs.json");
  for (std::size_t i = 0; i < index.at("pairs").size(); ++i) {
    const Json& pair = index.at("pairs").at(i);
    const std::string other =
        pair.has("other_sequence") ? pair.at("other_sequence").string() + "/" : "";
    names.insert(pair.at("camera").string() + " " + other + pair.at("other_camera").string());
  }
  return names;
}

TEST(Fleet, VehiclesOfDifferentRigsSeeEachOtherAndEveryBoundHolds) {
  const ScratchFolder scratch;
  const fs::path job =
      write_text(scratch / "job.toml", fleet_text("\"tartan\", \"pair\"", kTartan));
  const fs::path out = scratch / "out";
  const ProgramResult run = run_program({"run", job.string(), "--out", out.string()});
  ASSERT_EQ(run.status, 0) << run.output;
  // Whoever is left out is told, once.
  for (const char* line :
       {"kitti: sequence drone2 is left out, none of its rigs (eye)",
        "kitti: sequence plane is left out", "tartanair: sequence plane is",
        "terracast: sequence drone1 is left out, none of its rigs (pair, tartan)",
        "pairs: sequence drone2 has not both pair/left and pair/right"}) {
    const auto at = run.output.find(line);
    ASSERT_NE(at, std::string::npos) << line << "\n" << run.output;
    EXPECT_EQ(run.output.find(line, at + 1), std::string::npos) << line;
  }
  EXPECT_THAT(run.output, Not(HasSubstr("colmap: sequence")));

  const fs::path capture = out / "capture";
  const auto drone1 = capture::SequenceReader::open(capture / "drone1");
  const auto drone2 = capture::SequenceReader::open(capture / "drone2");
  const auto plane = capture::SequenceReader::open(capture / "plane");
  EXPECT_THAT(cameras_of(drone1),
              ElementsAre("pair/left", "pair/right", "tartan/left", "tartan/right"));
  EXPECT_THAT(cameras_of(drone2), ElementsAre("eye/cam"));
  EXPECT_THAT(cameras_of(plane), ElementsAre("down/cam"));
  EXPECT_NE(plane.info().believed()[0], plane.info().cameras[0]);
  EXPECT_TRUE(bodies_shown(drone1, 0).contains("drone2"));
  EXPECT_TRUE(bodies_shown(drone2, 0).contains("drone1"));
  EXPECT_TRUE(bodies_shown(plane, 0).contains("drone1"));
  EXPECT_TRUE(bodies_shown(plane, 0).contains("drone2"));

  // Which sequences a format has, and with which cameras; KITTI has each in grey and in colour.
  const std::map<std::string, std::vector<std::vector<std::string>>> expected = {
      {"kitti", {{"pair", "pair", "pair", "pair"}}},
      {"tartanair", {{"tartan", "tartan"}}},
      {"terracast", {{"eye"}, {"down"}}},
      {"colmap", {{"pair", "pair"}, {"eye"}, {"down"}}}};
  for (const auto& [format, rigs] : expected) {
    std::vector<std::vector<std::string>> found;
    const Json dataset = Json::read(out / "export" / format / "dataset.json");
    for (std::size_t i = 0; i < dataset.at("sequences").size(); ++i) {
      found.emplace_back();
      const Json& cameras = dataset.at("sequences").at(i).at("cameras");
      for (std::size_t k = 0; k < cameras.size(); ++k)
        found.back().push_back(cameras.at(k).at("rig").string());
    }
    EXPECT_EQ(found, rigs) << format;
    EXPECT_TRUE(fs::exists(out / "report" / format / "index.html"));
  }
  for (const auto& [name, num_cameras] :
       std::map<std::string, std::size_t>{{"drone1", 2}, {"drone2", 1}, {"plane", 1}}) {
    const Json rigs = Json::read(out / "export/colmap" / name / "rig_config.json");
    ASSERT_EQ(rigs.size(), 1U) << name;
    EXPECT_EQ(rigs.at(std::size_t{0}).at("cameras").size(), num_cameras) << name;
    // Only the plane's camera is not what it is believed to be.
    EXPECT_EQ(fs::exists(out / "export/colmap" / name / "calibration_true.json"), name == "plane");
  }

  EXPECT_THAT(pairs_of(capture / "drone1/labels"),
              ElementsAre("pair/left drone2/eye/cam", "pair/left pair/right"));
  EXPECT_THAT(pairs_of(capture / "drone2/labels"), ElementsAre("eye/cam drone1/pair/right"));
  EXPECT_THAT(pairs_of(capture / "plane/labels"), ElementsAre("down/cam drone2/eye/cam"));
  EXPECT_GT(check_pair(plane, drone2), 1000);
}

TEST(Fleet, MergedAsABatchEachFormatListsItsOwn) {
  const ScratchFolder scratch;
  const std::string text =
      fleet_text("\"pair\"", "[[sweep.list]]\nkeys = [\"seed\"]\nrows = [[4]]\n");
  const fs::path config = write_text(scratch / "fleet.toml", text);
  const fs::path job = scratch / "job";
  const ProgramResult plan =
      run_program({"batch", "plan", config.string(), "--out", job.string(), "-q"});
  ASSERT_EQ(plan.status, 0) << plan.output;
  const ProgramResult run = run_program({"batch", "run", job.string(), "-q"});
  ASSERT_EQ(run.status, 0) << run.output;
  const ProgramResult verify =
      run_program({"batch", "verify", job.string(), "--samples", "2", "-q"});
  ASSERT_EQ(verify.status, 0) << verify.output;
  std::map<std::string, std::vector<std::string>> formats;
  std::istringstream index(core::read_text_file(job / "dataset/index.jsonl"));
  for (std::string line; std::getline(index, line);) {
    const Json sequence = Json::parse(line, "index.jsonl");
    formats[sequence.at("sequence").string()] = sequence.at("formats").strings();
    EXPECT_EQ(sequence.at("cameras").integer(),
              sequence.at("sequence").string() == "drone1" ? 2 : 1);
  }
  EXPECT_THAT(formats["drone1"], ElementsAre("colmap", "kitti"));
  EXPECT_THAT(formats["drone2"], ElementsAre("colmap", "terracast"));
  EXPECT_THAT(formats["plane"], ElementsAre("colmap", "terracast"));
  EXPECT_TRUE(fs::exists(job / "dataset/kitti/run0000/dataset/sequences/00"));
  EXPECT_FALSE(fs::exists(job / "dataset/kitti/run0000/dataset/sequences/01"));
  EXPECT_THAT(core::read_text_file(job / "dataset/README.md"),
              AllOf(HasSubstr("| eye "), HasSubstr("| pair "), HasSubstr("| down ")));
}

// Before anything is made.
TEST(Fleet, ARigThatNobodyCarriesIsRefused) {
  const ScratchFolder scratch;
  const auto refused = [&](const std::string& what, const std::string& by, const char* message) {
    const fs::path job =
        write_text(scratch / "job.toml", replaced(fleet_text("\"pair\"", ""), what, by));
    for (const char* command : {"run", "render"}) {
      const ProgramResult run =
          run_program({command, job.string(), "--out", (scratch / "out").string(), "-q"});
      EXPECT_EQ(run.status, 2) << run.output;
      EXPECT_THAT(run.output, HasSubstr(message));
    }
    const ProgramResult plan =
        run_program({"batch", "plan", job.string(), "--out", (scratch / "job").string(), "-q"});
    EXPECT_EQ(plan.status, 2) << plan.output;
    EXPECT_THAT(plan.output, HasSubstr(message));
    EXPECT_FALSE(fs::exists(scratch / "out/world"));
  };
  refused("rigs = [\"eye\"]", "rigs = [\"eie\"]", "unknown rig \"eie\"");
  refused("rigs = [\"eye\"]", "rigs = [\"pair\"]", "no trajectory carries the rig eye");
  refused("rig = \"pair\"\nleft", "rig = \"pairs\"\nleft", "unknown rig \"pairs\"");
}

}  // namespace
}  // namespace terracast::test
