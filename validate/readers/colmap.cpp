#include "validate/readers/colmap.h"

#include <set>

#include "core/error.h"
#include "core/printable.h"

namespace terracast::validate {

namespace {

std::optional<Intrinsics> intrinsics_of(const ColmapCamera& camera) {
  constexpr std::int64_t kMostPixels = 1 << 15;
  if (camera.width_px < 1 || camera.height_px < 1 || camera.width_px > kMostPixels ||
      camera.height_px > kMostPixels)
    return std::nullopt;
  const auto known = colmap_intrinsics(camera.model, camera.parameters);
  if (!known) return std::nullopt;
  Intrinsics intrinsics{.width_px = static_cast<int>(camera.width_px),
                        .height_px = static_cast<int>(camera.height_px),
                        .fx_px = known->fx_px,
                        .fy_px = known->fy_px,
                        .cx_px = known->cx_px,
                        .cy_px = known->cy_px,
                        .lens = known->lens};
  intrinsics.find_reach();
  return intrinsics;
}

/// Splits "mcs4/cam0/000012.png" into the folder, and the frame.
/// returns  -1 for another form of name
int frame_of_name(const std::string& name, std::string& folder) {
  const std::size_t slash = name.rfind('/');
  const std::size_t start = slash == std::string::npos ? 0 : slash + 1;
  folder = name.substr(0, slash == std::string::npos ? 0 : slash);
  if (name.size() < start + 7 || name[start + 6] != '.') return -1;
  int frame = 0;
  for (std::size_t i = start; i < start + 6; ++i) {
    if (name[i] < '0' || name[i] > '9') return -1;
    frame = 10 * frame + (name[i] - '0');
  }
  return frame;
}

}  // namespace

void ColmapReader::read(const Dataset& dataset, Sequence& sequence, Findings& findings) const {
  const std::string binary = sequence.path + "/sparse/0";
  const std::string text = sequence.path + "/sparse_txt/0";
  sequence.binary_model = read_colmap_binary(dataset.root / binary, binary, findings);
  sequence.text_model = read_colmap_text(dataset.root / text, text, findings);

  // The binary model is what COLMAP opens; the check `colmap_model` holds the text against it.
  const ColmapModel& model = *sequence.binary_model;
  std::map<std::string, std::int64_t> camera_id_of_folder;
  std::set<std::string> known;
  for (Camera& camera : sequence.cameras) known.insert(camera.name);
  for (const auto& [id, image] : model.images) {
    std::string folder;
    const int frame = frame_of_name(image.name, folder);
    const int camera_index = sequence.camera_index(folder);
    if (frame < 0 || frame >= sequence.num_frames || camera_index < 0) {
      findings.add(binary + "/images.bin",
                   fmt::format("image \"{}\" belongs to no camera and frame of dataset.json",
                               core::first_letters(image.name, 100)));
      continue;
    }
    Camera& camera = sequence.cameras[static_cast<std::size_t>(camera_index)];
    const auto [known_id, is_new] = camera_id_of_folder.emplace(folder, image.camera_id);
    if (!is_new && known_id->second != image.camera_id)
      findings.add(binary + "/images.bin", fmt::format("images of {} name the cameras {} and {}",
                                                       folder, known_id->second, image.camera_id));
    if (is_new) {
      const auto found = model.cameras.find(image.camera_id);
      std::optional<Intrinsics> intrinsics;
      if (found != model.cameras.end()) intrinsics = intrinsics_of(found->second);
      if (intrinsics)
        camera.intrinsics = *intrinsics;
      else
        findings.add(binary + "/cameras.bin",
                     fmt::format("camera {} of {} is missing or of no known model", image.camera_id,
                                 folder));
    }
    auto& pose = camera.local_from_camera[static_cast<std::size_t>(frame)];
    if (pose) findings.add(binary + "/images.bin", fmt::format("\"{}\" stands twice", image.name));
    pose = image.camera_from_world.pose().inverse();
  }
  for (Camera& camera : sequence.cameras) {
    const auto fill = [&](const std::string& folder, const char* suffix,
                          std::string FrameFiles::*member, bool is_optional) {
      const std::vector<std::string> paths =
          numbered_files(dataset, sequence.path + folder + camera.name, suffix, sequence.num_frames,
                         findings, is_optional);
      for (std::size_t i = 0; i < paths.size(); ++i) camera.files[i].*member = paths[i];
    };
    fill("/images/", ".png", &FrameFiles::color, false);
    fill("/depth/", ".npy", &FrameFiles::depth, true);
    for (int frame = 0; frame < sequence.num_frames; ++frame)
      if (!camera.local_from_camera[static_cast<std::size_t>(frame)])
        findings.add(binary + "/images.bin",
                     fmt::format("no image {}/{}.png", camera.name, frame_digits(frame)));
  }
}

core::ImageF ColmapReader::depth(const Dataset& dataset, const Camera& camera, int frame) const {
  const std::string& path = camera.files[static_cast<std::size_t>(frame)].depth;
  return read_depth_npy(dataset.root / path, path, camera.intrinsics);
}

}  // namespace terracast::validate
