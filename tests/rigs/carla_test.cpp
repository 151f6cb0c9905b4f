#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/atomic_file.h"
#include "rigs/rig_file.h"
#include "rigs/rig_format.h"
#include "tests/rigs/lens_formulas.h"
#include "tests/rigs/shipped_rigs.h"
#include "tests/support/expect_error.h"

// Sensors of vehicles as the ROS bridge of CARLA has them.
namespace terracast::rigs {
namespace {

using core::ErrorKind;
using Eigen::Vector3d;
using test::expect_error;
namespace fs = std::filesystem;

ImportedRig rig_of(const std::string& sensors) {
  const fs::path file = test_folder("carla") / "objects.json";
  const std::string text = R"({"objects": [{"type": "sensor.pseudo.markers", "id": "markers"}, )"
                           R"({"type": "vehicle.audi.tt", "id": "ego_vehicle", "objects": [)" +
                           sensors + "]}]}";
  core::write_file(file, text);
  EXPECT_EQ(find_rig_format(file).name, "carla");
  return read_text("carla", file, text);
}

constexpr const char* kCamera =
    R"({"type": "sensor.camera.rgb", "id": "front", "image_size_x": 800, "image_size_y": 600,
        "fov": 90.0, "sensor_tick": 0.05,
        "spawn_point": {"x": 2.0, "y": 0.5, "z": 1.5, "roll": 0.0, "pitch": 20.0, "yaw": 90.0}})";

TEST(Carla, ACameraLooksWhereItsPoseSays) {
  const ImportedRig imported = rig_of(kCamera);
  const auto cameras = build_cameras({imported.rig});
  ASSERT_EQ(cameras.size(), 1U);
  EXPECT_EQ(imported.rig.name, "ego_vehicle");
  EXPECT_EQ(cameras[0].name, "front");
  // Of 800 pixels over a right angle.
  EXPECT_EQ(cameras[0].intrinsics.width_px, 800);
  EXPECT_NEAR(cameras[0].intrinsics.parameters[0], 400.0, 1e-9);
  EXPECT_NEAR(cameras[0].intrinsics.parameters[2], 400.0, 1e-9);
  // To the left, and 20 degrees down.
  const double tilt = 20.0 * std::numbers::pi / 180.0;
  EXPECT_LT((cameras[0].rig_from_camera * Vector3d(0, 0, 1) -
             Vector3d(2.0, 0.5 + std::cos(tilt), 1.5 - std::sin(tilt)))
                .norm(),
            1e-12);
  expect_told(imported.ledger, {"objects[].type", "not the first vehicle"});
}

TEST(Carla, ImagesOfOneCameraAreOne) {
  std::string depth = kCamera, apart = kCamera;
  depth.replace(depth.find("rgb"), 3, "depth");
  apart.replace(apart.find("\"x\": 2.0"), 8, "\"x\": 2.1");
  const ImportedRig imported = rig_of(std::string(kCamera) + ", " + depth + ", " + apart +
                                      R"(, {"type": "sensor.other.radar", "range": 100})");
  ASSERT_EQ(imported.rig.cameras.size(), 2U);
  EXPECT_EQ(imported.rig.cameras[1].name, "front_2");
  expect_told(imported.ledger, {"objects[].objects[].type", "another one here"});
  expect_told(imported.ledger, {"objects[].objects[].type", "sensor.other.radar"});
}

TEST(Carla, OtherSensorsHaveTheirNumbers) {
  const ImportedRig imported = rig_of(
      std::string(kCamera) +
      R"(, {"type": "sensor.lidar.ray_cast", "id": "lidar", "spawn_point": {"z": 2.4, "yaw": 180.0},
            "range": 50, "channels": 4, "points_per_second": 40000, "upper_fov": 2.0,
            "lower_fov": -28.0, "rotation_frequency": 20, "noise_stddev": 0.02,
            "atmosphere_attenuation_rate": 0.002, "dropoff_general_rate": 0.1},
          {"type": "sensor.other.imu", "id": "imu", "sensor_tick": 0.01,
           "noise_accel_stddev_x": 0.02, "noise_accel_stddev_y": 0.02, "noise_accel_stddev_z": 0.01,
           "noise_gyro_stddev_x": 0.001, "noise_gyro_bias_x": 0.1},
          {"type": "sensor.other.gnss", "id": "gnss", "noise_alt_stddev": 3.0,
           "noise_lat_stddev": 1e-5, "noise_lon_stddev": 1e-5},
          {"type": "sensor.other.collision", "id": "bumper"})");
  ASSERT_EQ(imported.rig.sensors.size(), 3U);
  EXPECT_EQ(imported.rig.sensors[0].offset_mm, (std::vector<double>{0.0, 0.0, 2400.0}));
  EXPECT_NEAR(std::abs(imported.rig.sensors[0].euler_deg.at(0)), 180.0, 1e-12);
  EXPECT_EQ(imported.rig.sensors[1].rate_hz, 100.0);
  EXPECT_EQ(imported.rig.sensors[2].rate_hz, 20.0);
  const std::string toml = rig_toml(imported.rig);
  for (const char* line :
       {"rate_hz = 20.0\n", "columns = 500\n", "most_range_m = 50.0\n", "extinction_per_km = 1.0\n",
        "range_noise_m = 0.02\n", "elevation_deg = [2.0, -8.0, -18.0, -28.0]\n",
        // Deviations of a sample at 100 Hz, over the square root of the rate.
        "noise_mps2_per_sqrt_hz = 0.002\n", "noise_radps_per_sqrt_hz = 0.0001\n",
        "noise_horizontal_m = 1.1131949", "noise_vertical_m = 3.0\n"})
    EXPECT_NE(toml.find(line), std::string::npos) << line << toml;
  expect_told(imported.ledger, {"noise_accel_stddev_z", "alike here"});
  expect_told(imported.ledger, {"noise_gyro_bias_x", "constant error"});
  expect_told(imported.ledger, {"dropoff_general_rate", "range_at_10_percent_m"});
  expect_told(imported.ledger, {"objects[].objects[].type", "sensor.other.collision"});
  // What is read is a rig file again.
  const fs::path again = test_folder("carla_again") / "rig.toml";
  core::write_file(again, toml);
  EXPECT_EQ(rig_toml(read_rig(again)), toml);
}

