#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

#include "tiler/gradient_noise.h"
#include "tiler/vegetation/finishes.h"
#include "tiler/vegetation/species.h"

// A block as it breaks from a face and weathers: a body cut by random joint planes (most in three
// sets, as joints are), its edges rounded, roughened by noise; a third of it is in the ground.
namespace terracast::tiler {
namespace {

using Eigen::Vector3d;

struct Joint {
  Vector3d normal;
  double distance_m;
};

Plant grow(std::uint64_t seed) {
  Draws draws(seed);
  std::vector<Joint> joints;
  const Vector3d first = draws.direction();
  const Vector3d second = (across(first) + 0.3 * draws.direction()).normalized();
  const Vector3d third = (first.cross(second) + 0.3 * draws.direction()).normalized();
  for (const Vector3d& set : {first, second, third})
    for (const double side : {-1.0, 1.0})
      joints.push_back(
          {(side * set + 0.12 * draws.direction()).normalized(), draws.between(0.5, 0.85)});
  for (int i = 0; i < 7; ++i) joints.push_back({draws.direction(), draws.between(0.72, 0.95)});
  const Vector3d stretch(draws.between(0.95, 1.3), draws.between(0.8, 1.0),
                         draws.between(0.62, 0.85));
  const GradientNoise noise(draws.direction().x() < 0.0 ? seed : ~seed, 0);
  Plant boulder;
  boulder.finishes = {
      plant_finish(world::Material::Boulder, core::SemanticClass::Stone, {132, 127, 119})};
  boulder.stone_center_m = {0.0, 0.0, 0.22};
  boulder.stone_reach_m = [joints, stretch, noise](const Vector3d& direction) {
    // Smooth minimum of the distances to the planes: edges are rounded.
    double sum = 0.0;
    for (const Joint& joint : joints) {
      const double cosine = direction.dot(joint.normal);
      if (cosine > 0.05) sum += std::pow(cosine / joint.distance_m, 14.0);
    }
    double reach_m = std::min(std::pow(std::max(sum, 1e-9), -1.0 / 14.0), 1.1);
    reach_m *= direction.cwiseProduct(stretch).norm();
    const double rough = noise(3.1 * direction.x() + 7.3 * direction.z(),
                               3.3 * direction.y() - 2.9 * direction.z()) +
                         0.5 * noise(8.7 * direction.x() - 4.1 * direction.z(),
                                     8.3 * direction.y() + 5.7 * direction.z());
    return reach_m * (1.0 + 0.07 * rough);
  };
  return boulder;
}

}  // namespace

SpeciesInfo boulder_species() {
  return {
      "boulder", "Weathered block of rock.", 5, {{-2, 1280}, {-1, 320}, {0, 80}, {3, 20}}, grow};
}

}  // namespace terracast::tiler
