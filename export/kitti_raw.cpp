// KITTI raw, synchronised and rectified, with OXTS.
//
// Drive    <date>/<date>_drive_<number>_sync: the date of the sequence's start, numbers that go on
//          from sequence to sequence. Files have ten digits, time stamps nine decimals and a new
//          line after each.
// Camera   RDF: x right, y down, z forward. image_00 and image_01 are the left and right camera in
//          grey, image_02 and image_03 the same two in colour.
// Pixels   centres at whole numbers, as in KITTI odometry: c is ours less 0.5.
// calib    nothing is distorted and the pair is rectified as it stands: S_rect = S, R_rect = I, D =
//          0. Without a lidar the velodyne's frame (x forward, y left, z up) stands at camera 0 and
//          is the change of axes alone; the mount is in imu_to_velo.
// velodyne a lidar's points about each frame's time (frame_scans.h), as they were at their own times.
// oxts     the unit is the body's reference point; see oxts.h. True WGS84: a reader that unrolls
//          latitudes by Mercator's map sees another track than was flown.
// extract  <date>_drive_<number>_extract: a packet for each sample of an IMU of 100 Hz.
// ours     depth_02: planar depth of image_02, float32, m; sky 0. poses.txt: image_00 to its first
//          frame, 3 x 4 row-major.

#include <cmath>
#include <map>
#include <optional>

#include "core/error.h"
#include "core/npy.h"
#include "core/parallel.h"
#include "core/progress.h"
#include "export/additions.h"
#include "export/calibration.h"
#include "export/cameras.h"
#include "export/dataset_writer.h"
#include "export/exporter.h"
#include "export/frame_scans.h"
#include "export/georeference.h"
#include "export/imu_states.h"
#include "export/kitti_files.h"
#include "export/oxts.h"
#include "export/utc_stamps.h"
#include "export/velodyne.h"
#include "geo/frames.h"

namespace terracast::exporters {
namespace {

using core::ErrorKind;
using core::fail;

constexpr const char* kFormat = "kitti_raw";
/// For forecasts.
constexpr double kBytesPerPixel = 4.3;

/// The date of a sequence's start as folders bear it: "2011_09_26".
std::string date_of(const capture::SequenceReader& sequence) {
  std::string date = sequence.info().utc_start.substr(0, 10);
  for (char& c : date)
    if (c == '-') c = '_';
  return date;
}

std::string cameras_file(const capture::CameraCalibration& camera, double baseline_m) {
  const Eigen::Vector2d size_px(camera.intrinsics.width_px, camera.intrinsics.height_px);
  const Eigen::Matrix3d identity = Eigen::Matrix3d::Identity();
  const Eigen::Matrix<double, 1, 5> no_distortion = Eigen::Matrix<double, 1, 5>::Zero();
  std::string text;
  for (int k = 0; k < 4; ++k) {
    const double offset_m = k % 2 == 1 ? baseline_m : 0.0;
    const auto add = [&](const char* key, const Eigen::Ref<const Eigen::MatrixXd>& values) {
      text += fmt::format("{}_{:02}: {}\n", key, k, number_line(values));
    };
    add("S", size_px);
    add("K", kitti_camera_matrix(camera));
    add("D", no_distortion);
    add("R", identity);
    add("T", Eigen::Vector3d(-offset_m, 0.0, 0.0));
    add("S_rect", size_px);
    add("R_rect", identity);
    add("P_rect", kitti_projection(camera, offset_m));
  }
  return text;
}

std::string motion_file(const geo::Rigid3d& target_from_source) {
  return fmt::format("R: {}\nT: {}\n", number_line(target_from_source.rotation.toRotationMatrix()),
                     number_line(target_from_source.translation));
}

class KittiRawExporter final : public Exporter {
 public:
  void describe(core::SchemaVisitor& visit) override {
    visit.key("rig", rig_, "Rig to export: it holds a rectified pair.");
    visit.key("left", left_, "Its left camera: image_00 (grey) and image_02.");
    visit.key("right", right_, "Its right camera: image_01 (grey) and image_03.");
    visit.key("drive", drive_, "Number of the first drive, four digits; the others follow.");
    visit.key("depth", depth_, "Write depth maps of image_02 beside it (ours, not KITTI's).");
    calibration_.describe(visit);
    lidar_.describe(visit);
    visit.key("extract", extract_,
              "Write the packets of the unsynchronised drive, where the rig has an IMU of 100 Hz.");
  }

  std::unique_ptr<Exporter> clone() const override {
    return std::make_unique<KittiRawExporter>(*this);
  }

