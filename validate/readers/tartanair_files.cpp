#include "validate/readers/tartanair_files.h"

#include <limits>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/json.h"
#include "validate/text.h"

namespace terracast::validate {

namespace {

using core::ErrorKind;
using core::fail;

Eigen::Matrix3d enu_from_ned() {
  Eigen::Matrix3d m;
  m << 0, 1, 0, 1, 0, 0, 0, 0, -1;
  return m;
}

/// The readers take the right camera to stand so far to the right of the left one.
constexpr double kFixedBaseline_m = 0.25;

}  // namespace

Eigen::Matrix3d frd_from_rdf() {
  Eigen::Matrix3d m;
  m << 0, 0, 1, 1, 0, 0, 0, 1, 0;
  return m;
}

void read_classes(const Dataset& dataset, Sequence& sequence, Findings& findings) {
  const std::string environment = sequence.path.substr(0, sequence.path.find('/'));
  const std::string labels = environment + "/seg_label_map.json";
  findings.attempt(labels, [&] {
    const core::Json map = core::Json::read(dataset.root / labels);
    for (const auto& [name, index] : map.at("name_map").members())
      if (index.integer() < 0 || index.integer() > 255)
        fail(ErrorKind::Input, "{}: class {} has the index {}, outside 0 to 255", labels, name,
             index.integer());
    for (const auto& [name, index] : map.at("name_map").members())
      sequence.classes[static_cast<int>(index.integer())] = name;
  });
}

void read_ned_poses(const Dataset& dataset, const Sequence& sequence, Camera& camera,
                    Findings& findings) {
  const std::string poses = sequence.path + "/pose_" + camera.name + ".txt";
  findings.attempt(poses, [&] {
    const std::string text = core::read_text_file(dataset.root / poses);
    const std::vector<TextLine> lines = split_lines(text);
    if (lines.size() != camera.local_from_camera.size())
      findings.add(poses, fmt::format("{} rows for {} frames", lines.size(), sequence.num_frames));
    for (std::size_t i = 0; i < lines.size() && i < camera.local_from_camera.size(); ++i) {
      const std::string where = poses + ":" + std::to_string(i + 1);
      if (split_at(lines[i].text, ' ').size() != 7)
        fail(ErrorKind::Input, "{}: {} fields parted by single blanks, not 7", where,
             split_at(lines[i].text, ' ').size());
      const std::vector<double> n = parse_numbers(lines[i].text, 7, where);
      const Eigen::Quaterniond ned_from_frd(n[6], n[3], n[4], n[5]);
      camera.local_from_camera[i] =
          Pose{enu_from_ned() * ned_from_frd.toRotationMatrix() * frd_from_rdf(),
               enu_from_ned() * Eigen::Vector3d(n[0], n[1], n[2])};
    }
  });
}

void add_fixed_pair(const std::string& left_name, const std::string& right_name,
                    Sequence& sequence) {
  const int left = sequence.camera_index(left_name);
  const int right = sequence.camera_index(right_name);
  if (left < 0 || right < 0) return;
  sequence.stereo = StereoPair{left, right, kFixedBaseline_m};
}

void check_fixed_pair(const Sequence& sequence, Findings& findings) {
  if (!sequence.stereo) return;
  const Camera& left = sequence.cameras[static_cast<std::size_t>(sequence.stereo->left)];
  const Camera& right = sequence.cameras[static_cast<std::size_t>(sequence.stereo->right)];
  const auto& left_poses = left.local_from_camera;
  const auto& right_poses = right.local_from_camera;
  for (std::size_t i = 0; i < left_poses.size() && i < right_poses.size(); ++i) {
    if (!left_poses[i] || !right_poses[i]) continue;
    const Eigen::Vector3d offset = (left_poses[i]->inverse() * *right_poses[i]).translation;
    // Nine digits of a position 50 km from the origin.
    constexpr double kTolerance_m = 1e-3;
    if ((offset - Eigen::Vector3d(kFixedBaseline_m, 0.0, 0.0)).norm() <= kTolerance_m) continue;
    findings.add(
        sequence.path,
        fmt::format("{} stands ({:.4f}, {:.4f}, {:.4f}) m right, down and forward of {} in "
                    "frame {}; {} m to the right is the format's",
                    right.name, offset.x(), offset.y(), offset.z(), left.name, i,
                    kFixedBaseline_m));
    return;
  }
}

float depth_or_sky(float value_m, const Dataset& dataset, const std::string& path,
                   std::size_t index, int width) {
  if (!(value_m > 0.0F) || value_m > dataset.sky_depth_m)
    fail(ErrorKind::Input,
         "{}: depth {} at pixel ({}, {}); more than 0 and at most {} (sky) is right", path, value_m,
         index % static_cast<std::size_t>(width), index / static_cast<std::size_t>(width),
         dataset.sky_depth_m);
  return value_m < dataset.sky_depth_m ? value_m : std::numeric_limits<float>::quiet_NaN();
}

}  // namespace terracast::validate
