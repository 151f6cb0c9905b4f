#include "validate/readers/terracast.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/json.h"
#include "core/printable.h"
#include "validate/readers/terracast_arrays.h"
#include "validate/readers/terracast_cameras.h"
#include "validate/text.h"

namespace terracast::validate {

namespace {

using core::ErrorKind;
using core::fail;
using core::Json;

/// poses.csv: a row for each frame and camera.
void read_poses(const Dataset& dataset, Sequence& sequence, Findings& findings) {
  constexpr std::string_view kHeader = "frame,camera,time_s,x_m,y_m,z_m,qw,qx,qy,qz";
  const std::string path = sequence.path + "/poses.csv";
  sequence.times_s.assign(static_cast<std::size_t>(sequence.num_frames),
                          std::numeric_limits<double>::quiet_NaN());
  findings.attempt(path, [&] {
    const std::string text = core::read_text_file(dataset.root / path);
    const std::vector<TextLine> lines = split_lines(text);
    if (lines.empty() || lines[0].text != kHeader)
      fail(ErrorKind::Input, "{}:1: another header than {}", path, kHeader);
    for (std::size_t i = 1; i < lines.size(); ++i) {
      const std::string where = path + ":" + std::to_string(lines[i].number);
      const std::vector<std::string_view> parts = split_at(lines[i].text, ',');
      if (parts.size() != 10) fail(ErrorKind::Input, "{}: {} columns, not 10", where, parts.size());
      const std::int64_t frame = parse_integer(parts[0], where);
      const int index = sequence.camera_index(std::string(parts[1]));
      if (frame < 0 || frame >= sequence.num_frames || index < 0)
        fail(ErrorKind::Input, "{}: frame {} of camera \"{}\" is not in the dataset", where, frame,
             core::first_letters(parts[1], 60));
      const auto at = static_cast<std::size_t>(frame);
      std::optional<Pose>& pose =
          sequence.cameras[static_cast<std::size_t>(index)].local_from_camera[at];
      if (pose) fail(ErrorKind::Input, "{}: frame {} of {} stands twice", where, frame, parts[1]);
      double n[8];
      for (std::size_t k = 0; k < 8; ++k) n[k] = parse_number(parts[k + 2], where);
      if (!std::isnan(sequence.times_s[at]) && sequence.times_s[at] != n[0])
        fail(ErrorKind::Input, "{}: time {} where the frame's other cameras have {}", where, n[0],
             sequence.times_s[at]);
      sequence.times_s[at] = n[0];
      const Eigen::Quaterniond q(n[4], n[5], n[6], n[7]);
      if (std::abs(q.norm() - 1.0) > 1e-9)
        fail(ErrorKind::Input, "{}: a quaternion of length {}, not 1", where, q.norm());
      pose = Pose{q.normalized().toRotationMatrix(), {n[1], n[2], n[3]}};
    }
    for (const Camera& camera : sequence.cameras)
      for (std::size_t f = 0; f < camera.local_from_camera.size(); ++f)
        if (!camera.local_from_camera[f])
          findings.add(path, fmt::format("no row for frame {} of {}", f, camera.name));
  });
  if (std::any_of(sequence.times_s.begin(), sequence.times_s.end(),
                  [](double time_s) { return std::isnan(time_s); }))
    sequence.times_s.clear();
}

void read_classes(const Dataset& dataset, Sequence& sequence, Findings& findings) {
  const char* path = "classes.json";
  findings.attempt(path, [&] {
    const Json json = Json::read(dataset.root / path);
    for (const auto& [name, value] : json.at("classes").members()) {
      const std::int64_t number = value.integer();
      constexpr std::int64_t kMost = 255;  // of 8-bit images
      if (number < 0 || number > kMost)
        fail(ErrorKind::Input, "{}: {} = {}; 0 to {} are right", path,
             core::first_letters(name, 60), number, kMost);
      const auto [entry, is_new] = sequence.classes.emplace(static_cast<int>(number), name);
      if (!is_new)
        fail(ErrorKind::Input, "{}: {} and {} are both {}", path,
             core::first_letters(entry->second, 60), core::first_letters(name, 60), number);
    }
  });
}

/// A folder of flow: an array and a mask for each frame from `first` to before `end`, and nothing else.
/// returns   whether it is there
bool has_flow(const Dataset& dataset, const std::string& folder, int first, int end,
              Findings& findings) {
  const std::vector<std::string> found = list_folder(dataset.root / folder);
  const auto listed = dataset.files.lower_bound(folder + "/");
  if (found.empty() && (listed == dataset.files.end() || !listed->first.starts_with(folder + "/")))
    return false;
  std::size_t num_known = 0;
  for (int frame = first; frame < end; ++frame)
    for (const char* suffix : {".npy", "_mask.png"}) {
      if (std::binary_search(found.begin(), found.end(), frame_digits(frame) + suffix))
        ++num_known;
      else
        findings.add(folder + "/" + frame_digits(frame) + suffix, "missing");
    }
  if (found.size() != num_known)
    findings.add(folder, fmt::format("{} files that are neither flow nor mask of a frame",
                                     found.size() - num_known));
  return true;
}

void find_flow(const Dataset& dataset, const Sequence& sequence, const std::string& folder,
               Camera& camera, Findings& findings) {
  const int count = sequence.num_frames;
  const bool has_forward = has_flow(dataset, folder + "/flow_forward", 0, count - 1, findings);
  const bool has_backward = has_flow(dataset, folder + "/flow_backward", 1, count, findings);
  if (has_forward != has_backward) findings.add(folder, "flow one way alone; both ways are right");
  const auto is_there = [&](const char* way, int frame) {
    for (const char* suffix : {".npy", "_mask.png"})
      if (!std::filesystem::exists(dataset.root / folder / way / (frame_digits(frame) + suffix)))
        return false;
    return true;
  };
  for (int frame = 0; has_forward && has_backward && frame + 1 < count; ++frame)
    if (is_there("flow_forward", frame) && is_there("flow_backward", frame + 1))
      camera.files[static_cast<std::size_t>(frame)].flow =
          folder + "/flow_forward/" + frame_digits(frame) + ".npy";
}

void find_files(const Dataset& dataset, const Sequence& sequence, const std::string& folder,
                Camera& camera, Findings& findings) {
  const auto fill = [&](const char* kind, const char* suffix, std::string FrameFiles::*member) {
    const std::vector<std::string> paths =
        numbered_files(dataset, folder + "/" + kind, suffix, sequence.num_frames, findings, true);
    for (std::size_t i = 0; i < paths.size(); ++i) camera.files[i].*member = paths[i];
  };
  fill("image", ".png", &FrameFiles::color);
  fill("range", ".npy", &FrameFiles::depth);
  fill("class", ".png", &FrameFiles::segmentation);
  fill("instance", ".npy", &FrameFiles::instances);
  fill("normal", ".npy", &FrameFiles::normals);
  find_flow(dataset, sequence, folder, camera, findings);
}

/// The masks of a flow: bit 0 in view, bit 1 seen.
void read_masks(const Dataset& dataset, const std::string& path, const Intrinsics& size,
                core::Image8& in_view, core::Image8& covisible) {
  const core::Image8 mask = read_png8(dataset.root / path, path, 1, size);
  in_view = core::Image8(mask.width(), mask.height());
  covisible = core::Image8(mask.width(), mask.height());
  for (std::size_t i = 0; i < mask.data().size(); ++i) {
    const std::uint8_t value = mask.data()[i];
    if (value != 0 && value != 1 && value != 3)
      fail(ErrorKind::Input, "{}: {} where 0, 1 or 3 should be", pixel_text(path, i, mask.width()),
           value);
    in_view.data()[i] = value & 1U;
    covisible.data()[i] = (value >> 1U) & 1U;
  }
}

core::ImageF read_flow(const Dataset& dataset, const std::string& path, const Intrinsics& size) {
  const std::vector<float> values = read_array<float>(dataset, path, size, 2, 'f');
  for (std::size_t i = 0; i < values.size(); i += 2)
    if (std::isnan(values[i]) != std::isnan(values[i + 1]) || std::isinf(values[i]) ||
        std::isinf(values[i + 1]))
      fail(ErrorKind::Input, "{}: flow ({}, {}); two finite numbers or two NaN are right",
           pixel_text(path, i / 2, size.width_px), values[i], values[i + 1]);
  core::ImageF flow(size.width_px, size.height_px, 2);
  std::copy(values.begin(), values.end(), flow.data().begin());
  return flow;
}

}  // namespace

void TerracastReader::read(const Dataset& dataset, Sequence& sequence, Findings& findings) const {
  read_terracast_cameras(dataset, sequence, findings);
  read_poses(dataset, sequence, findings);
  read_classes(dataset, sequence, findings);
  for (Camera& camera : sequence.cameras) {
    if (!camera.intrinsics.plane) continue;  // told above
    const std::string folder = sequence.path + "/" + camera.name;
    camera.marks_missing_flow = true;
    find_files(dataset, sequence, folder, camera, findings);
  }
}

core::ImageF TerracastReader::depth(const Dataset& dataset, const Camera& camera, int frame) const {
  return read_range(dataset, camera.files[static_cast<std::size_t>(frame)].depth,
                    camera.intrinsics);
}

FlowFields TerracastReader::flow(const Dataset& dataset, const Camera& camera, int frame) const {
  const std::string& there = camera.files[static_cast<std::size_t>(frame)].flow;
  // Of a part of a sequence the file's name alone tells which frame it is of.
  const std::filesystem::path name(there);
  const std::string digits = name.stem().string();
  const std::string folder = name.parent_path().parent_path().generic_string();
  const std::string back =
      folder + "/flow_backward/" + frame_digits(static_cast<int>(parse_integer(digits, there)) + 1);
  const Intrinsics& size = camera.intrinsics;
  FlowFields fields;
  fields.forward = read_flow(dataset, there, size);
  fields.backward = read_flow(dataset, back + ".npy", size);
  read_masks(dataset, folder + "/flow_forward/" + digits + "_mask.png", size,
             fields.in_view_forward, fields.covisible_forward);
  read_masks(dataset, back + "_mask.png", size, fields.in_view_backward, fields.covisible_backward);
  return fields;
}

core::ImageF TerracastReader::normals(const Dataset& dataset, const Camera& camera,
                                      int frame) const {
  const std::string& path = camera.files[static_cast<std::size_t>(frame)].normals;
  const Intrinsics& size = camera.intrinsics;
  const std::vector<float> values = read_array<float>(dataset, path, size, 3, 'f');
  core::ImageF normals(size.width_px, size.height_px, 3);
  for (std::size_t i = 0; i < values.size(); i += 3) {
    const Eigen::Vector3f normal(values[i], values[i + 1], values[i + 2]);
    constexpr float kRounding = 1e-6F;
    if (!(normal.array().isNaN().all() || std::abs(normal.norm() - 1.0F) < kRounding))
      fail(ErrorKind::Input, "{}: a normal of length {}, not 1",
           pixel_text(path, i / 3, size.width_px), normal.norm());
  }
  std::copy(values.begin(), values.end(), normals.data().begin());
  return normals;
}

core::ImageU32 TerracastReader::instances(const Dataset& dataset, const Camera& camera,
                                          int frame) const {
  const std::string& path = camera.files[static_cast<std::size_t>(frame)].instances;
  const Intrinsics& size = camera.intrinsics;
  const std::vector<std::uint32_t> values = read_array<std::uint32_t>(dataset, path, size, 0, 'u');
  core::ImageU32 instances(size.width_px, size.height_px);
  std::copy(values.begin(), values.end(), instances.data().begin());
  return instances;
}

}  // namespace terracast::validate
