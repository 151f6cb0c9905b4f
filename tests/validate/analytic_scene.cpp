#include <algorithm>
#include <array>
#include <cmath>

#include "core/parallel.h"
#include "tests/validate/analytic_dataset.h"

namespace terracast::test {

namespace {

constexpr double kRadPerDeg = 3.14159265358979323846 / 180.0;

/// Camera x right, y down, z forward from a body x forward, y left, z up, pitched down and yawed to
/// the left.
Eigen::Matrix3d looking(double yaw_deg, double down_deg) {
  Eigen::Matrix3d flu_from_rdf;
  flu_from_rdf << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  return Eigen::AngleAxisd(yaw_deg * kRadPerDeg, Eigen::Vector3d::UnitZ()).toRotationMatrix() *
         Eigen::AngleAxisd(down_deg * kRadPerDeg, Eigen::Vector3d::UnitY()).toRotationMatrix() *
         flu_from_rdf;
}

double hills(double x, double y) {
  return (14.0 * std::sin(x / 61.0 + 0.3) * std::cos(y / 47.0) +
          8.0 * std::sin((x + 1.7 * y) / 39.0) + 3.0 * std::cos((2.1 * x - y) / 23.0));
}

/// Heights on a grid, joined by triangles with the diagonal from (x + 1, y) to (x, y + 1).
double facets(double x, double y) {
  const double cell = 4.0;
  const double i = std::floor(x / cell);
  const double j = std::floor(y / cell);
  const double u = x / cell - i;
  const double v = y / cell - j;
  const auto at = [&](double di, double dj) {
    const double px = (i + di) * cell;
    const double py = (j + dj) * cell;
    // Noise at the corners: rough ground, as synthesised detail is.
    const double noise = std::sin(12.9898 * (i + di) + 78.233 * (j + dj)) * 43758.5453;
    return hills(px, py) + 0.25 * (noise - std::floor(noise) - 0.5);
  };
  if (u + v <= 1.0) return at(0, 0) + u * (at(1, 0) - at(0, 0)) + v * (at(0, 1) - at(0, 0));
  return at(1, 1) + (1.0 - u) * (at(0, 1) - at(1, 1)) + (1.0 - v) * (at(1, 0) - at(1, 1));
}

/// Low hills with two lakes' worth of hollows, whose slopes hide nothing from above.
double gentle_hills(double x, double y) {
  return 8.0 * std::sin(x / 61.0 + 0.3) * std::cos(y / 47.0) + 4.0 * std::sin((x + 1.7 * y) / 39.0);
}

/// Distance along a ray to the ground, near a guess; marched from the camera, then by false
/// position, with the weight of an end that stays halved.
double hit_distance(const std::function<double(double, double)>& ground,
                    const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double reach) {
  const auto above = [&](double t) {
    const Eigen::Vector3d p = origin + t * direction;
    return p.z() - ground(p.x(), p.y());
  };
  // The ground slopes by less than 1.2 (each sum below by less than 1.06, noise by 0.09 more): while the gap
  // between ray and ground is g, so long a step cannot pass the ground.
  const double closing = std::abs(direction.z()) + 1.2 * direction.head<2>().norm();
  double near = 0.0;
  double far = 0.0;
  double gap_near = 0.0;
  double gap_far = above(far);
  while (gap_far > 0.0) {
    near = far;
    gap_near = gap_far;
    far += std::max(gap_far / closing, 1e-4 * reach);
    if (far > 100.0 * reach) return far;
    gap_far = above(far);
  }
  int num_same = 0;  // turns in which the same end stayed: above 0 the far one, below the near one
  for (int turn = 0; turn < 60 && far - near > 1e-13 * far && gap_near > 0.0; ++turn) {
    const double middle = (near * gap_far - far * gap_near) / (gap_far - gap_near);
    const double gap = above(middle);
    if (std::abs(gap) < 1e-13 * reach) return middle;
    if (gap > 0.0) {
      near = middle;
      gap_near = gap;
      num_same = std::max(num_same, 0) + 1;
      if (num_same > 1) gap_far *= 0.5;
    } else {
      far = middle;
      gap_far = gap;
      num_same = std::min(num_same, 0) - 1;
      if (num_same < -1) gap_near *= 0.5;
    }
  }
  return 0.5 * (near + far);
}

/// Smooth colours of waves of 4 to 30 pixels' length, none so short that a pixel could not hold it.
Eigen::Vector3d ground_color(double x, double y, double s) {
  double value = 0.0;
  static constexpr std::array<std::array<double, 3>, 7> kWaves{{{0.9, 0.35, 0.1},
                                                                {-0.4, 0.8, 1.3},
                                                                {0.55, -0.62, 2.1},
                                                                {0.21, 0.17, 0.7},
                                                                {-0.12, 0.26, 3.0},
                                                                {1.15, 0.9, 4.0},
                                                                {0.8, -1.2, 5.0}}};
  const double bend = std::sin((0.07 * x - 0.05 * y) / s);
  for (const auto& wave : kWaves)
    value += std::sin((wave[0] * x + wave[1] * y) / s + wave[2] + bend);
  const double broad = std::sin(x / (31.0 * s)) * std::cos(y / (27.0 * s));
  return {118.0 + 15.0 * value + 20.0 * broad, 124.0 + 14.0 * value,
          96.0 + 11.0 * value - 16.0 * broad};
}

/// Moves flight and ground so that the flight starts near the scene's origin, as exports do.
void start_at_origin(Recording& recording) {
  const Eigen::Vector3d moved = Eigen::Vector3d(0.2, -0.1, 0.3) - recording.body_world.front();
  for (Eigen::Vector3d& place : recording.body_world) place += moved;
  recording.height_m = [ground = recording.height_m, moved](double x, double y) {
    return ground(x - moved.x(), y - moved.y()) + moved.z();
  };
}

/// Colours and depths of all cameras, of the poses and the ground that the recording has.
void take_images(Recording& recording) {
  recording.color.resize(recording.cameras.size());
  recording.depth.resize(recording.cameras.size());
  const bool has_classes = std::isfinite(recording.island_m);
  if (has_classes) recording.classes.resize(recording.cameras.size());
  for (std::size_t c = 0; c < recording.cameras.size(); ++c) {
    const SceneCamera& camera = recording.cameras[c];
    for (std::size_t f = 0; f < static_cast<std::size_t>(recording.num_frames()); ++f) {
      core::Image8 color(camera.width, camera.height, 3);
      core::Image<double> depth(camera.width, camera.height);
      core::Image8 classes(has_classes ? camera.width : 0, has_classes ? camera.height : 0);
      // Texture as fine as the images: a unit of it is about four pixels of this camera at 100 m.
      const double grain = 4.0 * 100.0 / camera.focal_px / 3.0;
      core::parallel_for(camera.height, [&](std::int64_t row) {
        const int y = static_cast<int>(row);
        for (int x = 0; x < camera.width; ++x) {
          const Eigen::Vector3d ray((x + 0.5 - 0.5 * camera.width) / camera.focal_px,
                                    (y + 0.5 - 0.5 * camera.height) / camera.focal_px, 1.0);
          const bool has_lines = camera.line_time_s > 0.0;
          const SaidPose pose =
              has_lines ? recording.pose_after(c, f, camera.line_offset_s(x + 0.5, y + 0.5))
                        : SaidPose{recording.rotation(c, f), recording.centre(c, f)};
          const Eigen::Vector3d& centre = pose.centre;
          const Eigen::Vector3d direction = pose.rotation * ray;
          // A ray that is level or rises meets no island.
          const bool is_sky_ray = std::isfinite(recording.island_m) && direction.z() > -0.05;
          const double t =
              is_sky_ray ? 0.0 : hit_distance(recording.height_m, centre, direction, 75.0);
          const Eigen::Vector3d point = centre + t * direction;
          if (is_sky_ray || point.head<2>().norm() > recording.island_m) {
            depth(x, y) = std::numeric_limits<double>::infinity();
            if (has_classes) classes(x, y) = 0;
            for (int k = 0; k < 3; ++k)
              color(x, y, k) = static_cast<std::uint8_t>(
                  std::lround(90.0 + 50.0 * k + 30.0 * direction.normalized().z()));
            continue;
          }
          depth(x, y) = t;  // the ray has z = 1: its parameter is the planar depth
          if (has_classes) classes(x, y) = point.z() < recording.shore_m ? 2 : 1;
          const Eigen::Vector3d shade = ground_color(point.x(), point.y(), grain);
          for (int k = 0; k < 3; ++k)
            color(x, y, k) =
                static_cast<std::uint8_t>(std::lround(std::clamp(shade[k], 0.0, 255.0)));
        }
      });
      recording.color[c].push_back(std::move(color));
      recording.depth[c].push_back(std::move(depth));
      if (has_classes) recording.classes[c].push_back(std::move(classes));
    }
  }
}

/// Where a body is and which way it looks at a time, s.
struct BodyPose {
  Eigen::Vector3d place;
  Eigen::Matrix3d world_from_body;
};
BodyPose straight_pose(double t) {
  const double heading = 20.0 * kRadPerDeg;
  return {
      Eigen::Vector3d(5.0 + 4.0 * t * std::cos(heading), -8.0 + 4.0 * t * std::sin(heading), 75.0),
      Eigen::AngleAxisd(heading, Eigen::Vector3d::UnitZ()).toRotationMatrix()};
}
BodyPose smooth_pose(double t) {
  const Eigen::Vector3d way(38.0 * std::sin(0.09 * t) + 0.9 * std::sin(0.45 * t),
                            38.0 * (1.0 - std::cos(0.09 * t)) + 0.7 * std::cos(0.4 * t),
                            0.5 * t + 0.6 * std::sin(0.5 * t));
  const Eigen::AngleAxisd north(20.0 * kRadPerDeg, Eigen::Vector3d::UnitZ());
  const double heading_deg = 20.0 + 5.2 * t + std::sin(0.5 * t);
  const double pitch_deg = -2.0 * std::sin(0.45 * t);
  const double bank_deg = -12.0 - std::cos(0.5 * t);
  return {Eigen::Vector3d(5.0, -8.0, 75.0) + north * way,
          (Eigen::AngleAxisd(heading_deg * kRadPerDeg, Eigen::Vector3d::UnitZ()) *
           Eigen::AngleAxisd(pitch_deg * kRadPerDeg, Eigen::Vector3d::UnitY()) *
           Eigen::AngleAxisd(bank_deg * kRadPerDeg, Eigen::Vector3d::UnitX()))
              .toRotationMatrix()};
}

}  // namespace

SaidPose Recording::pose_after(std::size_t camera, std::size_t frame, double offset_s) const {
  const Eigen::Vector3d turn = offset_s * rate_body_radps[frame];
  const Eigen::Matrix3d body =
      world_from_body[frame] * (turn.isZero() ? Eigen::AngleAxisd::Identity()
                                              : Eigen::AngleAxisd(turn.norm(), turn.normalized()))
                                   .toRotationMatrix();
  return {body * cameras[camera].body_from_camera,
          body_world[frame] + offset_s * velocity_mps[frame] +
              0.5 * offset_s * offset_s * acceleration_mps2[frame] +
              body * cameras[camera].offset_body};
}

Recording::Shown Recording::shown(std::size_t camera, std::size_t frame,
                                  const Eigen::Vector3d& point_world) const {
  const SceneCamera& seen_by = cameras[camera];
  Shown shown;
  double offset_s = 0.0;
  // Lines are exposed many times faster than points cross them: each turn is nearer by that factor.
  for (int turn = 0; turn < 60; ++turn) {
    const SaidPose pose = seen_by.line_time_s > 0.0
                              ? pose_after(camera, frame, offset_s)
                              : SaidPose{rotation(camera, frame), centre(camera, frame)};
    const Eigen::Vector3d at = pose.rotation.transpose() * (point_world - pose.centre);
    shown = {{seen_by.focal_px * at.x() / at.z() + 0.5 * seen_by.width,
              seen_by.focal_px * at.y() / at.z() + 0.5 * seen_by.height},
             at.z()};
    const double before_s = offset_s;
    offset_s = seen_by.line_offset_s(shown.pixel.x(), shown.pixel.y());
    if (std::abs(offset_s - before_s) < 1e-12 * seen_by.line_time_s) break;
  }
  return shown;
}

std::vector<SceneCamera> with_shutters(std::vector<SceneCamera> cameras, double line_time_s,
                                       const std::string& readout) {
  for (SceneCamera& camera : cameras) {
    camera.line_time_s = line_time_s;
    camera.readout = readout;
  }
  return cameras;
}

std::vector<SceneCamera> kitti_cameras() {
  const Eigen::Matrix3d mount = looking(0.0, 40.0);
  const Eigen::Vector3d right = mount.col(0);
  return {{"image_2", 160, 128, 130.0, mount, {0.3, 0.0, 0.0}},
          {"image_3", 160, 128, 130.0, mount, Eigen::Vector3d(0.3, 0.0, 0.0) + 0.5 * right}};
}

std::vector<SceneCamera> kitti_raw_cameras() {
  std::vector<SceneCamera> cameras = kitti_cameras();
  cameras[0].name = "image_02";
  cameras[1].name = "image_03";
  return cameras;
}

std::vector<SceneCamera> tartanair_cameras() {
  const Eigen::Matrix3d mount = looking(0.0, 55.0);
  const Eigen::Vector3d right = mount.col(0);
  return {{"lcam_front", 640, 640, 320.0, mount, {0.0, 0.0, 0.0}},
          {"rcam_front", 640, 640, 320.0, mount, 0.25 * right}};
}

std::vector<SceneCamera> tartanair_v1_cameras() {
  std::vector<SceneCamera> cameras = tartanair_cameras();
  cameras[0].name = "left";
  cameras[1].name = "right";
  for (SceneCamera& camera : cameras) camera.height = 480;
  return cameras;
}

std::vector<SceneCamera> colmap_cameras() {
  return {{"rig/cam0", 160, 128, 120.0, looking(0.0, 40.0), {0.3, 0.0, 0.0}},
          {"rig/cam1", 160, 128, 120.0, looking(-30.0, 40.0), {0.26, -0.15, 0.0}},
          {"rig/cam2", 160, 128, 120.0, looking(0.0, 40.0), {0.3, -0.5, 0.0}}};
}

Recording record_flight(const std::vector<SceneCamera>& cameras, int num_frames, Ground ground,
                        int frame_step) {
  Recording recording;
  recording.cameras = cameras;
  if (ground == Ground::Smooth)
    recording.height_m = [](double x, double y) { return hills(x, y); };
  else
    recording.height_m = [](double x, double y) { return facets(x, y); };
  double heading_deg = 20.0;
  Eigen::Vector3d place(5.0, -8.0, 75.0);
  for (int i = 0; i < num_frames * frame_step; ++i) {
    // Speed, climb and turn all change from frame to frame: else a shift of time could not be seen.
    const double speed = 3.0 + 0.9 * std::sin(1.1 * i) + 0.2 * i;
    heading_deg += 5.0 + 2.5 * std::sin(0.9 * i + 0.4);
    const double bank_deg = -12.0 - 3.0 * std::cos(0.8 * i);
    const double pitch_deg = -3.0 * std::sin(0.7 * i);
    place +=
        Eigen::Vector3d(speed * std::cos(heading_deg * kRadPerDeg),
                        speed * std::sin(heading_deg * kRadPerDeg), 0.6 + 0.5 * std::cos(0.6 * i));
    if (i % frame_step != 0) continue;
    recording.body_world.push_back(place);
    recording.world_from_body.push_back(
        (Eigen::AngleAxisd(heading_deg * kRadPerDeg, Eigen::Vector3d::UnitZ()) *
         Eigen::AngleAxisd(pitch_deg * kRadPerDeg, Eigen::Vector3d::UnitY()) *
         Eigen::AngleAxisd(bank_deg * kRadPerDeg, Eigen::Vector3d::UnitX()))
            .toRotationMatrix());
  }
  start_at_origin(recording);
  take_images(recording);
  return recording;
}

namespace {

/// Frames at 1 Hz of a path in closed form, and its derivatives.
void fly(Recording& recording, int num_frames, BodyPose (*pose)(double)) {
  recording.rate_hz = 1.0;
  for (int i = 0; i < num_frames; ++i) {
    // Central differences: step^2 / 6 of a third derivative under 0.2 m/s^3, and rounding, 1e-7.
    constexpr double kStep_s = 1e-3;
    const BodyPose before = pose(i - kStep_s), at = pose(i), after = pose(i + kStep_s);
    recording.body_world.push_back(at.place);
    recording.world_from_body.push_back(at.world_from_body);
    recording.velocity_mps.emplace_back((after.place - before.place) / (2.0 * kStep_s));
    recording.acceleration_mps2.emplace_back((after.place - 2.0 * at.place + before.place) /
                                             (kStep_s * kStep_s));
    const Eigen::AngleAxisd turn(
        Eigen::Matrix3d(before.world_from_body.transpose() * after.world_from_body));
    recording.rate_body_radps.emplace_back(turn.angle() * turn.axis() / (2.0 * kStep_s));
  }
}

}  // namespace

Recording record_smooth_flight(const std::vector<SceneCamera>& cameras, int num_frames) {
  Recording recording;
  recording.cameras = cameras;
  recording.height_m = [](double x, double y) { return hills(x, y); };
  fly(recording, num_frames, smooth_pose);
  start_at_origin(recording);
  take_images(recording);
  return recording;
}

Recording island_path(const std::vector<SceneCamera>& cameras, int num_frames, Path path) {
  Recording recording;
  recording.cameras = cameras;
  recording.height_m = [](double x, double y) { return gentle_hills(x, y); };
  recording.island_m = 180.0;
  fly(recording, num_frames, path == Path::Curved ? smooth_pose : straight_pose);
  start_at_origin(recording);
  recording.shore_m = recording.body_world.front().z() - 78.0;
  return recording;
}

Recording record_island_flight(const std::vector<SceneCamera>& cameras, int num_frames, Path path) {
  Recording recording = island_path(cameras, num_frames, path);
  take_images(recording);
  return recording;
}

Recording cropped(const Recording& recording, const std::vector<SceneCamera>& cameras) {
  Recording result = recording;
  result.cameras = cameras;
  const auto crop = [](auto& image, int height) {
    auto part = std::decay_t<decltype(image)>(image.width(), height, image.channels());
    const int first = (image.height() - height) / 2;
    for (int y = 0; y < height; ++y)
      std::copy(image.row(first + y).begin(), image.row(first + y).end(), part.row(y).begin());
    image = std::move(part);
  };
  for (std::size_t c = 0; c < cameras.size(); ++c)
    for (std::size_t f = 0; f < result.color[c].size(); ++f) {
      crop(result.color[c][f], cameras[c].height);
      crop(result.depth[c][f], cameras[c].height);
      if (!result.classes.empty()) crop(result.classes[c][f], cameras[c].height);
    }
  return result;
}

}  // namespace terracast::test
