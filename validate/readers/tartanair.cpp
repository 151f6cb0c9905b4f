#include "validate/readers/tartanair.h"

#include <algorithm>
#include <bit>
#include <limits>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/json.h"
#include "validate/npy.h"
#include "validate/text.h"

namespace terracast::validate {

namespace {

using core::ErrorKind;
using core::fail;

/// The readers of this format have 320 written into their code.
constexpr Intrinsics kFixedCamera{640, 640, 320.0, 320.0, 320.0, 320.0};

Eigen::Matrix3d enu_from_ned() {
  Eigen::Matrix3d m;
  m << 0, 1, 0, 1, 0, 0, 0, 0, -1;
  return m;
}

/// The readers take the right camera to stand so far to the right of the left one.
constexpr double kFixedBaseline_m = 0.25;

/// Camera x right, y down, z forward, in x forward, y right, z down.
Eigen::Matrix3d frd_from_rdf() {
  Eigen::Matrix3d m;
  m << 0, 0, 1, 1, 0, 0, 0, 1, 0;
  return m;
}

core::ImageF flow_image(const std::map<std::string, NpyArray>& arrays, const char* key,
                        const std::string& path, const Intrinsics& size) {
  const auto found = arrays.find(key);
  if (found == arrays.end()) fail(ErrorKind::Input, "{}: no array {}", path, key);
  const auto width = static_cast<std::size_t>(size.width_px);
  const auto height = static_cast<std::size_t>(size.height_px);
  if (found->second.shape != std::vector<std::size_t>{1, 2, height, width})
    fail(ErrorKind::Input, "{}: {} must have the shape (1, 2, {}, {})", path, key, height, width);
  const std::vector<float> values = found->second.floats(path + "/" + key);
  core::ImageF image(size.width_px, size.height_px, 2);
  for (std::size_t i = 0; i < width * height; ++i) {
    image.data()[2 * i] = values[i];
    image.data()[2 * i + 1] = values[width * height + i];
  }
  return image;
}

core::Image8 mask_image(const std::map<std::string, NpyArray>& arrays, const char* key,
                        const std::string& path, const Intrinsics& size) {
  const auto found = arrays.find(key);
  if (found == arrays.end()) fail(ErrorKind::Input, "{}: no array {}", path, key);
  if (found->second.shape != std::vector<std::size_t>{1, static_cast<std::size_t>(size.height_px),
                                                      static_cast<std::size_t>(size.width_px)})
    fail(ErrorKind::Input, "{}: {} must have the shape (1, {}, {})", path, key, size.height_px,
         size.width_px);
  const std::vector<std::uint8_t> values = found->second.flags(path + "/" + key);
  core::Image8 image(size.width_px, size.height_px);
  std::copy(values.begin(), values.end(), image.data().begin());
  return image;
}

/// The rectified pair, which must stand as the format fixes it.
void add_pair(Sequence& sequence, Findings& findings) {
  const int left = sequence.camera_index("lcam_front");
  const int right = sequence.camera_index("rcam_front");
  if (left < 0 || right < 0) return;
  sequence.stereo = StereoPair{left, right, kFixedBaseline_m};
  const auto& left_poses = sequence.cameras[static_cast<std::size_t>(left)].local_from_camera;
  const auto& right_poses = sequence.cameras[static_cast<std::size_t>(right)].local_from_camera;
  for (std::size_t i = 0; i < left_poses.size() && i < right_poses.size(); ++i) {
    if (!left_poses[i] || !right_poses[i]) continue;
    const Eigen::Vector3d offset = (left_poses[i]->inverse() * *right_poses[i]).translation;
    // Nine digits of a position 50 km from the origin.
    constexpr double kTolerance_m = 1e-3;
    if ((offset - Eigen::Vector3d(kFixedBaseline_m, 0.0, 0.0)).norm() <= kTolerance_m) continue;
    findings.add(sequence.path,
                 fmt::format("rcam_front stands ({:.4f}, {:.4f}, {:.4f}) m right, down and forward "
                             "of lcam_front in frame {}; {} m to the right is the format's",
                             offset.x(), offset.y(), offset.z(), i, kFixedBaseline_m));
    return;
  }
}

}  // namespace

void TartanAirReader::read(const Dataset& dataset, Sequence& sequence, Findings& findings) const {
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

  for (Camera& camera : sequence.cameras) {
    camera.intrinsics = kFixedCamera;
    const std::string poses = sequence.path + "/pose_" + camera.name + ".txt";
    findings.attempt(poses, [&] {
      const std::string text = core::read_text_file(dataset.root / poses);
      const std::vector<TextLine> lines = split_lines(text);
      if (lines.size() != camera.local_from_camera.size())
        findings.add(poses,
                     fmt::format("{} rows for {} frames", lines.size(), sequence.num_frames));
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
    const auto fill = [&](const std::string& kind, const std::string& suffix,
                          std::string FrameFiles::*member) {
      const std::vector<std::string> paths =
          numbered_files(dataset, sequence.path + "/" + kind + "_" + camera.name, suffix,
                         sequence.num_frames, findings);
      for (std::size_t i = 0; i < paths.size(); ++i) camera.files[i].*member = paths[i];
    };
    fill("image", "_" + camera.name + ".png", &FrameFiles::color);
    fill("depth", "_" + camera.name + "_depth.png", &FrameFiles::depth);
    fill("seg", "_" + camera.name + "_seg.png", &FrameFiles::segmentation);
    if (camera.name != "lcam_front") continue;
    const std::string folder = sequence.path + "/flow_" + camera.name;
    const std::vector<std::string> found = list_folder(dataset.root / folder);
    // The older form, 16-bit PNG, is only counted: its 1/64 px says less than the depth does.
    const bool is_png = !found.empty() && found[0].ends_with("_flow.png");
    for (int i = 0; i + 1 < sequence.num_frames; ++i) {
      const std::string stem = frame_digits(i) + "_" + frame_digits(i + 1);
      const std::string file = is_png ? stem + "_flow.png" : stem + "_" + camera.name + "_flow.npz";
      if (is_png && std::binary_search(found.begin(), found.end(), file)) continue;
      if (std::binary_search(found.begin(), found.end(), file))
        camera.files[static_cast<std::size_t>(i)].flow = folder + "/" + file;
      else
        findings.add(folder + "/" + file, "missing");
    }
    if (found.size() + 1 > static_cast<std::size_t>(sequence.num_frames))
      findings.add(
          folder,
          fmt::format("{} files for {} frames; the readers pair files by their place in the list",
                      found.size(), sequence.num_frames));
  }
  add_pair(sequence, findings);
}

core::ImageF TartanAirReader::depth(const Dataset& dataset, const Camera& camera, int frame) const {
  const std::string& path = camera.files[static_cast<std::size_t>(frame)].depth;
  const core::Image8 rgba = read_png8(dataset.root / path, path, 4, camera.intrinsics);
  core::ImageF depth(rgba.width(), rgba.height());
  for (std::size_t i = 0; i < depth.data().size(); ++i) {
    const std::uint8_t* p = &rgba.data()[4 * i];
    // OpenCV hands the readers B, G, R, A, which they take for the bytes of a little-endian float.
    const std::uint32_t bits =
        static_cast<std::uint32_t>(p[2]) | static_cast<std::uint32_t>(p[1]) << 8 |
        static_cast<std::uint32_t>(p[0]) << 16 | static_cast<std::uint32_t>(p[3]) << 24;
    const auto value = std::bit_cast<float>(bits);
    if (!(value > 0.0F) || value > dataset.sky_depth_m)
      fail(ErrorKind::Input,
           "{}: depth {} at pixel ({}, {}); more than 0 and at most {} (sky) is right", path, value,
           i % static_cast<std::size_t>(rgba.width()), i / static_cast<std::size_t>(rgba.width()),
           dataset.sky_depth_m);
    depth.data()[i] = value < dataset.sky_depth_m ? value : std::numeric_limits<float>::quiet_NaN();
  }
  return depth;
}

FlowFields TartanAirReader::flow(const Dataset& dataset, const Camera& camera, int frame) const {
  const std::string& path = camera.files[static_cast<std::size_t>(frame)].flow;
  const std::map<std::string, NpyArray> arrays =
      parse_npz(core::read_file(dataset.root / path), path);
  FlowFields fields;
  fields.forward = flow_image(arrays, "flow_fwd", path, camera.intrinsics);
  fields.backward = flow_image(arrays, "flow_bwd", path, camera.intrinsics);
  fields.in_view_forward = mask_image(arrays, "fov_mask_fwd", path, camera.intrinsics);
  fields.in_view_backward = mask_image(arrays, "fov_mask_bwd", path, camera.intrinsics);
  fields.covisible_forward = mask_image(arrays, "covisible_mask_fwd", path, camera.intrinsics);
  fields.covisible_backward = mask_image(arrays, "covisible_mask_bwd", path, camera.intrinsics);
  return fields;
}

}  // namespace terracast::validate
