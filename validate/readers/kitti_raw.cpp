#include "validate/readers/kitti_raw.h"

#include <array>
#include <cmath>
#include <limits>
#include <map>

#include "core/atomic_file.h"
#include "core/error.h"
#include "validate/readers/kitti_files.h"
#include "validate/text.h"

namespace terracast::validate {

namespace {

using core::ErrorKind;
using core::fail;

constexpr int kDigits = 10;
constexpr std::array kCameraNames = {"image_00", "image_01", "image_02", "image_03"};

int camera_number(const std::string& name) {
  for (std::size_t i = 0; i < kCameraNames.size(); ++i)
    if (name == kCameraNames[i]) return static_cast<int>(i);
  return -1;
}

/// The numbers of a calibration file by key; a line of other words (calib_time) is passed over.
class KeyedNumbers {
 public:
  KeyedNumbers(const Dataset& dataset, std::string path) : path_(std::move(path)) {
    text_ = core::read_text_file(dataset.root / path_);
    for (const TextLine& line : split_lines(text_)) {
      if (trimmed(line.text).empty()) continue;
      const std::size_t colon = line.text.find(':');
      if (colon == std::string_view::npos)
        fail(ErrorKind::Input, "{}:{}: a line without \"key:\"", path_, line.number);
      lines_[std::string(line.text.substr(0, colon))] = {line.number, line.text.substr(colon + 1)};
    }
  }

  /// throws  Input: no such key, another count, or something that is no number
  std::vector<double> at(const std::string& key, std::size_t count) const {
    const auto line = lines_.find(key);
    if (line == lines_.end()) fail(ErrorKind::Input, "{}: no line {}:", path_, key);
    return parse_numbers(line->second.text, count,
                         fmt::format("{}:{}", path_, line->second.number));
  }
  Eigen::Matrix3d matrix3(const std::string& key) const {
    const std::vector<double> n = at(key, 9);
    return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(n.data());
  }
  Pose pose(const std::string& rotation, const std::string& translation) const {
    const std::vector<double> t = at(translation, 3);
    return {matrix3(rotation), {t[0], t[1], t[2]}};
  }

