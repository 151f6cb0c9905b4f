#include "tiler/objects/model_polygon.h"

#include <Eigen/Geometry>
#include <cstddef>

namespace terracast::tiler {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Triangles = std::vector<std::array<std::uint32_t, 3>>;

/// So often all corners are looked at anew, where corners on one line or crossing edges left no ear.
constexpr int kLooks = 3;

/// Twice the area of a triangle, positive where it turns anticlockwise.
double turn(const Vector2d& a, const Vector2d& b, const Vector2d& c) {
  return (b - a).x() * (c - a).y() - (b - a).y() * (c - a).x();
}

/// The face in its plane (Newell's normal), in which it goes anticlockwise.
std::vector<Vector2d> flat(std::span<const Vector3d> corners) {
  Vector3d normal = Vector3d::Zero();
  for (std::size_t i = 0; i < corners.size(); ++i)
    normal += (corners[i] - corners[0]).cross(corners[(i + 1) % corners.size()] - corners[0]);
  int axis = 0;
  normal.cwiseAbs().maxCoeff(&axis);
  // Seen along the axis that is nearest to its normal; the next two keep the turn.
  const int x = (axis + 1) % 3, y = (axis + 2) % 3;
  const double sign = normal[axis] < 0.0 ? -1.0 : 1.0;
  std::vector<Vector2d> places;
  places.reserve(corners.size());
  for (const Vector3d& corner : corners) places.emplace_back(sign * corner[x], corner[y]);
  return places;
}

class Ears {
 public:
  explicit Ears(std::vector<Vector2d> places) : places_(std::move(places)) {
    const std::size_t size = places_.size();
    for (std::size_t i = 0; i < size; ++i) {
      before_.push_back((i + size - 1) % size);
      after_.push_back((i + 1) % size);
    }
    for (std::size_t i = 0; i < size; ++i) is_reflex_.push_back(!is_convex(i));
    is_ear_.assign(size, false);
  }

  bool has_reflex() const {
    for (const bool reflex : is_reflex_)
      if (reflex) return true;
    return false;
  }

  Triangles cut() {
    Triangles triangles;
    std::size_t left = places_.size(), at = 0;
    for (int look = 0; look < kLooks && left > 3; ++look) {
      find_ears(at);
      for (std::size_t misses = 0; left > 3 && misses < left;) {
        if (!is_ear_[at]) {
          at = after_[at];
          ++misses;
          continue;
        }
        misses = 0;
        triangles.push_back(triangle(at));
        at = without(at);
        --left;
      }
    }
    for (; left >= 3; --left) {
      const std::size_t middle = after_[at];
      triangles.push_back(triangle(middle));
      without(middle);
    }
    return triangles;
  }

 private:
  std::array<std::uint32_t, 3> triangle(std::size_t i) const {
    return {static_cast<std::uint32_t>(before_[i]), static_cast<std::uint32_t>(i),
            static_cast<std::uint32_t>(after_[i])};
  }
  /// Takes a corner out. Returns the next one but one, lest all triangles meet in a corner.
  std::size_t without(std::size_t i) {
    const std::size_t before = before_[i], after = after_[i];
    after_[before] = after;
    before_[after] = before;
    for (const std::size_t next : {before, after}) is_reflex_[next] = !is_convex(next);
    // What lies in other corners' triangles has not changed.
    for (const std::size_t next : {before, after}) is_ear_[next] = is_ear(next);
    return after_[after];
  }
  void find_ears(std::size_t first) {
    std::size_t i = first;
    do {
      is_ear_[i] = is_ear(i);
      i = after_[i];
    } while (i != first);
  }
  bool is_convex(std::size_t i) const {
    return turn(places_[before_[i]], places_[i], places_[after_[i]]) > 0.0;
  }
  /// No reflex corner lies in its triangle; one at a corner's own place does not count.
  bool is_ear(std::size_t i) const {
    if (is_reflex_[i]) return false;
    const Vector2d &a = places_[before_[i]], &b = places_[i], &c = places_[after_[i]];
    for (std::size_t k = after_[after_[i]]; k != before_[i]; k = after_[k]) {
      if (!is_reflex_[k]) continue;
      const Vector2d& at = places_[k];
      if (at == a || at == b || at == c) continue;
      if (turn(a, b, at) >= 0.0 && turn(b, c, at) >= 0.0 && turn(c, a, at) >= 0.0) return false;
    }
    return true;
  }

  std::vector<Vector2d> places_;
  std::vector<std::size_t> before_, after_;
  std::vector<bool> is_reflex_, is_ear_;
};

Triangles fan(std::size_t size) {
  Triangles triangles;
  for (std::uint32_t i = 2; i < size; ++i) triangles.push_back({0, i - 1, i});
  return triangles;
}

}  // namespace

Triangles triangles_of_face(std::span<const Vector3d> corners) {
  if (corners.size() <= 3) return fan(corners.size());
  Ears ears(flat(corners));
  return ears.has_reflex() ? ears.cut() : fan(corners.size());
}

}  // namespace terracast::tiler
