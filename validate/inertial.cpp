#include "validate/inertial.h"

#include <algorithm>
#include <cmath>

namespace terracast::validate {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kSemiMajorAxis_m = 6378137.0;
constexpr double kFlattening = 1.0 / 298.257223563;
constexpr double kGm_m3ps2 = 3986004.418e8;
/// Of the normal field; it follows from the ellipsoid, its mass and its turning.
constexpr double kJ2 = 1.082629821313e-3;

Matrix3d cross_matrix(const Vector3d& v) {
  return (Matrix3d() << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0).finished();
}

/// Weights of values at 0, 1, 2, … for that of their polynomial, or of its derivative, at a place.
std::vector<double> weights_at(std::size_t num_nodes, double place, bool is_derivative) {
  std::vector<double> weights(num_nodes, 0.0);
  for (std::size_t i = 0; i < num_nodes; ++i) {
    const auto factor = [&](std::size_t j) {
      return (place - static_cast<double>(j)) / (static_cast<double>(i) - static_cast<double>(j));
    };
    const auto product_without = [&](std::size_t left_out) {
      double product = 1.0;
      for (std::size_t j = 0; j < num_nodes; ++j)
        if (j != i && j != left_out) product *= factor(j);
      return product;
    };
    if (!is_derivative) {
      weights[i] = product_without(i);
      continue;
    }
    for (std::size_t m = 0; m < num_nodes; ++m)
      if (m != i)
        weights[i] += product_without(m) / (static_cast<double>(i) - static_cast<double>(m));
  }
  return weights;
}

}  // namespace

Vector3d normal_gravity_ecef_mps2(const Vector3d& point_ecef) {
  constexpr int kMost = 12;
  const double r = point_ecef.norm(), s = point_ecef.z() / r;
  const double e2 = kFlattening * (2.0 - kFlattening);
  // Legendre's polynomials of the sine of the geocentric latitude, two at a time, and their derivatives.
  double before = 1.0, here = s, slope_before = 0.0, slope = 1.0;
  double radial = -kGm_m3ps2 / (r * r), by_sine = 0.0;
  for (int degree = 2; degree <= kMost; ++degree) {
    const double next = ((2 * degree - 1) * s * here - (degree - 1) * before) / degree;
    const double next_slope = slope_before + (2 * degree - 1) * here;
    before = here;
    here = next;
    slope_before = slope;
    slope = next_slope;
    if (degree % 2 != 0) continue;
    const int n = degree / 2;
    const double j = (n % 2 == 0 ? -3.0 : 3.0) * std::pow(e2, n) / ((degree + 1) * (degree + 3)) *
                     (1.0 - n + 5.0 * n * kJ2 / e2);
    const double scaled = kGm_m3ps2 / r * j * std::pow(kSemiMajorAxis_m / r, degree);
    radial += (degree + 1) * scaled * here / r;
    by_sine -= scaled * slope;
  }
  const Vector3d up = point_ecef / r;
  return radial * up + by_sine / r * (Vector3d::UnitZ() - s * up) +
         kEarthRate_radps * kEarthRate_radps * Vector3d(point_ecef.x(), point_ecef.y(), 0.0);
}

InertialSamples::InertialSamples(std::vector<InertialReading> samples, double rate_hz,
                                 bool is_integrated)
    : samples_(std::move(samples)), rate_hz_(rate_hz), is_integrated_(is_integrated) {
  if (!is_integrated || samples_.empty()) return;
  samples_[0] = {Vector3d::Zero(), Vector3d::Zero()};  // of a time before the first
  for (std::size_t k = 1; k < samples_.size(); ++k) {
    samples_[k].turn_rate_radps =
        samples_[k - 1].turn_rate_radps + samples_[k].turn_rate_radps / rate_hz_;
    samples_[k].force_mps2 = samples_[k - 1].force_mps2 + samples_[k].force_mps2 / rate_hz_;
  }
}

InertialSamples InertialSamples::thinned() const {
  InertialSamples half({}, 0.5 * rate_hz_, is_integrated_);
  for (std::size_t k = 0; k < samples_.size(); k += 2) half.samples_.push_back(samples_[k]);
  return half;
}

InertialSamples InertialSamples::of_lower_order() const {
  InertialSamples other = *this;
  other.num_nodes_ = 4;
  return other;
}

