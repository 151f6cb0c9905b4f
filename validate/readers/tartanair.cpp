#include "validate/readers/tartanair.h"

#include <algorithm>
#include <bit>
#include <limits>

#include "core/atomic_file.h"
#include "core/error.h"
#include "validate/npy.h"
#include "validate/readers/tartanair_files.h"

namespace terracast::validate {

namespace {

using core::ErrorKind;
using core::fail;

/// The readers of this format have 320 written into their code.
const Intrinsics kFixedCamera{640, 640, 320.0, 320.0, 320.0, 320.0};

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

/// The older form's steps and the count of flow 0.
constexpr double kFlowStep_px = 1.0 / 64.0;
constexpr int kFlowZero = 32768;

/// Flow of the older form: in the file the mask is red, v green and u blue. The mask is 0 where the point
/// is seen, 1 or 10 where it is hidden by another thing or by itself, 100 out of view, 200 beyond the
/// counts, of which the nearest stands.
FlowFields png_flow(const std::filesystem::path& file, const std::string& path,
                    const Intrinsics& size) {
  const core::Image16 counts = read_png16(file, path, 3, size);
  FlowFields fields;
  fields.forward = core::ImageF(size.width_px, size.height_px, 2);
  fields.in_view_forward = core::Image8(size.width_px, size.height_px);
  fields.covisible_forward = core::Image8(size.width_px, size.height_px);
  for (int y = 0; y < size.height_px; ++y)
    for (int x = 0; x < size.width_px; ++x) {
      const int mask = counts(x, y, 0);
      bool is_at_end = false;
      for (int k = 0; k < 2; ++k) {
        const int count = counts(x, y, 2 - k);
        is_at_end = is_at_end || count == 0 || count == 65535;
        fields.forward(x, y, k) = mask == 200
                                      ? std::numeric_limits<float>::quiet_NaN()
                                      : static_cast<float>(kFlowStep_px * (count - kFlowZero));
      }
      if (mask == 200 && !is_at_end)
        fail(ErrorKind::Input, "{}: mask 200 at pixel ({}, {}), where neither count is 0 or 65535",
             path, x, y);
      if (mask != 0 && mask != 1 && mask != 10 && mask != 100 && mask != 200)
        fail(ErrorKind::Input, "{}: mask {} at pixel ({}, {}); 0, 1, 10, 100 or 200 is right", path,
             mask, x, y);
      fields.in_view_forward(x, y) = mask < 100 ? 1 : 0;
      fields.covisible_forward(x, y) = mask == 0 ? 1 : 0;
    }
  return fields;
}

/// Where the six cameras of a side look: columns are forward, right and down of the face in those of
/// the front camera.
const std::map<std::string, Eigen::Matrix3d>& faces() {
  const auto columns = [](const Eigen::Vector3d& forward, const Eigen::Vector3d& right) {
    Eigen::Matrix3d m;
    m << forward, right, forward.cross(right);
    return m;
  };
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX(), y = Eigen::Vector3d::UnitY(),
                        z = Eigen::Vector3d::UnitZ();
  static const std::map<std::string, Eigen::Matrix3d> table = {
      {"front", columns(x, y)}, {"right", columns(y, -x)}, {"back", columns(-x, -y)},
      {"left", columns(-y, x)}, {"top", columns(-z, y)},   {"bottom", columns(z, y)}};
  return table;
}

/// Readers stitch the six images of a side into one: each camera looks where its name says, from one
/// centre.
void check_faces(const Sequence& sequence, Findings& findings) {
  constexpr double kTolerance_m = 1e-3;
  constexpr double kTolerance_deg = 1e-3;
  for (const Camera& camera : sequence.cameras) {
    const std::string side = camera.name.substr(0, camera.name.find('_') + 1);
    const auto face =
        side == "lcam_" || side == "rcam_" ? faces().find(camera.name.substr(5)) : faces().end();
    if (face == faces().end()) {
      findings.add(sequence.path, fmt::format("the format has no camera {}", camera.name));
      continue;
    }
    const int front = sequence.camera_index(side + "front");
    if (front < 0) continue;
    const auto& front_poses = sequence.cameras[static_cast<std::size_t>(front)].local_from_camera;
    for (std::size_t i = 0; i < front_poses.size() && i < camera.local_from_camera.size(); ++i) {
      if (!front_poses[i] || !camera.local_from_camera[i]) continue;
      const Pose found = front_poses[i]->inverse() * *camera.local_from_camera[i];
      const Eigen::Matrix3d found_frd =
          frd_from_rdf() * found.rotation * frd_from_rdf().transpose();
      const double off_deg =
          degrees_from_radians(rotation_angle_rad(face->second.transpose() * found_frd));
      if (found.translation.norm() <= kTolerance_m && off_deg <= kTolerance_deg) continue;
      findings.add(
          sequence.path,
          fmt::format("{} stands {:.4f} m from {}front and looks {:.4f} deg past where its "
                      "name says in frame {}",
                      camera.name, found.translation.norm(), side, off_deg, i));
      break;
    }
  }
}

}  // namespace

namespace {

/// lidar/: at the frame's time, about lcam_front.
void find_scans(const Dataset& dataset, Sequence& sequence, Findings& findings) {
  const std::string folder = sequence.path + "/lidar";
  if (!sequence.scans) {
    if (dataset.files.contains(folder + "/000000_lcam_front_lidar.ply"))
      findings.add(folder, "dataset.json names no lidar that it is of");
    return;
  }
  FormatScans& scans = *sequence.scans;
  scans.is_ply = true;
  scans.camera = scans.depth_camera = sequence.camera_index("lcam_front");
  // From x right, y forward, z up.
  scans.camera_from_points.rotation << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  scans.points =
      numbered_files(dataset, folder, "_lcam_front_lidar.ply", sequence.num_frames, findings);
}

}  // namespace

void TartanAirReader::read(const Dataset& dataset, Sequence& sequence, Findings& findings) const {
  read_classes(dataset, sequence, findings);
  find_scans(dataset, sequence, findings);
  for (Camera& camera : sequence.cameras) {
    camera.intrinsics = kFixedCamera;
    read_ned_poses(dataset, sequence, camera, findings);
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
    const bool is_png = !found.empty() && found[0].ends_with("_flow.png");
    if (is_png) {
      camera.flow_step_px = kFlowStep_px;
      camera.flow_reach_px = kFlowStep_px * (kFlowZero - 1);
    }
    for (int i = 0; i + 1 < sequence.num_frames; ++i) {
      const std::string stem = frame_digits(i) + "_" + frame_digits(i + 1);
      const std::string file = is_png ? stem + "_flow.png" : stem + "_" + camera.name + "_flow.npz";
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
  add_fixed_pair("lcam_front", "rcam_front", sequence);
  check_mounts(sequence, findings);
}

void TartanAirReader::check_mounts(const Sequence& sequence, Findings& findings) const {
  check_fixed_pair(sequence, findings);
  check_faces(sequence, findings);
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
    depth.data()[i] = depth_or_sky(value, dataset, path, i, rgba.width());
  }
  return depth;
}

FlowFields TartanAirReader::flow(const Dataset& dataset, const Camera& camera, int frame) const {
  const std::string& path = camera.files[static_cast<std::size_t>(frame)].flow;
  if (path.ends_with(".png")) return png_flow(dataset.root / path, path, camera.intrinsics);
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
