#include "labels/object_outline.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

namespace terracast::labels {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// How far the image of an edge may lie beside its chord.
constexpr double kStraight_px = 0.02;
/// Edges are halved so often at most: what is left of them lies at a seam or at the domain's end.
constexpr int kMostHalvings = 12;
/// Edges that bend twice may have their middle on the chord.
constexpr int kLeastHalvings = 2;
/// Where the domain ends along an edge is found by so many bisections.
constexpr int kBisections = 48;

/// A point of an edge and where it stands in the image.
struct Seen {
  Vector3d point_shape;
  std::optional<Vector2d> pixel;
};

/// Where a place of a part's shape stands in the image.
std::optional<Vector2d> project(const capture::CameraView& view, const PlacedPart& part,
                                const Vector3d& point_shape) {
  if (part.moving) return capture::project(view, *part.moving, point_shape);
  return capture::project(view, part.frame * point_shape);
}

class EdgeWalk {
 public:
  EdgeWalk(const capture::CameraView& view, const PlacedPart& part, Outline& outline)
      : view_(view), part_(part), outline_(outline) {}

  Seen look_at(const Vector3d& point_shape) {
    Seen seen{point_shape, project(view_, part_, point_shape)};
    if (seen.pixel)
      extend(*seen.pixel);
    else
      outline_.is_whole = false;
    return seen;
  }

  void walk(const Seen& a, const Seen& b, int num_halvings = 0) {
    // A short chord holds no bend that shows, unless a seam lies between.
    if (num_halvings >= kMostHalvings) return find_end(a, b);
    if (a.pixel && b.pixel && (*a.pixel - *b.pixel).squaredNorm() < 1.0) return;
    const Seen middle = look_at(0.5 * (a.point_shape + b.point_shape));
    if (a.pixel && b.pixel && middle.pixel && num_halvings >= kLeastHalvings &&
        is_straight(*a.pixel, *middle.pixel, *b.pixel))
      return;
    if (!a.pixel && !b.pixel && !middle.pixel && num_halvings >= kLeastHalvings) return;
    walk(a, middle, num_halvings + 1);
    walk(middle, b, num_halvings + 1);
  }

 private:
  void extend(const Vector2d& pixel) {
    capture::ImageBox& box = outline_.box_px;
    box.left = std::min(box.left, pixel.x());
    box.right = std::max(box.right, pixel.x());
    box.top = std::min(box.top, pixel.y());
    box.bottom = std::max(box.bottom, pixel.y());
  }

  static bool is_straight(const Vector2d& a, const Vector2d& middle, const Vector2d& b) {
    const Vector2d chord = b - a;
    const Vector2d along = middle - a;
    const double length = chord.norm();
    const double beside = std::abs(chord.x() * along.y() - chord.y() * along.x()) / length;
    const double share = chord.dot(along) / (length * length);
    return beside <= kStraight_px && share >= 0.0 && share <= 1.0;
  }

  /// Where an edge leaves the camera's domain.
  void find_end(const Seen& a, const Seen& b) {
    if (a.pixel.has_value() == b.pixel.has_value()) return;
    Vector3d inside = a.pixel ? a.point_shape : b.point_shape;
    Vector3d outside = a.pixel ? b.point_shape : a.point_shape;
    for (int i = 0; i < kBisections; ++i) {
      const Seen middle = look_at(0.5 * (inside + outside));
      (middle.pixel ? inside : outside) = middle.point_shape;
    }
  }

  const capture::CameraView& view_;
  const PlacedPart& part_;
  Outline& outline_;
};

/// Whether lines of the world are lines of the image.
bool keeps_lines(const capture::CameraView& view) {
  return view.model.intrinsics().model == "pinhole" && !view.motion;
}

/// At the frame's time.
std::vector<Vector3d> vertices_world(const Placement& object) {
  std::vector<Vector3d> vertices;
  for (const PlacedPart& part : object.parts)
    for (const Vector3d& vertex : part.shape->vertices()) vertices.push_back(part.frame * vertex);
  return vertices;
}

/// A place that is met from the camera at the frame's time goes on with what is met there.
Vector3d shape_from_world(const PlacedPart& part, const Vector3d& point_world) {
  return ShapeRay(part.frame, point_world, Vector3d::UnitX()).origin;
}

/// Directions on a grid over a rectangle of a plane at unit distance, each with its solid angle but for a
/// common factor. Rows are shifted against each other, so that edges along the grid's axes cut them at
/// different places.
class DirectionGrid {
 public:
  static constexpr int kSide = 128;

