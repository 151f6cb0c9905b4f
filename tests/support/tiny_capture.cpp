#include "tests/support/tiny_capture.h"

#include <fmt/format.h>

#include <optional>

#include "capture/frame_writer.h"
#include "capture/object_labels.h"
#include "geo/frames.h"
#include "geo/units.h"

namespace terracast::test {

Eigen::Vector3d TinyScene::wall_normal() const { return wall_right.cross(wall_up); }

double TinyScene::wall_parameter(const Eigen::Vector3d& eye,
                                 const Eigen::Vector3d& direction) const {
  const double along = wall_normal().dot(direction);
  const double t = wall_normal().dot(wall_center - eye) / along;
  if (along == 0.0 || !(t > 0.0)) return std::numeric_limits<double>::infinity();
  const Eigen::Vector3d offset = eye + t * direction - wall_center;
  const bool is_inside = std::abs(offset.dot(wall_right)) <= wall_half_width_m &&
                         std::abs(offset.dot(wall_up)) <= wall_half_height_m;
  return is_inside ? t : std::numeric_limits<double>::infinity();
}

TinyHit TinyScene::cast(const Eigen::Vector3d& eye, const Eigen::Vector3d& direction) const {
  const double length = direction.norm();
  const double ground = ground_normal.dot(ground_point - eye) / ground_normal.dot(direction);
  const double ground_m = ground > 0.0 && ground * length < horizon_m
                              ? ground * length
                              : std::numeric_limits<double>::infinity();
  const double wall_m = wall_parameter(eye, direction) * length;
  if (std::isinf(ground_m) && std::isinf(wall_m)) return {};
  if (wall_m < ground_m)
    return {wall_m, wall_normal().dot(direction) < 0.0 ? wall_normal() : -wall_normal(),
            capture::SemanticClass::Rock, 7, 1u << 17};
  const Eigen::Vector3d place = eye + direction * ground;
  const auto cell = [](double x) { return static_cast<std::uint32_t>(std::floor(x / 8.0)) & 255; };
  return {
      ground_m, ground_normal,
      place.x() < ground_point.x() ? capture::SemanticClass::Grass : capture::SemanticClass::Soil,
      0, cell(place.y()) << 9 | cell(place.x()) << 1};
}

bool TinyScene::is_hidden(const Eigen::Vector3d& eye, const Eigen::Vector3d& point_world) const {
  return wall_parameter(eye, point_world - eye) < 1.0 - 1e-9;
}

double TinyScene::distance_to_surface(const Eigen::Vector3d& point_world) const {
  return std::min(std::abs(ground_normal.dot(point_world - ground_point)),
                  std::abs(wall_normal().dot(point_world - wall_center)));
}

capture::CameraCalibration tiny_camera(const std::string& rig, const std::string& name,
                                       int width_px, int height_px, double focal_length_px,
                                       const Eigen::Vector3d& axis_angle_rdf,
                                       const Eigen::Vector3d& offset_rdf_m) {
  const double angle = axis_angle_rdf.norm();
  const Eigen::Matrix3d turn =
      angle > 0.0 ? Eigen::AngleAxisd(angle, axis_angle_rdf / angle).toRotationMatrix()
                  : Eigen::Matrix3d(Eigen::Matrix3d::Identity());
  const double pitch_rad = geo::radians_from_degrees(30.0);
  return {
      .rig = rig,
      .name = name,
      .intrinsics = {.model = "pinhole",
                     .width_px = width_px,
                     .height_px = height_px,
                     .parameters = {focal_length_px, focal_length_px, width_px / 2.0,
                                    height_px / 2.0}},
      .rig_from_camera = {Eigen::Quaterniond(Eigen::Matrix3d(geo::rig_from_rdf() * turn)),
                          geo::rig_from_rdf() * offset_rdf_m},
      .body_from_rig = {Eigen::Quaterniond(Eigen::AngleAxisd(pitch_rad, Eigen::Vector3d::UnitY())),
                        Eigen::Vector3d(0.4, 0.0, -0.2)}};
}

Eigen::Vector3d tiny_face_turn(const std::string& face) {
  if (face == "left") return {0.0, -M_PI_2, 0.0};
  if (face == "right") return {0.0, M_PI_2, 0.0};
  if (face == "back") return {0.0, M_PI, 0.0};
  if (face == "top") return {M_PI_2, 0.0, 0.0};
  if (face == "bottom") return {-M_PI_2, 0.0, 0.0};
  return Eigen::Vector3d::Zero();
}

double tiny_bank_rad(int frame) { return 0.05 + kTinyBankStep_rad * frame; }

Eigen::Vector3d tiny_step(const TinyCaptureOptions& options) {
  return {options.step_m, 0.3 * options.step_m, 0.1 * options.step_m};
}

geo::Rigid3d tiny_world_from_body(const TinyCaptureOptions& options, int frame) {
  const double yaw_rad = 0.1 + kTinyYawStep_rad * frame;
  const Eigen::Vector3d start(20000.0, 9000.0, 420.0);
  return {(Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()) *
           Eigen::AngleAxisd(-tiny_bank_rad(frame), Eigen::Vector3d::UnitX())),
          start + tiny_step(options) * frame};
}

