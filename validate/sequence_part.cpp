#include "validate/sequence_part.h"

#include <algorithm>

namespace terracast::validate {

namespace {

/// The frames that are kept.
struct Span {
  int first = 0;
  int count = 0;
  double start_s = 0.0;

  /// Of a list with one entry a frame, which may be empty or too short.
  template <class List>
  List cut(const List& list) const {
    const auto at = [&](int frame) {
      return list.begin() +
             std::min(static_cast<std::ptrdiff_t>(frame), static_cast<std::ptrdiff_t>(list.size()));
    };
    return List(at(first), at(first + count));
  }
  std::vector<double> cut_times(const std::vector<double>& times_s) const {
    std::vector<double> part = cut(times_s);
    for (double& time_s : part) time_s -= start_s;
    return part;
  }
};

Camera camera_part(const Camera& camera, const Span& span) {
  // All members by name: one that is added must be given its place below.
  const auto& [name, rig, name_in_rig, intrinsics, stated, stated_model, imaging, body_from_camera,
               pixel_rays, local_from_camera, shutter, georeference, bounds, stamps_s, clock,
               camera0_from_camera, files, flow_step_px, marks_missing_flow, flow_reach_px] =
      camera;
  Camera part{.name = name,
              .rig = rig,
              .name_in_rig = name_in_rig,
              .intrinsics = intrinsics,
              .stated = stated,
              .stated_model = stated_model,
              .imaging = imaging,
              .body_from_camera = body_from_camera,
              .pixel_rays = pixel_rays,
              .local_from_camera = span.cut(local_from_camera),
              .shutter = shutter,
              .georeference = span.cut(georeference),
              .bounds = span.cut(bounds),
              .stamps_s = span.cut_times(stamps_s),
              .clock = clock,
              .camera0_from_camera = camera0_from_camera,
              .files = span.cut(files),
              .flow_step_px = flow_step_px,
              .marks_missing_flow = marks_missing_flow,
              .flow_reach_px = flow_reach_px};
  for (auto& row : part.georeference)
    if (row) row->time_s -= span.start_s;
  if (part.clock) part.clock->offset_s += part.clock->drift * span.start_s;
  return part;
}

std::optional<Moving> moving_part(const std::optional<Moving>& moving, const Span& span) {
  if (!moving) return std::nullopt;
  const auto& [names, masks, states, bodies] = *moving;
  return Moving{.names = names, .masks = masks, .states = span.cut(states), .bodies = bodies};
}

std::optional<StereoPair> pair_among(const std::optional<StereoPair>& pair,
                                     const std::vector<int>& cameras) {
  if (!pair) return std::nullopt;
  const auto left = std::find(cameras.begin(), cameras.end(), pair->left);
  const auto right = std::find(cameras.begin(), cameras.end(), pair->right);
  if (left == cameras.end() || right == cameras.end()) return std::nullopt;
  return StereoPair{.left = static_cast<int>(left - cameras.begin()),
                    .right = static_cast<int>(right - cameras.begin()),
                    .baseline_m = pair->baseline_m};
}

/// Packets' poses begin at the identity.
std::vector<Pose> poses_part(const std::vector<Pose>& first_from_camera0, const Span& span) {
  std::vector<Pose> part = span.cut(first_from_camera0);
  if (part.empty() || span.first == 0) return part;
  const Pose camera0_from_first = part[0].inverse();
  for (Pose& pose : part) pose = camera0_from_first * pose;
  return part;
}

}  // namespace

Sequence part_of(const Sequence& sequence, int first_frame, int num_frames,
                 const std::vector<int>& kept_cameras) {
  const auto& [name, path, num_all_frames, rate_hz, utc_start, origin, geometry, times_s,
               states_belief, states_sensor_stamps, has_poses_of_rows, motion, moving, cameras,
               stereo, scans, classes, local_from_first, binary_model, text_model, believed_model,
               oxts, camera0_from_imu, first_from_camera0, tried_sensors] = sequence;
  const Span span{
      .first = first_frame, .count = num_frames, .start_s = first_frame / sequence.rate_hz};
  Sequence part{.name = name,
                .path = path,
                .num_frames = num_frames,
                .rate_hz = rate_hz,
                .utc_start = utc_start,
                .origin = origin,
                .geometry = geometry,
                .times_s = span.cut_times(times_s),
                .states_belief = states_belief,
                .states_sensor_stamps = states_sensor_stamps,
                .has_poses_of_rows = has_poses_of_rows,
                .motion = span.cut(motion),
                .moving = moving_part(moving, span),
                .cameras = {},
                .stereo = pair_among(stereo, kept_cameras),
                .scans = std::nullopt,  // they are looked at whole
                .classes = classes,
                .local_from_first = local_from_first,
                .binary_model = std::nullopt,
                .text_model = std::nullopt,
                .believed_model = std::nullopt,
                .oxts = span.cut(oxts),
                .camera0_from_imu = camera0_from_imu,
                .first_from_camera0 = poses_part(first_from_camera0, span),
                .tried_sensors = tried_sensors};
  for (const int camera : kept_cameras)
    part.cameras.push_back(camera_part(cameras[static_cast<std::size_t>(camera)], span));
  return part;
}

}  // namespace terracast::validate
