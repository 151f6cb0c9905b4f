#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "validate/dataset.h"
#include "validate/readers/mcap_container.h"
#include "validate/readers/ros_values.h"
#include "validate/readers/sensors.h"

namespace terracast::validate {

/// A name as ROS takes it in a topic: - becomes _, and one that begins with a digit gets an n before it.
std::string ros_word(const std::string& name);

/// A message that was read by its definition.
struct ReadMessage {
  std::string where;  ///< "FILE: TOPIC: message K"
  std::int64_t log_ns = 0;
  std::uint64_t offset = 0;  ///< of its content in the file
  RosValue value;

  /// throws   Input: there is no header
  std::int64_t stamp_ns() const;
  /// throws   Input: another frame
  void check_frame(const std::string& right) const;
};

/// The bag of a sequence: its file, opened.
class Bag {
 public:
  /// throws   Input: as read_bag_file(); another profile, encoding or type than the format has
  Bag(const Dataset& dataset, const Sequence& sequence);

  const std::string& path() const { return path_; }  ///< relative to the dataset
  bool has(const std::string& topic) const { return file_.topics.contains(topic); }
  /// throws   Input: no such topic
  std::size_t num_messages(const std::string& topic) const;
  /// Topics that nobody has visited.
  std::vector<std::string> left_over() const;

  using Visit = std::function<void(std::size_t index, const ReadMessage& message)>;
  /// All messages of a topic, in order.
  /// is_image   content but for its first bytes stays in the file
  /// throws     Input: no such topic; another type; a message that its definition does not fit; Io
  void visit(const std::string& topic, const std::string& type, const Visit& visit,
             bool is_image = false);

 private:
  std::filesystem::path file_path_;
  std::string path_;
  BagFile file_;
  std::map<std::string, bool> visited_;
};

/// A count or a stamp's part.
/// throws   Input: not a whole number from 0 to 2^33; `where` names it
std::int64_t whole_of(const RosValue& value, const std::string& where);
/// A builtin_interfaces/Time, ns.
std::int64_t stamp_of(const RosValue& value, const std::string& where);
/// "x", "y", "z" of a value.
Eigen::Vector3d vector_of(const RosValue& value);
/// A geometry_msgs/Transform.
/// throws   Input: a quaternion that is not of unit length; `where` names it
Pose transform_of(const RosValue& value, const std::string& where);

/// Holds the samples of sensors against sensors.json, and where sensors are mounted.
/// sensors   of sensors.json
/// mounts    base_link from frame, of /tf_static
void check_bag_sensors(const Dataset& dataset, const Sequence& sequence,
                       const std::vector<SensorRecord>& sensors, std::int64_t start_ns,
                       const std::map<std::string, Pose>& mounts, Bag& bag, Findings& findings);

}  // namespace terracast::validate