geo::Rigid3d tiny_world_from_camera(const TinyCaptureOptions& options, int frame,
                                    const capture::CameraCalibration& camera) {
  return tiny_world_from_body(options, frame) * camera.body_from_camera();
}

Eigen::Vector3d tiny_ray(const capture::CameraCalibration& camera, double u, double v) {
  const std::vector<double>& p = camera.intrinsics.parameters;
  return {(u - p[2]) / p[0], (v - p[3]) / p[1], 1.0};
}

bool tiny_sees(const capture::CameraCalibration& camera, const Eigen::Vector3d& point_camera,
               Eigen::Vector2d* pixel) {
  const std::vector<double>& p = camera.intrinsics.parameters;
  if (!(point_camera.z() > 0.0)) return false;
  const Eigen::Vector2d at(p[0] * point_camera.x() / point_camera.z() + p[2],
                           p[1] * point_camera.y() / point_camera.z() + p[3]);
  if (pixel != nullptr) *pixel = at;
  return at.x() >= 0.0 && at.y() >= 0.0 && at.x() < camera.intrinsics.width_px &&
         at.y() < camera.intrinsics.height_px;
}

Eigen::Vector3d tiny_color(const Eigen::Vector3d& point_world) {
  return {128.0 + 60.0 * std::sin(point_world.x() / 31.0),
          128.0 + 60.0 * std::sin(point_world.y() / 23.0 + 1.0),
          128.0 + 60.0 * std::sin((point_world.x() + point_world.y()) / 41.0 + 2.0)};
}

capture::LabelBounds tiny_bounds(int frame, int camera_index) {
  const double scale = 1.0 + 0.137 * frame + 0.011 * camera_index;
  capture::LabelBounds bounds;
  // The second camera sees no ground.
  if (camera_index != 1)
    bounds.depth_m =
        capture::LabelError{.arithmetic = 1.234567e-12 * scale, .rounding = 3.456789e-5 * scale};
  bounds.flow_next_px =
      capture::LabelError{.arithmetic = 2.2e-12 * scale, .rounding = 1.1e-6 * scale};
  if (frame > 0)
    bounds.flow_previous_px =
        capture::LabelError{.arithmetic = 1.1e-12 * scale, .rounding = 2.2e-6 * scale};
  bounds.num_left_out = frame + camera_index;
  return bounds;
}

std::vector<capture::TrackPoint> tiny_tracks() {
  const TinyScene scene;
  std::vector<capture::TrackPoint> tracks;
  for (int i = 0; i < 12; ++i) {
    for (int k = 0; k < 12; ++k) {
      const double x = 20060.0 + 37.0 * i, y = 8780.0 + 41.0 * k;
      const Eigen::Vector3d& n = scene.ground_normal;
      const Eigen::Vector3d& p = scene.ground_point;
      const double z = p.z() - (n.x() * (x - p.x()) + n.y() * (y - p.y())) / n.z();
      tracks.push_back(
          {.id = 10 + 3 * static_cast<std::int64_t>(tracks.size()), .point_world = {x, y, z}});
    }
  }
  // Seen by nobody: behind the flight.
  tracks.push_back({.id = 100000, .point_world = {15000.0, 9000.0, 450.0}});
  return tracks;
}

