#include "validate/colmap/model_bundle.h"

#include <map>

namespace terracast::validate {

namespace {

std::vector<std::pair<std::size_t, std::size_t>> steps_of(const std::vector<Placed>& placed) {
  std::map<std::pair<int, int>, std::size_t> by_camera_and_frame;
  for (std::size_t i = 0; i < placed.size(); ++i)
    by_camera_and_frame[{placed[i].shot->camera_index, placed[i].shot->frame}] = i;
  std::vector<std::pair<std::size_t, std::size_t>> steps;
  for (const auto& [place, index] : by_camera_and_frame)
    if (const auto next = by_camera_and_frame.find({place.first, place.second + 1});
        next != by_camera_and_frame.end())
      steps.emplace_back(index, next->second);
  return steps;
}

}  // namespace

std::vector<Placed> placed_shots(const ColmapJob& job, const ColmapModel& model) {
  std::vector<Placed> placed;
  for (const Shot& shot : job.shots) {
    const auto image = model.images.find(shot.image_id);
    if (image == model.images.end() || image->second.name != shot.name) continue;
    placed.push_back({&shot, &image->second, image->second.camera_from_world.pose().inverse()});
  }
  return placed;
}

Bundle found_bundle(const ColmapModel& model, const std::vector<Placed>& placed) {
  Bundle bundle;
  std::map<std::int64_t, std::size_t> index_of;
  for (const auto& [id, point] : model.points) {
    index_of[id] = bundle.points.size();
    bundle.points.emplace_back(point.position[0], point.position[1], point.position[2]);
  }
  for (const Placed& one : placed) {
    BundleView view{.camera = &one.shot->camera->intrinsics,
                    .camera_from_bundle = one.model_from_camera.inverse(),
                    .observations = {},
                    .weight = 0.0};
    for (const ColmapObservation& seen : one.image->observations)
      if (const auto point = index_of.find(seen.point_id); point != index_of.end())
        view.observations.push_back({point->second, {seen.x_px, seen.y_px}});
    bundle.views.push_back(std::move(view));
  }
  bundle.steps = steps_of(placed);
  return bundle;
}

Bundle known_bundle(const ColmapModel& model, const std::vector<Placed>& placed) {
  Bundle bundle = found_bundle(model, placed);
  for (std::size_t i = 0; i < placed.size(); ++i)
    bundle.views[i].camera_from_bundle = placed[i].shot->local_from_camera.inverse();
  triangulate(bundle);
  return bundle;
}

}  // namespace terracast::validate
