#include "validate/readers/kitti.h"

#include <algorithm>
#include <array>
#include <limits>

#include "core/atomic_file.h"
#include "core/error.h"
#include "validate/readers/kitti_files.h"
#include "validate/text.h"

namespace terracast::validate {

namespace {

using core::ErrorKind;
using core::fail;

/// The matrices P0 to P3 (and Tr, which must be there: pykitti fails without it).
/// scans   take their mount from Tr; nothing: there is no lidar, and Tr is a change of axes
std::array<Projection, 4> read_calibration(const std::filesystem::path& file,
                                           const std::string& name,
                                           std::optional<FormatScans>& scans) {
  const Projection axes_alone = (Projection() << 0, -1, 0, 0, 0, 0, -1, 0, 1, 0, 0, 0).finished();
  std::array<Projection, 4> projections;
  Projection scanner = axes_alone;
  std::array<bool, 5> is_there{};
  const std::string text = core::read_text_file(file);
  for (const TextLine& line : split_lines(text)) {
    const std::string where = name + ":" + std::to_string(line.number);
    const std::size_t colon = line.text.find(':');
    if (trimmed(line.text).empty()) continue;
    if (colon == std::string_view::npos)
      fail(ErrorKind::Input, "{}: a line without \"key:\"", where);
    const std::string_view key = line.text.substr(0, colon);
    const bool is_projection = key.size() == 2 && key[0] == 'P' && key[1] >= '0' && key[1] <= '3';
    if (!is_projection && key != "Tr") continue;
    const Projection matrix =
        projection_from_numbers(parse_numbers(line.text.substr(colon + 1), 12, where));
    const std::size_t index = is_projection ? static_cast<std::size_t>(key[1] - '0') : 4;
    (is_projection ? projections[index] : scanner) = matrix;
    is_there[index] = true;
  }
  for (std::size_t i = 0; i < is_there.size(); ++i)
    if (!is_there[i])
      fail(ErrorKind::Input, "{}: no line {}", name, i < 4 ? "P" + std::to_string(i) + ":" : "Tr:");
  if (scans) {
    scans->mount_file = name;
    scans->camera_from_points = {scanner.leftCols<3>(), scanner.col(3)};
    constexpr double kDigitsOfRotation = 1e-6;
    if (!scans->camera_from_points.rotation.isUnitary(kDigitsOfRotation))
      fail(ErrorKind::Input, "{}: Tr holds no rotation", name);
  } else if (scanner !=
             axes_alone)  // the frame of no lidar: camera 0's with x forward, y left, z up
    fail(ErrorKind::Input, "{}: Tr is no change of axes from x forward, y left, z up", name);
  for (std::size_t k = 0; k < 2; ++k)
    if (projections[k] != projections[k + 2])
      fail(ErrorKind::Input, "{}: P{} is not P{}; grey and colour are of one camera", name, k,
           k + 2);
  return projections;
}

/// velodyne/ and labels/; a copy of the poses, where SemanticKITTI's readers look for them.
void find_scans(const Dataset& dataset, Sequence& sequence, Findings& findings) {
  if (!sequence.scans) {
    if (dataset.files.contains(sequence.path + "/velodyne/000000.bin"))
      findings.add(sequence.path + "/velodyne", "dataset.json names no lidar that it is of");
    return;
  }
  FormatScans& scans = *sequence.scans;
  scans.points =
      numbered_files(dataset, sequence.path + "/velodyne", ".bin", sequence.num_frames, findings);
  scans.labels =
      numbered_files(dataset, sequence.path + "/labels", ".label", sequence.num_frames, findings);
  scans.instances = sequence.path + "/instances.csv";
  scans.camera = sequence.camera_index("image_0");
  scans.depth_camera = sequence.camera_index("image_2");
  const std::string copy = sequence.path + "/poses.txt";
  findings.attempt(copy, [&] {
    if (core::read_text_file(dataset.root / copy) !=
        core::read_text_file(dataset.root / ("dataset/poses/" + sequence.name + ".txt")))
      findings.add(copy, "other poses than dataset/poses has");
  });
}

int camera_number(const std::string& name) {
  if (name.size() == 7 && name.starts_with("image_") && name[6] >= '0' && name[6] <= '3')
    return name[6] - '0';
  return -1;
}

/// Times by the left camera's clock since its first stamp become the times.
void adopt_true_times(Sequence& sequence) {
  const int left = sequence.camera_index("image_0");
  if (left < 0) return;
  const Camera& camera = sequence.cameras[static_cast<std::size_t>(left)];
  const auto ahead_s = [&](std::size_t frame) {
    const auto& row = camera.georeference[frame];
    return row ? camera.stamps_s[frame] - row->time_s : 0.0;
  };
  for (std::size_t i = 0; i < std::min(sequence.times_s.size(), camera.stamps_s.size()); ++i)
    sequence.times_s[i] -= ahead_s(i) - ahead_s(0);
}

}  // namespace

void KittiReader::read(const Dataset& dataset, Sequence& sequence, Findings& findings) const {
  add_unlisted_cameras(dataset, {"image_0", "image_1", "image_2", "image_3"}, sequence);
  std::array<Projection, 4> projections;
  const std::string calibration = sequence.path + "/calib.txt";
  const bool has_calibration = findings.attempt(calibration, [&] {
    projections = read_calibration(dataset.root / calibration, calibration, sequence.scans);
    for (Camera& camera : sequence.cameras) {
      const int number = camera_number(camera.name);
      if (number < 0)
        fail(ErrorKind::Input, "camera \"{}\" is none of image_0 to image_3", camera.name);
      set_intrinsics(projections[static_cast<std::size_t>(number)], "P" + std::to_string(number),
                     camera.intrinsics);
    }
  });

  find_scans(dataset, sequence, findings);
  const std::vector<Pose> first_from_camera0 = read_relative_poses(
      dataset, "dataset/poses/" + sequence.name + ".txt", sequence.num_frames, findings);

  const std::string times = sequence.path + "/times.txt";
  findings.attempt(times, [&] {
    const std::string text = core::read_text_file(dataset.root / times);
    for (const TextLine& line : split_lines(text))
      sequence.times_s.push_back(
          parse_number(line.text, times + ":" + std::to_string(line.number)));
    if (sequence.times_s.size() != static_cast<std::size_t>(sequence.num_frames))
      findings.add(times, fmt::format("{} rows for {} frames", sequence.times_s.size(),
                                      sequence.num_frames));
    if (sequence.states_belief) adopt_true_times(sequence);
  });

  // The first frame's place comes from georeference.csv; all others follow from the poses.
  std::optional<Pose> local_from_camera0;
  if (has_calibration)
    for (const Camera& camera : sequence.cameras) {
      if (local_from_camera0 || camera.georeference.empty() || !camera.georeference[0]) continue;
      const Georeference& row = *camera.georeference[0];
      const Pose ecef_from_camera{enu_from_ecef(row.place).transpose() * row.enu_from_camera,
                                  ecef_from_geodetic(row.place)};
      local_from_camera0 =
          ecef_from_local(sequence.origin).inverse() * ecef_from_camera *
          camera_from_camera0(projections[static_cast<std::size_t>(camera_number(camera.name))]);
    }
  if (!local_from_camera0)
    findings.add(sequence.path,
                 "no camera has a georeference of frame 0, so that the poses cannot be placed");

  for (Camera& camera : sequence.cameras) {
    const int number = camera_number(camera.name);
    if (number < 0) continue;
    const std::string digit = std::to_string(number);
    const auto fill = [&](const std::string& folder, const char* suffix,
                          std::string FrameFiles::*member, bool is_optional) {
      const std::vector<std::string> paths =
          numbered_files(dataset, sequence.path + "/" + folder, suffix, sequence.num_frames,
                         findings, is_optional);
      for (std::size_t i = 0; i < paths.size(); ++i) camera.files[i].*member = paths[i];
    };
    fill("image_" + digit, ".png", &FrameFiles::color, false);
    if (number == 2) {
      fill("depth_2", ".npy", &FrameFiles::depth, true);
      fill("disp_2", ".png", &FrameFiles::disparity, true);
    }
    if (!camera.files.empty() && !camera.files[0].color.empty())
      findings.attempt(camera.files[0].color,
                       [&] { read_size(dataset, camera.files[0].color, camera.intrinsics); });
    if (!has_calibration || !local_from_camera0) continue;
    const Pose camera0_from_camera =
        camera_from_camera0(projections[static_cast<std::size_t>(number)]).inverse();
    camera.camera0_from_camera = camera0_from_camera;
    sequence.local_from_first = *local_from_camera0;
    for (std::size_t i = 0; i < camera.local_from_camera.size() && i < first_from_camera0.size();
         ++i)
      camera.local_from_camera[i] =
          *local_from_camera0 * first_from_camera0[i] * camera0_from_camera;
  }
  const int left = sequence.camera_index("image_2");
  const int right = sequence.camera_index("image_3");
  if (has_calibration && left >= 0 && right >= 0)
    sequence.stereo = StereoPair{left, right,
                                 camera_from_camera0(projections[2]).translation.x() -
                                     camera_from_camera0(projections[3]).translation.x()};
}

core::ImageF KittiReader::depth(const Dataset& dataset, const Camera& camera, int frame) const {
  const std::string& path = camera.files[static_cast<std::size_t>(frame)].depth;
  return read_depth_npy(dataset.root / path, path, camera.intrinsics);
}

core::ImageF KittiReader::disparity(const Dataset& dataset, const Camera& camera, int frame) const {
  const std::string& path = camera.files[static_cast<std::size_t>(frame)].disparity;
  const core::Image16 counts = read_png16(dataset.root / path, path, 1, camera.intrinsics);
  core::ImageF disparity(counts.width(), counts.height());
  for (std::size_t i = 0; i < counts.data().size(); ++i) {
    const std::uint16_t count = counts.data()[i];
    disparity.data()[i] =
        count == 0 ? std::numeric_limits<float>::quiet_NaN() : static_cast<float>(count) / 256.0F;
  }
  return disparity;
}

}  // namespace terracast::validate
