#include "capture/frame.h"

#include <algorithm>

namespace terracast::capture {

std::vector<int> FrameSelection::frames_of(int num_frames) const {
  std::vector<int> frames;
  for (std::int64_t frame = first; frame < std::min(end, num_frames); frame += step)
    frames.push_back(static_cast<int>(frame));
  return frames;
}

int SequenceInfo::camera_index(const std::string& rig, const std::string& camera) const {
  for (std::size_t i = 0; i < cameras.size(); ++i)
    if (cameras[i].rig == rig && cameras[i].name == camera) return static_cast<int>(i);
  return -1;
}

std::vector<int> SequenceInfo::cameras_of_rig(const std::string& rig) const {
  std::vector<int> indices;
  for (std::size_t i = 0; i < cameras.size(); ++i)
    if (cameras[i].rig == rig) indices.push_back(static_cast<int>(i));
  return indices;
}

bool SequenceInfo::has_rolling_shutter() const {
  return std::any_of(cameras.begin(), cameras.end(),
                     [](const CameraCalibration& camera) { return camera.shutter.is_rolling(); });
}

std::vector<std::string> SequenceInfo::rig_names() const {
  std::vector<std::string> names;
  for (const CameraCalibration& camera : cameras)
    if (std::find(names.begin(), names.end(), camera.rig) == names.end())
      names.push_back(camera.rig);
  return names;
}

}  // namespace terracast::capture