 private:
  std::string path_;
  std::string text_;
  std::map<std::string, TextLine> lines_;
};

struct Calibration {
  std::array<Projection, 4> projections;
  std::array<Eigen::Vector2d, 4> sizes_px;
  Pose camera0_from_imu;       ///< the rectified camera 0
  Pose camera0_from_velodyne;  ///< the same
};

Calibration read_calibration(const Dataset& dataset, const std::string& date) {
  const KeyedNumbers cameras(dataset, date + "/calib_cam_to_cam.txt");
  const KeyedNumbers velodyne(dataset, date + "/calib_velo_to_cam.txt");
  const KeyedNumbers imu(dataset, date + "/calib_imu_to_velo.txt");
  Calibration calibration;
  for (std::size_t k = 0; k < 4; ++k) {
    const std::string number = fmt::format("{:02}", k);
    calibration.projections[k] = projection_from_numbers(cameras.at("P_rect_" + number, 12));
    // The cameras are rectified as they stand: both descriptions are of one camera.
    const Pose unrectified = cameras.pose("R_" + number, "T_" + number);
    const Pose rectified = camera_from_camera0(calibration.projections[k]);
    if ((cameras.matrix3("K_" + number) - calibration.projections[k].leftCols<3>())
                .cwiseAbs()
                .maxCoeff() > 1e-6 ||
        (unrectified.translation - rectified.translation).norm() > 1e-6 ||
        !unrectified.rotation.isIdentity(1e-9) ||
        !cameras.matrix3("R_rect_" + number).isIdentity(1e-9))
      fail(ErrorKind::Input,
           "{}/calib_cam_to_cam.txt: K_{}, R_{}, T_{} and R_rect_{} are not those of the rectified "
           "camera P_rect_{}",
           date, number, number, number, number, number);
    const std::vector<double> size_px = cameras.at("S_" + number, 2);
    if (size_px != cameras.at("S_rect_" + number, 2))
      fail(ErrorKind::Input, "{}/calib_cam_to_cam.txt: S_{} is not S_rect_{}", date, number,
           number);
    calibration.sizes_px[k] = {size_px[0], size_px[1]};
    for (const double value : cameras.at("D_" + number, 5))
      if (value != 0.0)
        fail(ErrorKind::Input, "{}/calib_cam_to_cam.txt: D_{} is not 0: nothing is distorted", date,
             number);
  }
  const Pose rectified0{cameras.matrix3("R_rect_00"), Eigen::Vector3d::Zero()};
  calibration.camera0_from_velodyne =
      camera_from_camera0(calibration.projections[0]) * rectified0 * velodyne.pose("R", "T");
  calibration.camera0_from_imu = calibration.camera0_from_velodyne * imu.pose("R", "T");
  return calibration;
}

/// Nanoseconds since 1970 of each line. Readers cut the last four characters off each line, so that
/// nine decimals and the end of the last line are needed.
std::vector<std::int64_t> read_timestamps(const Dataset& dataset, const std::string& path,
                                          int num_frames) {
  const std::string text = core::read_text_file(dataset.root / path);
  if (!text.ends_with('\n'))
    fail(ErrorKind::Input, "{}: no new line at its end: readers would cut the last time stamp",
         path);
  std::vector<std::int64_t> times_ns;
  for (const TextLine& line : split_lines(text)) {
    const std::string where = path + ":" + std::to_string(line.number);
    constexpr std::size_t kLength = 29;  // of "2011-09-26 13:02:25.964389445"
    if (line.text.size() != kLength)
      fail(ErrorKind::Input,
           "{}: a time stamp of {} characters; YYYY-MM-DD HH:MM:SS.nnnnnnnnn is right", where,
           line.text.size());
    times_ns.push_back(parse_utc_ns(line.text, where));
  }
  if (times_ns.size() != static_cast<std::size_t>(num_frames))
    fail(ErrorKind::Input, "{}: {} rows for {} frames", path, times_ns.size(), num_frames);
  return times_ns;
}

/// The unit's own times count; those of the cameras must be the same, or their own clocks' where the
/// dataset states what is believed.
void read_times(const Dataset& dataset, Sequence& sequence, Findings& findings) {
  const std::string path = sequence.path + "/oxts/timestamps.txt";
  std::vector<std::int64_t> times_ns;
  std::int64_t start_ns = 0;
  findings.attempt(path, [&] {
    times_ns = read_timestamps(dataset, path, sequence.num_frames);
    start_ns = parse_utc_ns(sequence.utc_start, "dataset.json: utc_start");
    for (const std::int64_t time_ns : times_ns)
      sequence.times_s.push_back(static_cast<double>(time_ns - start_ns) * 1e-9);
  });
  for (const Camera& camera : sequence.cameras) {
    const std::string images = sequence.path + "/" + camera.name + "/timestamps.txt";
    findings.attempt(images, [&] {
      const std::vector<std::int64_t> own_ns =
          read_timestamps(dataset, images, sequence.num_frames);
      if (!sequence.states_belief || camera.stamps_s.empty()) {
        if (own_ns != times_ns) findings.add(images, "other times than oxts/timestamps.txt");
        return;
      }
      for (std::size_t i = 0; i < own_ns.size(); ++i)
        if (static_cast<double>(own_ns[i] - start_ns) != std::round(camera.stamps_s[i] * 1e9))
          findings.add(images, fmt::format("frame {}: another stamp than timestamps.csv has", i));
    });
  }
}

/// velodyne_points/: as they were at their pulses' times.
void find_scans(const Dataset& dataset, const std::string& date, const Calibration& calibration,
                Sequence& sequence, Findings& findings) {
  const std::string folder = sequence.path + "/velodyne_points";
  if (!sequence.scans) {
    if (dataset.files.contains(folder + "/timestamps.txt"))
      findings.add(folder, "dataset.json names no lidar that it is of");
    return;
  }
  FormatScans& scans = *sequence.scans;
  scans.is_deskewed = false;
  scans.camera = sequence.camera_index("image_00");
  scans.camera_from_points = calibration.camera0_from_velodyne;
  scans.mount_file = date + "/calib_velo_to_cam.txt";
  scans.points = numbered_files(dataset, folder + "/data", ".bin", sequence.num_frames, findings,
                                false, kDigits);
  const std::int64_t start_ns = parse_utc_ns(sequence.utc_start, "dataset.json: utc_start");
  const auto seconds_of = [&](const std::string& name) {
    std::vector<double> times_s;
    findings.attempt(folder + "/" + name, [&] {
      for (const std::int64_t time_ns :
           read_timestamps(dataset, folder + "/" + name, sequence.num_frames))
        times_s.push_back(1e-9 * static_cast<double>(time_ns - start_ns));
    });
    times_s.resize(static_cast<std::size_t>(sequence.num_frames),
                   std::numeric_limits<double>::quiet_NaN());
    return times_s;
  };
  scans.begin_s = seconds_of("timestamps_start.txt");
  scans.middle_s = seconds_of("timestamps.txt");
  scans.end_s = seconds_of("timestamps_end.txt");
}

/// The thirty names of a packet's numbers, in their order.
void check_packet_names(const Dataset& dataset, const std::string& path) {
  constexpr std::array kNames = {
      "lat",          "lon",     "alt",     "roll",    "pitch",   "yaw",    "vn", "ve",
      "vf",           "vl",      "vu",      "ax",      "ay",      "az",     "af", "al",
      "au",           "wx",      "wy",      "wz",      "wf",      "wl",     "wu", "pos_accuracy",
      "vel_accuracy", "navstat", "numsats", "posmode", "velmode", "orimode"};
  if (!dataset.files.contains(path)) return;
  const std::string text = core::read_text_file(dataset.root / path);
  const std::vector<TextLine> lines = split_lines(text);
  if (lines.size() != kNames.size())
    fail(ErrorKind::Input, "{}: {} lines for {} numbers", path, lines.size(), kNames.size());
  for (std::size_t i = 0; i < lines.size(); ++i)
    if (lines[i].text.substr(0, lines[i].text.find(':')) != kNames[i])
      fail(ErrorKind::Input, "{}:{}: another name than {}", path, lines[i].number, kNames[i]);
}

void read_packets(const Dataset& dataset, Sequence& sequence, Findings& findings) {
  const std::vector<std::string> paths = numbered_files(
      dataset, sequence.path + "/oxts/data", ".txt", sequence.num_frames, findings, false, kDigits);
  sequence.oxts.resize(paths.size());
  for (std::size_t i = 0; i < paths.size(); ++i)
    if (!paths[i].empty())
      findings.attempt(paths[i], [&] {
        sequence.oxts[i] = parse_oxts(core::read_text_file(dataset.root / paths[i]), paths[i]);
      });
}

/// poses.txt, whose rotations are good to their digits.
std::vector<Pose> read_true_rotations(const Dataset& dataset, const std::string& path,
                                      const Sequence& sequence, Findings& findings) {
  constexpr double kDigitsOfRotation = 1e-6;
  std::vector<Pose> poses = read_relative_poses(dataset, path, sequence.num_frames, findings);
  for (std::size_t i = 0; i < poses.size(); ++i)
    if (!poses[i].rotation.isUnitary(kDigitsOfRotation))
      findings.add(path, fmt::format("row {} holds no rotation", i + 1));
  return poses;
}

void check_name(const Sequence& sequence, const std::string& date, Findings& findings) {
  const std::string start = date + "_drive_";
  const bool is_right = date.size() == 10 && sequence.name.size() == start.size() + 9 &&
                        sequence.name.starts_with(start) && sequence.name.ends_with("_sync") &&
                        sequence.path == date + "/" + sequence.name;
  if (!is_right)
    findings.add(sequence.path,
                 "readers look for YYYY_MM_DD/YYYY_MM_DD_drive_NNNN_sync, and for nothing else");
}

}  // namespace

void KittiRawReader::read(const Dataset& dataset, Sequence& sequence, Findings& findings) const {
  const std::string date = sequence.path.substr(0, sequence.path.find('/'));
  check_name(sequence, date, findings);
  add_unlisted_cameras(dataset, {kCameraNames.begin(), kCameraNames.end()}, sequence);
  Calibration calibration;
  const bool has_calibration = findings.attempt(date, [&] {
    calibration = read_calibration(dataset, date);
    sequence.camera0_from_imu = calibration.camera0_from_imu;
    for (Camera& camera : sequence.cameras) {
      const int number = camera_number(camera.name);
      if (number < 0)
        fail(ErrorKind::Input, "camera \"{}\" is none of image_00 to image_03", camera.name);
      set_intrinsics(calibration.projections[static_cast<std::size_t>(number)],
                     fmt::format("P_rect_{:02}", number), camera.intrinsics);
    }
  });
  findings.attempt(sequence.path,
                   [&] { find_scans(dataset, date, calibration, sequence, findings); });
  read_packets(dataset, sequence, findings);
  const std::string names = sequence.path + "/oxts/dataformat.txt";
  findings.attempt(names, [&] { check_packet_names(dataset, names); });
  read_times(dataset, sequence, findings);
  const std::string poses = sequence.path + "/poses.txt";
  if (std::filesystem::exists(dataset.root / poses) || dataset.files.contains(poses))
    sequence.first_from_camera0 = read_true_rotations(dataset, poses, sequence, findings);

  const Pose local_from_ecef = ecef_from_local(sequence.origin).inverse();
  for (Camera& camera : sequence.cameras) {
    const int number = camera_number(camera.name);
    if (number < 0) continue;
    const auto fill = [&](const std::string& folder, const char* suffix,
                          std::string FrameFiles::*member, bool is_optional) {
      const std::vector<std::string> paths =
          numbered_files(dataset, sequence.path + "/" + folder + "/data", suffix,
                         sequence.num_frames, findings, is_optional, kDigits);
      for (std::size_t i = 0; i < paths.size(); ++i) camera.files[i].*member = paths[i];
    };
    fill(camera.name, ".png", &FrameFiles::color, false);
    if (number == 2) fill("depth_02", ".npy", &FrameFiles::depth, true);
    if (!camera.files[0].color.empty())
      findings.attempt(camera.files[0].color,
                       [&] { read_size(dataset, camera.files[0].color, camera.intrinsics); });
    if (!has_calibration) continue;
    const Eigen::Vector2d& size_px = calibration.sizes_px[static_cast<std::size_t>(number)];
    if (size_px.x() != camera.intrinsics.width_px || size_px.y() != camera.intrinsics.height_px)
      findings.add(
          date + "/calib_cam_to_cam.txt",
          fmt::format("S_{:02} is {} x {}, of images of {} x {} px", number, size_px.x(),
                      size_px.y(), camera.intrinsics.width_px, camera.intrinsics.height_px));
    const Pose imu_from_camera =
        (camera_from_camera0(calibration.projections[static_cast<std::size_t>(number)]) *
         calibration.camera0_from_imu)
            .inverse();
    for (std::size_t i = 0; i < sequence.oxts.size(); ++i)
      if (sequence.oxts[i])
        camera.local_from_camera[i] =
            local_from_ecef * sequence.oxts[i]->ecef_from_imu() * imu_from_camera;
  }
  const int left = sequence.camera_index("image_02");
  const int right = sequence.camera_index("image_03");
  if (has_calibration && left >= 0 && right >= 0)
    sequence.stereo =
        StereoPair{left, right,
                   camera_from_camera0(calibration.projections[2]).translation.x() -
                       camera_from_camera0(calibration.projections[3]).translation.x()};
}

core::ImageF KittiRawReader::depth(const Dataset& dataset, const Camera& camera, int frame) const {
  const std::string& path = camera.files[static_cast<std::size_t>(frame)].depth;
  return read_depth_npy(dataset.root / path, path, camera.intrinsics);
}

}  // namespace terracast::validate