  std::vector<std::string> rigs() const override { return {rig_}; }

  void check(const std::vector<capture::CameraCalibration>& cameras) const override {
    const auto& left = cameras[static_cast<std::size_t>(find_camera(cameras, rig_, left_))];
    const auto& right = cameras[static_cast<std::size_t>(find_camera(cameras, rig_, right_))];
    check_pinhole(left, kFormat);
    check_pinhole(right, kFormat);
    rectified_baseline_m(left, right, kFormat);
    check_shutters_of_pair(left, right, kFormat);
    if (drive_.size() != 4 || drive_.find_first_not_of("0123456789") != std::string::npos)
      fail(ErrorKind::Config, "kitti_raw: drive = \"{}\": four digits are right, such as \"0001\"",
           drive_);
  }

  FrameSize frame_size(const std::vector<capture::CameraCalibration>& cameras) const override {
    const auto& left = cameras[static_cast<std::size_t>(find_camera(cameras, rig_, left_))];
    const auto& right = cameras[static_cast<std::size_t>(find_camera(cameras, rig_, right_))];
    return size_of_images({&left, &right}, kBytesPerPixel);
  }

  void write(const std::vector<capture::SequenceReader>& sequences,
             const std::filesystem::path& folder, const core::Context& context) const override {
    const std::size_t first = static_cast<std::size_t>(std::stoi(drive_));
    if (first + sequences.size() > 10000)
      fail(ErrorKind::Config, "kitti_raw: {} drives from {} on need more than four digits",
           sequences.size(), drive_);
    const std::string hash = source_hash(kFormat, *this, sequences);
    DatasetWriter writer(folder, kFormat, hash, context);
    if (writer.is_complete()) {
      context.log.info("{}: finished already, its sources are unchanged", folder.string());
      return;
    }
    std::vector<std::optional<FrameScans>> scans;
    bool has_lidar = false, has_extract = false;
    for (const capture::SequenceReader& sequence : sequences) {
      scans.push_back(FrameScans::find(sequence, rig_, lidar_, kFormat, context));
      has_lidar = has_lidar || scans.back().has_value();
      has_extract = has_extract || extracted_imu(sequence) >= 0;
    }
    write_calibration(sequences, scans, writer);
    core::Json list = core::Json::array();
    for (std::size_t i = 0; i < sequences.size(); ++i) {
      const std::string date = date_of(sequences[i]);
      const std::string name = fmt::format("{}_drive_{:04}_sync", date, first + i);
      list.push(write_drive(sequences[i], scans[i], name, date + "/" + name, writer, context));
    }
    core::Json description = metadata(kFormat, "KITTI raw, synchronised and rectified", hash,
                                      sequences, conventions(has_lidar, has_extract), additions());
    description.set("sequences", std::move(list));
    writer.finish(std::move(description));
  }

 private:
  static std::vector<std::pair<std::string, std::string>> conventions(bool has_lidar,
                                                                      bool has_extract) {
    std::vector<std::pair<std::string, std::string>> list = {
        {"pixel_center", "The centre of pixel i is at i: K's c is dataset.json's less 0.5."},
        {"world_frame",
         "WGS84: latitude, longitude and ellipsoidal height of each packet; true, not on a map."},
        {"pose",
         "Rz(yaw) Ry(pitch) Rx(roll) takes the body (x forward, y left, z up) to the east, north, "
         "up of the packet's own place; the unit stands at the body's reference point."},
        {"calib",
         has_lidar
             ? "P_rect = K [I | t], R_rect the identity, no distortion; the velodyne's frame is "
               "the "
               "lidar's: x forward, y left, z up. Of dates without a lidar it is camera 0's in "
               "these axes."
             : "P_rect = K [I | t], R_rect the identity, no distortion; the velodyne's frame is "
               "camera 0's with x forward, y left, z up: there is no scanner."},
        {"oxts",
         "Accelerations are specific forces: of the body against the Earth, with 9.80665 m/s^2 "
         "upwards; turn rates are against the Earth. No bias, no noise. pos_accuracy and "
         "vel_accuracy are what the decimals cut off; navstat to orimode are -1, for there is no "
         "receiver."},
        {"time", "UTC with nine decimals; all cameras and the unit share their instants."},
        {"depth",
         "depth_02, where it is written: along the optical axis of image_02, metres, float32."},
        {"sky", "0 in depth_02."}};
    if (has_lidar)
      list.emplace_back(
          "velodyne_points",
          "x, y, z, reflectance of each pulse whose time is nearest to the frame's: those with "
          "floor(time_s * rate_hz + 0.5) of its number, in the order of time, along the sensor's "
          "axes as they were at the pulse's own time: motion is not compensated. timestamps.txt "
          "has the frame's time, which is the middle of the scan.");
    if (has_extract)
      list.emplace_back(
          "extract",
          "A packet a sample of an IMU of 100 Hz: place, attitude and velocity are the body's, in "
          "truth; accelerations and turn rates are what the IMU shows where it is mounted, along "
          "the body's axes, with the Earth's turning.");
    return list;
  }

