#include "validate/readers/mcap_bag.h"

#include <cmath>

#include "core/error.h"
#include "core/printable.h"

namespace terracast::validate {

using core::ErrorKind;
using core::fail;

std::string ros_word(const std::string& name) {
  std::string word;
  if (!name.empty() && name[0] >= '0' && name[0] <= '9') word = "n";
  for (const char letter : name) word += letter == '-' ? '_' : letter;
  return word;
}

std::int64_t ReadMessage::stamp_ns() const { return stamp_of(value.at("header.stamp"), where); }

void ReadMessage::check_frame(const std::string& right) const {
  const std::string& found = value.at("header.frame_id").text;
  if (found != right)
    fail(ErrorKind::Input, "{}: frame_id is \"{}\"; {} is right", where,
         core::first_letters(found, 60), right);
}

Bag::Bag(const Dataset& dataset, const Sequence& sequence)
    : path_(sequence.path + "/" + sequence.name + ".mcap") {
  file_path_ = dataset.root / path_;
  file_ = read_bag_file(file_path_, path_);
  if (file_.profile != "ros2")
    fail(ErrorKind::Input, "{}: the profile is \"{}\", not ros2", path_,
         core::first_letters(file_.profile, 40));
  for (const auto& [name, topic] : file_.topics) {
    if (topic.encoding != "cdr" || topic.definition_encoding != "ros2msg")
      fail(ErrorKind::Input, "{}: {} is encoded as {} by a schema of {}; cdr and ros2msg are right",
           path_, core::first_letters(name, 100), core::first_letters(topic.encoding, 40),
           core::first_letters(topic.definition_encoding, 40));
    const auto qos = topic.metadata.find("offered_qos_profiles");
    if (qos == topic.metadata.end() || !qos->second.starts_with("- "))
      fail(ErrorKind::Input, "{}: {} has no list of offered_qos_profiles", path_,
           core::first_letters(name, 100));
    if (name == "/tf_static" && qos->second.find("durability: 1\n") == std::string::npos)
      fail(ErrorKind::Input,
           "{}: /tf_static is offered without durability 1 (transient local): who comes late "
           "misses it",
           path_);
  }
}

std::size_t Bag::num_messages(const std::string& topic) const {
  const auto found = file_.topics.find(topic);
  if (found == file_.topics.end()) fail(ErrorKind::Input, "{}: there is no topic {}", path_, topic);
  return found->second.messages.size();
}

std::vector<std::string> Bag::left_over() const {
  std::vector<std::string> names;
  for (const auto& [name, topic] : file_.topics)
    if (!visited_.contains(name)) names.push_back(name);
  return names;
}

void Bag::visit(const std::string& topic, const std::string& type, const Visit& visit,
                bool is_image) {
  // Enough for the header and what stands before an image's content.
  constexpr std::uint64_t kHeadOfImage = 4096;
  constexpr std::uint64_t kMostBytes = std::uint64_t{1} << 30;
  num_messages(topic);
  const BagTopic& found = file_.topics.at(topic);
  visited_[topic] = true;
  const std::string where = path_ + ": " + topic;
  if (found.type != type)
    fail(ErrorKind::Input, "{}: messages are of the type {}; {} is right", where,
         core::first_letters(found.type, 60), type);
  const RosDefinition definition(*found.definition, where);
  for (std::size_t i = 0; i < found.messages.size(); ++i) {
    const BagMessage& message = found.messages[i];
    const std::uint64_t size =
        is_image ? std::min(message.num_bytes, kHeadOfImage) : message.num_bytes;
    if (size > kMostBytes)
      fail(ErrorKind::Input, "{}: message {} has {} bytes", where, i, message.num_bytes);
    const std::vector<std::byte> bytes = read_bytes_at(file_path_, path_, message.offset, size);
    visit(i, {.where = fmt::format("{}: message {}", where, i),
              .log_ns = message.log_ns,
              .offset = message.offset,
              .value = definition.read(bytes, message.num_bytes)});
  }
}

std::int64_t whole_of(const RosValue& value, const std::string& where) {
  constexpr double kMost = 8589934592.0;
  if (!(value.number >= 0.0 && value.number <= kMost) || value.number != std::floor(value.number))
    fail(ErrorKind::Input, "{}: {} where a whole number should be", where, value.number);
  return static_cast<std::int64_t>(value.number);
}

std::int64_t stamp_of(const RosValue& value, const std::string& where) {
  return 1'000'000'000 * whole_of(value.at("sec"), where) + whole_of(value.at("nanosec"), where);
}

Eigen::Vector3d vector_of(const RosValue& value) {
  return {value.at("x").number, value.at("y").number, value.at("z").number};
}

Pose transform_of(const RosValue& value, const std::string& where) {
  const RosValue& q = value.at("rotation");
  const Eigen::Quaterniond rotation(q.at("w").number, q.at("x").number, q.at("y").number,
                                    q.at("z").number);
  constexpr double kUnit = 1e-9;
  if (!(std::abs(rotation.norm() - 1.0) < kUnit))
    fail(ErrorKind::Input, "{}: a quaternion of length {:.9g}", where, rotation.norm());
  return {rotation.normalized().toRotationMatrix(), vector_of(value.at("translation"))};
}

}  // namespace terracast::validate
