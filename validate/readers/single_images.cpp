#include "validate/readers/single_images.h"

namespace terracast::validate {

void take_georeferenced_poses(Sequence& sequence) {
  sequence.has_poses_of_rows = true;
  const Pose local_from_ecef = ecef_from_local(sequence.origin).inverse();
  for (Camera& camera : sequence.cameras)
    for (std::size_t i = 0; i < camera.georeference.size(); ++i) {
      const std::optional<Georeference>& row = camera.georeference[i];
      if (!row) continue;
      camera.local_from_camera[i] =
          local_from_ecef * Pose{enu_from_ecef(row->place).transpose() * row->enu_from_camera,
                                 ecef_from_geodetic(row->place)};
    }
}

}  // namespace terracast::validate
