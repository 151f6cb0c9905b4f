#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "capture/frame_reader.h"
#include "export/calibration.h"
#include "export/georeference.h"

/// The texts of the ASL layout, in which EuRoC's datasets come, and of the calibrations beside it.
namespace terracast::exporters {

/// The four densities by which programs of visual-inertial odometry know an IMU, and what else its config lets it err by.
struct ImuBelief {
  double gyro_noise_radps_per_sqrt_hz = 0.0;
  double gyro_walk_radps2_per_sqrt_hz = 0.0;
  double accel_noise_mps2_per_sqrt_hz = 0.0;
  double accel_walk_mps3_per_sqrt_hz = 0.0;
  std::vector<std::string>
      others;  ///< "gyroscope.turn_on_radps = 0.01", which the densities do not tell
};
/// settings_toml   of the stream of an IMU
ImuBelief imu_belief(const std::string& settings_toml);

/// Refuses lenses that the layouts of EuRoC and TUM do not know.
/// throws   Config: the camera is no pinhole with radial-tangential or equidistant distortion, or none; says which models
///          the format holds
void check_opencv_model(const capture::CameraCalibration& camera, const char* format);

/// What an IMU shows at one time, and its state.
struct ImuSample {
  double time_s = 0.0;
  double stamp_s = 0.0;  ///< by the IMU's own clock where what is believed is stated; else the time
  Eigen::Vector3d gyro_radps = Eigen::Vector3d::Zero();
  Eigen::Vector3d accel_mps2 = Eigen::Vector3d::Zero();
  geo::Rigid3d ecef_from_imu;
  Eigen::Vector3d velocity_ecef_mps = Eigen::Vector3d::Zero();
  Eigen::Vector3d gyro_bias_radps = Eigen::Vector3d::Zero();
  Eigen::Vector3d accel_bias_mps2 = Eigen::Vector3d::Zero();
};

/// An IMU of a capture, with its samples.
struct ImuStream {
  capture::StreamInfo info;
  std::vector<ImuSample> samples;
};

/// The IMUs of the rigs that are exported, in the order of the config.
/// throws   Input: damaged samples, or those of an earlier version, whose IMUs do not tell where they are
std::vector<ImuStream> read_imus(const capture::SequenceReader& sequence,
                                 const std::vector<ExportedCamera>& cameras,
                                 const StatedCalibration& stated);

/// State of the body B at one time, in the local frame R.
struct InertialState {
  geo::Rigid3d local_from_body;
  Eigen::Vector3d velocity_local_mps = Eigen::Vector3d::Zero();
  Eigen::Vector3d gyro_bias_radps = Eigen::Vector3d::Zero();
  Eigen::Vector3d accel_bias_mps2 = Eigen::Vector3d::Zero();
};

/// States by nanoseconds since 1970: one at each sample of the IMU, whose frame B is, and one at each frame's time. Without
/// an IMU B is the vehicle's body, without biases. Between two samples biases are their mean by time: a walk's own.
/// imu   null: there is none
std::map<std::int64_t, InertialState> inertial_states(const capture::SequenceReader& sequence,
                                                      const LocalFrame& local,
                                                      const ImuStream* imu);

/// data.csv of the states, of an IMU (what it shows), of a camera's images.
std::string states_csv(const std::map<std::int64_t, InertialState>& states);
/// throws   Config: by its clock an IMU's stamps do not rise by a nanosecond
std::string imu_csv(const ImuStream& imu, std::int64_t start_ns);
std::string images_csv(const std::vector<std::int64_t>& stamps_ns);

/// sensor.yaml of each; T_BS takes points of the sensor into B.
std::string states_yaml(bool has_imu);
std::string imu_yaml(const ImuStream& imu, const geo::Rigid3d& body_from_sensor);
/// intrinsics   of the models opencv or opencv_fisheye
std::string camera_yaml(const std::string& name, const geo::CameraIntrinsics& intrinsics,
                        double rate_hz, const geo::Rigid3d& body_from_sensor);

/// Kalibr's file of an IMU.
std::string kalibr_imu(const ImuStream& imu, std::size_t number);
/// OpenVINS' chain of an IMU, for OpenCV's reader.
std::string openvins_imu(const ImuStream& imu);

/// A camera of a chain.
struct ChainedCamera {
  std::string name;
  geo::CameraIntrinsics intrinsics;
  geo::Rigid3d imu_from_camera;
};
/// Kalibr's chain.
/// timeshift_cam_imu_s   by which the IMU's clock is believed to be ahead of the cameras'; nothing: there is no IMU, and it
///                       states each camera from the one before it alone
std::string kalibr_chain(const std::vector<ChainedCamera>& cameras,
                         std::optional<double> timeshift_cam_imu_s);
std::string openvins_chain(const std::vector<ChainedCamera>& cameras, double timeshift_cam_imu_s);

}  // namespace terracast::exporters