capture::CameraFrame tiny_frame(const TinyCaptureOptions& options,
                                const capture::SequenceInfo& info, int frame, int camera_index) {
  const TinyScene scene;
  const capture::CameraCalibration& camera = info.cameras[static_cast<std::size_t>(camera_index)];
  const int width = camera.intrinsics.width_px, height = camera.intrinsics.height_px;
  const geo::Rigid3d world_from_camera = tiny_world_from_camera(options, frame, camera);
  struct Other {
    const capture::CameraCalibration* camera;
    geo::Rigid3d camera_from_world;
    Eigen::Vector3d eye;
    std::uint32_t bit;
  };
  std::vector<Other> others;
  const auto look_from = [&](int other_frame, int other_index, std::uint32_t bit) {
    const auto& other = info.cameras[static_cast<std::size_t>(other_index)];
    const geo::Rigid3d pose = tiny_world_from_camera(options, other_frame, other);
    others.push_back({&other, pose.inverse(), pose.translation, bit});
  };
  if (frame + 1 < info.num_frames) look_from(frame + 1, camera_index, capture::kVisibleNext);
  if (frame > 0) look_from(frame - 1, camera_index, capture::kVisiblePrevious);
  for (const int k : info.cameras_of_rig(camera.rig))
    if (k != camera_index) look_from(frame, k, capture::visible_in_camera(k));

  capture::CameraFrame result;
  result.color = core::Image8(width, height, 3, 200);
  result.range_m = core::ImageF(width, height, 1, capture::kSkyRange_m);
  result.normal_world = core::ImageF(width, height, 3, 0.0F);
  result.semantic_id = core::ImageU32(width, height);
  result.instance_id = core::ImageU32(width, height);
  result.primitive_id = core::ImageU32(width, height, 1, capture::kNoPrimitive);
  result.flags = core::ImageU32(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const Eigen::Vector3d direction =
          world_from_camera.rotation * tiny_ray(camera, x + 0.5, y + 0.5).normalized();
      const TinyHit hit = scene.cast(world_from_camera.translation, direction);
      if (std::isinf(hit.range_m)) continue;
      result.range_m(x, y) = static_cast<float>(hit.range_m);
      result.semantic_id(x, y) = static_cast<std::uint32_t>(hit.semantic);
      result.instance_id(x, y) = hit.instance_id;
      result.primitive_id(x, y) = hit.primitive_id;
      const Eigen::Vector3d place = world_from_camera.translation + hit.range_m * direction;
      const Eigen::Vector3d color = tiny_color(place);
      for (int k = 0; k < 3; ++k) {
        result.normal_world(x, y, k) = static_cast<float>(hit.normal_world[k]);
        result.color(x, y, k) = static_cast<std::uint8_t>(std::lround(color[k]));
      }
      for (const Other& other : others)
        if (tiny_sees(*other.camera, other.camera_from_world * place) &&
            !scene.is_hidden(other.eye, place))
          result.flags(x, y) |= other.bit;
    }
  }
  return result;
}

