#include "validate/readers/kitti.h"

#include <array>
#include <limits>

#include "core/atomic_file.h"
#include "core/error.h"
#include "validate/text.h"

namespace terracast::validate {

namespace {

using core::ErrorKind;
using core::fail;

using Projection = Eigen::Matrix<double, 3, 4>;

Projection projection_from_numbers(const std::vector<double>& numbers) {
  Projection matrix;
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 4; ++column)
      matrix(row, column) = numbers[static_cast<std::size_t>(4 * row + column)];
  return matrix;
}

/// The matrices P0 to P3 (and Tr, which must be there: pykitti fails without it).
std::array<Projection, 4> read_calibration(const std::filesystem::path& file,
                                           const std::string& name) {
  std::array<Projection, 4> projections;
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
    if (is_projection) projections[index] = matrix;
    is_there[index] = true;
  }
  for (std::size_t i = 0; i < is_there.size(); ++i)
    if (!is_there[i])
      fail(ErrorKind::Input, "{}: no line {}", name, i < 4 ? "P" + std::to_string(i) + ":" : "Tr:");
  return projections;
}

/// Camera k from camera 0: P = K [I | t].
Pose camera_from_camera0(const Projection& projection) {
  const Eigen::Matrix3d k = projection.leftCols<3>();
  return {Eigen::Matrix3d::Identity(), k.inverse() * projection.col(3)};
}

int camera_number(const std::string& name) {
  if (name.size() == 7 && name.starts_with("image_") && name[6] >= '0' && name[6] <= '3')
    return name[6] - '0';
  return -1;
}

/// Width and height as the image's own header says; every other image is held against it.
void read_size(const Dataset& dataset, const std::string& path, Intrinsics& intrinsics) {
  const core::Image8 image = read_png8(dataset.root / path, path, 0, Intrinsics{});
  intrinsics.width_px = image.width();
  intrinsics.height_px = image.height();
}

}  // namespace

void KittiReader::read(const Dataset& dataset, Sequence& sequence, Findings& findings) const {
  for (int number = 0; number < 4; ++number) {
    const std::string name = "image_" + std::to_string(number);
    if (sequence.camera_index(name) >= 0 ||
        !std::filesystem::exists(dataset.root / sequence.path / name))
      continue;
    Camera camera;  // a folder that dataset.json does not speak of is read all the same
    camera.name = name;
    camera.local_from_camera.resize(static_cast<std::size_t>(sequence.num_frames));
    camera.georeference.resize(static_cast<std::size_t>(sequence.num_frames));
    camera.files.resize(static_cast<std::size_t>(sequence.num_frames));
    sequence.cameras.push_back(std::move(camera));
  }

  std::array<Projection, 4> projections;
  const std::string calibration = sequence.path + "/calib.txt";
  const bool has_calibration = findings.attempt(calibration, [&] {
    projections = read_calibration(dataset.root / calibration, calibration);
    for (Camera& camera : sequence.cameras) {
      const int number = camera_number(camera.name);
      if (number < 0)
        fail(ErrorKind::Input, "camera \"{}\" is none of image_0 to image_3", camera.name);
      const Projection& p = projections[static_cast<std::size_t>(number)];
      camera.intrinsics.fx_px = p(0, 0);
      camera.intrinsics.fy_px = p(1, 1);
      camera.intrinsics.cx_px = p(0, 2) + 0.5;
      camera.intrinsics.cy_px = p(1, 2) + 0.5;
      if (p(0, 0) <= 0.0 || p(1, 1) <= 0.0 || p(2, 2) != 1.0 || p(0, 1) != 0.0 || p(1, 0) != 0.0 ||
          p(2, 0) != 0.0 || p(2, 1) != 0.0)
        fail(ErrorKind::Input, "P{} is not K [I | t]", number);
    }
  });

  // Poses of camera 0 relative to its first frame.
  const std::string poses = "dataset/poses/" + sequence.name + ".txt";
  std::vector<Pose> first_from_camera0;
  findings.attempt(poses, [&] {
    const std::string text = core::read_text_file(dataset.root / poses);
    for (const TextLine& line : split_lines(text)) {
      const std::string where = poses + ":" + std::to_string(line.number);
      // evo takes exactly 12 fields with single blanks and none at the end.
      if (split_at(line.text, ' ').size() != 12)
        fail(ErrorKind::Input, "{}: {} fields parted by single blanks, not 12", where,
             split_at(line.text, ' ').size());
      const Projection matrix = projection_from_numbers(parse_numbers(line.text, 12, where));
      first_from_camera0.push_back({matrix.leftCols<3>(), matrix.col(3)});
    }
    if (first_from_camera0.size() != static_cast<std::size_t>(sequence.num_frames))
      findings.add(poses, fmt::format("{} rows for {} frames", first_from_camera0.size(),
                                      sequence.num_frames));
  });

  const std::string times = sequence.path + "/times.txt";
  findings.attempt(times, [&] {
    const std::string text = core::read_text_file(dataset.root / times);
    for (const TextLine& line : split_lines(text))
      sequence.times_s.push_back(
          parse_number(line.text, times + ":" + std::to_string(line.number)));
    if (sequence.times_s.size() != static_cast<std::size_t>(sequence.num_frames))
      findings.add(times, fmt::format("{} rows for {} frames", sequence.times_s.size(),
                                      sequence.num_frames));
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
