#include "export/mcap/ros_messages.h"

#include <algorithm>
#include <array>

#include "core/error.h"
#include "export/georeference.h"
#include "export/mcap/cdr.h"

namespace terracast::exporters {
namespace {

using Eigen::Vector3d;

constexpr std::int64_t kNanosecondsOfASecond = 1'000'000'000;

/// Adding 0 turns -0 into 0.
void put_vector(CdrWriter& cdr, const Vector3d& vector) {
  for (const double number : vector) cdr.put(number + 0.0);
}

void put_quaternion(CdrWriter& cdr, const Eigen::Quaterniond& rotation) {
  const Eigen::Quaterniond q = canonical(rotation);
  put_vector(cdr, q.vec());
  cdr.put(q.w());
}

void put_header(CdrWriter& cdr, const RosHeader& header) {
  cdr.put(static_cast<std::int32_t>(header.stamp_ns / kNanosecondsOfASecond))
      .put(static_cast<std::uint32_t>(header.stamp_ns % kNanosecondsOfASecond))
      .text(header.frame_id);
}

CdrWriter headed(const RosHeader& header) {
  CdrWriter cdr;
  put_header(cdr, header);
  return cdr;
}

/// A square matrix of numbers on its diagonal.
std::vector<double> diagonal(std::span<const double> numbers) {
  std::vector<double> matrix(numbers.size() * numbers.size());
  for (std::size_t i = 0; i < numbers.size(); ++i) matrix[i * (numbers.size() + 1)] = numbers[i];
  return matrix;
}

std::vector<double> diagonal3(double x, double y, double z) {
  return diagonal(std::array{x, y, z});
}

constexpr std::array<std::string_view, 6> kCameraModels = {
    "pinhole", "simple_radial", "radial", "opencv", "full_opencv", "opencv_fisheye"};

}  // namespace

RosMessage imu_message(const RosHeader& header, const Vector3d& gyro_radps,
                       const Vector3d& accel_mps2, double gyro_variance, double accel_variance) {
  CdrWriter cdr = headed(header);
  put_quaternion(cdr, Eigen::Quaterniond::Identity());
  cdr.array(diagonal3(-1.0, 0.0, 0.0));  // there is no orientation
  put_vector(cdr, gyro_radps);
  cdr.array(diagonal3(gyro_variance, gyro_variance, gyro_variance));
  put_vector(cdr, accel_mps2);
  cdr.array(diagonal3(accel_variance, accel_variance, accel_variance));
  return cdr.take();
}

RosMessage nav_sat_fix_message(const RosHeader& header, const geo::Geodetic& place,
                               std::int8_t status, double horizontal_variance_m2,
                               double vertical_variance_m2) {
  constexpr std::uint16_t kGps = 1;
  constexpr std::uint8_t kDiagonalKnown = 2;
  CdrWriter cdr = headed(header);
  cdr.put(status).put(kGps).put(place.lat_deg).put(place.lon_deg).put(place.height_m);
  cdr.array(diagonal3(horizontal_variance_m2, horizontal_variance_m2, vertical_variance_m2));
  return cdr.put(kDiagonalKnown).take();
}

RosMessage velocity_message(const RosHeader& header, const Vector3d& velocity_mps,
                            const Vector3d& variances) {
  CdrWriter cdr = headed(header);
  put_vector(cdr, velocity_mps);
  put_vector(cdr, Vector3d::Zero());
  cdr.array(diagonal(std::array{variances.x(), variances.y(), variances.z(), -1.0, -1.0, -1.0}));
  return cdr.take();
}

RosMessage fluid_pressure_message(const RosHeader& header, double pressure_pa, double variance) {
  return headed(header).put(pressure_pa).put(variance).take();
}

RosMessage magnetic_field_message(const RosHeader& header, const Vector3d& field_t,
                                  double variance_t2) {
  CdrWriter cdr = headed(header);
  put_vector(cdr, field_t);
  return cdr.array(diagonal3(variance_t2, variance_t2, variance_t2)).take();
}

RosMessage range_message(const RosHeader& header, const RosRange& range) {
  return headed(header)
      .put(std::uint8_t{range.is_light})
      .put(range.field_of_view_rad)
      .put(range.least_m)
      .put(range.most_m)
      .put(range.range_m)
      .put(range.variance_m2)
      .take();
}

RosMessage point_cloud_message(const RosHeader& header, std::span<const RosPointField> fields,
                               std::uint32_t point_bytes, std::span<const std::byte> points) {
  CdrWriter cdr = headed(header);
  cdr.put(std::uint32_t{1}).put(static_cast<std::uint32_t>(points.size() / point_bytes));
  cdr.put(static_cast<std::uint32_t>(fields.size()));
  for (const RosPointField& field : fields)
    cdr.text(field.name)
        .put(field.offset)
        .put(static_cast<std::uint8_t>(field.type))
        .put(std::uint32_t{1});
  return cdr.put(false)
      .put(point_bytes)
      .put(static_cast<std::uint32_t>(points.size()))
      .sequence(points)
      .put(true)
      .take();
}

RosMessage compressed_image_message(const RosHeader& header, std::string_view format,
                                    std::span<const std::byte> bytes) {
  return headed(header).text(format).sequence(bytes).take();
}

RosMessage image_message(const RosHeader& header, int width_px, int height_px,
                         std::string_view encoding, std::span<const std::byte> bytes) {
  const auto height = static_cast<std::uint32_t>(height_px);
  return headed(header)
      .put(height)
      .put(static_cast<std::uint32_t>(width_px))
      .text(encoding)
      .put(std::uint8_t{0})
      .put(static_cast<std::uint32_t>(bytes.size()) / height)
      .sequence(bytes)
      .take();
}

std::span<const std::string_view> ros_camera_models() { return kCameraModels; }

RosCamera ros_camera(const geo::CameraIntrinsics& intrinsics) {
  constexpr std::size_t kOfPinhole = 4;
  TERRACAST_CHECK(std::find(kCameraModels.begin(), kCameraModels.end(), intrinsics.model) !=
                      kCameraModels.end(),
                  "CameraInfo has no model {}", intrinsics.model);
  RosCamera camera;
  camera.distortion.assign(intrinsics.parameters.begin() + kOfPinhole, intrinsics.parameters.end());
  if (intrinsics.model == "opencv_fisheye") {
    camera.distortion_model = "equidistant";
    camera.distortion.resize(4, 0.0);
  } else if (intrinsics.model == "full_opencv") {
    camera.distortion_model = "rational_polynomial";
    camera.distortion.resize(8, 0.0);
  } else {
    camera.distortion_model = "plumb_bob";
    camera.distortion.resize(5, 0.0);  // k1 k2 p1 p2 k3
  }
  return camera;
}

RosMessage camera_info_message(const RosHeader& header, const geo::CameraIntrinsics& intrinsics) {
  constexpr double kCentreOfFirstPixel_px = 0.5;
  const RosCamera camera = ros_camera(intrinsics);
  const double fx = intrinsics.parameters[0], fy = intrinsics.parameters[1];
  const double cx = intrinsics.parameters[2] - kCentreOfFirstPixel_px;
  const double cy = intrinsics.parameters[3] - kCentreOfFirstPixel_px;
  CdrWriter cdr = headed(header);
  cdr.put(static_cast<std::uint32_t>(intrinsics.height_px))
      .put(static_cast<std::uint32_t>(intrinsics.width_px))
      .text(camera.distortion_model)
      .sequence(std::span<const double>(camera.distortion))
      .array(std::array{fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0})
      .array(diagonal3(1.0, 1.0, 1.0))
      .array(std::array{fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0});
  // No binning; the region of interest is the whole image, which zeros say.
  for (int i = 0; i < 6; ++i) cdr.put(std::uint32_t{0});
  return cdr.put(false).take();
}

RosMessage odometry_message(const RosHeader& header, const std::string& child_frame_id,
                            const geo::Rigid3d& pose, const Vector3d& velocity_mps,
                            const Vector3d& turn_rate_radps) {
  constexpr std::array<double, 36> kNone{};
  CdrWriter cdr = headed(header);
  cdr.text(child_frame_id);
  put_vector(cdr, pose.translation);
  put_quaternion(cdr, pose.rotation);
  cdr.array(kNone);
  put_vector(cdr, velocity_mps);
  put_vector(cdr, turn_rate_radps);
  return cdr.array(kNone).take();
}

RosMessage transforms_message(std::span<const RosTransform> transforms) {
  CdrWriter cdr;
  cdr.put(static_cast<std::uint32_t>(transforms.size()));
  for (const RosTransform& transform : transforms) {
    put_header(cdr, transform.header);
    cdr.text(transform.child_frame_id);
    put_vector(cdr, transform.parent_from_child.translation);
    put_quaternion(cdr, transform.parent_from_child.rotation);
  }
  return cdr.take();
}

}  // namespace terracast::exporters
