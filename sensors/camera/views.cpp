#include "sensors/camera/views.h"

#include <algorithm>
#include <array>

#include "core/packet_code.h"

namespace terracast::sensors {
namespace {

/// View::camera_from_world of several points.
/// rows   of the rotation from world to camera
TERRACAST_PACKET_CODE
void to_camera_frame(const double* center, const double* rows, const geo::VectorBlock& points,
                     geo::VectorBlock& __restrict rays) {
  const double* const r = rows;
  const double center_x = center[0];
  const double center_y = center[1];
  const double center_z = center[2];
  const double xx = r[0], xy = r[1], xz = r[2];
  const double yx = r[3], yy = r[4], yz = r[5];
  const double zx = r[6], zy = r[7], zz = r[8];
  for (int i = 0; i < geo::VectorBlock::kVectors; ++i) {
    const double x = points.x[i] - center_x;
    const double y = points.y[i] - center_y;
    const double z = points.z[i] - center_z;
    rays.x[i] = xx * x + xy * y + xz * z;
    rays.y[i] = yx * x + yy * y + yz * z;
    rays.z[i] = zx * x + zy * y + zz * z;
  }
}

/// What View::ray_world does to rays of the camera's frame.
/// columns   of the rotation from camera to world
TERRACAST_PACKET_CODE
void to_world_frame(const double* columns, const geo::VectorBlock& rays_camera,
                    geo::VectorBlock& __restrict rays_world) {
  const double* const c = columns;
  const double xx = c[0], yx = c[1], zx = c[2];
  const double xy = c[3], yy = c[4], zy = c[5];
  const double xz = c[6], yz = c[7], zz = c[8];
  for (int i = 0; i < geo::VectorBlock::kVectors; ++i) {
    const double x = rays_camera.x[i];
    const double y = rays_camera.y[i];
    const double z = rays_camera.z[i];
    rays_world.x[i] = xx * x + xy * y + xz * z;
    rays_world.y[i] = yx * x + yy * y + yz * z;
    rays_world.z[i] = zx * x + zy * y + zz * z;
  }
}

}  // namespace

void View::find_rays(const geo::PixelBlock& pixels, geo::VectorBlock& rays_world) const {
  geo::VectorBlock rays_camera;
  model->find_rays(pixels, rays_camera);
  to_world_frame(world_from_camera.data(), rays_camera, rays_world);
}

std::uint32_t View::find_in_image(const geo::VectorBlock& points_world) const {
  geo::VectorBlock rays_camera;
  // Eigen keeps matrices column by column: the transpose's rows.
  to_camera_frame(center_world.data(), world_from_camera.data(), points_world, rays_camera);
  return model->find_in_image(rays_camera);
}

Eigen::Vector3d View::origin_toward(const Eigen::Vector3d& point_world) const {
  if (model->is_central()) return center_world;
  const std::optional<Eigen::Vector2d> pixel = project(point_world);
  return pixel ? origin_world(*pixel) : center_world;
}

std::vector<Eigen::Vector3d> View::starts_world(int num_parts) const {
  if (model->is_central()) return {center_world};
  std::vector<Eigen::Vector3d> starts;
  for (int j = 0; j <= num_parts; ++j)
    for (int i = 0; i <= num_parts; ++i) {
      const Eigen::Vector3d start =
          origin_world({static_cast<double>(model->width_px()) * i / num_parts,
                        static_cast<double>(model->height_px()) * j / num_parts});
      if (starts.empty() || starts.back() != start) starts.push_back(start);
    }
  return starts;
}

View OpenView::at(double offset_s) const {
  if (offset_s == 0.0) return middle;
  const geo::Rigid3d world_from_camera = motion.world_from_camera(offset_s);
  return {.model = middle.model,
          .center_world = world_from_camera.translation,
          .world_from_camera = world_from_camera.rotation.toRotationMatrix()};
}

std::optional<OpenView::SeenFrom> OpenView::that_sees(
    const std::function<Eigen::Vector3d(double)>& point_world_at) const {
  const auto seen = geo::find_seen(
      motion.shutter, middle.model->width_px(), middle.model->height_px(),
      [&](double offset_s) { return at(offset_s).project(point_world_at(offset_s)); });
  if (!seen || !middle.model->contains(seen->pixel)) return std::nullopt;
  const View view = at(seen->offset_s);
  return SeenFrom{
      .view = view, .offset_s = seen->offset_s, .origin_world = view.origin_world(seen->pixel)};
}

OpenView::LensRay OpenView::lens_ray(const Eigen::Vector2d& pixel, double open_share,
                                     const Eigen::Vector2d& on_disc) const {
  const double offset_s = offset_of_line_s(pixel) + (open_share - 0.5) * motion.shutter.exposure_s;
  const View view = at(offset_s);
  if (aperture.diameter_m == 0.0)
    return {.origin_world = view.origin_world(pixel),
            .direction_world = view.ray_world(pixel).normalized(),
            .offset_s = offset_s};
  const Eigen::Vector3d in_pupil(0.5 * aperture.diameter_m * on_disc.x(),
                                 0.5 * aperture.diameter_m * on_disc.y(), 0.0);
  const Eigen::Vector3d ray = view.model->ray_from_pixel(pixel);
  const Eigen::Vector3d through =
      aperture.focus_m > 0.0 ? Eigen::Vector3d(aperture.focus_m * ray - in_pupil) : ray;
  return {.origin_world = view.center_world + view.world_from_camera * in_pupil,
          .direction_world = (view.world_from_camera * through).normalized(),
          .offset_s = offset_s};
}

ViewTable::ViewTable(const std::vector<geo::BodyState>& states,
                     const std::vector<capture::CameraCalibration>& cameras)
    : num_frames_(static_cast<int>(states.size())), states_(states), cameras_(cameras) {
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

OpenView ViewTable::open(int frame, int camera) const {
  const capture::CameraCalibration& calibration = cameras_[static_cast<std::size_t>(camera)];
  return {.middle = at(frame, camera),
          .motion = {.state = states_[static_cast<std::size_t>(frame)],
                     .body_from_camera = calibration.body_from_camera(),
                     .shutter = calibration.shutter},
          .aperture = calibration.aperture};
}

double ViewTable::longest_reach_s() const {
  double longest_s = 0.0;
  for (const capture::CameraCalibration& camera : cameras_)
    longest_s = std::max(
        longest_s, camera.shutter.reach_s(camera.intrinsics.width_px, camera.intrinsics.height_px));
  return longest_s;
}

bool ViewTable::has_open_views() const {
  return std::any_of(cameras_.begin(), cameras_.end(),
                     [](const auto& camera) {
                       return !camera.shutter.is_instant() || camera.aperture.diameter_m > 0.0;
                     }) ||
         std::any_of(models_.begin(), models_.end(),
                     [](const auto& model) { return !model->is_central(); });
}

namespace {

/// Null: all rays start at one place.
std::shared_ptr<const world::RaySheaf> sheaf_of(const View& view) {
  if (view.model->is_central()) return nullptr;
  const double width_px = view.model->width_px();
  const double height_px = view.model->height_px();
  const std::array<Eigen::Vector2d, 4> corners = {
      Eigen::Vector2d(0.0, 0.0), Eigen::Vector2d(width_px, 0.0),
      Eigen::Vector2d(width_px, height_px), Eigen::Vector2d(0.0, height_px)};
  std::array<Eigen::Vector3d, 4> starts, directions;
  for (std::size_t k = 0; k < corners.size(); ++k) {
    starts[k] = view.origin_world(corners[k]);
    directions[k] = view.ray_world(corners[k]);
  }
  return std::make_shared<const world::RaySheaf>(starts, directions,
                                                 view.model->finest_pixels_per_m());
}

/// The view at the frame's time; where rays start at many places, also when the image begins and when it ends.
std::vector<View> views_of_image(const ViewTable& views, int frame, int camera) {
  std::vector<View> of_image = {views.at(frame, camera)};
  const OpenView open = views.open(frame, camera);
  if (open.is_central() || open.motion.shutter.is_instant()) return of_image;
  const double reach_s =
      open.motion.shutter.reach_s(open.middle.model->width_px(), open.middle.model->height_px());
  for (const double offset_s : {-reach_s, reach_s}) of_image.push_back(open.at(offset_s));
  return of_image;
}

}  // namespace

std::vector<world::Viewpoint> viewpoints_of_frames(const ViewTable& views, int first, int last) {
  std::vector<world::Viewpoint> viewpoints;
  for (int frame = first; frame <= std::min(last, views.num_frames() - 1); ++frame) {
    for (int camera = 0; camera < views.num_cameras(); ++camera) {
      for (const View& view : views_of_image(views, frame, camera))
        viewpoints.push_back({.position_world = view.center_world,
                              .pixels_per_radian = view.model->finest_pixels_per_radian(),
                              .sheaf = sheaf_of(view)});
    }
  }
  return viewpoints;
}

}  // namespace terracast::sensors
