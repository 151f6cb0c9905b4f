// What a user of KITTI raw reads: drives by name, calibration by key, packets of 30 numbers.

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "core/json.h"
#include "export/oxts.h"
#include "export/utc_stamps.h"
#include "tests/export/exported.h"
#include "tests/export/readers.h"

namespace terracast::test {
namespace {

namespace fs = std::filesystem;
using core::ErrorKind;
using core::Json;
using Eigen::AngleAxisd;
using Eigen::Matrix3d;
using Eigen::Vector3d;

const TinyCaptureOptions kDrive{.num_frames = 4,
                                .has_tartan2 = false,
                                .acceleration_world_mps2 = {1.5, -0.7, 0.4},
                                .utc_start = "2024-06-21T23:59:59.875Z"};

/// A packet as its fields are described.
struct Packet {
  double lat_deg, lon_deg, alt_m;
  double roll_rad, pitch_rad, yaw_rad;
  double vn, ve, vf, vl, vu;
  Vector3d force_body, force_level;
  Vector3d rate_body, rate_level;
  double position_accuracy_m, velocity_accuracy_mps;

  explicit Packet(const std::vector<double>& v)
      : lat_deg(v.at(0)),
        lon_deg(v.at(1)),
        alt_m(v.at(2)),
        roll_rad(v.at(3)),
        pitch_rad(v.at(4)),
        yaw_rad(v.at(5)),
        vn(v.at(6)),
        ve(v.at(7)),
        vf(v.at(8)),
        vl(v.at(9)),
        vu(v.at(10)),
        force_body(v.at(11), v.at(12), v.at(13)),
        force_level(v.at(14), v.at(15), v.at(16)),
        rate_body(v.at(17), v.at(18), v.at(19)),
        rate_level(v.at(20), v.at(21), v.at(22)),
        position_accuracy_m(v.at(23)),
        velocity_accuracy_mps(v.at(24)) {}

  Matrix3d enu_from_body() const {
    return AngleAxisd(yaw_rad, Vector3d::UnitZ()) * level_from_body();
  }
  Matrix3d level_from_body() const {
    return (AngleAxisd(pitch_rad, Vector3d::UnitY()) * AngleAxisd(roll_rad, Vector3d::UnitX()))
        .toRotationMatrix();
  }
  Vector3d ecef() const { return Wgs84::ecef(lat_deg, lon_deg, alt_m); }
  Matrix3d ecef_from_body() const {
    return Wgs84::ecef_from_enu(lat_deg, lon_deg) * enu_from_body();
  }
};

struct KittiRaw : testing::Test {
  static inline std::unique_ptr<ScratchFolder> folder;
  void SetUp() override {
    if (folder) return;
    folder = std::make_unique<ScratchFolder>();
    write_tiny_capture(*folder / "capture", kDrive);
    run_export(*folder / "capture", "format = \"kitti_raw\"", *folder / "out");
  }
  static void TearDownTestSuite() { folder.reset(); }