capture::SequenceInfo tiny_sequence(const TinyCaptureOptions& options) {
  capture::SequenceInfo info;
  info.name = options.name;
  info.input_hash = options.input_hash;
  info.world_name = "TinyWorld";
  info.world_input_hash = "fedcba9876543210fedcba9876543210";
  info.origin = TinyScene().origin;
  info.utc_start = options.utc_start;
  info.rate_hz = 10.0;
  info.num_frames = options.num_frames;
  info.geometry = {.cell_px = 2.0,
                   .finest_spacing_m = 1.0,
                   .tiles = {{7, -1, 0, "00112233445566778899aabbccddeeff", 411.5},
                             {7, 0, 0, "ffeeddccbbaa99887766554433221100", 370.25}}};
  info.config_toml = "name = \"tiny\"\n";
  info.licences = {"Drawn for tests; public domain"};
  const Eigen::Vector3d none = Eigen::Vector3d::Zero();
  if (options.has_tartan2) {
    info.cameras.push_back(tiny_camera("tartan2", "lcam_front", 640, 640, 320.0, none, none));
    info.cameras.push_back(
        tiny_camera("tartan2", "rcam_front", 640, 640, 320.0, none, {0.25, 0.0, 0.0}));
  }
  for (const std::string& face : options.faces)
    info.cameras.push_back(tiny_camera("tartan2", face, 640, 640, 320.0,
                                       tiny_face_turn(face.substr(5)),
                                       {face.starts_with('r') ? 0.25 : 0.0, 0.0, 0.0}));
  if (options.has_tartan_v1) {
    info.cameras.push_back(tiny_camera("tartan_v1", "left", 640, 480, 320.0, none, none));
    info.cameras.push_back(
        tiny_camera("tartan_v1", "right", 640, 480, 320.0, none, {0.25, 0.0, 0.0}));
  }
  if (options.has_mcs4) {
    const auto add = [&](const char* name, double yaw_rad, const Eigen::Vector3d& offset_m) {
      info.cameras.push_back(
          tiny_camera("mcs4", name, 90, 80, 90.0, {0.0, yaw_rad, 0.0}, offset_m));
    };
    add("cam0", 0.0, {0.0, 0.0, 0.3});
    add("cam1", 0.524, {0.15, 0.0, 0.259808});
    add("cam2", 1.047, {0.259808, 0.0, 0.15});
    add("cam3", 0.0, {0.5, 0.0, 0.3});
  }
  if (options.has_imaging) {
    info.cameras[0].shutter.exposure_s = 0.008;
    info.imaging.resize(info.cameras.size());
    info.imaging[1].settings_toml = "[color]\nsaturation = 1.25\n";
  }
  if (options.has_camera_errors) {
    info.believed_cameras = info.cameras;
    for (std::size_t i = 0; i < info.cameras.size(); ++i) {
      const double share = 0.01 * static_cast<double>(i + 1);
      capture::CameraCalibration& camera = info.cameras[i];
      for (std::size_t k : {0u, 1u}) camera.intrinsics.parameters[k] *= 1.0 + share;
      camera.rig_from_camera.rotation =
          camera.rig_from_camera.rotation *
          Eigen::AngleAxisd(share, Eigen::Vector3d(1.0, -2.0, 3.0).normalized());
      camera.rig_from_camera.translation += share * Eigen::Vector3d(1.0, 2.0, -1.5);
    }
  }
  if (options.has_clock_errors)
    for (std::size_t i = 0; i < info.cameras.size(); ++i)
      info.clocks.push_back({.offset_s = 0.01 * static_cast<double>(i + 1),
                             .drift = -1e-3 * static_cast<double>(i + 1),
                             .jitter_sd_s = 0.001});
  if (options.has_sensor)
    info.streams.push_back(
        {.rig = "mcs4",
         .name = "laser",
         .kind = "rangefinder",
         .rate_hz = 25.0,
         .channels = {{.name = "range_m", .unit = "m"}, {.name = "shape", .unit = ""}},
         .rig_from_sensor = {.rotation = Eigen::Quaterniond(0.8, 0.0, 0.6, 0.0),
                             .translation = {0.1, -0.2, 0.3}},
         .body_from_rig = {},
         .settings_toml = "least_range_m = 0.0\nmost_range_m = 2000.0\n"});
  for (const char* name : {"dvs", "own"}) {
    if (!options.has_events) break;
    info.streams.push_back(
        {.rig = "mcs4",
         .name = name,
         .kind = "events",
         .rate_hz = 40.0,
         .channels = {{.name = "x_px", .unit = "px", .type = capture::NumberType::Count16},
                      {.name = "y_px", .unit = "px", .type = capture::NumberType::Count16},
                      {.name = "polarity", .unit = "", .type = capture::NumberType::Count8},
                      {.name = "is_noise", .unit = "", .type = capture::NumberType::Count8},
                      {.name = "contrast", .unit = "", .type = capture::NumberType::Float32}},
         .rig_from_sensor = {},
         .body_from_rig = {},
         .settings_toml = std::string(name) == "dvs"
                              ? "camera = \"cam0\"\nwidth_px = 0\nheight_px = 0\nfx_px = 0.0\n"
                              : "camera = \"\"\nwidth_px = 20\nheight_px = 10\nfx_px = 30.0\n",
         .is_scan = true});
  }
  return info;
}

