#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "rigs/rig_file.h"
#include "tests/rigs/lens_formulas.h"
#include "tests/rigs/shipped_rigs.h"
#include "tests/support/expect_error.h"

// camera_info as ROS's programs write it, and the calibrations of VINS-Mono and VINS-Fusion.
namespace terracast::rigs {
namespace {

using core::ErrorKind;
using Eigen::Vector3d;
using test::expect_error;
namespace fs = std::filesystem;

constexpr Projection kOptics{286.5, 287.25, 423.75, 399.5};
constexpr const char* kUnit = "[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]";

std::string matrix_text(const char* name, int rows, int cols, const std::string& data) {
  return fmt::format("{}:\n  rows: {}\n  cols: {}\n  data: {}\n", name, rows, cols, data);
}

/// A file of camera_calibration, without R and P.
std::string info_text(const std::string& model, const std::string& coefficients, int num,
                      const std::string& k = "[286.5, 0., 423.75, 0., 287.25, 399.5, 0., 0., 1.]") {
  return "image_width: 848\nimage_height: 800\ncamera_name: fisheye1\n" +
         matrix_text("camera_matrix", 3, 3, k) +
         (model.empty() ? "" : "distortion_model: " + model + "\n") +
         matrix_text("distortion_coefficients", 1, num, coefficients);
}

std::string rectified_text(const std::string& r = kUnit,
                           const std::string& p =
                               "[286.5, 0.0, 423.75, 0.0, 0.0, 287.25, 399.5, "
                               "0.0, 0.0, 0.0, 1.0, 0.0]") {
  return matrix_text("rectification_matrix", 3, 3, r) + matrix_text("projection_matrix", 3, 4, p);
}

capture::CameraCalibration only_camera(const ImportedRig& read) {
  return build_cameras({read.rig}).at(0);
}

TEST(RosCameraInfo, EachModelShowsPointsWhereItsFormulaDoes) {
  const fs::path file = test_folder("ros_models") / "ost.yaml";
  const std::vector<double> rational{0.5, -0.2, 0.0012, -0.0004, 0.03, 0.7, -0.1, 0.02};
  const struct {
    const char *model, *coefficients;
    int num;
    Lens lens;
    const char* read_as;
  } cases[] = {
      {"plumb_bob", "[-0.281, 0.0795, 0.0012, -0.0004, 0.0]", 5,
       pinhole_lens(kOptics, {-0.281, 0.0795, 0.0012, -0.0004}), "opencv"},
      {"plumb_bob", "[-0.281, 0.0795, 0.0012, -0.0004, -0.0061]", 5,
       pinhole_lens(kOptics, {-0.281, 0.0795, 0.0012, -0.0004, -0.0061}), "full_opencv"},
      {"", "[-0.281, 0.0795, 0.0012, -0.0004, 0.0]", 5,
       pinhole_lens(kOptics, {-0.281, 0.0795, 0.0012, -0.0004}), "opencv"},
      {"rational_polynomial", "[0.5, -0.2, 0.0012, -0.0004, 0.03, 0.7, -0.1, 0.02]", 8,
       pinhole_lens(kOptics, rational), "full_opencv"},
      {"rational_polynomial",
       "[0.5, -0.2, 0.0012, -0.0004, 0.03, 0.7, -0.1, 0.02, 0, 0, 0, 0, 0, 0]", 14,
       pinhole_lens(kOptics, rational), "full_opencv"},
      {"equidistant", "[-0.005, 0.042, -0.039, 0.0065]", 4,
       equidistant_lens(kOptics, {-0.005, 0.042, -0.039, 0.0065}), "opencv_fisheye"},
      {"fisheye", "[0.0, 0.0, 0.0, 0.0]", 4, equidistant_lens(kOptics, {0, 0, 0, 0}),
       "opencv_fisheye"},
      {"plumb_bob", "[0.0, 0.0, 0.0, 0.0, 0.0]", 5, pinhole_lens(kOptics, {}), "pinhole"},
      {"''", "[]", 0, pinhole_lens(kOptics, {}), "pinhole"},
  };
  for (const auto& one : cases) {
    SCOPED_TRACE(fmt::format("{} {}", one.model, one.coefficients));
    const std::string text = info_text(one.model, one.coefficients, one.num) + rectified_text();
    core::write_file(file, text);
    EXPECT_EQ(find_rig_format(file).name, "ros");
    const ImportedRig read = read_text("ros", file, text);
    const capture::CameraCalibration camera = only_camera(read);
    EXPECT_EQ(camera.intrinsics.model, one.read_as);
    EXPECT_EQ(camera.name, "fisheye1");
    expect_lens(camera, one.lens);
    // It looks ahead from the rig's origin.
    EXPECT_LT((camera.rig_from_camera * Vector3d(0.0, 0.0, 2.0) - Vector3d(2.0, 0.0, 0.0)).norm(),
              1e-12);
    EXPECT_TRUE(lines_not_used(read.ledger).empty());
  }
}

/// Seen in November 2026: read as OpenCV's, a fisheye's four numbers became k1 k2 p1 p2.
TEST(RosCameraInfo, IsAFisheyeForTheReaderOfOpencvToo) {
  const fs::path file = test_folder("ros_as_opencv") / "info.yaml";
  const std::string coefficients = "[-0.005, 0.042, -0.039, 0.0065]";
  const ImportedRig read = read_text("opencv", file, info_text("equidistant", coefficients, 4));
  expect_lens(only_camera(read), equidistant_lens(kOptics, {-0.005, 0.042, -0.039, 0.0065}));
  expect_error(ErrorKind::Input, {"info.yaml", "scaramuzza is not known", "equidistant"},
               [&] { read_text("opencv", file, info_text("scaramuzza", coefficients, 4)); });
  expect_error(ErrorKind::Input, {"equidistant, but fisheye_model says otherwise"}, [&] {
    read_text("opencv", file, info_text("equidistant", coefficients, 4) + "fisheye_model: 0\n");
  });
}

/// What CameraInfo says of P: a point of the rectified frame is seen in the rectified image at P (x, y, z, 1). A camera
/// without a lens's distortion gives the same when its ray is turned by R.
TEST(RosCameraInfo, APairStandsWhereItsProjectionsSay) {
  const fs::path folder = test_folder("ros_pair");
  const double turn = 0.02;  // the left one looks to the right, the right one to the left
  const auto side_text = [&](const char* name, double sign, double tx) {
    const double c = std::cos(turn), s = sign * std::sin(turn);
    return info_text("plumb_bob", "[0.0, 0.0, 0.0, 0.0, 0.0]", 5) +
           rectified_text(fmt::format("[{}, 0, {}, 0, 1, 0, {}, 0, {}]", c, s, -s, c),
                          fmt::format("[300.0, 0.0, 410.0, {}, 0.0, 300.0, 402.0, 0.0, 0.0, 0.0, "
                                      "1.0, 0.0]",
                                      tx)) +
           fmt::format("# {}\n", name);
  };
  core::write_file(folder / "left.yaml", side_text("left", 1.0, 0.0));
  core::write_file(folder / "right.yaml", side_text("right", -1.0, -36.0));
  EXPECT_EQ(find_rig_format(folder).name, "ros");
  const ImportedRig read = find_rig_format(folder).read(folder, {});
  const auto cameras = build_cameras({read.rig});
  ASSERT_EQ(cameras.size(), 2U);
  EXPECT_EQ(cameras[0].name, "left");  // both files say fisheye1
  EXPECT_EQ(cameras[1].name, "right");
  for (const std::size_t side : {0U, 1U}) {
    const double tx = side == 0 ? 0.0 : -36.0, sign = side == 0 ? 1.0 : -1.0;
    const Eigen::Matrix3d r = Eigen::AngleAxisd(sign * turn, Vector3d::UnitY()).toRotationMatrix();
    for (const Vector3d& point : seen_points()) {  // in the rectified frame, x right
      const Vector3d point_rig(point.z(), -point.x(), -point.y());
      const Vector3d ray = cameras[side].rig_from_camera.inverse() * point_rig;
      const Vector3d rectified = r * ray;
      const Eigen::Vector2d seen(300.0 * rectified.x() / rectified.z() + 410.0,
                                 300.0 * rectified.y() / rectified.z() + 402.0);
      const Eigen::Vector2d wanted((300.0 * point.x() + 410.0 * point.z() + tx) / point.z(),
                                   (300.0 * point.y() + 402.0 * point.z()) / point.z());
      EXPECT_LT((seen - wanted).norm(), 1e-9);  // some hundred pixels in doubles
    }
  }
  // 36 / 300 m, to the right.
  EXPECT_NEAR(cameras[1].rig_from_camera.translation.y(), -0.12, 1e-12);
  expect_told(read.ledger, {"projection_matrix: columns 1 to 3", "rectified image"});
  fs::remove(folder / "left.yaml");
  expect_error(ErrorKind::Input, {"left.yaml and right.yaml 1 are there"},
               [&] { core::find_registered(rig_formats(), "format", "ros").read(folder, {}); });
}

TEST(RosCameraInfo, ReadsAPrintedMessage) {
  const fs::path folder = test_folder("ros_echo");
  const std::string ros1 =
      "header:\n  seq: 12\n  frame_id: \"cam\"\nheight: 800\nwidth: 848\ndistortion_model: "
      "\"equidistant\"\nD: [-0.005, 0.042, -0.039, 0.0065]\nK: [286.5, 0.0, 423.75, 0.0, 287.25, "
      "399.5, 0.0, 0.0, 1.0]\nR: [0, 0, 0, 0, 0, 0, 0, 0, 0]\nP: [0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, "
      "0]\nbinning_x: 0\nbinning_y: 0\nroi:\n  x_offset: 0\n---\n";
  std::string ros2 = ros1;
  for (std::string::size_type at; (at = ros2.find_first_of("DKRP")) != std::string::npos;)
    ros2[at] = static_cast<char>(ros2[at] - 'A' + 'a');
  for (const std::string& text : {ros1, ros2, ros1 + ros1}) {
    core::write_file(folder / "info.yaml", text);
    EXPECT_EQ(find_rig_format(folder / "info.yaml").name, "ros");
    const ImportedRig read = read_text("ros", folder / "info.yaml", text);
    expect_lens(only_camera(read), equidistant_lens(kOptics, {-0.005, 0.042, -0.039, 0.0065}));
    EXPECT_EQ(only_camera(read).name, "info");
    expect_told(read.ledger, {"binning_x", "not used"});
    EXPECT_TRUE(read.ledger.warnings().empty());
  }
}

TEST(RosCameraInfo, NamesWhatNoRigHolds) {
  const fs::path file = test_folder("ros_bad") / "left.yaml";
  const auto expect = [&](const std::string& text, const std::vector<std::string>& words) {
    SCOPED_TRACE(text);
    expect_error(ErrorKind::Input, words, [&] { read_text("ros", file, text); });
  };
  expect(info_text("scaramuzza", "[0.1]", 1),
         {"left.yaml:8: distortion_model", "scaramuzza is not known", "rational_polynomial",
          "equidistant"});
  expect(info_text("rational_polynomial", "[0.5, -0.2, 0, 0, 0, 0, 0, 0, 0.001, 0, 0, 0]", 12),
         {"distortion_coefficients", "thin prisms", "CALIB_THIN_PRISM_MODEL"});
  expect(info_text("none", "[0.1, 0.2, 0, 0]", 4), {"distortion_model", "none, beside"});
  expect(info_text("plumb_bob", "[0.1, 0.2]", 2), {"2 distortion coefficients", "4, 5, 8"});
  expect(info_text("plumb_bob", "[0.1, 0.2, 0, 0]", 5), {"4 numbers; 1 rows of 5 are 5"});
  expect(info_text("equidistant", "[0.1, 0.2, 0, 0, 0]", 5), {"a fisheye has 4"});
  expect(info_text("plumb_bob", "[]", 0, "[300, 0.0586, 320, 0, 300, 240, 0, 0, 1]"),
         {"camera_matrix", "skew, here of 0.0586 px"});
  expect(info_text("plumb_bob", "[]", 0, "[0, 0, 0, 0, 0, 0, 0, 0, 0]"), {"not calibrated"});
  expect(info_text("plumb_bob", "[]", 0) + rectified_text("[2, 0, 0, 0, 1, 0, 0, 0, 1]"),
         {"rectification_matrix", "no rotation"});
  expect(info_text("plumb_bob", "[]", 0) +
             rectified_text(kUnit, "[1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12]"),
         {"projection_matrix", "no projection matrix"});
}

std::string camodocal_text(const char* model, const std::string& parameters) {
  return fmt::format(
      "%YAML:1.0\n---\nmodel_type: {}\ncamera_name: camera\nimage_width: 848\nimage_height: "
      "800\n{}",
      model, parameters);
}

const std::string kPinhole =
    "distortion_parameters:\n   k1: -0.28\n   k2: 7.0e-02\n   p1: 0.0002\n   p2: -0.0003\n"
    "projection_parameters:\n   fx: 286.5\n   fy: 287.25\n   cx: 423.75\n   cy: 399.5\n";

TEST(Vins, EachModelShowsPointsWhereItsFormulaDoes) {
  const fs::path file = test_folder("vins_models") / "cam0.yaml";
  const std::string axes = "   mu: 286.5\n   mv: 287.25\n   u0: 423.75\n   v0: 399.5\n";
  const std::string angle = "   k2: -0.005\n   k3: 0.042\n   k4: -0.039\n   k5: 0.0065\n";
  const Lens fisheye = equidistant_lens(kOptics, {-0.005, 0.042, -0.039, 0.0065});
  const struct {
    const char* model;
    std::string parameters;
    Lens lens;
  } cases[] = {
      {"PINHOLE", kPinhole, pinhole_lens(kOptics, {-0.28, 0.07, 0.0002, -0.0003})},
      {"KANNALA_BRANDT", "projection_parameters:\n" + angle + axes, fisheye},
      {"KANNALA_BRANDT", "distortion_parameters:\n" + angle + "projection_parameters:\n" + axes,
       fisheye},
      {"MEI",
       "mirror_parameters:\n   xi: 1.75347951\ndistortion_parameters:\n   k1: 0.035\n   k2: "
       "-0.359\n"
       "   p1: 0.0025\n   p2: 0.0006\nprojection_parameters:\n   gamma1: 286.5\n   gamma2: 287.25\n"
       "   u0: 423.75\n   v0: 399.5\n",
       mei_lens(kOptics, 1.75347951, {0.035, -0.359, 0.0025, 0.0006})},
  };
  for (const auto& one : cases) {
    SCOPED_TRACE(one.model);
    const std::string text = camodocal_text(one.model, one.parameters);
    core::write_file(file, text);
    EXPECT_EQ(find_rig_format(file).name, "vins");
    const ImportedRig read = read_text("vins", file, text);
    expect_lens(only_camera(read), one.lens);
    EXPECT_TRUE(lines_not_used(read.ledger).empty());
  }
  expect_error(ErrorKind::Input,
               {"cam0.yaml:3: model_type", "SCARAMUZZA is not known", "KANNALA_BRANDT, MEI"},
               [&] { read_text("vins", file, camodocal_text("SCARAMUZZA", "")); });
}

constexpr const char* kBodyFromCamera =
    "!!opencv-matrix\n   rows: 4\n   cols: 4\n   dt: d\n   data: [0., 0., 1., 0.12, -1., 0., 0., "
    "0.05,\n      0., -1., 0., -0.03, 0., 0., 0., 1.]\n";

std::string estimator_text(const std::string& more = "") {
  return "%YAML:1.0\n\n#common parameters\nimu: 1\nnum_of_cam: 2\nimu_topic: \"/imu0\"\n"
         "image0_topic: \"/cam0/image_raw\"\nimage1_topic: \"/cam1/image_raw\"\n"
         "cam0_calib: \"cam0_pinhole.yaml\"\ncam1_calib: \"cam1_pinhole.yaml\"\n"
         "image_width: 848\nimage_height: 800\nestimate_extrinsic: 0\nmax_cnt: 150\nacc_n: 0.1\n" +
         fmt::format("body_T_cam0: {}body_T_cam1: {}", kBodyFromCamera, kBodyFromCamera) + more;
}

/// A step of the estimator adds acc_n dt to a velocity's deviation, and acc_w dt to a bias's. Of white noise of density N it is
/// N sqrt(dt), and of a walk of density K K sqrt(dt): so N = acc_n sqrt(dt).
TEST(Vins, NoiseOfSamplesTakesAStatedRate) {
  const fs::path folder = test_folder("vins_noise");
  for (const char* camera : {"cam0_pinhole.yaml", "cam1_pinhole.yaml"})
    core::write_file(folder / camera, camodocal_text("PINHOLE", kPinhole));
  core::write_file(folder / "config.yaml",
                   estimator_text("gyr_n: 0.02\nacc_w: 0.002\ngyr_w: 4.0e-5\n"));
  const RigFormatInfo& format = core::find_registered(rig_formats(), "format", "vins");
  const ImportedRig without = format.read(folder / "config.yaml", {});
  EXPECT_TRUE(without.rig.sensors.empty());
  expect_told(without.ledger, {"acc_n", "--imu-rate-hz"});
  const ImportedRig with =
      format.read(folder / "config.yaml", {.name = "", .axes = "", .imu_rate_hz = 400.0});
  ASSERT_EQ(with.rig.sensors.size(), 1U);
  EXPECT_EQ(with.rig.sensors[0].rate_hz, 400.0);
  const std::string toml = rig_toml(with.rig);
  const auto stated = [&](const std::string& key) {
    const std::size_t at = toml.find("\n" + key + " = ");
    return at == std::string::npos ? -1.0 : std::stod(toml.substr(at + key.size() + 4));
  };
  EXPECT_DOUBLE_EQ(stated("noise_mps2_per_sqrt_hz"), 0.005);
  EXPECT_DOUBLE_EQ(stated("noise_radps_per_sqrt_hz"), 0.001);
  EXPECT_DOUBLE_EQ(stated("walk_mps2_per_s_per_sqrt_hz"), 1e-4);
  EXPECT_DOUBLE_EQ(stated("walk_radps_per_s_per_sqrt_hz"), 2e-6);
}

TEST(Vins, AnEstimatorPlacesItsCameras) {
  const fs::path folder = test_folder("vins_fusion");
  for (const char* camera : {"cam0_pinhole.yaml", "cam1_pinhole.yaml"})
    core::write_file(folder / camera, camodocal_text("PINHOLE", kPinhole));
  core::write_file(folder / "config.yaml", estimator_text());
  EXPECT_EQ(find_rig_format(folder / "config.yaml").name, "vins");
  const auto read = [&](const std::string& text) {
    return read_text("vins", folder / "config.yaml", text);
  };
  const ImportedRig rig = read(estimator_text("td: 0.0\n"));
  const auto cameras = build_cameras({rig.rig});
  ASSERT_EQ(cameras.size(), 2U);
  EXPECT_EQ(cameras[1].name, "cam1");
  for (const auto& camera : cameras) {
    expect_lens(camera, pinhole_lens(kOptics, {-0.28, 0.07, 0.0002, -0.0003}));
    // p = body_T_cam q: the first column of numbers is what x of the camera is in the body.
    EXPECT_LT(
        (camera.rig_from_camera * Vector3d(1.0, 2.0, 3.0) - Vector3d(3.12, -0.95, -2.03)).norm(),
        1e-12);
  }
  EXPECT_TRUE(rig.ledger.warnings().empty());
  expect_told(rig.ledger, {"max_cnt", "of the estimator"});
  expect_told(read(estimator_text("td: -0.011\n")).ledger, {"not used: td", "clock"});
  expect_told(read(estimator_text("wheel_topic: \"/odom\"\n")).ledger,
              {"wheel_topic is not known"});

  const auto replaced = [](std::string text, const std::string& from, const std::string& to) {
    return text.replace(text.find(from), from.size(), to);
  };
  expect_told(read(replaced(estimator_text(), "image_width: 848", "image_width: 752")).ledger,
              {"image_width", "752, and 848 in a camera's file"});
  EXPECT_EQ(build_cameras({read(replaced(estimator_text(), "cam: 2", "cam: 1")).rig}).size(), 1U);
  expect_error(ErrorKind::Input, {"config.yaml", "no cam2_calib, but num_of_cam is 3"},
               [&] { read(replaced(estimator_text(), "cam: 2", "cam: 3")); });
  expect_error(ErrorKind::Input, {"num_of_cam = 0", "1 to 100 cameras"},
               [&] { read(replaced(estimator_text(), "cam: 2", "cam: 0")); });
  for (const char* outside : {"../cam0_pinhole.yaml", "/etc/cam0.yaml", "a/../../cam0.yaml"})
    expect_error(ErrorKind::Input, {"cam0_calib", "outside of the file's folder", outside},
                 [&] { read(replaced(estimator_text(), "cam0_pinhole.yaml", outside)); });
  expect_error(ErrorKind::Io, {"cam7.yaml"},
               [&] { read(replaced(estimator_text(), "cam0_pinhole.yaml", "cam7.yaml")); });
}

TEST(Vins, AMonocularEstimatorIsItsCamera) {
  const fs::path file = test_folder("vins_mono") / "euroc_config.yaml";
  const std::string text =
      camodocal_text("PINHOLE", kPinhole) +
      "image_topic: \"/cam0/image_raw\"\nextrinsicRotation: !!opencv-matrix\n   rows: 3\n   cols: "
      "3\n"
      "   dt: d\n   data: [0, 0, 1, -1, 0, 0, 0, -1, 0]\nextrinsicTranslation: !!opencv-matrix\n"
      "   rows: 3\n   cols: 1\n   dt: d\n   data: [0.12, 0.05, -0.03]\n"
      "rolling_shutter: 1\nrolling_shutter_tr: 0.02\n";
  const ImportedRig read = read_text("vins", file, text);
  const capture::CameraCalibration camera = only_camera(read);
  EXPECT_EQ(camera.name, "cam0");
  EXPECT_LT(
      (camera.rig_from_camera * Vector3d(1.0, 2.0, 3.0) - Vector3d(3.12, -0.95, -2.03)).norm(),
      1e-12);
  // 20 ms for 800 lines.
  EXPECT_NEAR(read.rig.cameras[0].line_time_us, 25.0, 1e-9);
  EXPECT_TRUE(lines_not_used(read.ledger).empty());
}

}  // namespace
}  // namespace terracast::rigs
