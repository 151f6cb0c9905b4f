#include <gtest/gtest.h>

#include "rigs/rig_file.h"
#include "tests/rigs/lens_formulas.h"
#include "tests/rigs/shipped_rigs.h"
#include "tests/support/expect_error.h"

// Camchains as Kalibr and OpenVINS write them.
namespace terracast::rigs {
namespace {

using core::ErrorKind;
using test::expect_error;
namespace fs = std::filesystem;

std::string camera_text(int number, const std::string& more) {
  return fmt::format(
      "cam{}:\n  camera_model: pinhole\n  distortion_model: none\n  distortion_coeffs: []\n"
      "  resolution: [64, 48]\n  intrinsics: [30.0, 31.0, 31.5, 23.5]\n{}",
      number, more);
}

std::string link_text(double x) {
  return fmt::format(
      "  T_cn_cnm1:\n  - [1.0, 0.0, 0.0, {}]\n  - [0.0, 1.0, 0.0, 0.0]\n  - [0.0, 0.0, 1.0, 0.0]\n"
      "  - [0.0, 0.0, 0.0, 1.0]\n",
      x);
}

constexpr const char* kForward =
    "[[0.0, -1.0, 0.0, 0.05], [0.0, 0.0, -1.0, -0.03], [1.0, 0.0, 0.0, -0.12], [0.0, 0.0, 0.0, "
    "1.0]]";
constexpr const char* kForwardInverse =  // worked out by hand: R^T, -R^T t
    "[[0.0, 0.0, 1.0, 0.12], [-1.0, 0.0, 0.0, 0.05], [0.0, -1.0, 0.0, -0.03], [0.0, 0.0, 0.0, "
    "1.0]]";

std::vector<capture::CameraCalibration> cameras_of(const ImportedRig& read) {
  return build_cameras({read.rig});
}

TEST(Kalibr, EachModelShowsPointsWhereItsFormulaDoes) {
  const fs::path file = test_folder("kalibr_models") / "chain.yaml";
  const Projection k{301.0, 302.0, 319.25, 239.75};
  const struct {
    const char *model, *distortion, *intrinsics, *coefficients;
    Lens lens;
  } cases[] = {
      {"pinhole", "none", "", "[]", pinhole_lens(k, {})},
      {"pinhole", "radtan", "", "[-0.28, 0.07, 0.0002, -0.0003]",
       pinhole_lens(k, {-0.28, 0.07, 0.0002, -0.0003})},
      {"pinhole", "equidistant", "", "[-0.005, 0.042, -0.039, 0.0065]",
       equidistant_lens(k, {-0.005, 0.042, -0.039, 0.0065})},
      {"pinhole", "equi", "", "[-0.005, 0.042, -0.039, 0.0065]",
       equidistant_lens(k, {-0.005, 0.042, -0.039, 0.0065})},
      {"pinhole", "fov", "", "[0.92]", fov_lens(k, 0.92)},
      {"omni", "none", "0.8, ", "[]", mei_lens(k, 0.8, {})},
      {"omni", "radtan", "1.75, ", "[-0.12, 0.03, 0.001, -0.002]",
       mei_lens(k, 1.75, {-0.12, 0.03, 0.001, -0.002})},
      {"eucm", "none", "0.6, 1.1, ", "[]", eucm_lens(k, 0.6, 1.1)},
      {"ds", "none", "-0.2, 0.59, ", "[]", double_sphere_lens(k, -0.2, 0.59)},
  };
  for (const auto& one : cases) {
    SCOPED_TRACE(fmt::format("{} with {}", one.model, one.distortion));
    const ImportedRig read = read_text(
        "kalibr", file,
        fmt::format("cam0:\n  cam_overlaps: [1]\n  camera_model: {}\n  distortion_coeffs: "
                    "{}\n  distortion_model: {}\n  intrinsics: [{}301.0, 302.0, 319.25, "
                    "239.75]\n  resolution: [640, 480]\n  rostopic: /cam0/image_raw\n",
                    one.model, one.coefficients, one.distortion, one.intrinsics));
    expect_lens(cameras_of(read).at(0), one.lens);
    EXPECT_TRUE(read.ledger.warnings().empty());
  }
}

/// IMUs of imu.yaml beside the chain, of OpenVINS's file, and of the chain itself; the second one a quarter turn and
/// 0.1 m from the first.
TEST(Kalibr, ImusAreSensorsOfTheRig) {
  constexpr const char* kNoise =
      "accelerometer_noise_density: 2.0e-3\naccelerometer_random_walk: 3.0e-3\n"
      "gyroscope_noise_density: 1.6968e-04\ngyroscope_random_walk: 1.9393e-05\n"
      "rostopic: /imu0\nupdate_rate: 200.0\n";
  const auto indented = [](std::string text) {
    for (std::size_t i = 0; i < text.size(); ++i)
      if (i == 0 || text[i - 1] == '\n') text.insert(i, "  ");
    return text;
  };
  const fs::path flat = test_folder("kalibr_imu") / "chain.yaml";
  core::write_file(flat.parent_path() / "imu.yaml", kNoise);
  ImportedRig read = read_text("kalibr", flat, camera_text(0, ""));
  ASSERT_EQ(read.rig.sensors.size(), 1U);
  EXPECT_EQ(read.rig.sensors[0].rate_hz, 200.0);
  EXPECT_NE(rig_toml(read.rig).find("noise_radps_per_sqrt_hz = 0.00016968\n"), std::string::npos);
  EXPECT_TRUE(read.ledger.warnings().empty()) << read.ledger.table();

  const fs::path chain = test_folder("kalibr_imus") / "chain.yaml";
  core::write_file(
      chain.parent_path() / "kalibr_imu_chain.yaml",
      "%YAML:1.0\nimu0:\n  time_offset: 0.0\n" + indented(kNoise) + "imu1:\n" + indented(kNoise) +
          "  time_offset: 0.02\n  Tw: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]\n"
          "  T_i_b: [[0.0, 1.0, 0.0, 0.0], [-1.0, 0.0, 0.0, 0.1], [0.0, 0.0, 1.0, 0.0], [0.0, "
          "0.0, 0.0, 1.0]]\n");
  read = read_text("kalibr", chain, camera_text(0, ""));
  ASSERT_EQ(read.rig.sensors.size(), 2U);
  // Its x is imu0's y: a quarter turn to the left. Its place: of -R^T (0, 0.1, 0).
  EXPECT_EQ(read.rig.sensors[1].name, "imu1");
  ASSERT_EQ(read.rig.sensors[1].euler_deg.size(), 3U);
  EXPECT_NEAR(read.rig.sensors[1].euler_deg[0], 90.0, 1e-12);
  EXPECT_NEAR(read.rig.sensors[1].offset_mm.at(0), 100.0, 1e-12);
  EXPECT_NEAR(read.rig.sensors[1].offset_mm.at(1), 0.0, 1e-12);
  expect_told(read.ledger, {"kalibr_imu_chain.yaml: imuN.time_offset", "clock"});
  expect_told(read.ledger, {"imuN.Tw", "misalignment_mrad"});

  read = read_text("kalibr", test_folder("kalibr_own_imu") / "chain.yaml",
                   camera_text(0, "") + "imu0:\n" + indented(kNoise));
  EXPECT_EQ(read.rig.sensors.size(), 1U);
  core::write_file(chain.parent_path() / "imu.yaml", kNoise);
  read = read_text("kalibr", chain, camera_text(0, ""));
  EXPECT_EQ(read.rig.sensors.size(), 1U);
  expect_told(read.ledger, {"kalibr_imu_chain.yaml", "another file"});
  core::write_file(flat.parent_path() / "imu.yaml", std::string(kNoise) + "gyroscope_noise: 1\n");
  expect_told(read_text("kalibr", flat, camera_text(0, "")).ledger,
              {"imu.yaml: imuN.gyroscope_noise", "not known"});
  expect_error(ErrorKind::Input, {"imu0", "update_rate"}, [&] {
    read_text("kalibr", test_folder("kalibr_no_rate") / "chain.yaml",
              camera_text(0, "") + "imu0:\n  gyroscope_noise_density: 1e-4\n");
  });
}

TEST(Kalibr, AShiftOfTheClockIsToldAndNoneIsNot) {
  const fs::path file = test_folder("kalibr_shift") / "chain.yaml";
  const auto read = [&](const char* shift) {
    return read_text("kalibr", file,
                     camera_text(0, fmt::format("  timeshift_cam_imu: {}\n", shift)));
  };
  expect_told(read("0.0342").ledger,
              {"not used: camN.timeshift_cam_imu", "plus this are the IMU's time", "clock"});
  EXPECT_EQ(read("0.0342").ledger.entries().at("camN.timeshift_cam_imu").num_ignored, 1);
  EXPECT_TRUE(lines_not_used(read("0.0").ledger).empty());
  EXPECT_EQ(read("0.0").ledger.entries().at("camN.timeshift_cam_imu").num_used, 1);
  expect_error(ErrorKind::Input, {"cam0.timeshift_cam_imu", "no finite number"},
               [&] { read("late"); });
}

// Kalibr writes its maps in the order of their text, cam10 and cam11 before cam2.
TEST(Kalibr, CamerasGoByTheirNumbers) {
  std::string text = camera_text(0, "");
  for (const int number : {1, 10, 11, 2, 3, 4, 5, 6, 7, 8, 9})
    text += camera_text(number, link_text(-0.1));
  const auto cameras =
      cameras_of(read_text("kalibr", test_folder("kalibr_twelve") / "chain.yaml", text));
  ASSERT_EQ(cameras.size(), 12U);
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    EXPECT_EQ(cameras[i].name, fmt::format("cam{}", i));
    // Each a tenth of a metre right of the one before.
    const Eigen::Vector3d wanted(0.0, -0.1 * static_cast<double>(i), 0.0);
    EXPECT_LT((cameras[i].rig_from_camera.translation - wanted).norm(), 1e-12);
  }
}

TEST(Kalibr, AChainHangsOnAnyCameraThatTheImuPlaces) {
  const fs::path file = test_folder("kalibr_back") / "chain.yaml";
  const std::string placed = fmt::format("  T_cam_imu: {}\n", kForward);
  const auto cameras = cameras_of(
      read_text("kalibr", file, camera_text(0, "") + camera_text(1, link_text(-0.1) + placed)));
  // cam1 is where the IMU says, looks forward, and cam0 is 0.1 m left of it.
  EXPECT_LT((cameras[1].rig_from_camera.translation - Eigen::Vector3d(0.12, 0.05, -0.03)).norm(),
            1e-12);
  EXPECT_LT((cameras[0].rig_from_camera.translation - Eigen::Vector3d(0.12, 0.15, -0.03)).norm(),
            1e-12);
  expect_error(ErrorKind::Input, {"chain.yaml", "cam1", "nothing says where it is", "T_cn_cnm1"},
               [&] { read_text("kalibr", file, camera_text(0, placed) + camera_text(1, "")); });
  expect_error(ErrorKind::Input, {"cam2", "nothing says where it is"}, [&] {
    read_text("kalibr", file, camera_text(0, placed) + camera_text(2, link_text(-0.1)));
  });
}

TEST(Kalibr, SaysWhereChainAndImuContradict) {
  const fs::path file = test_folder("kalibr_two") / "chain.yaml";
  const std::string placed = fmt::format("  T_cam_imu: {}\n", kForward);
  const auto read = [&](double x) {
    return read_text("kalibr", file,
                     camera_text(0, placed) + camera_text(1, link_text(x) + placed));
  };
  EXPECT_TRUE(lines_not_used(read(0.0).ledger).empty());
  expect_told(read(-0.1).ledger, {"camN.T_cn_cnm1", "not understood", "by the IMU"});
}

TEST(Kalibr, ReadsTheInverseThatOpenVinsWrites) {
  const fs::path file = test_folder("openvins") / "kalibr_imucam_chain.yaml";
  const std::string text =
      "%YAML:1.0\n\n" +
      camera_text(0,
                  fmt::format("  T_imu_cam: #rotation from camera to IMU\n    {}\n  cam_overlaps: "
                              "[1]\n  timeshift_cam_imu: 0.0\n  rostopic: /cam0/image_raw\n",
                              kForwardInverse));
  core::write_file(file, text);
  EXPECT_EQ(find_rig_format(file).name, "kalibr");
  const auto cameras = cameras_of(read_text("kalibr", file, text));
  EXPECT_LT((cameras[0].rig_from_camera.translation - Eigen::Vector3d(0.12, 0.05, -0.03)).norm(),
            1e-12);
  EXPECT_LT(
      (cameras[0].rig_from_camera.rotation * Eigen::Vector3d::UnitZ() - Eigen::Vector3d::UnitX())
          .norm(),
      1e-12);
  const std::string both = fmt::format("  T_cam_imu: {}\n  T_imu_cam: ", kForward);
  EXPECT_NO_THROW(read_text("kalibr", file, camera_text(0, both + kForwardInverse + "\n")));
  expect_error(ErrorKind::Input, {"cam0.T_imu_cam", "not the inverse"},
               [&] { read_text("kalibr", file, camera_text(0, both + kForward + "\n")); });
}

TEST(Kalibr, NamesWhatContradictsOrStandsTwice) {
  const fs::path file = test_folder("kalibr_bad") / "chain.yaml";
  const auto expect = [&](const std::string& text, const std::vector<std::string>& words) {
    SCOPED_TRACE(text);
    expect_error(ErrorKind::Input, words, [&] { read_text("kalibr", file, text); });
  };
  const std::string head = "cam0:\n  camera_model: pinhole\n  resolution: [64, 48]\n";
  const std::string optics = "  intrinsics: [30, 30, 32, 24]\n";
  expect(head + optics + "  distortion_model: none\n  distortion_coeffs: [0.0, 0.1]\n",
         {"cam0.distortion_coeffs", "0.1 beside a distortion_model none"});
  expect(head + optics + "  distortion_model: kb4\n",
         {"pinhole with distortion_model kb4 is not known", "omni with radtan"});
  expect(head + optics + optics, {"chain.yaml:2: cam0", "key intrinsics stands twice"});
  expect(head + optics + "cam0:\n  camera_model: ds\n", {"key cam0 stands twice"});
  // Written column by column.
  expect(head + optics + "  T_cam_imu: [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0.1,0.2,0.3,1]]\n",
         {"cam0.T_cam_imu", "last row is 0.1 0.2 0.3 1", "column by column"});
}

TEST(Kalibr, TopicsOfOneNameLeaveTheCamerasTheirs) {
  const auto topic = [](const char* name) { return fmt::format("  rostopic: {}\n", name); };
  const auto names = [&](const std::string& first, const std::string& second) {
    const auto cameras =
        cameras_of(read_text("kalibr", test_folder("kalibr_names") / "chain.yaml",
                             camera_text(0, topic(first.c_str())) +
                                 camera_text(1, topic(second.c_str()) + link_text(-0.1))));
    return std::vector{cameras[0].name, cameras[1].name};
  };
  EXPECT_EQ(names("/camera/infra1/image_rect_raw", "/camera/infra2/image_rect_raw"),
            (std::vector<std::string>{"infra1", "infra2"}));
  EXPECT_EQ(names("/a/mono", "/b/mono"), (std::vector<std::string>{"cam0", "cam1"}));
  EXPECT_EQ(names("/left/image_raw/compressed", "null"),
            (std::vector<std::string>{"left", "cam1"}));
}

TEST(Kalibr, DocumentsAfterTheFirstAreCounted) {
  const ImportedRig read = read_text("kalibr", test_folder("kalibr_documents") / "chain.yaml",
                                     camera_text(0, "") + "---\n" + camera_text(0, ""));
  expect_told(read.ledger, {"(documents after the first)"});
}

}  // namespace
}  // namespace terracast::rigs