capture::Samples tiny_events(const capture::TickRange& ticks, double rate_hz) {
  capture::Samples events;
  for (std::int64_t tick = ticks.first; tick < ticks.end; ++tick)
    for (int i = 0; i < 300; ++i) {
      // 81 us apart, each third at the time of the one before.
      const std::int64_t ns =
          std::llround(1e9 * static_cast<double>(tick) / rate_hz) + 81'237 * (i - i % 3) + 5;
      events.times_s.push_back(static_cast<double>(ns) / 1e9);
      for (const int value : {(7 * i) % 20, (3 * i) % 10, i % 2, 0}) events.values.push_back(value);
      events.values.push_back(0.25);
    }
  return events;
}

double tiny_stamp_s(int camera_index, double time_s) {
  return time_s + (camera_index + 1) * (0.01 - 1e-3 * time_s);
}

namespace {

constexpr std::uint32_t kWall = 7;

/// The wall in an image, by its own plane; nothing where no pixel shows it.
std::optional<capture::ObjectView> tiny_view(const capture::CameraCalibration& camera,
                                             const geo::Rigid3d& pose,
                                             const capture::CameraFrame& facts) {
  const TinyScene scene;
  capture::ObjectView view;
  view.instance_id = kWall;
  view.nearest_m = scene.horizon_m;
  Eigen::AlignedBox2d visible;
  for (int y = 0; y < facts.instance_id.height(); ++y)
    for (int x = 0; x < facts.instance_id.width(); ++x) {
      const Eigen::Vector3d ray = pose.rotation * tiny_ray(camera, x + 0.5, y + 0.5);
      if (std::isfinite(scene.wall_parameter(pose.translation, ray))) ++view.num_own;
      if (facts.instance_id(x, y) != kWall) continue;
      ++view.num_visible;
      view.nearest_m = std::min(view.nearest_m, static_cast<double>(facts.range_m(x, y)));
      visible.extend(Eigen::Vector2d(x, y));
      visible.extend(Eigen::Vector2d(x + 1, y + 1));
    }
  if (view.num_visible == 0) return std::nullopt;
  Eigen::AlignedBox2d whole;
  int num_outside = 0;
  for (const double right : {-1.0, 1.0})
    for (const double up : {-1.0, 1.0}) {
      Eigen::Vector2d pixel;
      const Eigen::Vector3d corner =
          pose.inverse() * (scene.wall_center + right * scene.wall_half_width_m * scene.wall_right +
                            up * scene.wall_half_height_m * scene.wall_up);
      num_outside += tiny_sees(camera, corner, &pixel) ? 0 : 1;
      if (corner.z() > 0.0)
        whole.extend(pixel);
      else
        whole.extend(visible);
    }
  const auto box = [&](const Eigen::AlignedBox2d& b) {
    return capture::ImageBox{std::max(b.min().x(), 0.0), std::max(b.min().y(), 0.0),
                             std::min<double>(b.max().x(), camera.intrinsics.width_px),
                             std::min<double>(b.max().y(), camera.intrinsics.height_px)};
  };
  view.visible_px = box(visible);
  view.whole_px = box(whole);
  view.truncation = 0.25 * num_outside;  // nobody derives anything from it
  return view;
}

/// Along the wall, through it and up; it is as thin as a plane.
capture::OrientedBox tiny_wall_box() {
  const TinyScene scene;
  Eigen::Matrix3d axes;
  axes << scene.wall_right, scene.wall_up.cross(scene.wall_right), scene.wall_up;
  return {.world_from_box = {Eigen::Quaterniond(axes), scene.wall_center},
          .half_size_m = {scene.wall_half_width_m, 0.0, scene.wall_half_height_m}};
}

}  // namespace

