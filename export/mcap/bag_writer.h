#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/progress.h"
#include "export/mcap/bag_plan.h"

namespace terracast::exporters {

/// Writes the messages of one sequence, in the order of their log times, which are true; stamps in headers are what the
/// sensors' clocks show. Of one log time a message of a channel that is named earlier comes first.
///
/// memory    images of up to 16 at once and of one frame; samples of one frame
class BagWriter {
 public:
  /// All must outlive this.
  /// throws   Config: times before 1970, or beyond 2038, which stamps of ROS do not hold
  BagWriter(const capture::SequenceReader& sequence, const BagPlan& plan, const BagImages& images,
            const StatedCalibration& calibration, const LocalFrame& local);

  /// Writes the whole file.
  /// name       that it will have, for its description
  /// metadata   of the record "terracast"
  /// returns    bag_description(), which the record "rosbag2" holds
  /// throws     Input: damaged images or samples; Io
  std::string write(const std::filesystem::path& file, const std::string& name,
                    const std::map<std::string, std::string>& metadata, core::Progress& progress);

 private:
  struct Pending {
    std::int64_t log_ns = 0;
    std::size_t channel = 0;
    RosMessage message;
  };
  struct Images {
    RosMessage image, depth;
  };

  std::int64_t at_ns(double time_s) const;
  /// The header of a camera's messages.
  RosHeader camera_header(int frame, const BagCamera& camera) const;
  Images make_images(int frame, const BagCamera& camera) const;
  RosMessage depth_message(const RosHeader& header, const capture::CameraCalibration& camera,
                           const core::ImageF& range_m) const;

  void add_static_transforms();
  void add_body(const capture::FrameRecord& record);
  void add_sensors(int frame);
  /// Where the body is at each sample of an IMU, from a frame's time to before the next one's.
  void add_transforms_of_imu(const capture::StreamInfo& imu, const capture::Samples& samples,
                             int frame);
  void add_transform(double time_s, const geo::Rigid3d& local_from_body);
  /// Writes what waits and is of before `end_ns`.
  void write_pending(std::int64_t end_ns, McapFile& file);

  const capture::SequenceReader& sequence_;
  const BagPlan& plan_;
  const BagImages& images_;
  const StatedCalibration& calibration_;
  const LocalFrame& local_;
  std::int64_t start_ns_;
  int imu_stream_ = -1;  ///< the first one, which tells where the body is
  std::vector<Pending> pending_;
};

}  // namespace terracast::exporters