  template <class Visit>
  static void visit(const Eigen::Matrix3d& world_from_plane, const Vector2d& low,
                    const Vector2d& high, const Visit& visit) {
    constexpr double kGolden = 0.6180339887498949;
    const Vector2d step = (high - low) / kSide;
    for (int j = 0; j < kSide; ++j) {
      const double shift = std::fmod(0.5 + j * kGolden, 1.0);
      for (int i = 0; i < kSide; ++i) {
        const Vector3d ray(low.x() + (i + shift) * step.x(), low.y() + (j + 0.5) * step.y(), 1.0);
        visit(Vector3d(world_from_plane * ray), step.prod() / std::pow(ray.squaredNorm(), 1.5));
      }
    }
  }
};

Eigen::Matrix3d frame_toward(const Vector3d& direction) {
  Eigen::Matrix3d frame;
  frame.col(2) = direction.normalized();
  frame.col(0) = frame.col(2).unitOrthogonal();
  frame.col(1) = frame.col(2).cross(frame.col(0));
  return frame;
}

/// Calls visit(direction, weight) all over the directions in which an object may be met.
template <class Visit>
void visit_directions(const std::vector<Vector3d>& vertices, const Vector3d& center_world,
                      const Visit& visit) {
  Eigen::AlignedBox3d bounds;
  for (const Vector3d& vertex : vertices) bounds.extend(vertex - center_world);
  const Eigen::Matrix3d world_from_plane =
      frame_toward(bounds.center().norm() > 0.0 ? Vector3d(bounds.center()) : Vector3d::UnitX());
  Vector2d low = Vector2d::Constant(std::numeric_limits<double>::infinity());
  Vector2d high = -low;
  // Within 60 deg of the axis one plane holds them well.
  constexpr double kWidest = 1.8;
  bool fits_plane = true;
  for (const Vector3d& vertex : vertices) {
    const Vector3d place = world_from_plane.transpose() * (vertex - center_world);
    fits_plane = fits_plane && place.head<2>().norm() < kWidest * place.z();
    if (!fits_plane) break;
    low = low.cwiseMin(place.head<2>() / place.z());
    high = high.cwiseMax(place.head<2>() / place.z());
  }
  if (fits_plane) return DirectionGrid::visit(world_from_plane, low, high, visit);
  for (int axis = 0; axis < 3; ++axis)
    for (const double sign : {1.0, -1.0})
      DirectionGrid::visit(frame_toward(sign * Vector3d::Unit(axis)), Vector2d::Constant(-1.0),
                           Vector2d::Constant(1.0), visit);
}

/// Calls visit(pixel) for image points on a grid over a box, within the image or not.
template <class Visit>
void visit_image(const capture::ImageBox& box, const Visit& visit) {
  constexpr double kGolden = 0.6180339887498949;
  const Vector2d step((box.right - box.left) / DirectionGrid::kSide,
                      (box.bottom - box.top) / DirectionGrid::kSide);
  for (int j = 0; j < DirectionGrid::kSide; ++j) {
    const double shift = std::fmod(0.5 + j * kGolden, 1.0);
    for (int i = 0; i < DirectionGrid::kSide; ++i)
      visit(Vector2d(box.left + (i + shift) * step.x(), box.top + (j + 0.5) * step.y()));
  }
}

}  // namespace

