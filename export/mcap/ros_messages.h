#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "geo/camera_model.h"
#include "geo/geodesy.h"
#include "geo/rigid3.h"

/// Messages of ROS 2 as CDR, by the definitions of ros_definitions.h.
namespace terracast::exporters {

using RosMessage = std::vector<std::byte>;

struct RosHeader {
  std::int64_t stamp_ns = 0;  ///< since 1970; seconds that 31 bits hold
  std::string frame_id;
};

/// sensor_msgs/msg/Imu without an orientation.
/// variances   of each axis; 0 says that they are unknown
RosMessage imu_message(const RosHeader& header, const Eigen::Vector3d& gyro_radps,
                       const Eigen::Vector3d& accel_mps2, double gyro_variance,
                       double accel_variance);

/// sensor_msgs/msg/NavSatFix.
/// status   0 a fix, 2 one with a station on the ground
RosMessage nav_sat_fix_message(const RosHeader& header, const geo::Geodetic& place,
                               std::int8_t status, double horizontal_variance_m2,
                               double vertical_variance_m2);

/// geometry_msgs/msg/TwistWithCovarianceStamped of a velocity alone: turning is marked as unknown by variances of -1.
RosMessage velocity_message(const RosHeader& header, const Eigen::Vector3d& velocity_mps,
                            const Eigen::Vector3d& variances);

/// sensor_msgs/msg/FluidPressure.
RosMessage fluid_pressure_message(const RosHeader& header, double pressure_pa, double variance);

/// sensor_msgs/msg/MagneticField.
RosMessage magnetic_field_message(const RosHeader& header, const Eigen::Vector3d& field_t,
                                  double variance_t2);

/// The parts of sensor_msgs/msg/Range.
struct RosRange {
  bool is_light =
      false;  ///< else the message calls it sound, which is the one other kind that it has
  float field_of_view_rad = 0.0F;
  float least_m = 0.0F, most_m = 0.0F;
  float range_m = 0.0F;  ///< +inf: nothing within `most_m`
  float variance_m2 = 0.0F;
};
RosMessage range_message(const RosHeader& header, const RosRange& range);

/// A field of a point of sensor_msgs/msg/PointCloud2.
struct RosPointField {
  /// As the message numbers them.
  enum Type : std::uint8_t { kUint8 = 2, kUint16 = 4, kFloat32 = 7 };
  std::string_view name;
  std::uint32_t offset;
  Type type;
};
/// points   one after the other, `point_bytes` each; all are valid
RosMessage point_cloud_message(const RosHeader& header, std::span<const RosPointField> fields,
                               std::uint32_t point_bytes, std::span<const std::byte> points);

/// sensor_msgs/msg/CompressedImage.
RosMessage compressed_image_message(const RosHeader& header, std::string_view format,
                                    std::span<const std::byte> bytes);

/// sensor_msgs/msg/Image, rows packed.
RosMessage image_message(const RosHeader& header, int width_px, int height_px,
                         std::string_view encoding, std::span<const std::byte> bytes);

/// A camera in the words of sensor_msgs/msg/CameraInfo: pixel centres at whole numbers.
struct RosCamera {
  std::string_view distortion_model;
  std::vector<double> distortion;
};
/// Models that CameraInfo has, by our names.
std::span<const std::string_view> ros_camera_models();
/// intrinsics   of one of ros_camera_models()
RosCamera ros_camera(const geo::CameraIntrinsics& intrinsics);
/// The images are as the lens makes them: R is the identity, P is K.
RosMessage camera_info_message(const RosHeader& header, const geo::CameraIntrinsics& intrinsics);

/// nav_msgs/msg/Odometry of a truth: all covariances are 0.
/// velocity, turn rate   along the child's axes
RosMessage odometry_message(const RosHeader& header, const std::string& child_frame_id,
                            const geo::Rigid3d& pose, const Eigen::Vector3d& velocity_mps,
                            const Eigen::Vector3d& turn_rate_radps);

/// A transform that takes points of a child's frame into its header's.
struct RosTransform {
  RosHeader header;
  std::string child_frame_id;
  geo::Rigid3d parent_from_child;
};
/// tf2_msgs/msg/TFMessage.
RosMessage transforms_message(std::span<const RosTransform> transforms);

}  // namespace terracast::exporters
