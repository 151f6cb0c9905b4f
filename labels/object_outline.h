#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "capture/labels.h"
#include "capture/object_labels.h"
#include "labels/shown_objects.h"

/// How an object lies in an image, seen through all others.
namespace terracast::labels {

/// Around all of an object that projects.
struct Outline {
  capture::ImageBox box_px;  ///< within the image or not
  bool is_whole =
      true;  ///< none of it lies beyond the camera's domain, as what is behind a pinhole
};

/// The box around the images of an object's edges.
/// accuracy   0.02 px of the edges' images: exact for straight ones, others are halved until they are as
///            straight. The image of a pole of a panorama can lie beyond it, within a face
Outline outline_of(const Placement& object, const capture::CameraView& view);

/// Rays of all pixels' centres, in the world.
class PixelRays {
 public:
  explicit PixelRays(const capture::CameraView& view);

  int width_px() const { return width_px_; }
  int height_px() const { return height_px_; }
  /// NaN where no ray comes in.
  const Eigen::Vector3d& direction_world(int x, int y) const {
    return directions_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_px_) +
                       static_cast<std::size_t>(x)];
  }
  Eigen::Vector3d origin_world(int x, int y) const;
  /// When it comes in, counted from the frame's time.
  double offset_s(int x, int y) const {
    return view_.offset_of_line_s(capture::pixel_center(x, y));
  }

 private:
  const capture::CameraView& view_;
  int width_px_;
  int height_px_;
  std::vector<Eigen::Vector3d> directions_;
};

/// Which pixels of an image would show an object that stood alone: those whose rays meet it.
struct OwnPixels {
  std::int64_t count = 0;
  /// Around their centres; nothing where there are none.
  double left = 0.0, top = 0.0, right = -1.0, bottom = -1.0;
};
/// outline       of outline_of()
/// is_shown(x, y)   pixels that show it are not asked again
template <class IsShown>
OwnPixels own_pixels(const Placement& object, const PixelRays& rays, const Outline& outline,
                     const IsShown& is_shown);

/// The share of an object's solid angle, seen alone from the camera, that lies outside the image or where
/// no ray comes in. Where rays start at many places no angle counts, but the area that it would have in an image
/// that went on; of an object that reaches behind where they start, the share of its vertices.
/// accuracy   1/128 of its height or width, by 128 x 128 rays and more over it; of an object too thin for
///            them the share of its vertices
double truncation_of(const Placement& object, const capture::CameraView& view,
                     const Outline& outline);

/// A ray of the world in the frame of an object's shape.
struct ShapeRay {
  Eigen::Vector3d origin;
  Eigen::Vector3d direction;

  ShapeRay(const world::InstanceFrame& frame, const Eigen::Vector3d& origin_world,
           const Eigen::Vector3d& direction_world) {
    const Eigen::Quaterniond shape_from_world = frame.world_from_prototype.conjugate();
    origin = (1.0 / frame.scale) * (shape_from_world * (origin_world - frame.place_world));
    direction = (1.0 / frame.scale) * (shape_from_world * direction_world);
  }
};

/// Whether a ray meets an object that stands alone.
inline bool is_met(const Placement& object, double offset_s, const Eigen::Vector3d& origin_world,
                   const Eigen::Vector3d& direction_world) {
  return std::any_of(object.parts.begin(), object.parts.end(), [&](const PlacedPart& part) {
    const ShapeRay ray(part.frame_at(offset_s), origin_world, direction_world);
    return part.shape->is_met(ray.origin, ray.direction);
  });
}

template <class IsShown>
OwnPixels own_pixels(const Placement& object, const PixelRays& rays, const Outline& outline,
                     const IsShown& is_shown) {
  const auto first = [](double edge_px, int size_px) {
    return static_cast<int>(std::clamp(std::floor(edge_px - 1.0), 0.0, double(size_px)));
  };
  const auto end = [](double edge_px, int size_px) {
    return static_cast<int>(std::clamp(std::ceil(edge_px + 1.0), 0.0, double(size_px)));
  };
  const capture::ImageBox& box = outline.box_px;
  const int x_begin = first(box.left, rays.width_px());
  const int x_end = end(box.right, rays.width_px());
  // What goes all the way across a panorama may hold a pole.
  const bool is_all_across = x_begin == 0 && x_end == rays.width_px();
  const int y_begin = is_all_across ? 0 : first(box.top, rays.height_px());
  const int y_end = is_all_across ? rays.height_px() : end(box.bottom, rays.height_px());
  OwnPixels own;
  for (int y = y_begin; y < y_end; ++y) {
    for (int x = x_begin; x < x_end; ++x) {
      if (!is_shown(x, y)) {
        const Eigen::Vector3d& direction_world = rays.direction_world(x, y);
        if (!direction_world.allFinite()) continue;
        if (!is_met(object, rays.offset_s(x, y), rays.origin_world(x, y), direction_world))
          continue;
      }
      const Eigen::Vector2d center = capture::pixel_center(x, y);
      if (own.count == 0) {
        own.left = own.right = center.x();
        own.top = own.bottom = center.y();
      }
      ++own.count;
      own.left = std::min(own.left, center.x());
      own.right = std::max(own.right, center.x());
      own.bottom = center.y();
    }
  }
  return own;
}

}  // namespace terracast::labels