Outline outline_of(const Placement& object, const capture::CameraView& view) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Outline outline{.box_px = {kInfinity, kInfinity, -kInfinity, -kInfinity}};
  for (const PlacedPart& part : object.parts) {
    EdgeWalk walk(view, part, outline);
    std::vector<Seen> seen;
    seen.reserve(part.shape->vertices().size());
    for (const Vector3d& vertex : part.shape->vertices()) seen.push_back(walk.look_at(vertex));
    const bool is_whole = std::all_of(seen.begin(), seen.end(),
                                      [](const Seen& one) { return one.pixel.has_value(); });
    if (keeps_lines(view) && is_whole) continue;
    for (const LoneShape::Edge& edge : part.shape->edges()) walk.walk(seen[edge[0]], seen[edge[1]]);
  }
  return outline;
}

PixelRays::PixelRays(const capture::CameraView& view)
    : view_(view), width_px_(view.model.width_px()), height_px_(view.model.height_px()) {
  directions_.resize(static_cast<std::size_t>(width_px_) * static_cast<std::size_t>(height_px_));
  for (int y = 0; y < height_px_; ++y) {
    for (int x = 0; x < width_px_; ++x) {
      const Vector2d center = capture::pixel_center(x, y);
      directions_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_px_) +
                  static_cast<std::size_t>(x)] =
          view.pose_of_line(center).rotation * view.model.ray_from_pixel(center);
    }
  }
}

Vector3d PixelRays::origin_world(int x, int y) const {
  const Vector2d center = capture::pixel_center(x, y);
  return view_.pose_of_line(center) * view_.model.origin_from_pixel(center);
}

double truncation_of(const Placement& object, const capture::CameraView& view,
                     const Outline& outline) {
  const capture::ImageBox& box = outline.box_px;
  if (outline.is_whole && box.left >= 0.0 && box.top >= 0.0 && box.right <= view.model.width_px() &&
      box.bottom <= view.model.height_px())
    return 0.0;
  const auto is_outside = [&](const PlacedPart& part, const Vector3d& point_shape) {
    const std::optional<Vector2d> pixel = project(view, part, point_shape);
    return !pixel || !view.model.contains(*pixel);
  };
  const std::vector<Vector3d> vertices = vertices_world(object);
  const Vector3d& center_world = view.world_from_camera.translation;
  // What moves while a rolling shutter is open is asked about as far away as it is.
  Eigen::AlignedBox3d bounds;
  for (const Vector3d& vertex : vertices) bounds.extend(vertex);
  constexpr double kLeast_m = 1.0;  // the camera may be in the middle of it
  double all = 0.0;
  double outside = 0.0;
  const auto look = [&](const Vector3d& start_world, const Vector3d& direction_world,
                        double weight) {
    const auto met =
        std::find_if(object.parts.begin(), object.parts.end(), [&](const PlacedPart& part) {
          const ShapeRay ray(part.frame, start_world, direction_world);
          return part.shape->is_met(ray.origin, ray.direction);
        });
    if (met == object.parts.end()) return;
    all += weight;
    const double distance_m =
        view.model.is_central() ? (bounds.center() - start_world).norm()
                                : (bounds.center() - start_world).dot(direction_world.normalized());
    const Vector3d there =
        start_world + std::max(distance_m, kLeast_m) * direction_world.normalized();
    if (is_outside(*met, shape_from_world(*met, there))) outside += weight;
  };
  if (view.model.is_central())
    visit_directions(vertices, center_world, [&](const Vector3d& direction_world, double weight) {
      look(center_world, direction_world, weight);
    });
  else if (outline.is_whole)
    visit_image(box, [&](const Vector2d& pixel) {
      look(view.world_from_camera * view.model.origin_from_pixel(pixel),
           view.world_from_camera.rotation * view.model.ray_from_pixel(pixel), 1.0);
    });
  if (all > 0.0) return outside / all;
  std::int64_t num_outside = 0;
  for (const PlacedPart& part : object.parts)
    num_outside += std::count_if(part.shape->vertices().begin(), part.shape->vertices().end(),
                                 [&](const Vector3d& vertex) { return is_outside(part, vertex); });
  return static_cast<double>(num_outside) / static_cast<double>(vertices.size());
}

}  // namespace terracast::labels