InertialReading InertialSamples::at(double time_s) const {
  const double place = time_s * rate_hz_;
  const auto most = static_cast<double>(samples_.size() - num_nodes_);
  const double first =
      std::clamp(std::floor(place) - 0.5 * static_cast<double>(num_nodes_) + 1.0, 0.0, most);
  const auto weights = weights_at(num_nodes_, place - first, is_integrated_);
  InertialReading reading{Vector3d::Zero(), Vector3d::Zero()};
  for (std::size_t i = 0; i < num_nodes_; ++i) {
    const InertialReading& node = samples_[static_cast<std::size_t>(first) + i];
    const double weight = weights[i] * (is_integrated_ ? rate_hz_ : 1.0);
    reading.turn_rate_radps += weight * node.turn_rate_radps;
    reading.force_mps2 += weight * node.force_mps2;
  }
  return reading;
}

InertialLeg leg_of(const InertialSamples& samples, double from_s, double to_s) {
  const auto num_steps =
      std::max<std::int64_t>(1, std::llround(std::ceil((to_s - from_s) / samples.step_s() - 1e-6)));
  InertialLeg leg{
      .from_s = from_s, .step_s = (to_s - from_s) / static_cast<double>(num_steps), .readings = {}};
  for (std::int64_t k = 0; k <= 2 * num_steps; ++k)
    leg.readings.push_back(samples.at(from_s + 0.5 * static_cast<double>(k) * leg.step_s));
  return leg;
}

InertialState integrate(InertialState state, const InertialLeg& leg) {
  const Vector3d earth(0.0, 0.0, kEarthRate_radps);
  struct Slope {
    Vector3d place, velocity;
    Matrix3d turn;
  };
  const auto slope_of = [&](const InertialState& at, const InertialReading& reading) {
    return Slope{.place = at.velocity_ecef_mps,
                 .velocity = at.ecef_from_sensor * reading.force_mps2 +
                             normal_gravity_ecef_mps2(at.place_ecef) -
                             2.0 * earth.cross(at.velocity_ecef_mps),
                 .turn = at.ecef_from_sensor * cross_matrix(reading.turn_rate_radps) -
                         cross_matrix(earth) * at.ecef_from_sensor};
  };
  const auto moved = [](const InertialState& at, const Slope& slope, double step_s) {
    return InertialState{at.place_ecef + step_s * slope.place,
                         at.velocity_ecef_mps + step_s * slope.velocity,
                         at.ecef_from_sensor + step_s * slope.turn};
  };
  const double step_s = leg.step_s;
  for (std::size_t k = 0; k < leg.num_steps(); ++k) {
    const InertialReading& middle = leg.readings[2 * k + 1];
    const Slope a = slope_of(state, leg.readings[2 * k]);
    const Slope b = slope_of(moved(state, a, 0.5 * step_s), middle);
    const Slope c = slope_of(moved(state, b, 0.5 * step_s), middle);
    const Slope d = slope_of(moved(state, c, step_s), leg.readings[2 * k + 2]);
    state = moved(state,
                  {(a.place + 2.0 * b.place + 2.0 * c.place + d.place) / 6.0,
                   (a.velocity + 2.0 * b.velocity + 2.0 * c.velocity + d.velocity) / 6.0,
                   (a.turn + 2.0 * b.turn + 2.0 * c.turn + d.turn) / 6.0},
                  step_s);
    // The nearest rotation, to second order in how far it is off one.
    state.ecef_from_sensor = 1.5 * state.ecef_from_sensor - 0.5 * state.ecef_from_sensor *
                                                                state.ecef_from_sensor.transpose() *
                                                                state.ecef_from_sensor;
  }
  return state;
}

void InertialDoubt::gather(const InertialLeg& leg, std::span<const InertialSamples> others) {
  const auto apart = [&](std::size_t index) {
    const InertialReading& reading = leg.readings[index];
    Eigen::Vector2d sum(0.0, 0.0);
    for (const InertialSamples& other : others) {
      const InertialReading at =
          other.at(leg.from_s + 0.5 * static_cast<double>(index) * leg.step_s);
      sum += Eigen::Vector2d((reading.turn_rate_radps - at.turn_rate_radps).norm(),
                             (reading.force_mps2 - at.force_mps2).norm());
    }
    return sum;
  };
  Eigen::Vector2d before = apart(0);
  for (std::size_t k = 0; k < leg.num_steps(); ++k) {
    const Eigen::Vector2d after = apart(2 * k + 2);
    const Eigen::Vector2d over = leg.step_s / 6.0 * (before + 4.0 * apart(2 * k + 1) + after);
    before = after;
    turn_rad += over[0];
    // A sensor that is turned by so much is pushed aside by its force.
    speed_mps += over[1] + leg.step_s * leg.readings[2 * k + 1].force_mps2.norm() * turn_rad;
    place_m += leg.step_s * speed_mps;
  }
}

}  // namespace terracast::validate
