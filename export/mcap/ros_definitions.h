#pragma once

#include <string>

namespace terracast::exporters {

/// The definition of a ROS 2 message type as MCAP keeps it (schema encoding ros2msg): its fields, then those of every
/// type that it is made of, each behind a line of 80 "=" and "MSG: package/Name".
/// type     "sensor_msgs/msg/Imu"; one that is written here, else Internal is thrown
std::string ros_definition(const std::string& type);

}  // namespace terracast::exporters
