#include "validate/body_pose.h"

namespace terracast::validate {

std::optional<Pose> local_from_body(const Sequence& sequence, std::size_t frame) {
  for (const Camera& camera : sequence.cameras)
    if (camera.body_from_camera && frame < camera.local_from_camera.size() &&
        camera.local_from_camera[frame])
      return *camera.local_from_camera[frame] * camera.body_from_camera->inverse();
  return std::nullopt;
}

}  // namespace terracast::validate
