#include "capture/sequence_files.h"

#include <fmt/format.h>

namespace terracast::capture {

std::string record_path(int frame_index) {
  return fmt::format("{}/{:06}.json", kRecordsFolder, frame_index);
}
std::string color_path(const CameraCalibration& camera, int frame_index) {
  return fmt::format("{}/{}/{:06}.png", camera.rig, camera.name, frame_index);
}
std::string raw_path(const CameraCalibration& camera, int frame_index) {
  return fmt::format("{}/{}/{:06}.raw.png", camera.rig, camera.name, frame_index);
}
std::string facts_path(const CameraCalibration& camera, int frame_index) {
  return fmt::format("{}/{}/{:06}.exr", camera.rig, camera.name, frame_index);
}
std::string samples_path(const StreamInfo& stream, int frame_index) {
  return fmt::format("{}/{}/{:06}.npy", stream.rig, stream.name, frame_index);
}

bool is_safe_name(const std::string& name) {
  if (name.empty() || name.size() > 64) return false;
  for (const char c : name)
    if (!(('a' <= c && c <= 'z') || ('A' <= c && c <= 'Z') || ('0' <= c && c <= '9') || c == '_' ||
          c == '-'))
      return false;
  return true;
}

}  // namespace terracast::capture
