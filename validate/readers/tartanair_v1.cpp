#include "validate/readers/tartanair_v1.h"

#include <algorithm>

#include "core/atomic_file.h"
#include "core/error.h"
#include "validate/npy.h"
#include "validate/readers/tartanair_files.h"

namespace terracast::validate {

namespace {

using core::ErrorKind;
using core::fail;

/// The readers of this format have these numbers written into their code.
const Intrinsics kFixedCamera{640, 480, 320.0, 320.0, 320.0, 240.0};

/// An array of the image's size.
/// channels   0: (height, width); else (height, width, channels)
NpyArray read_array(const Dataset& dataset, const std::string& path, const Intrinsics& size,
                    std::size_t channels) {
  constexpr std::size_t kMostBytes = std::size_t{1} << 24;  // eight bytes a pixel, and a header
  NpyArray array = parse_npy(core::read_file(dataset.root / path, kMostBytes), path);
  std::vector<std::size_t> shape = {static_cast<std::size_t>(size.height_px),
                                    static_cast<std::size_t>(size.width_px)};
  if (channels > 0) shape.push_back(channels);
  if (array.shape != shape)
    fail(ErrorKind::Input, "{}: an array of the shape ({}) is right", path, fmt::join(shape, ", "));
  return array;
}

core::Image8 read_bytes(const Dataset& dataset, const std::string& path, const Intrinsics& size) {
  const NpyArray array = read_array(dataset, path, size, 0);
  if (array.kind != 'u' || array.item_size != 1)
    fail(ErrorKind::Input, "{}: unsigned bytes are right", path);
  core::Image8 image(size.width_px, size.height_px);
  std::transform(array.bytes.begin(), array.bytes.end(), image.data().begin(),
                 [](std::byte value) { return std::to_integer<std::uint8_t>(value); });
  return image;
}

/// "flow/000000_000001_flow.npy" and its mask for each frame but the last, and nothing else.
void find_flow(const Dataset& dataset, const Sequence& sequence, Camera& camera,
               Findings& findings) {
  const std::string folder = sequence.path + "/flow";
  const std::vector<std::string> found = list_folder(dataset.root / folder);
  for (int i = 0; i + 1 < sequence.num_frames; ++i) {
    const std::string stem = frame_digits(i) + "_" + frame_digits(i + 1);
    bool is_there = true;
    for (const char* suffix : {"_flow.npy", "_mask.npy"}) {
      if (std::binary_search(found.begin(), found.end(), stem + suffix)) continue;
      findings.add(folder + "/" + stem + suffix, "missing");
      is_there = false;
    }
    if (is_there) camera.files[static_cast<std::size_t>(i)].flow = folder + "/" + stem;
  }
  if (found.size() > 2 * static_cast<std::size_t>(sequence.num_frames - 1))
    findings.add(
        folder,
        fmt::format("{} files for {} frames; the readers pair files by their place in the list",
                    found.size(), sequence.num_frames));
}

}  // namespace

void TartanAirV1Reader::read(const Dataset& dataset, Sequence& sequence, Findings& findings) const {
  read_classes(dataset, sequence, findings);
  for (Camera& camera : sequence.cameras) {
    camera.intrinsics = kFixedCamera;
    if (camera.name != "left" && camera.name != "right")
      findings.add(sequence.path, fmt::format("the format has no camera {}", camera.name));
    read_ned_poses(dataset, sequence, camera, findings);
    const auto fill = [&](const std::string& kind, const std::string& suffix,
                          std::string FrameFiles::*member) {
      const std::vector<std::string> paths =
          numbered_files(dataset, sequence.path + "/" + kind + "_" + camera.name,
                         "_" + camera.name + suffix, sequence.num_frames, findings);
      for (std::size_t i = 0; i < paths.size(); ++i) camera.files[i].*member = paths[i];
    };
    fill("image", ".png", &FrameFiles::color);
    fill("depth", "_depth.npy", &FrameFiles::depth);
    fill("seg", "_seg.npy", &FrameFiles::segmentation);
    if (camera.name == "left") find_flow(dataset, sequence, camera, findings);
  }
  add_fixed_pair("left", "right", sequence);
  check_mounts(sequence, findings);
}

void TartanAirV1Reader::check_mounts(const Sequence& sequence, Findings& findings) const {
  check_fixed_pair(sequence, findings);
}

core::ImageF TartanAirV1Reader::depth(const Dataset& dataset, const Camera& camera,
                                      int frame) const {
  const std::string& path = camera.files[static_cast<std::size_t>(frame)].depth;
  const std::vector<float> values = read_array(dataset, path, camera.intrinsics, 0).floats(path);
  core::ImageF depth(camera.intrinsics.width_px, camera.intrinsics.height_px);
  for (std::size_t i = 0; i < values.size(); ++i)
    depth.data()[i] = depth_or_sky(values[i], dataset, path, i, depth.width());
  return depth;
}

FlowFields TartanAirV1Reader::flow(const Dataset& dataset, const Camera& camera, int frame) const {
  const std::string& stem = camera.files[static_cast<std::size_t>(frame)].flow;
  const Intrinsics& size = camera.intrinsics;
  const std::vector<float> values =
      read_array(dataset, stem + "_flow.npy", size, 2).floats(stem + "_flow.npy");
  const core::Image8 mask = read_bytes(dataset, stem + "_mask.npy", size);
  FlowFields fields;
  fields.forward = core::ImageF(size.width_px, size.height_px, 2);
  std::copy(values.begin(), values.end(), fields.forward.data().begin());
  fields.in_view_forward = core::Image8(size.width_px, size.height_px);
  fields.covisible_forward = core::Image8(size.width_px, size.height_px);
  for (std::size_t i = 0; i < mask.data().size(); ++i) {
    // 1 and 10 are hidden by another thing or by itself, 100 is out of view; they may add up.
    constexpr int kOutOfView = 100;
    const int value = mask.data()[i];
    if (value % 10 > 1 || value / 10 % 10 > 1 || value / kOutOfView > 1)
      fail(ErrorKind::Input, "{}_mask.npy: {} at pixel ({}, {}); sums of 1, 10 and 100 are right",
           stem, value, i % static_cast<std::size_t>(size.width_px),
           i / static_cast<std::size_t>(size.width_px));
    fields.in_view_forward.data()[i] = value < kOutOfView ? 1 : 0;
    fields.covisible_forward.data()[i] = value == 0 ? 1 : 0;
  }
  return fields;
}

core::Image8 TartanAirV1Reader::segmentation(const Dataset& dataset, const Camera& camera,
                                             int frame) const {
  return read_bytes(dataset, camera.files[static_cast<std::size_t>(frame)].segmentation,
                    camera.intrinsics);
}

}  // namespace terracast::validate
