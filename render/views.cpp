#include "render/views.h"

namespace terracast::render {

ViewTable::ViewTable(const std::vector<geo::BodyState>& states,
                     const std::vector<capture::CameraCalibration>& cameras)
    : num_frames_(static_cast<int>(states.size())) {
  for (const capture::CameraCalibration& camera : cameras) {
    models_.push_back(geo::make_camera(camera.intrinsics));
    std::vector<int>& others = companions_.emplace_back();
    for (std::size_t i = 0; i < cameras.size(); ++i)
      if (cameras[i].rig == camera.rig && cameras[i].name != camera.name)
        others.push_back(static_cast<int>(i));
  }
  views_.reserve(states.size() * cameras.size());
  for (const geo::BodyState& state : states) {
    for (std::size_t i = 0; i < cameras.size(); ++i) {
      const geo::Rigid3d world_from_camera = state.world_from_body * cameras[i].body_from_camera();
      views_.push_back({.model = models_[i].get(),
                        .center_world = world_from_camera.translation,
                        .world_from_camera = world_from_camera.rotation.toRotationMatrix()});
    }
  }
}

}  // namespace terracast::render
