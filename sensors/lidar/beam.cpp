#include "sensors/lidar/beam.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>

#include "core/error.h"

namespace terracast::sensors::lidar {
namespace {

/// Nodes of u = 2 r^2 with exp(-u) as weight over u from 0 on: the axis, and a ring each at roots of Laguerre's polynomials
/// of first kind (Gauss and Radau's rule). The weights are those that give 1, u, u^2, … their means 1, 1, 2, ….
std::vector<double> rings_of(int num_rays) {
  if (num_rays == 7) return {2.0};
  if (num_rays == 19) return {3.0 - std::numbers::sqrt3, 3.0 + std::numbers::sqrt3};
  if (num_rays == 37) return {0.93582222752408786, 3.3054072893322786, 7.7587704831436335};
  return {};
}

/// The mean of Lagrange's polynomial that is 1 on a ring, and 0 on the others and on the axis.
double weight_of(const std::vector<double>& rings, std::size_t ring) {
  std::vector<double> coefficients = {0.0, 1.0 / rings[ring]};  // u / u_ring
  for (std::size_t other = 0; other < rings.size(); ++other) {
    if (other == ring) continue;
    const double scale = 1.0 / (rings[ring] - rings[other]);
    std::vector<double> product(coefficients.size() + 1, 0.0);
    for (std::size_t k = 0; k < coefficients.size(); ++k) {
      product[k + 1] += scale * coefficients[k];
      product[k] -= scale * rings[other] * coefficients[k];
    }
    coefficients = std::move(product);
  }
  double mean = 0.0;
  double factorial = 1.0;
  for (std::size_t k = 0; k < coefficients.size(); ++k) {
    if (k > 0) factorial *= static_cast<double>(k);
    mean += factorial * coefficients[k];
  }
  return mean;
}

std::vector<BeamRay> rays_of_beam(int num_rays) {
  const std::vector<double> rings = rings_of(num_rays);
  std::vector<BeamRay> rays = {{.offset = Eigen::Vector2d::Zero(), .weight = 1.0}};
  for (std::size_t ring = 0; ring < rings.size(); ++ring) {
    const auto count = static_cast<int>(6 * (ring + 1));
    const double weight = weight_of(rings, ring);
    rays.front().weight -= weight;
    for (int i = 0; i < count; ++i) {
      const double angle =
          2.0 * std::numbers::pi * (i + 0.5 * static_cast<double>(ring % 2)) / count;
      rays.push_back({.offset = std::sqrt(0.5 * rings[ring]) *
                                Eigen::Vector2d(std::cos(angle), std::sin(angle)),
                      .weight = weight / count});
    }
  }
  return rays;
}

}  // namespace

std::span<const BeamRay> beam_rays(int num_rays) {
  static const std::map<int, std::vector<BeamRay>> made = {
      {1, rays_of_beam(1)}, {7, rays_of_beam(7)}, {19, rays_of_beam(19)}, {37, rays_of_beam(37)}};
  return made.at(num_rays);
}

void BeamOptions::describe(core::SchemaVisitor& visit) {
  visit.key("rays", rays,
            "Rays a pulse: 1 has no width, 7, 19 and 37 stand for a Gaussian beam and find several "
            "returns. The time of rendering grows with them.",
            core::between(1.0, 37.0));
  visit.key("divergence_mrad", divergence_mrad,
            "Full angle of the beam; of an elliptic one from left to right.",
            core::between(0.0, 500.0));
  visit.key("divergence_vertical_mrad", divergence_vertical_mrad,
            "Full angle from top to bottom; 0: as divergence_mrad.", core::between(0.0, 500.0));
  visit.key(
      "divergence_at", divergence_at,
      "Where the angle is measured: to 1/e2 of the power at the axis, or to half of it, which "
      "is 1.699 times less.",
      core::one_of({"1/e2", "half"}));
}

void BeamOptions::validate() const {
  if (rays != 1 && rays != 7 && rays != 19 && rays != 37)
    core::fail(core::ErrorKind::Config, "rays = {}; a beam has 1, 7, 19 or 37", rays);
  if (rays > 1 && divergence_mrad == 0.0)
    core::fail(core::ErrorKind::Config,
               "rays = {} of a beam without divergence_mrad would all be the same; state it, or "
               "take rays = 1",
               rays);
}

void BeamOptions::directions(const Pulse& pulse, double turn_rad,
                             std::vector<Eigen::Vector3d>& into) const {
  into.clear();
  if (rays == 1) {
    into.push_back(pulse.direction);
    return;
  }
  // exp(-8 v^2) at half is v = sqrt(ln 2 / 8), and at 1/e2 1/2.
  const double widened = divergence_at == "half" ? std::sqrt(2.0 / std::numbers::ln2) : 1.0;
  const double vertical_mrad =
      divergence_vertical_mrad > 0.0 ? divergence_vertical_mrad : divergence_mrad;
  const Eigen::Vector2d half_rad =
      0.5e-3 * widened * Eigen::Vector2d(divergence_mrad, vertical_mrad);
  Eigen::Vector3d left = Eigen::Vector3d::UnitZ().cross(pulse.direction);
  left = left.norm() > 1e-6 ? left.normalized() : Eigen::Vector3d::UnitY();
  const Eigen::Vector3d up = pulse.direction.cross(left);
  const Eigen::Rotation2Dd turn(turn_rad);
  for (const BeamRay& ray : beam_rays(static_cast<int>(rays))) {
    const Eigen::Vector2d offset = half_rad.cwiseProduct(turn * ray.offset);
    into.push_back((pulse.direction + offset.x() * left + offset.y() * up).normalized());
  }
}

void separate_returns(std::vector<Echo>& echoes, double gap_m, std::vector<Return>& returns) {
  returns.clear();
  std::sort(echoes.begin(), echoes.end(), [](const Echo& a, const Echo& b) {
    return std::pair(a.range_m, a.ray) < std::pair(b.range_m, b.ray);
  });
  for (auto begin = echoes.begin(); begin != echoes.end();) {
    auto end = begin + 1;
    while (end != echoes.end() && end->range_m - (end - 1)->range_m <= gap_m) ++end;
    Return one;
    double most = -1.0;
    for (auto echo = begin; echo != end; ++echo) {
      one.power += echo->power;
      one.range_m += echo->power * echo->range_m;
      if (echo->power > most) {
        most = echo->power;
        one.ray = echo->ray;
      }
    }
    one.range_m = one.power > 0.0 ? one.range_m / one.power : begin->range_m;
    double variance = 0.0;
    for (auto echo = begin; echo != end; ++echo)
      variance += echo->power * std::pow(echo->range_m - one.range_m, 2.0);
    one.spread_m = one.power > 0.0 ? std::sqrt(variance / one.power) : 0.0;
    // The mean of equal ranges is not rounded away from them.
    if (begin->range_m == (end - 1)->range_m) {
      one.range_m = begin->range_m;
      one.spread_m = 0.0;
    }
    returns.push_back(one);
    begin = end;
  }
}

}  // namespace terracast::sensors::lidar
