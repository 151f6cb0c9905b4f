#include "validate/oracle/exact_paint.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

namespace terracast::oracle {
namespace {

constexpr double kStep_m = 0x1.0p-10;

Eigen::Vector2d metres(const Eigen::Vector2i& steps) { return steps.cast<double>() * kStep_m; }

double distance_to_segment(const Eigen::Vector2d& p, const Eigen::Vector2d& a,
                           const Eigen::Vector2d& b) {
  const Eigen::Vector2d along = b - a;
  const double share = std::clamp((p - a).dot(along) / along.squaredNorm(), 0.0, 1.0);
  return (p - a - share * along).norm();
}

double distance_to_line(const Eigen::Vector2d& p, const std::vector<Eigen::Vector2i>& points) {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i + 1 < points.size(); ++i)
    least = std::min(least, distance_to_segment(p, metres(points[i]), metres(points[i + 1])));
  return least;
}

struct Within {
  bool is_inside = false;
  double to_border_m = std::numeric_limits<double>::infinity();
};

Within within(const Eigen::Vector2d& p, const world::Area& area) {
  Within result;
  for (const auto& ring : area.rings_steps)
    for (std::size_t i = 0; i < ring.size(); ++i) {
      const Eigen::Vector2d a = metres(ring[i]);
      const Eigen::Vector2d b = metres(ring[(i + 1) % ring.size()]);
      if (a != b) result.to_border_m = std::min(result.to_border_m, distance_to_segment(p, a, b));
      // An edge counts where it passes to the east, from a lower to a higher y or back.
      if ((a.y() > p.y()) != (b.y() > p.y()) &&
          p.x() < a.x() + (p.y() - a.y()) / (b.y() - a.y()) * (b.x() - a.x()))
        result.is_inside = !result.is_inside;
    }
  return result;
}

/// What is drawn over what: the higher.
auto rank(const world::Coating& coating) { return std::tuple(coating.order, coating.feature); }

Box flat_box(const std::vector<Eigen::Vector2i>& points, double margin_m) {
  Box box;
  for (const Eigen::Vector2i& point : points) {
    const Eigen::Vector2d at = metres(point);
    box.grow(Eigen::Vector3d(at.x() - margin_m, at.y() - margin_m, 0.0));
    box.grow(Eigen::Vector3d(at.x() + margin_m, at.y() + margin_m, 0.0));
  }
  return box;
}

}  // namespace

ExactPaint::ExactPaint(const std::vector<world::Strip>& strips,
                       const std::vector<world::Area>& areas)
    : strips_(strips), areas_(areas) {
  std::vector<Box> boxes;
  for (const world::Strip& strip : strips_)
    boxes.push_back(flat_box(strip.points_steps, strip.half_width_steps * kStep_m));
  strip_tree_ = BoxTree(boxes);
  boxes.clear();
  for (const world::Area& area : areas_) {
    Box box;
    for (const auto& ring : area.rings_steps) box.grow(flat_box(ring, 0.0));
    boxes.push_back(box);
  }
  area_tree_ = BoxTree(boxes);
}

Paint ExactPaint::at(const Eigen::Vector2d& place_world) const {
  struct Coat {
    const world::Coating* coating;
    bool is_strip;
    bool is_marked;
  };
  const Coat* best = nullptr;
  std::vector<Coat> coats;
  coats.reserve(16);
  bool is_tie = false;
  // A ray that stands still at the place.
  const BoxRay here({place_world.x(), place_world.y(), 0.0}, Eigen::Vector3d::Zero(), 2.0 * kTie_m);
  strip_tree_.visit(here, 1.0, [&](std::uint32_t i) {
    const world::Strip& strip = strips_[i];
    const double over_m =
        distance_to_line(place_world, strip.points_steps) - strip.half_width_steps * kStep_m;
    is_tie = is_tie || std::abs(over_m) < kTie_m;
    if (over_m <= 0.0)
      coats.push_back({&strip.coating, true, strip.marking != world::Marking::None});
  });
  area_tree_.visit(here, 1.0, [&](std::uint32_t i) {
    const Within found = within(place_world, areas_[i]);
    is_tie = is_tie || found.to_border_m < kTie_m;
    if (found.is_inside) coats.push_back({&areas_[i].coating, false, false});
  });
  for (const Coat& coat : coats)
    if (best == nullptr || std::tuple(rank(*coat.coating), coat.is_strip) >
                               std::tuple(rank(*best->coating), best->is_strip))
      best = &coat;
  if (best == nullptr) return {.is_tie = is_tie};
  bool is_marked = false;
  for (const Coat& coat : coats)
    is_marked = is_marked || (coat.is_marked && rank(*coat.coating) == rank(*best->coating));
  return {.is_painted = true,
          .is_marked = is_marked,
          .semantic_class = static_cast<std::uint8_t>(best->coating->semantic_class),
          .is_tie = is_tie};
}

std::size_t ExactPaint::num_bytes() const {
  std::size_t sum = strip_tree_.num_bytes() + area_tree_.num_bytes();
  for (const world::Strip& strip : strips_)
    sum += sizeof strip + strip.points_steps.size() * sizeof(Eigen::Vector2i);
  for (const world::Area& area : areas_)
    for (const auto& ring : area.rings_steps)
      sum += sizeof area + ring.size() * sizeof(Eigen::Vector2i);
  return sum;
}

}  // namespace terracast::oracle