  /// Index of the rig's first IMU of 100 Hz; -1: none, or no unsynchronised drive is written.
  int extracted_imu(const capture::SequenceReader& sequence) const {
    if (!extract_) return -1;
    constexpr double kRate_hz = 100.0, kRounding = 1e-9;
    return find_imu(sequence.info(), rig_, [](const capture::StreamInfo& imu) {
      return std::abs(imu.rate_hz - kRate_hz) <= kRounding * kRate_hz;
    });
  }

  /// Packets of the unsynchronised drive.
  /// path      of the drive beside it
  /// returns   the sequence's "extract" in dataset.json
  static core::Json write_extract(const capture::SequenceReader& sequence, int imu_index,
                                  const std::string& path, DatasetWriter& writer) {
    const capture::StreamInfo& imu = sequence.info().streams[static_cast<std::size_t>(imu_index)];
    const std::string folder =
        path.substr(0, path.size() - std::string_view("_sync").size()) + "_extract/oxts";
    std::string times;
    std::int64_t number = 0;
    for (const ImuState& state : imu_states(sequence, imu_index)) {
      writer.write(fmt::format("{}/data/{:010}.txt", folder, number++),
                   oxts_packet_of_imu(state, imu.body_from_sensor()));
      times += utc_with_nanoseconds(sequence.info().utc_start, state.time_s) + "\n";
    }
    writer.write(folder + "/timestamps.txt", times);
    writer.write(folder + "/dataformat.txt", oxts_format());
    return core::Json::object()
        .set("rig", imu.rig)
        .set("name", imu.name)
        .set("folder", folder)
        .set("num_packets", number);
  }

  std::vector<std::string> additions() const {
    std::vector<std::string> list = {
        "poses.txt: image_00 of each frame to image_00 of the first, 3 x 4, as KITTI odometry has "
        "them"};
    if (depth_)
      list.emplace_back(
          "depth_02/data/NNNNNNNNNN.npy: planar depth of image_02, float32 (height, width), "
          "metres, sky 0");
    return list;
  }

  /// The calibration of each date; all drives of a date share it.
  void write_calibration(const std::vector<capture::SequenceReader>& sequences,
                         const std::vector<std::optional<FrameScans>>& scans,
                         DatasetWriter& writer) const {
    std::map<std::string, const capture::SequenceReader*> by_date;
    std::map<std::string, geo::Rigid3d> body_from_lidar;
    for (std::size_t i = 0; i < sequences.size(); ++i) {
      if (!scans[i]) continue;
      const geo::Rigid3d mount = scans[i]->stream().body_from_sensor();
      const auto& [date, first] = *body_from_lidar.emplace(date_of(sequences[i]), mount).first;
      if (!(first == mount))
        fail(ErrorKind::Config,
             "kitti_raw: the lidar {} of {} is mounted otherwise than that of another drive of "
             "{}; drives of one date share a calibration: other dates, or lidar = \"off\", are "
             "right",
             scans[i]->name(), sequences[i].info().name, date);
    }
    for (const capture::SequenceReader& sequence : sequences) {
      const auto& [date, first] = *by_date.emplace(date_of(sequence), &sequence).first;
      const auto& cameras = sequence.info().cameras;
      const auto& others = first->info().cameras;
      const auto is_same = [&](const std::string& name) {
        return others[static_cast<std::size_t>(find_camera(others, rig_, name))] ==
               cameras[static_cast<std::size_t>(find_camera(cameras, rig_, name))];
      };
      for (const std::string& name : {left_, right_})
        calibration_.check_is_true(sequence.info(), find_camera(cameras, rig_, name), kFormat);
      if (!is_same(left_) || !is_same(right_))
        fail(ErrorKind::Config,
             "kitti_raw: the sequences {} and {} of {} differ in their cameras; drives of one date "
             "share a calibration",
             first->info().name, sequence.info().name, date);
    }
    for (const auto& [date, sequence] : by_date) {
      const auto& cameras = sequence->info().cameras;
      const auto& left = cameras[static_cast<std::size_t>(find_camera(cameras, rig_, left_))];
      const auto& right = cameras[static_cast<std::size_t>(find_camera(cameras, rig_, right_))];
      geo::Rigid3d camera_from_velodyne{
          Eigen::Quaterniond(Eigen::Matrix3d(geo::rig_from_forward_camera().transpose())),
          Eigen::Vector3d::Zero()};
      if (const auto lidar = body_from_lidar.find(date); lidar != body_from_lidar.end())
        camera_from_velodyne = left.body_from_camera().inverse() * lidar->second;
      const geo::Rigid3d velodyne_from_body =
          camera_from_velodyne.inverse() * left.body_from_camera().inverse();
      writer.write(date + "/calib_cam_to_cam.txt",
                   cameras_file(left, rectified_baseline_m(left, right, kFormat)));
      writer.write(date + "/calib_velo_to_cam.txt", motion_file(camera_from_velodyne));
      writer.write(date + "/calib_imu_to_velo.txt", motion_file(velodyne_from_body));
    }
  }

