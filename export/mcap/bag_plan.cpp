#include "export/mcap/bag_plan.h"

#include <fmt/format.h>

#include <set>

#include "core/error.h"
#include "export/cameras.h"
#include "export/mcap/ros_definitions.h"

namespace terracast::exporters {
namespace {

/// Qualities of service, as rosbag2 keeps them: a list of YAML.
/// is_latched   who comes late gets the last message all the same
std::string offered_qos(bool is_latched) {
  // No deadline and no lifespan, in the numbers by which ROS's middleware says so.
  constexpr std::string_view kNever = "\n    sec: 9223372036\n    nsec: 854775807\n";
  return fmt::format(
      "- history: 1\n  depth: {}\n  reliability: 1\n  durability: {}\n  deadline:{}  lifespan:{}"
      "  liveliness: 1\n  liveliness_lease_duration:{}  avoid_ros_namespace_conventions: false\n",
      is_latched ? 1 : 10, is_latched ? 1 : 2, kNever, kNever, kNever);
}

std::size_t add_channel(BagPlan& plan, const std::string& topic, const std::string& type,
                        bool is_latched = false) {
  plan.channels.push_back({.topic = topic,
                           .type = type,
                           .definition = ros_definition(type),
                           .metadata = {{"offered_qos_profiles", offered_qos(is_latched)}}});
  return plan.channels.size() - 1;
}

void add_sensors(const Exporter& exporter, const capture::SequenceInfo& info, BagPlan& plan) {
  for (std::size_t i = 0; i < info.streams.size(); ++i) {
    const capture::StreamInfo& stream = info.streams[i];
    if (!exporter.takes(stream.rig)) continue;
    std::shared_ptr<const SensorMessages> messages = sensor_messages(stream);
    if (messages == nullptr) {
      plan.left_out.push_back(fmt::format("{}/{} ({})", stream.rig, stream.name, stream.kind));
      continue;
    }
    const std::string name = ros_word(stream.rig) + "/" + ros_word(stream.name);
    const std::size_t first = plan.channels.size();
    for (const SensorTopic& topic : messages->topics())
      add_channel(plan, "/" + name + topic.suffix, topic.type);
    plan.sensors.push_back({.stream_index = static_cast<int>(i),
                            .frame_id = name,
                            .messages = std::move(messages),
                            .first_channel = first});
  }
}

void add_cameras(const Exporter& exporter, const capture::SequenceInfo& info,
                 const BagImages& images, BagPlan& plan) {
  for (const ExportedCamera& taken : cameras_taken(exporter, info.cameras)) {
    const capture::CameraCalibration& camera =
        info.cameras[static_cast<std::size_t>(taken.camera_index)];
    const std::string name = ros_word(camera.rig) + "/" + ros_word(camera.name);
    BagCamera added{.camera_index = taken.camera_index, .frame_id = name + "_optical"};
    added.info_channel =
        add_channel(plan, "/" + name + "/camera_info", "sensor_msgs/msg/CameraInfo");
    added.image_channel =
        images.is_png ? add_channel(plan, "/" + name + "/image_raw/compressed",
                                    "sensor_msgs/msg/CompressedImage")
                      : add_channel(plan, "/" + name + "/image_raw", "sensor_msgs/msg/Image");
    if (images.has_depth)
      added.depth_channel = add_channel(plan, "/" + name + "/depth", "sensor_msgs/msg/Image");
    plan.cameras.push_back(std::move(added));
  }
}

void check_names(const BagPlan& plan, const std::string& sequence) {
  std::set<std::string> topics, frames{kEarthFrame, kMapFrame, kBodyFrame};
  const auto check = [&](std::set<std::string>& names, const std::string& name, const char* what) {
    if (!names.insert(name).second)
      core::fail(core::ErrorKind::Config,
                 "mcap: sequence {} has two {} called {} (ROS has no - in names: it becomes _); "
                 "give rigs, cameras and sensors other names",
                 sequence, what, name);
  };
  for (const McapChannel& channel : plan.channels) check(topics, channel.topic, "topics");
  for (const BagCamera& camera : plan.cameras) check(frames, camera.frame_id, "frames");
  for (const BagSensor& sensor : plan.sensors) check(frames, sensor.frame_id, "frames");
}

/// A text of several lines in one line of YAML.
std::string quoted(const std::string& text) {
  std::string quoted = "\"";
  for (const char letter : text) quoted += letter == '\n' ? "\\n" : std::string(1, letter);
  return quoted + "\"";
}

}  // namespace

std::string ros_word(const std::string& name) {
  std::string word = !name.empty() && name[0] >= '0' && name[0] <= '9' ? "n" + name : name;
  for (char& letter : word)
    if (letter == '-') letter = '_';
  return word;
}

BagPlan plan_bag(const Exporter& exporter, const capture::SequenceInfo& info,
                 const BagImages& images) {
  BagPlan plan;
  add_channel(plan, "/tf_static", "tf2_msgs/msg/TFMessage", true);
  add_channel(plan, "/tf", "tf2_msgs/msg/TFMessage");
  add_channel(plan, "/truth/odometry", "nav_msgs/msg/Odometry");
  add_sensors(exporter, info, plan);
  add_cameras(exporter, info, images, plan);
  check_names(plan, info.name);
  return plan;
}

std::string bag_description(const BagPlan& plan, const McapCounts& counts,
                            const std::string& file) {
  const std::int64_t duration_ns = counts.last_ns - counts.first_ns;
  std::string text = fmt::format(
      "version: 5\nstorage_identifier: mcap\n"
      "duration:\n  nanoseconds: {}\nstarting_time:\n  nanoseconds_since_epoch: {}\n"
      "message_count: {}\ntopics_with_message_count:\n",
      duration_ns, counts.first_ns, counts.num_messages);
  for (std::size_t i = 0; i < plan.channels.size(); ++i) {
    const McapChannel& channel = plan.channels[i];
    text += fmt::format(
        "  - topic_metadata:\n      name: {}\n      type: {}\n"
        "      serialization_format: cdr\n      offered_qos_profiles: {}\n"
        "    message_count: {}\n",
        channel.topic, channel.type, quoted(channel.metadata.at("offered_qos_profiles")),
        counts.of_channels[i]);
  }
  return text + fmt::format(
                    "compression_format: \"\"\ncompression_mode: \"\"\n"
                    "relative_file_paths:\n  - {0}\nfiles:\n  - path: {0}\n"
                    "    starting_time:\n      nanoseconds_since_epoch: {1}\n"
                    "    duration:\n      nanoseconds: {2}\n    message_count: {3}\n",
                    file, counts.first_ns, duration_ns, counts.num_messages);
}

std::string bag_metadata_yaml(const std::string& description) {
  std::string text = "rosbag2_bagfile_information:\n  ";
  for (std::size_t i = 0; i < description.size(); ++i) {
    text += description[i];
    if (description[i] == '\n' && i + 1 < description.size()) text += "  ";
  }
  return text;
}

}  // namespace terracast::exporters