  fs::path date() const { return *folder / "out/kitti_raw/2024_06_21"; }
  fs::path drive() const { return date() / "2024_06_21_drive_0001_sync"; }
  Packet packet(int frame) const {
    const auto rows = read_rows(drive() / fmt::format("oxts/data/{:010}.txt", frame));
    EXPECT_EQ(rows.size(), 1U);
    EXPECT_EQ(rows.at(0).size(), 30U);
    for (std::size_t i = 25; i < 30; ++i) EXPECT_EQ(rows.at(0).at(i), -1.0);
    return Packet(rows.at(0));
  }
  std::map<std::string, std::vector<double>> calibration(const std::string& name) const {
    std::map<std::string, std::vector<double>> values;
    std::istringstream lines(slurp(date() / name));
    for (std::string line; std::getline(lines, line);) {
      std::istringstream words(line.substr(line.find(": ") + 2));
      auto& list = values[line.substr(0, line.find(": "))];
      for (double value = 0.0; words >> value;) list.push_back(value);
    }
    return values;
  }
  /// As a reader chains them: imu to velodyne to camera 0.
  Eigen::Matrix4d camera0_from_imu() const {
    return rigid(calibration("calib_velo_to_cam.txt")) *
           rigid(calibration("calib_imu_to_velo.txt"));
  }
  static Eigen::Matrix4d rigid(const std::map<std::string, std::vector<double>>& values) {
    Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
    for (int i = 0; i < 9; ++i)
      matrix(i / 3, i % 3) = values.at("R").at(static_cast<std::size_t>(i));
    for (int i = 0; i < 3; ++i) matrix(i, 3) = values.at("T").at(static_cast<std::size_t>(i));
    return matrix;
  }
  TinyScene scene;
  Matrix3d ecef_from_world = Wgs84::ecef_from_enu(scene.origin.lat_deg, scene.origin.lon_deg);
  Vector3d origin_ecef =
      Wgs84::ecef(scene.origin.lat_deg, scene.origin.lon_deg, scene.origin.height_m);
};

TEST_F(KittiRaw, LayoutIsTheFormats) {
  for (const char* name : {"image_00", "image_01", "image_02", "image_03"})
    for (int frame = 0; frame < 4; ++frame)
      EXPECT_TRUE(fs::exists(drive() / name / "data" / fmt::format("{:010}.png", frame))) << name;
  for (const char* name : {"image_00", "image_01", "image_02", "image_03", "oxts"})
    EXPECT_EQ(slurp(drive() / name / "timestamps.txt"),
              "2024-06-21 23:59:59.875000000\n2024-06-21 23:59:59.975000000\n"
              "2024-06-22 00:00:00.075000000\n2024-06-22 00:00:00.175000000\n");
  const std::string fields = slurp(drive() / "oxts/dataformat.txt");
  EXPECT_EQ(std::count(fields.begin(), fields.end(), '\n'), 30);
  const cv::Mat grey =
      cv::imread((drive() / "image_01/data/0000000002.png").string(), cv::IMREAD_UNCHANGED);
  const cv::Mat color =
      cv::imread((drive() / "image_03/data/0000000002.png").string(), cv::IMREAD_UNCHANGED);
  EXPECT_EQ(grey.type(), CV_8UC1);
  const capture::CameraFrame truth = tiny_frame(kDrive, tiny_sequence(kDrive), 2, 3);
  ASSERT_EQ(color.type(), CV_8UC3);
  for (int v = 0; v < 80; ++v)
    for (int u = 0; u < 90; ++u)
      for (int k = 0; k < 3; ++k) ASSERT_EQ(color.at<cv::Vec3b>(v, u)[2 - k], truth.color(u, v, k));
}

TEST_F(KittiRaw, TimesAreExactToTheNanosecond) {
  using exporters::utc_with_nanoseconds;
  EXPECT_EQ(utc_with_nanoseconds("2025-06-21T10:00:00Z", 0.0), "2025-06-21 10:00:00.000000000");
  EXPECT_EQ(utc_with_nanoseconds("2025-06-21T10:00:00.25Z", 1.0 / 3.0),
            "2025-06-21 10:00:00.583333333");
  EXPECT_EQ(utc_with_nanoseconds("2024-02-28T23:59:59.999999999Z", 86400.000000001),
            "2024-03-01 00:00:00.000000000");
  EXPECT_EQ(utc_with_nanoseconds("2024-12-31T23:59:59.9Z", 0.1), "2025-01-01 00:00:00.000000000");
  EXPECT_EQ(utc_with_nanoseconds("2025-01-01T00:00:00Z", -0.25), "2024-12-31 23:59:59.750000000");
}

TEST_F(KittiRaw, CalibrationIsARectifiedPairsAndCarriesTheMount) {
  const auto cameras = calibration("calib_cam_to_cam.txt");
  EXPECT_EQ(cameras.size(), 32U);
  for (int k = 0; k < 4; ++k) {
    const auto of = [&](const char* key) { return cameras.at(fmt::format("{}_{:02}", key, k)); };
    const double offset_m = k % 2 == 1 ? 0.5 : 0.0;
    EXPECT_EQ(of("S"), (std::vector<double>{90, 80}));
    EXPECT_EQ(of("S_rect"), of("S"));
    EXPECT_EQ(of("K"), (std::vector<double>{90, 0, 44.5, 0, 90, 39.5, 0, 0, 1}));
    EXPECT_EQ(of("D"), std::vector<double>(5, 0.0));
    EXPECT_EQ(of("R"), (std::vector<double>{1, 0, 0, 0, 1, 0, 0, 0, 1}));
    EXPECT_EQ(of("R_rect"), of("R"));
    EXPECT_NEAR(of("T").at(0), -offset_m, 1e-12);
    EXPECT_EQ(of("P_rect").size(), 12U);
    EXPECT_EQ(of("P_rect").at(2), 44.5);
    EXPECT_NEAR(of("P_rect").at(3), -90.0 * offset_m, 1e-10);
  }
  // A velodyne's forward is the camera's z, its left the camera's -x, its up the camera's -y.
  const Eigen::Matrix4d camera_from_velodyne = rigid(calibration("calib_velo_to_cam.txt"));
  EXPECT_TRUE((camera_from_velodyne * Eigen::Vector4d(1, 2, 3, 1))
                  .isApprox(Eigen::Vector4d(-2, -3, 1, 1), 1e-12));
  const geo::Rigid3d body_from_camera = tiny_sequence(kDrive).cameras[0].body_from_camera();
  for (const Vector3d& point : {Vector3d(0, 0, 0), Vector3d(3, -2, 40)}) {
    const Vector3d body = body_from_camera * point;
    // Twelve digits behind the point, of 40 m.
    EXPECT_LE(((camera0_from_imu() * body.homogeneous()).head<3>() - point).norm(), 1e-10);
  }
}

TEST_F(KittiRaw, PlacesAreWgs84sAndAnglesThoseOfThePlacesOwnEnu) {
  for (int frame = 0; frame < 4; ++frame) {
    const Packet at = packet(frame);
    const geo::Rigid3d truth = tiny_world_from_body(kDrive, frame);
    const Vector3d position = origin_ecef + ecef_from_world * truth.translation;
    EXPECT_LE((at.ecef() - position).norm(), 1e-6);
    EXPECT_GE(at.position_accuracy_m, (at.ecef() - position).norm() - 2e-9);
    const Matrix3d attitude = ecef_from_world * truth.rotation.toRotationMatrix();
    EXPECT_LE((at.ecef_from_body() - attitude).norm(), 1e-12);
    // 22 km off, the world's own axes would be wrong by the convergence and the Earth's curve.
    const Matrix3d wrong = truth.rotation.toRotationMatrix();
    const double off_deg =
        AngleAxisd(Matrix3d(at.enu_from_body().transpose() * wrong)).angle() * 180.0 / M_PI;
    EXPECT_GT(off_deg, 0.2);
  }
}

TEST_F(KittiRaw, AnglesHaveTheFormatsSigns) {
  const Packet at = packet(3);
  const Matrix3d enu = at.enu_from_body();
  // The bank to the left lowers the left wing; the nose stands 0.25 rad north of east, less the
  // convergence.
  EXPECT_LT(at.roll_rad, -0.1);
  EXPECT_LT(enu(2, 1), 0.0);
  EXPECT_NEAR(at.yaw_rad, 0.25, 0.01);
  EXPECT_NEAR(std::atan2(enu(1, 0), enu(0, 0)), at.yaw_rad, 1e-12);
}

TEST_F(KittiRaw, MotionsAreTheFlightsInTheFramesOfTheirNames) {
  for (int frame = 0; frame < 4; ++frame) {
    const Packet at = packet(frame);
    const Matrix3d enu_from_world =
        Wgs84::ecef_from_enu(at.lat_deg, at.lon_deg).transpose() * ecef_from_world;
    const Vector3d velocity = enu_from_world * Vector3d(120.0, 36.0, 12.0);
    EXPECT_LE((Vector3d(at.ve, at.vn, at.vu) - velocity).norm(), at.velocity_accuracy_mps);
    const Vector3d nose_level(std::cos(at.yaw_rad), std::sin(at.yaw_rad), 0.0);
    const Vector3d left_level(-std::sin(at.yaw_rad), std::cos(at.yaw_rad), 0.0);
    EXPECT_NEAR(at.vf, velocity.dot(nose_level), 1e-9);
    EXPECT_NEAR(at.vl, velocity.dot(left_level), 1e-9);

    const Vector3d force_enu =
        enu_from_world * kDrive.acceleration_world_mps2 + Vector3d(0.0, 0.0, 9.80665);
    EXPECT_LE((at.enu_from_body() * at.force_body - force_enu).norm(), 2e-9);
    EXPECT_NEAR(at.force_level.x(), force_enu.dot(nose_level), 1e-9);
    EXPECT_NEAR(at.force_level.y(), force_enu.dot(left_level), 1e-9);
    EXPECT_NEAR(at.force_level.z(), force_enu.z(), 1e-9);

    // 0.5 rad/s about the world's up, 0.3 rad/s of roll to the left.
    const Matrix3d attitude = tiny_world_from_body(kDrive, frame).rotation.toRotationMatrix();
    const Vector3d rate_world = 0.5 * Vector3d::UnitZ() - 0.3 * attitude.col(0);
    EXPECT_LE((attitude * at.rate_body - rate_world).norm(), 2e-12);
    const Vector3d rate_enu = enu_from_world * rate_world;
    EXPECT_NEAR(at.rate_level.x(), rate_enu.dot(nose_level), 2e-12);
    EXPECT_NEAR(at.rate_level.y(), rate_enu.dot(left_level), 2e-12);
    EXPECT_NEAR(at.rate_level.z(), rate_enu.z(), 2e-12);
  }
}

TEST_F(KittiRaw, ABodyThatPointsStraightDownKeepsItsAttitude) {
  const geo::WorldFrame world({.lat_deg = 42.5, .lon_deg = 1.5, .height_m = 0.0});
  for (const double pitch_deg : {90.0, -90.0, 90.0 - 1e-6}) {
    capture::FrameRecord record;
    record.world_from_body.rotation = AngleAxisd(0.7, Vector3d::UnitZ()) *
                                      AngleAxisd(pitch_deg * M_PI / 180.0, Vector3d::UnitY()) *
                                      AngleAxisd(-0.4, Vector3d::UnitX());
    std::istringstream words(exporters::oxts_packet(world, record));
    std::vector<double> values;
    for (double value = 0.0; words >> value;) values.push_back(value);
    ASSERT_EQ(values.size(), 30U);
    EXPECT_LE((Packet(values).enu_from_body() - record.world_from_body.rotation.toRotationMatrix())
                  .norm(),
              1e-8);
  }
}

// Everything from the files: depth by P_rect, the calibration's chain and the packet, on the globe.
TEST_F(KittiRaw, DepthsLieOnTheGroundByPacketAndCalibration) {
  const auto projection = calibration("calib_cam_to_cam.txt").at("P_rect_02");
  const Eigen::Matrix4d imu_from_camera0 = camera0_from_imu().inverse();
  for (int frame = 0; frame < 4; ++frame) {
    const Packet at = packet(frame);
    const Array depth = parse_npy(slurp(drive() / fmt::format("depth_02/data/{:010}.npy", frame)));
    ASSERT_EQ(depth.shape, (std::vector<int>{80, 90}));
    int num_ground = 0;
    for (int v = 0; v < 80; v += 3) {
      for (int u = 0; u < 90; u += 3) {
        const double d = static_cast<double>(depth.values[static_cast<std::size_t>(90 * v + u)]);
        if (d == 0.0) continue;
        const Vector3d camera((u - projection[2]) / projection[0] * d,
                              (v - projection[6]) / projection[5] * d, d);
        const Vector3d imu = (imu_from_camera0 * camera.homogeneous()).head<3>();
        const Vector3d world =
            ecef_from_world.transpose() * (at.ecef() + at.ecef_from_body() * imu - origin_ecef);
        // float32 of the range and of the depth; the packet's place is good to 1e-6 m.
        EXPECT_LE(scene.distance_to_surface(world), 1.3e-7 * camera.norm() + 1.1e-6);
        ++num_ground;
      }
    }
    EXPECT_GT(num_ground, 300);
  }
}

TEST_F(KittiRaw, PosesOfTheFileAreThoseOfThePackets) {
  const auto rows = read_rows(drive() / "poses.txt");
  ASSERT_EQ(rows.size(), 4U);
  const auto ecef_from_camera = [&](int frame) {
    Eigen::Matrix4d ecef_from_imu = Eigen::Matrix4d::Identity();
    ecef_from_imu.topLeftCorner<3, 3>() = packet(frame).ecef_from_body();
    ecef_from_imu.topRightCorner<3, 1>() = packet(frame).ecef();
    return Eigen::Matrix4d(ecef_from_imu * camera0_from_imu().inverse());
  };
  for (int frame = 0; frame < 4; ++frame) {
    Eigen::Matrix4d first_from_camera = Eigen::Matrix4d::Identity();
    ASSERT_EQ(rows[static_cast<std::size_t>(frame)].size(), 12U);
    for (int i = 0; i < 12; ++i)
      first_from_camera(i / 4, i % 4) =
          rows[static_cast<std::size_t>(frame)][static_cast<std::size_t>(i)];
    const Vector3d point(4.0, -2.0, 60.0);
    const Vector3d by_file =
        (ecef_from_camera(0) * first_from_camera * point.homogeneous()).head<3>();
    const Vector3d by_packet = (ecef_from_camera(frame) * point.homogeneous()).head<3>();
    EXPECT_LE((by_file - by_packet).norm(), 2e-6);  // of two places of 1e-6 m
  }
}

TEST_F(KittiRaw, DrivesAreNumberedFromTheGivenOne) {
  run_export(*folder / "capture", "format = \"kitti_raw\"\ndrive = \"0042\"\ndepth = false",
             *folder / "numbered");
  const fs::path root = *folder / "numbered/kitti_raw";
  const std::string name = "2024_06_21_drive_0042_sync";
  EXPECT_TRUE(fs::exists(root / "2024_06_21" / name / "oxts/data/0000000003.txt"));
  EXPECT_FALSE(fs::exists(root / "2024_06_21" / name / "depth_02"));
  const Json dataset = Json::read(root / "dataset.json");
  EXPECT_EQ(dataset.at("sequences").at(std::size_t{0}).at("name").string(), name);
}

TEST(KittiRawCheck, OnlyARectifiedPairFits) {
  const auto cameras = tiny_sequence(kDrive).cameras;
  const auto refuse = [&](const std::string& toml, const std::vector<std::string>& words) {
    expect_error(ErrorKind::Config, words, [&] {
      export_options("format = \"kitti_raw\"\n" + toml).exporter().check(cameras);
    });
  };
  EXPECT_NO_THROW(export_options("format = \"kitti_raw\"").exporter().check(cameras));
  refuse("right = \"cam1\"", {"kitti_raw", "turned by", "parallel"});
  refuse("left = \"cam3\"\nright = \"cam0\"", {"+x"});
  refuse("rig = \"mcs5\"", {"mcs5", "mcs4"});
  refuse("drive = \"1\"", {"four digits"});
}

}  // namespace
}  // namespace terracast::test
