#include "validate/belief.h"

#include <string>
#include <utility>

namespace terracast::validate {

namespace {

/// What a camera is beyond what is believed of it.
struct Difference {
  double fx_px = 0.0, fy_px = 0.0, cx_px = 0.0, cy_px = 0.0;
  /// The camera as it is, from the camera as it is believed to be.
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  Pose true_from_believed() const { return {rotation.toRotationMatrix(), translation}; }
};

Difference difference_of(const Camera& truth, const Camera& believed) {
  const Intrinsics& a = *truth.stated;
  const Intrinsics& b = *believed.stated;
  const Pose true_from_believed = truth.body_from_camera->inverse() * *believed.body_from_camera;
  return {a.fx_px - b.fx_px,
          a.fy_px - b.fy_px,
          a.cx_px - b.cx_px,
          a.cy_px - b.cy_px,
          Eigen::Quaterniond(true_from_believed.rotation),
          true_from_believed.translation};
}

/// after * pose * before^-1. Products of quaternions keep how far one is from a rotation.
ColmapPose moved(const Difference& after, const ColmapPose& pose, const Difference& before) {
  const auto& q = pose.rotation_wxyz;
  const Eigen::Quaterniond rotation =
      after.rotation * Eigen::Quaterniond(q[0], q[1], q[2], q[3]) * before.rotation.conjugate();
  const Pose all = after.true_from_believed() * pose.pose() * before.true_from_believed().inverse();
  return {.rotation_wxyz = {rotation.w(), rotation.x(), rotation.y(), rotation.z()},
          .translation = {all.translation.x(), all.translation.y(), all.translation.z()}};
}

void adopt_truth(const Difference& difference, ColmapCamera& camera) {
  const bool has_one_focal_length =
      camera.model.starts_with("SIMPLE_") || camera.model.starts_with("RADIAL");
  const std::size_t center = has_one_focal_length ? 1 : 2;
  std::vector<double>& p = camera.parameters;
  if (p.size() < center + 2) return;
  p[0] += difference.fx_px;
  if (!has_one_focal_length) p[1] += difference.fy_px;
  p[center] += difference.cx_px;
  p[center + 1] += difference.cy_px;
}

void adopt_truth(const Sequence& sequence, const std::vector<Difference>& differences,
                 ColmapModel& model) {
  std::map<std::int64_t, const Difference*> of_camera;
  for (const auto& [id, image] : model.images) {
    const int index = sequence.camera_index(image.name.substr(0, image.name.rfind('/')));
    if (index >= 0)
      of_camera.emplace(image.camera_id, &differences[static_cast<std::size_t>(index)]);
  }
  const Difference none;
  const auto difference_of_camera = [&](std::int64_t id) -> const Difference& {
    const auto found = of_camera.find(id);
    return found == of_camera.end() ? none : *found->second;
  };
  for (auto& [id, camera] : model.cameras) adopt_truth(difference_of_camera(id), camera);
  for (auto& [id, image] : model.images)
    image.camera_from_world =
        moved(difference_of_camera(image.camera_id), image.camera_from_world, none);
  for (auto& [id, rig] : model.rigs)
    for (ColmapSensor& sensor : rig.sensors)
      if (sensor.has_pose)
        sensor.sensor_from_rig = moved(difference_of_camera(sensor.id), sensor.sensor_from_rig,
                                       difference_of_camera(rig.sensors.front().id));
  for (auto& [id, frame] : model.frames) {
    const auto rig = model.rigs.find(frame.rig_id);
    if (rig != model.rigs.end() && !rig->second.sensors.empty())
      frame.rig_from_world =
          moved(difference_of_camera(rig->second.sensors.front().id), frame.rig_from_world, none);
  }
}

}  // namespace

void adopt_truth(const std::vector<Camera>& believed, Sequence& sequence) {
  std::vector<Difference> differences;
  for (std::size_t i = 0; i < believed.size(); ++i)
    differences.push_back(difference_of(sequence.cameras[i], believed[i]));
  for (std::size_t i = 0; i < believed.size(); ++i) {
    Camera& camera = sequence.cameras[i];
    const Difference& difference = differences[i];
    camera.intrinsics.fx_px += difference.fx_px;
    camera.intrinsics.fy_px += difference.fy_px;
    camera.intrinsics.cx_px += difference.cx_px;
    camera.intrinsics.cy_px += difference.cy_px;
    const Pose believed_from_true = difference.true_from_believed().inverse();
    for (std::optional<Pose>& pose : camera.local_from_camera)
      if (pose) pose = *pose * believed_from_true;
  }
  if (sequence.binary_model && sequence.has_rolling_shutters()) {
    ColmapModel& stated = sequence.believed_model.emplace();
    stated.cameras = sequence.binary_model->cameras;
    for (const auto& [id, image] : sequence.binary_model->images) {
      ColmapImage& copy = stated.images[id];
      copy.camera_id = image.camera_id;
      copy.camera_from_world = image.camera_from_world;
    }
  }
  for (std::optional<ColmapModel>* model : {&sequence.binary_model, &sequence.text_model})
    if (*model) adopt_truth(sequence, differences, **model);
}

}  // namespace terracast::validate
