#include "tiler/buildings/roof_things.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>

#include "core/random.h"
#include "tiler/buildings/building_draws.h"

namespace terracast::tiler {
namespace {

using core::random_between;
using core::random_unit;
using Eigen::Vector2d;
using Eigen::Vector2i;
using Eigen::Vector3d;

std::array<Vector2i, 4> box_ring(const Vector2d& middle, const Vector2d& along, double length,
                                 double width) {
  const Vector2d u = 0.5 * length * along;
  const Vector2d v = 0.5 * width * Vector2d(-along.y(), along.x());
  const auto at = [&](const Vector2d& place) {
    return Vector2i(place.array().round().cast<int>());
  };
  return {at(middle - u - v), at(middle + u - v), at(middle + u + v), at(middle - u + v)};
}

/// rise = x a + y b + c
std::optional<Vector3d> plane_of(const Roof& roof, const std::vector<int>& face) {
  double largest = 0.0;
  Vector3d best = Vector3d::Zero();
  const auto place = [&](int node) {
    const auto i = static_cast<std::size_t>(node);
    return at_height(roof.points_steps[i], roof.rises_steps[i]);
  };
  for (std::size_t i = 2; i < face.size(); ++i) {
    const Vector3d a = place(face[0]);
    const Vector3d normal = (place(face[i - 1]) - a).cross(place(face[i]) - a);
    if (normal.z() <= largest) continue;
    largest = normal.z();
    best = {-normal.x() / normal.z(), -normal.y() / normal.z(), normal.dot(a) / normal.z()};
  }
  if (largest <= 0.0) return std::nullopt;
  return best;
}

}  // namespace

std::vector<OnRoof> plant_on(const RingsSteps& floor, const BuildingDesign& design,
                             std::uint64_t own, double height, const RoofFinishes& finish_of) {
  const double area = area_m2(floor);
  const double high_m = design.top_m;
  if (area < 60.0 || num_corners(floor) > 80) return {};
  const Rectangle box = rectangle_round(floor.front());
  std::vector<OnRoof> things;
  struct Kind {
    double length_m, width_m, height_m;
    std::uint8_t finish;
  };
  std::vector<Kind> kinds;
  const bool is_hall = design.kind == BuildingKind::Hall;
  if (!is_hall && high_m > 11.0 && area > 130.0) {
    kinds.push_back({4.2, 3.0, 2.7, finish_of(RoofFinish::Wall)});
    if (area > 900.0) kinds.push_back({5.0, 3.2, 2.9, finish_of(RoofFinish::Wall)});
  }
  const double per_m2 = is_hall ? 1.0 / 450.0 : 1.0 / 190.0;
  const int num_small =
      static_cast<int>(std::min(7.0, area * per_m2 + 1.6 * random_unit(own, 0, kNumPlant)));
  for (int i = 0; i < num_small; ++i) {
    const auto k = static_cast<std::uint64_t>(i);
    kinds.push_back({random_between(0.8, 2.4, own, 3 * k, kPlantSize),
                     random_between(0.8, 1.3, own, 3 * k + 1, kPlantSize),
                     random_between(0.6, 1.4, own, 3 * k + 2, kPlantSize),
                     finish_of(RoofFinish::Metal)});
  }
  std::uint64_t attempt = 0;
  for (const Kind& kind : kinds)
    for (int tries = 0; tries < 6; ++tries, ++attempt) {
      const double u = random_between(-0.5, 0.5, own, 2 * attempt, kPlant);
      const double v = random_between(-0.5, 0.5, own, 2 * attempt + 1, kPlant);
      const Vector2d middle = box.middle_steps + u * box.length_steps * box.along +
                              v * box.width_steps * Vector2d(-box.along.y(), box.along.x());
      const double reach = 0.5 * steps(std::hypot(kind.length_m, kind.width_m));
      if (!contains(floor, middle) || distance_to_edges(floor, middle) < reach + steps(0.7))
        continue;
      bool is_free = true;
      for (const OnRoof& other : things) {
        const Vector2d a = 0.5 * (other.ring[0] + other.ring[2]).cast<double>();
        const double other_reach = 0.5 * (other.ring[2] - other.ring[0]).cast<double>().norm();
        is_free = is_free && (a - middle).norm() > reach + other_reach + steps(0.6);
      }
      if (!is_free) continue;
      OnRoof thing;
      thing.ring = box_ring(middle, box.along, steps(kind.length_m), steps(kind.width_m));
      thing.foot_steps.fill(height);
      thing.top_steps.fill(height + steps(kind.height_m));
      thing.finish = kind.finish;
      thing.top_finish = kind.finish;
      things.push_back(thing);
      break;
    }
  return things;
}

std::vector<OnRoof> chimneys_on(const Roof& roof, const RingsSteps& walls,
                                const BuildingDesign& design, std::uint64_t own,
                                double eaves_height, const RoofFinishes& finish_of) {
  const bool has_some = design.kind == BuildingKind::House ||
                        design.kind == BuildingKind::Apartments ||
                        design.kind == BuildingKind::Commercial;
  if (!has_some || area_m2(walls) < 45.0 || roof.faces.empty()) return {};
  const Rectangle box = rectangle_round(walls.front());
  const double highest = roof.highest_steps();
  const int wanted = area_m2(walls) > 260.0 ? 3 : random_unit(own, 0, kChimney) < 0.35 ? 2 : 1;
  std::vector<OnRoof> things;
  for (std::uint64_t attempt = 0; attempt < 24 && static_cast<int>(things.size()) < wanted;
       ++attempt) {
    const double u = random_between(-0.45, 0.45, own, 2 * attempt + 1, kChimney);
    const double v = random_between(-0.45, 0.45, own, 2 * attempt + 2, kChimney);
    const Vector2d middle = box.middle_steps + u * box.length_steps * box.along +
                            v * box.width_steps * Vector2d(-box.along.y(), box.along.x());
    const double length_m = random_between(0.55, 1.1, own, attempt, kChimneyLength);
    OnRoof thing;
    thing.ring = box_ring(middle, box.along, steps(length_m), steps(0.55));
    const std::array<Vector2i, 4> wide =
        box_ring(middle, box.along, steps(length_m + 0.5), steps(1.05));
    for (const auto& face : roof.faces) {
      std::vector<Vector2i> ring;
      for (const int node : face) ring.push_back(roof.points_steps[static_cast<std::size_t>(node)]);
      const RingsSteps area = {ring};
      if (!std::all_of(wide.begin(), wide.end(), [&](const Vector2i& corner) {
            return contains(area, corner.cast<double>());
          }))
        continue;
      const auto plane = plane_of(roof, face);
      if (!plane) break;
      double lowest_foot = 1e18;
      for (std::size_t k = 0; k < 4; ++k) {
        const Vector2d at = thing.ring[k].cast<double>();
        const double rise = plane->x() * at.x() + plane->y() * at.y() + plane->z();
        thing.foot_steps[k] = eaves_height + rise;
        lowest_foot = std::min(lowest_foot, rise);
      }
      if (lowest_foot < 0.45 * highest) break;
      thing.top_steps.fill(eaves_height + highest +
                           steps(random_between(0.35, 0.8, own, attempt, kChimneyHeight)));
      thing.finish = finish_of(RoofFinish::Chimney);
      thing.top_finish = thing.finish;
      const bool is_free = std::all_of(things.begin(), things.end(), [&](const OnRoof& other) {
        return (other.ring[0] - thing.ring[0]).cast<double>().norm() > steps(2.0);
      });
      if (is_free) things.push_back(thing);
      break;
    }
  }
  return things;
}

}  // namespace terracast::tiler
