#include "export/mcap/bag_writer.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include "capture/labels.h"
#include "core/error.h"
#include "core/image_io.h"
#include "core/parallel.h"
#include "export/kitti_files.h"
#include "export/stream_columns.h"
#include "export/utc_stamps.h"
#include "geo/camera_model.h"
#include "geo/geodesy.h"

namespace terracast::exporters {
namespace {

using core::ErrorKind;
using core::fail;

}  // namespace

BagWriter::BagWriter(const capture::SequenceReader& sequence, const BagPlan& plan,
                     const BagImages& images, const StatedCalibration& calibration,
                     const LocalFrame& local)
    : sequence_(sequence),
      plan_(plan),
      images_(images),
      calibration_(calibration),
      local_(local),
      start_ns_(unix_nanoseconds(sequence.info().utc_start, 0.0)) {
  for (const BagSensor& sensor : plan.sensors)
    if (imu_stream_ < 0 &&
        sequence.info().streams[static_cast<std::size_t>(sensor.stream_index)].kind == "imu")
      imu_stream_ = sensor.stream_index;
  constexpr std::int64_t kMost_ns = (std::int64_t{1} << 31) * 1'000'000'000;
  const auto check = [&](std::int64_t time_ns) {
    if (time_ns < 0 || time_ns >= kMost_ns)
      fail(ErrorKind::Config,
           "mcap: sequence {} begins at {}: its stamps are not of 1970 to 2038-01-19T03:14:07, "
           "which ROS's hold; another utc_start would do",
           sequence.info().name, sequence.info().utc_start);
  };
  constexpr double kAfterLastFrame_s = 1.0;  // no sample is as late
  for (const capture::FrameRecord& record : sequence.frames()) {
    check(at_ns(record.time_s + kAfterLastFrame_s));
    check(at_ns(record.time_s));
    for (const BagCamera& camera : plan.cameras)
      check(camera_header(record.index, camera).stamp_ns);
    for (const BagSensor& sensor : plan.sensors) {
      const capture::StreamInfo& stream =
          sequence.info().streams[static_cast<std::size_t>(sensor.stream_index)];
      // Of as many deviations no stamp jitters.
      constexpr double kBeyondJitter = 5.0;
      const double jitter_s = stream.clock ? kBeyondJitter * stream.clock->jitter_sd_s : 0.0;
      const double stamp_s = calibration_.reading_s(stream, record.time_s);
      check(at_ns(stamp_s - jitter_s));
      check(at_ns(stamp_s + jitter_s + kAfterLastFrame_s));
    }
  }
}

std::int64_t BagWriter::at_ns(double time_s) const {
  return start_ns_ + std::llround(1e9 * time_s);
}

RosHeader BagWriter::camera_header(int frame, const BagCamera& camera) const {
  const capture::FrameRecord& record = sequence_.frames()[static_cast<std::size_t>(frame)];
  return {at_ns(calibration_.time_s(record, camera.camera_index)), camera.frame_id};
}

RosMessage BagWriter::depth_message(const RosHeader& header,
                                    const capture::CameraCalibration& camera,
                                    const core::ImageF& range_m) const {
  core::ImageF depth_m = capture::depth_image(*geo::make_camera(camera.intrinsics), range_m);
  for (float& depth : depth_m.data())  // beside or behind the camera there is none
    if (!(depth > 0.0F)) depth = std::numeric_limits<float>::quiet_NaN();
  return image_message(header, depth_m.width(), depth_m.height(), "32FC1",
                       std::as_bytes(depth_m.data()));
}

BagWriter::Images BagWriter::make_images(int frame, const BagCamera& camera) const {
  using Reader = capture::SequenceReader;
  const capture::CameraFrame facts =
      sequence_.read_camera(frame, camera.camera_index,
                            images_.has_depth ? Reader::kColor | Reader::kFacts : Reader::kColor);
  const RosHeader header = camera_header(frame, camera);
  const core::Image8 image = images_.is_grey ? grey_of(facts.color) : facts.color;
  Images made;
  // The pixels' own encoding, and what OpenCV makes of a PNG.
  const std::string format =
      fmt::format("{}; png compressed {}", images_.encoding(), images_.is_grey ? "" : "bgr8");
  made.image = images_.is_png ? compressed_image_message(header, format, core::encode_png(image))
                              : image_message(header, image.width(), image.height(),
                                              images_.encoding(), std::as_bytes(image.data()));
  if (images_.has_depth)
    made.depth = depth_message(
        header, sequence_.info().cameras[static_cast<std::size_t>(camera.camera_index)],
        facts.range_m);
  return made;
}

void BagWriter::add_static_transforms() {
  const RosHeader map{start_ns_, kEarthFrame}, body{start_ns_, kBodyFrame};
  std::vector<RosTransform> transforms = {
      {map, kMapFrame, geo::WorldFrame(local_.origin).ecef_from_world()}};
  for (const BagSensor& sensor : plan_.sensors)
    transforms.push_back({body, sensor.frame_id,
                          sequence_.info()
                              .streams[static_cast<std::size_t>(sensor.stream_index)]
                              .body_from_sensor()});
  for (const BagCamera& camera : plan_.cameras)
    transforms.push_back(
        {body, camera.frame_id,
         calibration_.cameras(sequence_.info())[static_cast<std::size_t>(camera.camera_index)]
             .body_from_camera()});
  pending_.push_back({start_ns_, BagPlan::kStaticTransforms, transforms_message(transforms)});
}

void BagWriter::add_transform(double time_s, const geo::Rigid3d& local_from_body) {
  const RosTransform transform{{at_ns(time_s), kMapFrame}, kBodyFrame, local_from_body};
  pending_.push_back({transform.header.stamp_ns, BagPlan::kTransforms,
                      transforms_message(std::span(&transform, 1))});
}

void BagWriter::add_body(const capture::FrameRecord& record) {
  const geo::Rigid3d local_from_body = local_.local_from_world * record.world_from_body;
  add_transform(record.time_s, local_from_body);
  const std::int64_t stamp_ns = at_ns(record.time_s);
  pending_.push_back(
      {stamp_ns, BagPlan::kOdometry,
       odometry_message({stamp_ns, kMapFrame}, kBodyFrame, local_from_body,
                        record.world_from_body.rotation.conjugate() * record.velocity_world_mps,
                        record.angular_velocity_body_radps)});
}

void BagWriter::add_transforms_of_imu(const capture::StreamInfo& imu,
                                      const capture::Samples& samples, int frame) {
  const StreamColumns columns(imu);
  const auto place = columns.of_axes("ecef_", "xyz", "_m");
  const auto turn = columns.of_axes("ecef_q", "wxyz", "");
  const geo::Rigid3d local_from_ecef = geo::WorldFrame(local_.origin).ecef_from_world().inverse();
  const geo::Rigid3d imu_from_body = imu.body_from_sensor().inverse();
  const auto frame_ns = [&](int index) {
    const auto at = std::min(static_cast<std::size_t>(index), sequence_.frames().size() - 1);
    return at_ns(sequence_.frames()[at].time_s);
  };
  for (std::size_t i = 0; i < samples.times_s.size(); ++i) {
    // Frames have their own: the next one, too, whose time may be the same but for the rounding of a double.
    const std::int64_t stamp_ns = at_ns(samples.times_s[i]);
    if (stamp_ns == frame_ns(frame) || stamp_ns == frame_ns(frame + 1)) continue;
    const double* row = &samples.values[i * imu.channels.size()];
    const geo::Rigid3d ecef_from_imu{
        Eigen::Quaterniond(row[turn[0]], row[turn[1]], row[turn[2]], row[turn[3]]),
        {row[place[0]], row[place[1]], row[place[2]]}};
    add_transform(samples.times_s[i], local_from_ecef * ecef_from_imu * imu_from_body);
  }
}

void BagWriter::add_sensors(int frame) {
  const capture::SequenceInfo& info = sequence_.info();
  for (const BagSensor& sensor : plan_.sensors) {
    const capture::StreamInfo& stream = info.streams[static_cast<std::size_t>(sensor.stream_index)];
    const capture::Samples samples = sequence_.read_samples(sensor.stream_index, frame);
    MessageTimes times;
    times.stamps_s = calibration_.times_s(stream, samples);
    times.ticks_s = capture::times_of(
        capture::ticks_of_frame(stream.rate_hz, info.rate_hz, frame, info.num_frames),
        stream.rate_hz);
    for (const double time_s : times.ticks_s)
      times.tick_stamps_s.push_back(calibration_.reading_s(stream, time_s));
    sensor.messages->make(
        samples, times,
        [&](double stamp_s) {
          return RosHeader{at_ns(stamp_s), sensor.frame_id};
        },
        [&](std::size_t topic, double time_s, RosMessage message) {
          pending_.push_back({at_ns(time_s), sensor.first_channel + topic, std::move(message)});
        });
    if (sensor.stream_index == imu_stream_) add_transforms_of_imu(stream, samples, frame);
  }
}

void BagWriter::write_pending(std::int64_t end_ns, McapFile& file) {
  std::stable_sort(pending_.begin(), pending_.end(), [](const Pending& a, const Pending& b) {
    return a.log_ns != b.log_ns ? a.log_ns < b.log_ns : a.channel < b.channel;
  });
  auto next = pending_.begin();
  for (; next != pending_.end() && next->log_ns < end_ns; ++next)
    file.write(next->channel, next->log_ns, next->message);
  pending_.erase(pending_.begin(), next);
}

std::string BagWriter::write(const std::filesystem::path& path, const std::string& name,
                             const std::map<std::string, std::string>& metadata,
                             core::Progress& progress) {
  McapFile file(path, "terracast " TERRACAST_VERSION, plan_.channels);
  file.add_metadata("terracast", metadata);
  add_static_transforms();
  const std::size_t num_cameras = plan_.cameras.size();
  const std::vector<capture::FrameRecord>& frames = sequence_.frames();
  constexpr int kAhead = 16;
  std::vector<Images> made(kAhead);
  core::parallel_in_order(
      static_cast<std::int64_t>(frames.size() * num_cameras), kAhead,
      [&](std::int64_t i) {
        const auto index = static_cast<std::size_t>(i);
        made[index % kAhead] =
            make_images(static_cast<int>(index / num_cameras), plan_.cameras[index % num_cameras]);
      },
      [&](std::int64_t i) {
        const auto index = static_cast<std::size_t>(i);
        const std::size_t frame = index / num_cameras;
        const BagCamera& camera = plan_.cameras[index % num_cameras];
        const std::int64_t taken_ns = at_ns(frames[frame].time_s);
        if (index % num_cameras == 0) {
          // Times of samples are rounded by themselves: some nanoseconds are left for those of the frames before.
          constexpr std::int64_t kRounding_ns = 100;
          write_pending(taken_ns - kRounding_ns, file);
          add_body(frames[frame]);
          add_sensors(static_cast<int>(frame));
        }
        pending_.push_back(
            {taken_ns, camera.info_channel,
             camera_info_message(
                 camera_header(static_cast<int>(frame), camera),
                 calibration_
                     .cameras(sequence_.info())[static_cast<std::size_t>(camera.camera_index)]
                     .intrinsics)});
        Images images = std::move(made[index % kAhead]);
        pending_.push_back({taken_ns, camera.image_channel, std::move(images.image)});
        if (images_.has_depth)
          pending_.push_back({taken_ns, camera.depth_channel, std::move(images.depth)});
        progress.advance();
      });
  write_pending(std::numeric_limits<std::int64_t>::max(), file);
  const std::string description = bag_description(plan_, file.counts(), name);
  file.add_metadata("rosbag2", {{"serialized_metadata", description}});
  file.finish();
  return description;
}

}  // namespace terracast::exporters