  core::Json write_drive(const capture::SequenceReader& sequence,
                         const std::optional<FrameScans>& scans, const std::string& name,
                         const std::string& path, DatasetWriter& writer,
                         const core::Context& context) const {
    const auto& cameras = sequence.info().cameras;
    const int left = find_camera(cameras, rig_, left_);
    const int right = find_camera(cameras, rig_, right_);
    const std::vector<ExportedCamera> exported = {
        {"image_00", left}, {"image_01", right}, {"image_02", left}, {"image_03", right}};
    const LocalFrame local = local_frame(sequence);
    const geo::WorldFrame world(sequence.info().origin);

    for (const capture::FrameRecord& record : sequence.frames())
      writer.write(fmt::format("{}/oxts/data/{:010}.txt", path, record.index),
                   oxts_packet(world, record));
    const auto write_times = [&](const std::string& sensor, auto&& time_s) {
      std::string times;
      for (const capture::FrameRecord& record : sequence.frames())
        times += utc_with_nanoseconds(sequence.info().utc_start, time_s(record)) + "\n";
      writer.write(fmt::format("{}/{}/timestamps.txt", path, sensor), times);
    };
    for (const ExportedCamera& camera : exported)
      write_times(camera.name, [&](const capture::FrameRecord& record) {
        return calibration_.time_s(record, camera.camera_index);
      });
    write_times("oxts", [](const capture::FrameRecord& record) { return record.time_s; });
    writer.write(path + "/oxts/dataformat.txt", oxts_format());
    writer.write(path + "/poses.txt", relative_poses(sequence, local, left));
    write_additions(writer, path, sequence, exported, scan_forms);

    const auto num_frames = static_cast<std::int64_t>(sequence.frames().size());
    core::Progress progress(context, "frames", num_frames);
    core::parallel_for(num_frames, [&](std::int64_t i) {
      const auto frame = static_cast<int>(i);
      const auto image = [&](int number) {
        return fmt::format("{}/image_{:02}/data/{:010}.png", path, number, frame);
      };
      write_grey_and_color(sequence, frame, left, image(0), image(2), writer);
      write_grey_and_color(sequence, frame, right, image(1), image(3), writer);
      if (depth_)
        writer.write_kept(fmt::format("{}/depth_02/data/{:010}.npy", path, frame), [&] {
          return core::npy_bytes(depth_with_empty_sky(sequence, frame, left));
        });
      progress.advance();
    });
    core::Json entry = describe_sequence(sequence, local, name, path, exported, calibration_);
    if (scans) entry.set("lidar", write_raw_scans(*scans, path, writer));
    if (const int imu = extracted_imu(sequence); imu >= 0)
      entry.set("extract", write_extract(sequence, imu, path, writer));
    return entry;
  }

  std::string rig_ = "mcs4";
  std::string left_ = "cam0";
  std::string right_ = "cam3";
  std::string drive_ = "0001";
  bool depth_ = true;
  StatedCalibration calibration_;
  LidarChoice lidar_;
  bool extract_ = true;
};

}  // namespace

ExporterInfo kitti_raw_exporter() {
  return {
      .name = kFormat,
      .summary = "KITTI raw: rectified pair, calibration, OXTS packets on true WGS84, lidar.",
      .make = []() -> std::unique_ptr<Exporter> { return std::make_unique<KittiRawExporter>(); }};
}

}  // namespace terracast::exporters