capture::Samples tiny_samples(std::vector<double> times_s) {
  capture::Samples samples{.times_s = std::move(times_s), .values = {}};
  for (const double time_s : samples.times_s) {
    samples.values.push_back(100.0 / 3.0 + time_s);
    samples.values.push_back(time_s < 0.1 ? std::numeric_limits<double>::infinity() : -1e-9);
  }
  return samples;
}

std::filesystem::path write_tiny_capture(const std::filesystem::path& capture_folder,
                                         const TinyCaptureOptions& options) {
  const TinyScene scene;
  const capture::SequenceInfo info = tiny_sequence(options);
  const std::vector<capture::TrackPoint> tracks = tiny_tracks();
  const std::filesystem::path folder = capture_folder / options.name;
  const capture::SequenceWriter writer(folder, info, tracks);
  std::map<std::string, std::vector<capture::ObjectView>> labels;
  for (int frame = 0; frame < info.num_frames; ++frame) {
    capture::FrameRecord record;
    record.index = frame;
    record.time_s = frame / info.rate_hz;
    for (std::size_t k = 0; k < info.clocks.size(); ++k)
      record.stamps_s.push_back(tiny_stamp_s(static_cast<int>(k), record.time_s));
    record.world_from_body = tiny_world_from_body(options, frame);
    record.velocity_world_mps = tiny_step(options) * info.rate_hz;
    record.acceleration_world_mps2 = options.acceleration_world_mps2;
    // The yaw turns about the world's up, which stands in the body as the bank leaves it.
    const double bank_rad = tiny_bank_rad(frame);
    record.angular_velocity_body_radps =
        info.rate_hz * Eigen::Vector3d(-kTinyBankStep_rad, -kTinyYawStep_rad * std::sin(bank_rad),
                                       kTinyYawStep_rad * std::cos(bank_rad));
    for (int k = 0; k < static_cast<int>(info.cameras.size()); ++k) {
      const auto& camera = info.cameras[static_cast<std::size_t>(k)];
      const capture::CameraFrame facts = tiny_frame(options, info, frame, k);
      capture::CameraRecord part = writer.write_camera(frame, k, facts);
      const geo::Rigid3d pose = tiny_world_from_camera(options, frame, camera);
      std::vector<capture::ObjectView>& views = labels[capture::object_views_path(camera, frame)];
      if (auto view = tiny_view(camera, pose, facts)) {
        view->camera_from_box = pose.inverse() * tiny_wall_box().world_from_box;
        views.push_back(*view);
      }
      for (const capture::TrackPoint& track : tracks)
        if (tiny_sees(camera, pose.inverse() * track.point_world) &&
            !scene.is_hidden(pose.translation, track.point_world))
          part.visible_tracks.push_back(track.id);
      part.bounds = tiny_bounds(frame, k);
      if (options.has_imaging && k == 1) part.exposure_ev = 0.25 * frame;
      record.cameras.push_back(std::move(part));
    }
    for (std::size_t k = 0; k < info.streams.size(); ++k) {
      const double rate_hz = info.streams[k].rate_hz;
      const capture::TickRange ticks =
          capture::ticks_of_frame(rate_hz, info.rate_hz, frame, info.num_frames);
      record.streams.push_back(writer.write_samples(
          frame, static_cast<int>(k),
          info.streams[k].kind == "events" ? tiny_events(ticks, rate_hz)
                                           : tiny_samples(capture::times_of(ticks, rate_hz))));
    }
    record.key = fmt::format("{:032x}", frame + 1);
    record.touched_tiles = {0};
    record.passed_tiles = {{.tile = 1, .above_z_world_m = 380.0 + capture::kPassedStep_m * frame}};
    writer.finish_frame(record);
  }
  writer.finish_sequence();
  const std::string source = capture::labels_source(capture::SequenceReader::open(folder));
  for (const auto& [path, views] : labels)
    capture::json_from_object_views(views, source).write(folder / path, -1);
  capture::json_from_objects({{.instance_id = kWall,
                               .semantic_class = capture::SemanticClass::Truck,
                               .layer = "walls",
                               .feature = 77,
                               .prototype = "",
                               .box = tiny_wall_box()}},
                             source)
      .write(folder / capture::kObjectsFile);
  return folder;
}

}  // namespace terracast::test
