#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <set>

#include "core/atomic_file.h"
#include "core/registry.h"
#include "core/schema_writer.h"
#include "core/toml_reader.h"
#include "rigs/rig_format.h"
#include "tests/rigs/shipped_rigs.h"
#include "tests/support/expect_error.h"

namespace terracast::rigs {
namespace {

using core::ErrorKind;
using test::expect_error;
namespace fs = std::filesystem;

/// Where a format writes to in a folder.
fs::path path_in(const fs::path& folder, const RigFormatInfo& format) {
  if (format.name == "colmap") return folder / "colmap";
  const bool is_table = format.name == "csv" || format.name == "xlsx";
  return folder / (std::string("rig.") + (is_table ? std::string(format.name) : "yaml"));
}

void expect_same_cameras(const rigs::RigOptions& expected, const rigs::RigOptions& found) {
  const auto ours = rigs::build_cameras({expected}), theirs = rigs::build_cameras({found});
  ASSERT_EQ(ours.size(), theirs.size());
  for (std::size_t i = 0; i < ours.size(); ++i) {
    SCOPED_TRACE(ours[i].name);
    EXPECT_EQ(ours[i].rig, theirs[i].rig);
    EXPECT_EQ(ours[i].name, theirs[i].name);
    EXPECT_EQ(ours[i].intrinsics.model, theirs[i].intrinsics.model);
    EXPECT_EQ(ours[i].intrinsics.width_px, theirs[i].intrinsics.width_px);
    EXPECT_EQ(ours[i].intrinsics.height_px, theirs[i].intrinsics.height_px);
    ASSERT_EQ(ours[i].intrinsics.parameters.size(), theirs[i].intrinsics.parameters.size());
    // The bounds that RigFormatInfo promises: some roundings of doubles.
    for (std::size_t k = 0; k < ours[i].intrinsics.parameters.size(); ++k)
      EXPECT_NEAR(ours[i].intrinsics.parameters[k], theirs[i].intrinsics.parameters[k], 1e-9);
    const geo::Rigid3d& a = ours[i].rig_from_camera;
    const geo::Rigid3d& b = theirs[i].rig_from_camera;
    EXPECT_LT((a.translation - b.translation).norm(), 1e-12);
    EXPECT_LT((a.rotation.toRotationMatrix() - b.rotation.toRotationMatrix()).norm(), 1e-12);
  }
}

TEST(RigFormats, GiveEachRigBack) {
  const fs::path folder = test_folder("round_trip");
  for (const fs::path& file : shipped_rigs()) {
    const rigs::RigOptions rig = read_rig(file);
    for (const RigFormatInfo& format : rig_formats()) {
      if (format.write == nullptr) continue;
      SCOPED_TRACE(fmt::format("{} as {}", rig.name, format.name));
      const fs::path path = path_in(folder, format);
      format.write(rig, path);
      EXPECT_EQ(find_rig_format(path).name, format.name);
      expect_same_cameras(rig, format.read(path, {}).rig);
    }
  }
}

/// A lens of each model that keys describe; away from its defaults, so that no other model is the same.
std::vector<geo::CameraIntrinsics> lenses() {
  const std::pair<const char*, std::vector<double>> own[] = {
      {"pinhole", {}},
      {"simple_radial", {-0.1}},
      {"radial", {-0.1, 0.01}},
      {"opencv", {-0.1, 0.01, 1e-3, -2e-3}},
      {"full_opencv", {-0.1, 0.01, 1e-3, -2e-3, 3e-3, -0.02, 4e-3, 5e-4}},
      {"opencv_fisheye", {0.01, -2e-3, 1e-3, -1e-4}},
      {"thin_prism_fisheye", {0.01, -2e-3, 1e-3, -1e-3, 3e-3, -1e-4, 2e-3, -3e-3}},
      {"fov", {0.9}},
      {"unified", {0.8, -0.1, 0.01, 1e-3, -2e-3}},
      {"extended_unified", {0.6, 1.1}},
      {"double_sphere", {-0.2, 0.55}},
      {"equirectangular", {}},
      {"cylindrical", {}},
  };
  std::vector<geo::CameraIntrinsics> lenses;
  for (const auto& [model, parameters] : own) {
    const bool has_one_focal_length = std::string(model).ends_with("radial");
    geo::CameraIntrinsics& lens = lenses.emplace_back(geo::CameraIntrinsics{
        model, 320, 240, {300.0, has_one_focal_length ? 300.0 : 301.0, 160.5, 119.0}});
    lens.parameters.insert(lens.parameters.end(), parameters.begin(), parameters.end());
  }
  return lenses;
}

rigs::RigOptions rig_of_lens(const geo::CameraIntrinsics& lens) {
  geo::Rigid3d second = rigs::rig_from_eye_camera(30.0, 50.0, 170.0);
  return rig_of_cameras("r", {{.rig = "r",
                               .name = "first",
                               .intrinsics = lens,
                               .rig_from_camera = rigs::rig_from_eye_camera(0.0, 0.0, 170.0),
                               .body_from_rig = {}},
                              {.rig = "r",
                               .name = "second",
                               .intrinsics = lens,
                               .rig_from_camera = second,
                               .body_from_rig = {}}});
}

/// What a lens comes back as: to Kalibr and OpenCV one of one or two radial terms is `opencv` with zeros.
rigs::RigOptions rig_as_held(const geo::CameraIntrinsics& lens, std::string_view format) {
  geo::CameraIntrinsics held = lens;
  if (lens.model.ends_with("radial") && (format == "kalibr" || format == "opencv")) {
    held.model = "opencv";
    while (held.parameters.size() < 8) held.parameters.push_back(0.0);
  }
  return rig_of_lens(held);
}

TEST(RigFormats, HoldTheirModelsAndRefuseOthers) {
  const fs::path folder = test_folder("models");
  const std::map<std::string_view, std::set<std::string>> held = {
      {"colmap",
       {"pinhole", "simple_radial", "radial", "opencv", "full_opencv", "opencv_fisheye",
        "thin_prism_fisheye", "fov"}},
      {"kalibr",
       {"pinhole", "simple_radial", "radial", "opencv", "opencv_fisheye", "fov", "unified",
        "extended_unified", "double_sphere"}},
      {"opencv",
       {"pinhole", "simple_radial", "radial", "opencv", "full_opencv", "opencv_fisheye"}}};
  for (const geo::CameraIntrinsics& lens : lenses()) {
    const rigs::RigOptions rig = rig_of_lens(lens);
    ASSERT_EQ(rigs::build_cameras({rig})[0].intrinsics, lens);
    for (const RigFormatInfo& format : rig_formats()) {
      if (format.write == nullptr) continue;
      SCOPED_TRACE(fmt::format("{} as {}", lens.model, format.name));
      const fs::path path = path_in(folder, format);
      if (format.is_table || held.at(format.name).contains(lens.model)) {
        format.write(rig, path);
        expect_same_cameras(rig_as_held(lens, format.name), format.read(path, {}).rig);
      } else {
        expect_error(ErrorKind::Config, {"camera first", "no model " + lens.model, "pinhole"},
                     [&] { format.write(rig, path); });
      }
    }
  }
}

TEST(RigFormats, TablesTakeCamerasOfSeveralModels) {
  const fs::path folder = test_folder("mixed");
  std::vector<capture::CameraCalibration> cameras;
  for (const geo::CameraIntrinsics& lens : lenses())
    cameras.push_back({.rig = "r",
                       .name = lens.model,
                       .intrinsics = lens,
                       .rig_from_camera = rigs::rig_from_eye_camera(0.0, 0.0, 10.0),
                       .body_from_rig = {}});
  const rigs::RigOptions rig = rig_of_cameras("r", cameras);
  for (const char* name : {"csv", "xlsx"}) {
    const auto& format = core::find_registered(rig_formats(), "format", name);
    format.write(rig, path_in(folder, format));
    expect_same_cameras(rig, format.read(path_in(folder, format), {}).rig);
  }
}

/// A rig that states something of all that a rig may.
rigs::RigOptions full_rig() {
  rigs::RigOptions rig;
  core::TomlDocument::parse(R"(
name = "full"
mount_pitch_deg = 30.0
mount_offset_m = [1.0, 2.0, 3.0]
[errors]
focal_length_sd_px = 2.5
offset_sd_mm = [1.0, 0.5, 0.25]
clock_drift_sd_ppm = 20.0
[imaging.lens]
vignetting_polynomial = [-0.1, 0.02, 0.0]
[imaging.exposure]
mode = "automatic"
target = 0.12
[imaging.sensor]
bits = 12
full_well_e = 10000.0
mosaic = "rggb"
[imaging.color]
curve = "gamma"
gamma = 1.8
white_balance = "gains"
gains = [1.5, 1.0, 2.0]
[[cameras]]
name = "c"
width_px = 640
height_px = 480
fx_px = 300.0
exposure_ms = 2.0
line_time_us = 10.0
readout = "up"
[[cameras]]
name = "d"
width_px = 640
height_px = 480
fx_px = 300.0
aperture_mm = 2.0
focus_m = 5.0
)",
                            "full.toml")
      .read(rig);
  return rig;
}

TEST(RigFormats, TablesHoldErrorsAndImagingToo) {
  const fs::path folder = test_folder("full");
  for (const RigFormatInfo& format : rig_formats()) {
    if (!format.is_table) continue;
    SCOPED_TRACE(format.name);
    format.write(full_rig(), path_in(folder, format));
    EXPECT_EQ(rig_toml(format.read(path_in(folder, format), {}).rig), rig_toml(full_rig()));
    EXPECT_TRUE(keys_left_out(format, full_rig()).empty());
  }
}

TEST(RigFormats, OthersSayWhatTheyLeaveOut) {
  const std::vector<std::string> wanted = {
      "mount_pitch_deg",           "mount_offset_m",
      "errors.focal_length_sd_px", "errors.offset_sd_mm",
      "errors.clock_drift_sd_ppm", "imaging.lens.vignetting_polynomial",
      "imaging.exposure.mode",     "imaging.exposure.target",
      "imaging.sensor.bits",       "imaging.sensor.full_well_e",
      "imaging.sensor.mosaic",     "imaging.color.white_balance",
      "imaging.color.gains",       "imaging.color.curve",
      "imaging.color.gamma",       "cameras[].exposure_ms",
      "cameras[].line_time_us",    "cameras[].readout",
      "cameras[].aperture_mm",     "cameras[].focus_m"};
  for (const RigFormatInfo& format : rig_formats()) {
    if (format.is_table) continue;
    SCOPED_TRACE(format.name);
    EXPECT_EQ(keys_left_out(format, full_rig()), wanted);
    EXPECT_TRUE(keys_left_out(format, rig_of_lens(lenses()[0])).empty());
  }
}

TEST(RigTables, SayWhatOfTheRigDiffersBetweenRows) {
  const fs::path file = test_folder("rows") / "sd.csv";
  const auto& csv = core::find_registered(rig_formats(), "format", "csv");
  const auto read = [&](const std::string& rows) {
    core::write_file(file, "name,width_px,height_px,fx_px,focal_length_sd_px,bits\n" + rows);
    return csv.read(file, {}).rig;
  };
  expect_error(ErrorKind::Input, {"row 3", "focal_length_sd_px is \"1.5\"", "\"2.5\" in the first"},
               [&] { read("c,640,480,300,2.5,12\nd,640,480,300,1.5,12\n"); });
  const rigs::RigOptions rig = read("c,640,480,300,2.5,12\nd,640,480,300,,\n");
  EXPECT_EQ(rig.errors.focal_length_sd_px, 2.5);
  EXPECT_EQ(rig.imaging.sensor.bits, 12);
  // What a rig file would refuse a table does too.
  expect_error(ErrorKind::Input, {"row 2", "bits = 7"}, [&] { read("c,640,480,300,2.5,7\n"); });
}

/// Headings do not know of sections.
TEST(RigTables, NoHeadingHasTwoMeanings) {
  std::set<std::string> names;
  for (const geo::CameraIntrinsics& lens : lenses())
    for (const core::KeyInfo& key : core::list_keys(rig_of_lens(lens).cameras[0]))
      names.insert(key.name);
  for (const core::KeyInfo& key : core::list_keys(rigs::RigOptions{})) {
    const bool is_held = key.name.starts_with("errors.") || key.name.starts_with("imaging.");
    if (!is_held) continue;
    const std::string heading = key.name.substr(key.name.rfind('.') + 1);
    EXPECT_TRUE(names.insert(heading).second) << key.name;
  }
}

TEST(RigFiles, SayWhoseAKeyIsAndWhyATableOfRaysIsNotRead) {
  const fs::path file = test_folder("whose") / "rig.toml";
  const auto build = [&](const std::string& keys) {
    core::write_file(
        file, "name = \"r\"\n[[cameras]]\nname = \"c\"\nwidth_px = 64\nheight_px = 48\n" + keys);
    rigs::build_cameras({read_rig(file)});
  };
  expect_error(ErrorKind::Config,
               {"rig.toml:7:1", "\"k1\"", "pinhole has none", "full_opencv", "simple_radial"},
               [&] { build("fx_px = 50.0\nk1 = 0.1\n"); });
  expect_error(ErrorKind::Config, {"\"rays\"", "models that do are tabulated"},
               [&] { build("fx_px = 50.0\nrays = \"table.txt\"\n"); });
  EXPECT_NO_THROW(build("fx_px = 50.0\nmodel = \"radial\"\nk1 = -0.1\n"));
  expect_error(ErrorKind::Io, {"none.txt", "No such file"},
               [&] { build("model = \"tabulated\"\nrays = \"none.txt\"\n"); });
}

TEST(RigFormats, ARigFileReadsBackToTheSameRig) {
  for (const fs::path& file : shipped_rigs()) {
    const rigs::RigOptions rig = read_rig(file);
    rigs::RigOptions back;
    core::TomlDocument::parse(rig_toml(rig), "rig.toml").read(back);
    EXPECT_EQ(rig_toml(rig), rig_toml(back));
    const auto ours = rigs::build_cameras({rig}), theirs = rigs::build_cameras({back});
    EXPECT_EQ(ours, theirs) << file;
  }
}

TEST(RigFormats, TablesKeepOpticsAsTheyWereStated) {
  const fs::path folder = test_folder("tables");
  for (const char* name : {"csv", "xlsx"}) {
    const auto& format = core::find_registered(rig_formats(), "format", name);
    const fs::path path = path_in(folder, format);
    format.write(shipped_rig("mcs4"), path);
    const rigs::RigOptions rig = format.read(path, {}).rig;
    EXPECT_EQ(rig_toml(rig), rig_toml(shipped_rig("mcs4"))) << name;
  }
}

TEST(RigFormats, SameRigSameBytes) {
  const fs::path folder = test_folder("bytes");
  const auto& format = core::find_registered(rig_formats(), "format", "xlsx");
  format.write(shipped_rig("aces9"), folder / "a.xlsx");
  format.write(shipped_rig("aces9"), folder / "b.xlsx");
  EXPECT_EQ(core::read_file(folder / "a.xlsx"), core::read_file(folder / "b.xlsx"));
}

rigs::RigOptions imported(const char* format, const fs::path& file, const std::string& text,
                          const ReadOptions& options = {}) {
  core::write_file(file, text);
  return core::find_registered(rig_formats(), "format", format).read(file, options).rig;
}

TEST(RigTables, ReadThePapersTables) {
  const fs::path folder = test_folder("paper");
  // Table 3 of Qi et al., Drones 2025, 9, 656: optics once, vectors in one cell.
  const rigs::RigOptions mcs4 =
      imported("csv", folder / "mcs4.csv",
               "Camera,Focal Length (mm),Image Plane Width (mm),Image Resolution,"
               "Orientation (Axis-Angle),Position Offset (mm)\n"
               "cam0,20,20,720 \xc3\x97 640,\"0 , 0 , 0\",\"0 , 0 , 300\"\n"
               "cam1,,,,\"0 , 0.524 , 0\",\"150 , 0 , 259.808\"\n"
               "cam2,,,,\"0 , 1.047 , 0\",\"259.808 , 0 , 150\"\n"
               "cam3,,,,\"0 , 0 , 0\",\"500 , 0 , 300\"\n",
               {.name = "", .axes = "rdf"});
  expect_same_cameras(shipped_rig("mcs4"), mcs4);
  // Its table 7.
  const rigs::RigOptions aces9 =
      imported("csv", folder / "aces9.csv",
               "Camera;Focal Length (mm);Image Plane Width (mm);Image Resolution;"
               "Roll Angle (\xc2\xb0);Pitch Angle (\xc2\xb0);Radius (mm)\n"
               "cam0;3.240;5.568;640 x 360;0.0;0.0;170.0\n"
               "cam1;;;;0.0;56.2;\ncam2;;;;41.93;55.0;\ncam3;;;;88.87;53.5;\n"
               "cam4;;;;132.52;53.0;\ncam5;;;;183.82;53.0;\ncam6;;;;223.16;52.0;\n"
               "cam7;;;;268.42;54.5;\ncam8;;;;314.32;55.0;\n");
  expect_same_cameras(shipped_rig("aces9"), aces9);
}

TEST(RigTables, BadCellsAreNamedByRowAndColumn) {
  const fs::path file = test_folder("bad_tables") / "rig.csv";
  const auto expect = [&](const std::string& text, const std::vector<std::string>& words) {
    SCOPED_TRACE(text);
    expect_error(ErrorKind::Input, words, [&] { imported("csv", file, text); });
  };
  expect("name,width_px,height_px,fx_px\na,640,480,\"3,2\"\n",
         {"rig.csv: row 2, column D (fx_px)", "\"3,2\" is no number"});
  expect("name,width_px,height_px,fx_px\na,640,480,300\nb,640,480,1e9\n",
         {"row 3, column D (fx_px)", "outside 0 to"});
  expect("name,width_px,height_px,fx_px\na,640.5,480,300\n",
         {"row 2, column B", "no whole number"});
  expect("name,width_px,height_px,focal_lenght_mm\na,640,480,3\n",
         {"column D (focal_lenght_mm)", "unknown heading", "nearest: focal_length_mm"});
  expect("name,width_px,height_px,fx_px,x_mm\na,640,480,300,5\n",
         {"row 2", "1 of 3 values of offset_mm"});
  expect("name,width_px,height_px,fx_px,x_mm,y_mm,z_mm\na,640,480,300,5,0,0\n",
         {"--axes rdf", "--axes flu"});
  expect("name,width_px,height_px,fx_px\n,640,480,300\n", {"row 2", "no name"});
  expect("name,fx_px\na,300\n", {"row 2", "give width_px and height_px"});
  expect("name,resolution,fx_px\na,640,300\n", {"row 2, column B (resolution)", "720 x 640"});
  expect("name,width_px,height_px\na,640,480\n", {"no focal length", "row 2"});
  expect("name,width_px,width px,height_px\na,640,640,480\n",
         {"column C (width px)", "second column"});
  expect("name,width_px,height_px,fx_px\n", {"no row below the headings"});
  expect("name,width_px,height_px,fx_px,roll angle,pitch angle\na,64,48,30,0,0\n",
         {"not all three"});
  expect("name,width_px,height_px,fx_px,axes\na,64,48,30,frd\n",
         {"row 2, column E (axes)", "flu, rdf"});
  expect("name,width_px,height_px,fx_px,rig\na,64,48,30,r\nb,64,48,30,q\n",
         {"row 3", "\"r\" in the first row"});
}

TEST(RigYaml, BadCalibrationsAreNamedByLineAndKey) {
  const fs::path file = test_folder("bad_yaml") / "chain.yaml";
  const auto expect = [&](const char* format, const std::string& text,
                          const std::vector<std::string>& words) {
    SCOPED_TRACE(text);
    expect_error(ErrorKind::Input, words, [&] { imported(format, file, text); });
  };
  const std::string head =
      "cam0:\n  camera_model: pinhole\n  distortion_model: none\n  resolution: [64, 48]\n";
  expect("kalibr", "cam0: [1, 2\n", {"chain.yaml:", "no YAML"});
  expect("kalibr", "imu0: {}\n", {"no camera", "cam0, cam1"});
  expect("kalibr", head + "  intrinsics: [30, 30, 32]\n",
         {"chain.yaml:5: cam0.intrinsics has 3 numbers", "takes 4"});
  expect("kalibr", head + "  intrinsics: [30, 30, 32, .nan]\n",
         {"cam0.intrinsics[3]", "no finite number"});
  expect("kalibr", head, {"cam0 has no intrinsics"});
  expect("kalibr", "cam0:\n  camera_model: pinhole\n  distortion_model: plumb\n",
         {"plumb", "pinhole with radtan"});
  expect("kalibr",
         head + "  intrinsics: [30, 30, 32, 24]\n  T_cam_imu: [[2,0,0,0],[0,1,0,0],[0,0,1,0]]\n",
         {"chain.yaml:6: cam0.T_cam_imu", "no rotation"});
  expect("kalibr", "a: " + std::string(100000, '['), {"no YAML"});
  expect("opencv", "%YAML:1.0\n---\nx: 1\n", {"neither a list cameras nor a camera_matrix"});
  expect("opencv",
         "%YAML:1.0\n---\nimage_width: 64\nimage_height: 48\ncamera_matrix: !!opencv-matrix\n"
         "   rows: 3\n   cols: 3\n   dt: d\n   data: [ 30., 1., 32., 0., 30., 24., 0., 0., 1. ]\n",
         {"camera_matrix", "no camera matrix"});
  // Aliases that stand for many numbers.
  std::string bomb = "a: &a [";
  for (int i = 0; i < 900; ++i) bomb += "1,";
  bomb += "1]\n" + head + "  intrinsics: [";
  for (int i = 0; i < 900; ++i) bomb += "*a,";
  expect("kalibr", bomb + "*a]\n", {"more than 1000 numbers"});
}

// Until 2026-11 such a file was read without end, and took ever more memory: yaml-cpp begins a document there again and again.
TEST(RigYaml, ADocumentThatBeginsLikeNoneIsNamedByItsLine) {
  for (const char* text :
       {",\n", "%YAML:1.0\n,--\nrig: r\n", "---\na: 1\n...\n]\n", "a: 1\n...\n}"}) {
    const fs::path file = test_folder("no_document") / "chain.yaml";
    core::write_file(file, std::string_view(text));
    expect_error(ErrorKind::Input, {"chain.yaml:", "no YAML"}, [&] { find_rig_format(file); });
  }
}

TEST(RigYaml, ACamchainWithoutAnImuStandsOnItsFirstCamera) {
  const fs::path file = test_folder("chain") / "chain.yaml";
  const std::string camera =
      "  camera_model: pinhole\n  distortion_model: none\n  resolution: [64, 48]\n  intrinsics: "
      "[30, 31, 31.5, 23.5]\n";
  const rigs::RigOptions rig =
      imported("kalibr", file,
               "cam0:\n" + camera + "cam1:\n" + camera +
                   "  T_cn_cnm1: [[1,0,0,-0.5],[0,1,0,0],[0,0,1,0],[0,0,0,1]]\n");
  const auto cameras = rigs::build_cameras({rig});
  ASSERT_EQ(cameras.size(), 2U);
  // A point is half a metre further left for the camera that stands half a metre further right.
  EXPECT_LT((cameras[1].rig_from_camera.translation - Eigen::Vector3d(0.0, -0.5, 0.0)).norm(),
            1e-12);
  EXPECT_LT(
      (cameras[0].rig_from_camera.rotation * Eigen::Vector3d::UnitZ() - Eigen::Vector3d::UnitX())
          .norm(),
      1e-12);
  EXPECT_EQ(cameras[0].intrinsics.parameters, (std::vector<double>{30.0, 31.0, 32.0, 24.0}));
  EXPECT_EQ(cameras[0].name, "cam0");
}

TEST(RigYaml, ReadsKalibrsOwnExample) {
  // The example of Kalibr's page on its formats.
  const rigs::RigOptions rig = imported(
      "kalibr", test_folder("example") / "camchain.yaml",
      "cam0:\n  camera_model: pinhole\n  intrinsics: [461.629, 460.152, 362.680, 246.049]\n"
      "  distortion_model: radtan\n"
      "  distortion_coeffs: [-0.27695497, 0.06712482, 0.00087538, 0.00011556]\n"
      "  T_cam_imu:\n  - [0.01779318, 0.99967549, -0.01822936, 0.07008565]\n"
      "  - [-0.9998017, 0.01795239, 0.00860714, -0.01771023]\n"
      "  - [0.00893160, 0.01807260, 0.99979678, 0.00399246]\n  - [0.0, 0.0, 0.0, 1.0]\n"
      "  timeshift_cam_imu: -8.121e-05\n  rostopic: /cam0/image_raw\n  resolution: [752, 480]\n");
  const auto cameras = rigs::build_cameras({rig});
  ASSERT_EQ(cameras.size(), 1U);
  EXPECT_EQ(cameras[0].name, "cam0");
  const geo::CameraIntrinsics expected{
      "opencv",
      752,
      480,
      {461.629, 460.152, 363.180, 246.549, -0.27695497, 0.06712482, 0.00087538, 0.00011556}};
  EXPECT_EQ(cameras[0].intrinsics.model, expected.model);
  ASSERT_EQ(cameras[0].intrinsics.parameters.size(), 8U);
  for (std::size_t i = 0; i < 8; ++i)
    EXPECT_NEAR(cameras[0].intrinsics.parameters[i], expected.parameters[i], 1e-9);
  // The camera's axes in those of the IMU are the rows; printed to eight digits, and made whole.
  const Eigen::Matrix3d rotation = cameras[0].rig_from_camera.rotation.toRotationMatrix();
  EXPECT_LT((rotation.col(2) - Eigen::Vector3d(0.00893160, 0.01807260, 0.99979678)).norm(), 1e-7);
}

TEST(RigYaml, KalibrsParametersStandInItsOrder) {
  const fs::path file = test_folder("omni") / "chain.yaml";
  for (const geo::CameraIntrinsics& lens : lenses()) {
    if (lens.model != "unified") continue;
    core::find_registered(rig_formats(), "format", "kalibr").write(rig_of_lens(lens), file);
    const std::string text = core::read_text_file(file, 100000);
    EXPECT_NE(text.find("  camera_model: omni\n  intrinsics: [0.8, 300.0, 301.0, 160.0, 118.5]\n"
                        "  distortion_model: radtan\n"
                        "  distortion_coeffs: [-0.1, 0.01, 0.001, -0.002]\n"
                        "  resolution: [320, 240]\n"),
              std::string::npos)
        << text;
  }
}

TEST(RigColmap, ParametersStandInItsOrder) {
  const fs::path folder = test_folder("colmap_order");
  const auto& format = core::find_registered(rig_formats(), "format", "colmap");
  const std::map<std::string, std::string> lines = {
      {"radial", "1 RADIAL 320 240 300 160.5 119 -0.1 0.01\n"},
      {"opencv", "1 OPENCV 320 240 300 301 160.5 119 -0.1 0.01 0.001 -0.002\n"},
      {"fov", "1 FOV 320 240 300 301 160.5 119 0.9\n"}};
  for (const geo::CameraIntrinsics& lens : lenses()) {
    if (!lines.contains(lens.model)) continue;
    format.write(rig_of_lens(lens), folder);
    EXPECT_NE(core::read_text_file(folder / "cameras.txt", 100000).find(lines.at(lens.model)),
              std::string::npos)
        << lens.model;
  }
  // One focal length is not two.
  geo::CameraIntrinsics lens{"radial", 320, 240, {300.0, 301.0, 160.5, 119.0, -0.1, 0.01}};
  expect_error(ErrorKind::Config, {"camera first", "RADIAL", "one focal length"},
               [&] { format.write(rig_of_lens(lens), folder); });
}

TEST(RigColmap, BadFilesAreNamedByLineAndCamera) {
  const fs::path folder = test_folder("bad_colmap");
  const auto expect = [&](const std::string& cameras, const std::string& config,
                          const std::vector<std::string>& words) {
    SCOPED_TRACE(cameras + config);
    core::write_file(folder / "cameras.txt", cameras);
    core::write_file(folder / "rig_config.json", config);
    expect_error(ErrorKind::Input, words, [&] {
      core::find_registered(rig_formats(), "format", "colmap").read(folder, {});
    });
  };
  const std::string good = "# a comment\n1 PINHOLE 64 48 30 30 32 24\n";
  const std::string reference = R"([{"cameras":[{"image_prefix":"r/a/","ref_sensor":true}]}])";
  expect("1 PINHOLE 64 48 30 30 32\n", reference,
         {"cameras.txt:1", "3 parameters; PINHOLE takes 4"});
  expect("1 PINHOLE 64 48 30 30 32 x\n", reference, {"cameras.txt:1", "\"x\", word 8"});
  expect("1 OMNI 64 48 30\n", reference, {"model OMNI is not known", "FULL_OPENCV"});
  expect("1 PINHOLE 64 0 30 30 32 24\n", reference, {"cameras.txt:1", "0 px"});
  expect(good + "1 PINHOLE 64 48 30 30 32 24\n", reference, {"cameras.txt:3", "CAMERA_ID 1"});
  expect(good, "[]", {"rig_config.json", "one rig"});
  expect(good, R"([{"cameras":[]}])", {"0 cameras", "cameras.txt beside it has 1"});
  expect(good, R"([{"cameras":[{"image_prefix":"a/"}]}])",
         {"0 cameras say ref_sensor", "ref_camera_id"});
  expect(
      good,
      R"([{"cameras":[{"image_prefix":"a/","cam_from_rig_rotation":[1,1,0,0],"cam_from_rig_translation":[0,0,0]}]}])",
      {"cameras[0]", "length"});
  expect(
      good,
      R"([{"cameras":[{"image_prefix":"a/","cam_from_rig_rotation":[1,0,0,0],"cam_from_rig_translation":[0,0,0]}]}])",
      {"0 cameras say ref_sensor"});
}

TEST(RigFormats, WhatNoCameraCanBeIsTheFilesFault) {
  const fs::path file = test_folder("range") / "chain.yaml";
  const auto expect = [&](const std::string& optics, const std::vector<std::string>& words) {
    core::write_file(file, "cam0:\n  resolution: [64, 48]\n" + optics);
    expect_error(ErrorKind::Input, words, [&] { import_rig(find_rig_format(file), file, {}); });
  };
  expect("  camera_model: ds\n  intrinsics: [0.1, 1.5, 30, 30, 32, 24]\n",
         {"chain.yaml", "no rig can be made of it", "alpha"});
  expect("  camera_model: pinhole\n  intrinsics: [-30, 30, 32, 24]\n",
         {"chain.yaml", "no rig can be made of it", "cam0: focal lengths of -30 and 30 px"});
  // Not fx once more, as of a rig file that does not state fy_px.
  expect("  camera_model: pinhole\n  intrinsics: [30, 0, 32, 24]\n",
         {"chain.yaml", "focal lengths of 30 and 0 px"});
}

TEST(RigFormats, AnUnknownFileIsRefused) {
  const fs::path folder = test_folder("unknown");
  const auto expect_unknown = [&](const char* name, const std::string& text) {
    core::write_file(folder / name, text);
    expect_error(ErrorKind::Input, {name, "nor its keys", "--format", "xlsx"},
                 [&] { find_rig_format(folder / name); });
  };
  expect_unknown("rig.doc", "x");
  expect_unknown("sensor.yaml", "%YAML:1.0\nsensor_type: camera\nresolution: [752, 480]\n");
  expect_unknown("list.yaml", "- cam0\n- cam1\n");
  expect_unknown("other.json", "{\"frames\": []}");
  fs::create_directory(folder / "empty");
  expect_error(ErrorKind::Input, {"empty", "--format"}, [&] { find_rig_format(folder / "empty"); });
  expect_error(ErrorKind::Io, {"none.yaml", "no such file"},
               [&] { find_rig_format(folder / "none.yaml"); });
}

}  // namespace
}  // namespace terracast::rigs
