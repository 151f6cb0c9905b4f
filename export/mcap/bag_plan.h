#pragma once

#include <memory>
#include <string>
#include <vector>

#include "capture/frame_reader.h"
#include "export/calibration.h"
#include "export/exporter.h"
#include "export/georeference.h"
#include "export/mcap/mcap_file.h"
#include "export/mcap/sensor_messages.h"

/// What the bag of a sequence holds: its topics, the frames of its sensors, and who writes to which.
namespace terracast::exporters {

/// How images are written.
struct BagImages {
  bool is_grey = false;
  bool is_png = true;  ///< else packed numbers
  bool has_depth = true;

  std::string_view encoding() const { return is_grey ? "mono8" : "rgb8"; }
};

/// A camera of a bag; indices are of BagPlan::channels.
struct BagCamera {
  int camera_index = 0;  ///< of the sequence's cameras
  std::string frame_id;  ///< x right, y down, z forward
  std::size_t info_channel = 0, image_channel = 0, depth_channel = 0;
};

/// A sensor of a bag.
struct BagSensor {
  int stream_index = 0;  ///< of the sequence's streams
  std::string frame_id;  ///< x forward, y left, z up
  std::shared_ptr<const SensorMessages> messages;
  std::size_t first_channel = 0;
};

struct BagPlan {
  static constexpr std::size_t kStaticTransforms = 0, kTransforms = 1, kOdometry = 2;

  std::vector<McapChannel> channels;
  std::vector<BagCamera> cameras;
  std::vector<BagSensor> sensors;
  std::vector<std::string> left_out;  ///< "RIG/NAME (KIND)": sensors of which ROS has no message
};

inline constexpr const char* kEarthFrame = "earth";  ///< Earth-fixed, WGS84
inline constexpr const char* kMapFrame = "map";      ///< east, north, up at the sequence's origin
inline constexpr const char* kBodyFrame = "base_link";  ///< the vehicle: x forward, y left, z up

/// A name as ROS takes it in a topic: - becomes _, and one that begins with a digit gets an n before it.
std::string ros_word(const std::string& name);

/// throws   Config: two topics or two frames would have one name; Input: as sensor_messages()
BagPlan plan_bag(const Exporter& exporter, const capture::SequenceInfo& info,
                 const BagImages& images);

/// rosbag2's description of a bag of one file, as YAML; of version 5, in which policies of QoS are numbers. It stands in the
/// file, too: without it rosbag2 takes the policies that a file without metadata.yaml offers for names.
std::string bag_description(const BagPlan& plan, const McapCounts& counts, const std::string& file);

/// metadata.yaml, by which rosbag2 takes the folder that holds the file for a bag.
/// description   bag_description()
std::string bag_metadata_yaml(const std::string& description);

}  // namespace terracast::exporters
