#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "capture/frame.h"
#include "geo/camera_model.h"
#include "geo/shutter.h"
#include "geo/trajectory.h"
#include "world/lod.h"

namespace terracast::sensors {

/// A camera at the time of a frame.
struct View {
  const geo::CameraModel* model = nullptr;
  Eigen::Vector3d center_world = Eigen::Vector3d::Zero();
  Eigen::Matrix3d world_from_camera = Eigen::Matrix3d::Identity();

  /// Ray through an image point, of the model's own length; spelled out, so that several rays
  /// together come out the same to the last bit.
  Eigen::Vector3d ray_world(const Eigen::Vector2d& pixel) const {
    const Eigen::Matrix3d& m = world_from_camera;
    const Eigen::Vector3d r = model->ray_from_pixel(pixel);
    return {m(0, 0) * r.x() + m(0, 1) * r.y() + m(0, 2) * r.z(),
            m(1, 0) * r.x() + m(1, 1) * r.y() + m(1, 2) * r.z(),
            m(2, 0) * r.x() + m(2, 1) * r.y() + m(2, 2) * r.z()};
  }
  /// Where that ray starts; spelled out likewise.
  Eigen::Vector3d origin_world(const Eigen::Vector2d& pixel) const {
    if (model->is_central()) return center_world;
    const Eigen::Matrix3d& m = world_from_camera;
    const Eigen::Vector3d o = model->origin_from_pixel(pixel);
    return center_world + Eigen::Vector3d(m(0, 0) * o.x() + m(0, 1) * o.y() + m(0, 2) * o.z(),
                                          m(1, 0) * o.x() + m(1, 1) * o.y() + m(1, 2) * o.z(),
                                          m(2, 0) * o.x() + m(2, 1) * o.y() + m(2, 2) * o.z());
  }
  /// Where the ray starts that meets a point which projects; of one that does not, the camera's place.
  Eigen::Vector3d origin_toward(const Eigen::Vector3d& point_world) const;
  /// Places where rays start, on a grid of so many parts a side over the image, its corners among them; of a
  /// model with one centre of projection that alone.
  std::vector<Eigen::Vector3d> starts_world(int num_parts) const;
  /// The same of several image points.
  void find_rays(const geo::PixelBlock& pixels, geo::VectorBlock& rays_world) const;
  /// The camera-frame point of a world point; spelled out likewise.
  Eigen::Vector3d camera_from_world(const Eigen::Vector3d& point_world) const {
    const Eigen::Matrix3d& m = world_from_camera;
    const Eigen::Vector3d d = point_world - center_world;
    return {m(0, 0) * d.x() + m(1, 0) * d.y() + m(2, 0) * d.z(),
            m(0, 1) * d.x() + m(1, 1) * d.y() + m(2, 1) * d.z(),
            m(0, 2) * d.x() + m(1, 2) * d.y() + m(2, 2) * d.z()};
  }
  /// Image point of a world point; nothing behind the camera. It may lie outside the image.
  std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& point_world) const {
    return model->pixel_from_ray(camera_from_world(point_world));
  }
  /// Whether a world point lies in front and in the image.
  bool has_in_image(const Eigen::Vector3d& point_world) const {
    const std::optional<Eigen::Vector2d> pixel = project(point_world);
    return pixel && model->contains(*pixel);
  }
  /// The same of several points, a bit each.
  std::uint32_t find_in_image(const geo::VectorBlock& points_world) const;
};

/// A camera over the time that its image takes, and its lens.
struct OpenView {
  View middle;  ///< at the frame's time
  geo::CameraMotion motion;
  geo::Aperture aperture;

  bool is_rolling() const { return motion.shutter.is_rolling(); }
  /// All rays start where the view's do at the frame's time.
  bool is_pinhole_instant() const {
    return motion.shutter.is_instant() && aperture.diameter_m == 0.0;
  }
  /// So much after the frame's time.
  View at(double offset_s) const;
  double offset_of_line_s(const Eigen::Vector2d& pixel) const {
    return motion.shutter.offset_s(pixel, middle.model->width_px(), middle.model->height_px());
  }
  /// Whether all rays start at one place at a time.
  bool is_central() const { return middle.model->is_central(); }
  /// In the middle of the exposure of the line through an image point.
  View of_line(const Eigen::Vector2d& pixel) const { return at(offset_of_line_s(pixel)); }
  /// The view in whose image a point stands when its line is exposed, and when that is.
  struct SeenFrom {
    View view;
    double offset_s;
    Eigen::Vector3d origin_world;  ///< where its ray to the point starts
  };
  /// point_world_at   where the point is so much after the frame's time
  /// returns          nothing where there is no such view
  std::optional<SeenFrom> that_sees(
      const std::function<Eigen::Vector3d(double offset_s)>& point_world_at) const;
  std::optional<SeenFrom> that_sees(const Eigen::Vector3d& point_world) const {
    return that_sees([&](double) { return point_world; });
  }

  /// A ray of light that comes through the lens to an image point.
  struct LensRay {
    Eigen::Vector3d origin_world;
    Eigen::Vector3d direction_world;  ///< of length 1, or not finite: no light comes in
    double offset_s = 0.0;            ///< when it comes in, counted from the frame's time
  };
  /// open_share   when in the exposure of the point's line, in [0, 1)
  /// on_disc      where in the pupil, in the unit disc
  LensRay lens_ray(const Eigen::Vector2d& pixel, double open_share,
                   const Eigen::Vector2d& on_disc) const;
};

/// All views of a sequence, by frame and camera. Threads: safe.
class ViewTable {
 public:
  /// throws Config: as geo::make_camera
  ViewTable(const std::vector<geo::BodyState>& states,
            const std::vector<capture::CameraCalibration>& cameras);

  int num_frames() const { return num_frames_; }
  int num_cameras() const { return static_cast<int>(models_.size()); }
  const View& at(int frame, int camera) const {
    return views_[static_cast<std::size_t>(frame) * models_.size() +
                  static_cast<std::size_t>(camera)];
  }
  OpenView open(int frame, int camera) const;
  /// The most that any ray's time differs from its frame's.
  double longest_reach_s() const;
  /// Whether any camera's rays start elsewhere than at its centre at the frame's time.
  bool has_open_views() const;
  /// Cameras of the same rig as `camera`, itself left out.
  const std::vector<int>& companions(int camera) const {
    return companions_[static_cast<std::size_t>(camera)];
  }

 private:
  int num_frames_ = 0;
  std::vector<geo::BodyState> states_;
  std::vector<capture::CameraCalibration> cameras_;
  std::vector<std::unique_ptr<geo::CameraModel>> models_;
  std::vector<View> views_;
  std::vector<std::vector<int>> companions_;
};

/// The places from which the cameras see the world at frames first to last, as far as there are such.
std::vector<world::Viewpoint> viewpoints_of_frames(const ViewTable& views, int first, int last);

}  // namespace terracast::sensors
