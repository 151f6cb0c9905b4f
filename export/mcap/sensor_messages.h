#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "capture/stream.h"
#include "export/mcap/ros_messages.h"

/// Samples of sensors beside cameras as messages of ROS 2.
namespace terracast::exporters {

/// A topic of a sensor, below the sensor's own.
struct SensorTopic {
  std::string suffix;  ///< "/fix"; empty: the sensor's own
  std::string type;
};

/// The times that messages of some samples have.
struct MessageTimes {
  std::vector<double> stamps_s;  ///< of each sample, as the clock that is stated shows them
  std::vector<double>
      ticks_s;  ///< true, of the ticks that the samples are of: scanners have a message for each
  std::vector<double> tick_stamps_s;  ///< as the clock shows them, without jitter
};

/// What a sensor of one kind is written as.
class SensorMessages {
 public:
  virtual ~SensorMessages() = default;
  virtual std::vector<SensorTopic> topics() const = 0;

  /// Takes a message on one of the topics, of a time since the sequence's start.
  using Take = std::function<void(std::size_t topic, double time_s, RosMessage message)>;
  /// The messages of some samples, by topic and true time.
  /// header   gives the header of a message of a stamp
  virtual void make(const capture::Samples& samples, const MessageTimes& times,
                    const std::function<RosHeader(double stamp_s)>& header,
                    const Take& take) const = 0;
};

/// returns   null: no message of ROS is known for the kind
/// throws    Input: the stream has not the channels or settings that its kind has
std::unique_ptr<SensorMessages> sensor_messages(const capture::StreamInfo& stream);

}  // namespace terracast::exporters
