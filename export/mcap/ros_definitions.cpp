// The fields of ROS 2's common interfaces, of the distribution Jazzy: names, types and order are what CDR's bytes follow.

#include "export/mcap/ros_definitions.h"

#include <algorithm>
#include <array>
#include <string_view>
#include <vector>

#include "core/error.h"

namespace terracast::exporters {
namespace {

struct Definition {
  std::string_view package, name, fields;
};

constexpr std::array kDefinitions = {
    Definition{"builtin_interfaces", "Time", "int32 sec\nuint32 nanosec\n"},
    Definition{"std_msgs", "Header", "builtin_interfaces/Time stamp\nstring frame_id\n"},
    Definition{"geometry_msgs", "Vector3", "float64 x\nfloat64 y\nfloat64 z\n"},
    Definition{"geometry_msgs", "Point", "float64 x\nfloat64 y\nfloat64 z\n"},
    Definition{"geometry_msgs", "Quaternion", "float64 x\nfloat64 y\nfloat64 z\nfloat64 w\n"},
    Definition{"geometry_msgs", "Pose",
               "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n"},
    Definition{"geometry_msgs", "PoseWithCovariance",
               "geometry_msgs/Pose pose\nfloat64[36] covariance\n"},
    Definition{"geometry_msgs", "Twist",
               "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular\n"},
    Definition{"geometry_msgs", "TwistWithCovariance",
               "geometry_msgs/Twist twist\nfloat64[36] covariance\n"},
    Definition{"geometry_msgs", "TwistWithCovarianceStamped",
               "std_msgs/Header header\ngeometry_msgs/TwistWithCovariance twist\n"},
    Definition{"geometry_msgs", "Transform",
               "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n"},
    Definition{"geometry_msgs", "TransformStamped",
               "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform "
               "transform\n"},
    Definition{"tf2_msgs", "TFMessage", "geometry_msgs/TransformStamped[] transforms\n"},
    Definition{"nav_msgs", "Odometry",
               "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/PoseWithCovariance "
               "pose\ngeometry_msgs/TwistWithCovariance twist\n"},
    Definition{"sensor_msgs", "Imu",
               "std_msgs/Header header\ngeometry_msgs/Quaternion orientation\n"
               "float64[9] orientation_covariance\ngeometry_msgs/Vector3 angular_velocity\n"
               "float64[9] angular_velocity_covariance\n"
               "geometry_msgs/Vector3 linear_acceleration\n"
               "float64[9] linear_acceleration_covariance\n"},
    Definition{"sensor_msgs", "NavSatStatus", "int8 status\nuint16 service\n"},
    Definition{"sensor_msgs", "NavSatFix",
               "std_msgs/Header header\nsensor_msgs/NavSatStatus status\nfloat64 latitude\n"
               "float64 longitude\nfloat64 altitude\nfloat64[9] position_covariance\n"
               "uint8 position_covariance_type\n"},
    Definition{"sensor_msgs", "FluidPressure",
               "std_msgs/Header header\nfloat64 fluid_pressure\nfloat64 variance\n"},
    Definition{"sensor_msgs", "MagneticField",
               "std_msgs/Header header\ngeometry_msgs/Vector3 magnetic_field\n"
               "float64[9] magnetic_field_covariance\n"},
    Definition{"sensor_msgs", "Range",
               "std_msgs/Header header\nuint8 radiation_type\nfloat32 field_of_view\n"
               "float32 min_range\nfloat32 max_range\nfloat32 range\nfloat32 variance\n"},
    Definition{"sensor_msgs", "PointField",
               "string name\nuint32 offset\nuint8 datatype\nuint32 count\n"},
    Definition{"sensor_msgs", "PointCloud2",
               "std_msgs/Header header\nuint32 height\nuint32 width\n"
               "sensor_msgs/PointField[] fields\nbool is_bigendian\nuint32 point_step\n"
               "uint32 row_step\nuint8[] data\nbool is_dense\n"},
    Definition{"sensor_msgs", "CompressedImage",
               "std_msgs/Header header\nstring format\nuint8[] data\n"},
    Definition{"sensor_msgs", "Image",
               "std_msgs/Header header\nuint32 height\nuint32 width\nstring encoding\n"
               "uint8 is_bigendian\nuint32 step\nuint8[] data\n"},
    Definition{"sensor_msgs", "RegionOfInterest",
               "uint32 x_offset\nuint32 y_offset\nuint32 height\nuint32 width\nbool do_rectify\n"},
    Definition{"sensor_msgs", "CameraInfo",
               "std_msgs/Header header\nuint32 height\nuint32 width\nstring distortion_model\n"
               "float64[] d\nfloat64[9] k\nfloat64[9] r\nfloat64[12] p\nuint32 binning_x\n"
               "uint32 binning_y\nsensor_msgs/RegionOfInterest roi\n"}};

/// name   "package/Name"
const Definition& definition_of(std::string_view name) {
  const std::size_t slash = name.find('/');
  const auto found =
      std::find_if(kDefinitions.begin(), kDefinitions.end(), [&](const Definition& each) {
        return each.package == name.substr(0, slash) && each.name == name.substr(slash + 1);
      });
  TERRACAST_CHECK(found != kDefinitions.end(), "no definition of {}", name);
  return *found;
}

/// Adds the types that fields are made of, "package/Name", and those that they are made of; each once.
void add_parts(std::string_view fields, std::vector<std::string_view>& types) {
  for (std::size_t at = 0; at < fields.size();) {
    const std::size_t end = fields.find('\n', at);
    const std::string_view line = fields.substr(at, end - at);
    at = end + 1;
    const std::string_view type = line.substr(0, line.find_first_of(" ["));
    if (type.find('/') == std::string_view::npos ||
        std::find(types.begin(), types.end(), type) != types.end())
      continue;
    types.push_back(type);
    add_parts(definition_of(type).fields, types);
  }
}

}  // namespace

std::string ros_definition(const std::string& type) {
  constexpr std::string_view kMiddle = "/msg/";
  std::string name = type;
  if (const std::size_t at = name.find(kMiddle); at != std::string::npos)
    name.replace(at, kMiddle.size(), "/");
  const std::string_view fields = definition_of(name).fields;
  std::vector<std::string_view> parts;
  add_parts(fields, parts);
  std::string text(fields);
  for (const std::string_view part : parts) {
    text += std::string(80, '=') + "\nMSG: ";
    text += part;
    text += "\n";
    text += definition_of(part).fields;
  }
  return text;
}

}  // namespace terracast::exporters