TEST(Carla, TheFirstVehicleThatHasACameraIsRead) {
  const fs::path file = test_folder("carla_vehicles") / "objects.json";
  const ImportedRig imported =
      read_text("carla", file,
                std::string(R"({"objects": [{"type": "vehicle.a", "id": "npc", "objects": []}, )") +
                    R"({"type": "vehicle.b", "id": "ego", "objects": [)" + kCamera + "]}]}");
  EXPECT_EQ(imported.rig.name, "ego");
}

/// Mounts that look nearly straight down, where yaw and roll are hardly told apart, by Rz Ry Rx.
TEST(Carla, SensorsAreTurnedAsTheirAnglesSay) {
  for (const double off_deg : {0.0, 1e-11, 3e-8, 2e-7, 6e-6, 1.0, -3e-8, 60.0}) {
    const double yaw = 37.0, pitch = 90.0 - off_deg, roll = 11.0;
    const ImportedRig imported = rig_of(
        std::string(kCamera) +
        fmt::format(
            R"(, {{"type": "sensor.other.imu", "spawn_point": {{"yaw": {}, "pitch": {}, "roll": {}}}}})",
            yaw, pitch, roll));
    const auto turn = [](double z, double y, double x) {
      const double degree = std::numbers::pi / 180.0;
      return (Eigen::AngleAxisd(z * degree, Vector3d::UnitZ()) *
              Eigen::AngleAxisd(y * degree, Vector3d::UnitY()) *
              Eigen::AngleAxisd(x * degree, Vector3d::UnitX()))
          .toRotationMatrix();
    };
    const std::vector<double>& euler = imported.rig.sensors.at(0).euler_deg;
    EXPECT_LT((turn(euler.at(0), euler.at(1), euler.at(2)) - turn(yaw, pitch, roll)).norm(), 1e-12)
        << off_deg;
  }
}

TEST(Carla, WrongFilesAreToldSo) {
  const auto expect = [](const std::string& sensors, const std::vector<std::string>& words) {
    expect_error(ErrorKind::Input, words, [&] { rig_of(sensors); });
  };
  expect("", {"no vehicle with a camera", "sensor.camera"});
  expect(std::string(kCamera) + R"(, {"id": "a"})", {"has no type"});
  expect(std::string(kCamera) +
             R"(, {"type": "sensor.other.imu", "id": "a", "noise_gyro_stddev_x": 0.5})",
         {"objects.json: objects[1].objects[1]", "gyroscope.noise_radps_per_sqrt_hz"});
  expect(std::string(kCamera) + R"(, {"type": "sensor.other.imu", "spawn_point": {"y": 1e308}})",
         {"objects[1].objects[1]", "not a finite number"});
  expect(R"({"type": "sensor.camera.rgb", "fov": 200})", {"fov = 200", "179.9"});
  expect(R"({"type": "sensor.camera.rgb", "image_size_x": "wide"})", {"image_size_x"});
  expect(std::string(kCamera) + R"(, {"type": "sensor.lidar.ray_cast", "points_per_second": 10})",
         {"less than a column"});
  expect(std::string(kCamera) + R"(, {"type": "sensor.lidar.ray_cast", "channels": 1e300})",
         {"channels", "4096"});
  expect(std::string(kCamera) + R"(, {"type": "sensor.other.imu", "sensor_tick": -1})",
         {"sensor_tick = -1"});
}

}  // namespace
}  // namespace terracast::rigs
