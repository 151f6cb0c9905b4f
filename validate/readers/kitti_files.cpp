#include "validate/readers/kitti_files.h"

#include "core/atomic_file.h"
#include "core/error.h"
#include "validate/text.h"

namespace terracast::validate {

using core::ErrorKind;
using core::fail;

Projection projection_from_numbers(const std::vector<double>& numbers) {
  Projection matrix;
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 4; ++column)
      matrix(row, column) = numbers[static_cast<std::size_t>(4 * row + column)];
  return matrix;
}

Pose camera_from_camera0(const Projection& projection) {
  const Eigen::Matrix3d k = projection.leftCols<3>();
  return {Eigen::Matrix3d::Identity(), k.inverse() * projection.col(3)};
}

void set_intrinsics(const Projection& projection, const std::string& name, Intrinsics& intrinsics) {
  const Projection& p = projection;
  intrinsics.fx_px = p(0, 0);
  intrinsics.fy_px = p(1, 1);
  intrinsics.cx_px = p(0, 2) + 0.5;
  intrinsics.cy_px = p(1, 2) + 0.5;
  if (p(0, 0) <= 0.0 || p(1, 1) <= 0.0 || p(2, 2) != 1.0 || p(0, 1) != 0.0 || p(1, 0) != 0.0 ||
      p(2, 0) != 0.0 || p(2, 1) != 0.0)
    fail(ErrorKind::Input, "{} is not K [I | t]", name);
}

void read_size(const Dataset& dataset, const std::string& path, Intrinsics& intrinsics) {
  const core::Image8 image = read_png8(dataset.root / path, path, 0, Intrinsics{});
  intrinsics.width_px = image.width();
  intrinsics.height_px = image.height();
}

void add_unlisted_cameras(const Dataset& dataset, const std::vector<std::string>& names,
                          Sequence& sequence) {
  for (const std::string& name : names) {
    if (sequence.camera_index(name) >= 0 ||
        !std::filesystem::exists(dataset.root / sequence.path / name))
      continue;
    Camera camera;
    camera.name = name;
    camera.local_from_camera.resize(static_cast<std::size_t>(sequence.num_frames));
    camera.georeference.resize(static_cast<std::size_t>(sequence.num_frames));
    camera.files.resize(static_cast<std::size_t>(sequence.num_frames));
    camera.bounds.resize(static_cast<std::size_t>(sequence.num_frames));
    sequence.cameras.push_back(std::move(camera));
  }
}

std::vector<Pose> read_relative_poses(const Dataset& dataset, const std::string& path,
                                      int num_frames, Findings& findings) {
  std::vector<Pose> poses;
  findings.attempt(path, [&] {
    const std::string text = core::read_text_file(dataset.root / path);
    for (const TextLine& line : split_lines(text)) {
      const std::string where = path + ":" + std::to_string(line.number);
      // evo takes exactly 12 fields with single blanks and none at the end.
      if (split_at(line.text, ' ').size() != 12)
        fail(ErrorKind::Input, "{}: {} fields parted by single blanks, not 12", where,
             split_at(line.text, ' ').size());
      const Projection matrix = projection_from_numbers(parse_numbers(line.text, 12, where));
      poses.push_back({matrix.leftCols<3>(), matrix.col(3)});
    }
    if (poses.size() != static_cast<std::size_t>(num_frames))
      findings.add(path, fmt::format("{} rows for {} frames", poses.size(), num_frames));
  });
  return poses;
}

}  // namespace terracast::validate
