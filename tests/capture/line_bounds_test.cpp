#include "capture/line_bounds.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "core/random.h"

/// Flow between images of rolling shutters, and the poses of their lines, against 113-bit arithmetic.
namespace terracast::capture {
namespace {

__extension__ typedef __float128 Real;
using Vector = std::array<Real, 3>;
/// w x y z.
using Quaternion = std::array<Real, 4>;

Vector real(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }
Quaternion real(const Eigen::Quaterniond& q) { return {q.w(), q.x(), q.y(), q.z()}; }
Vector operator+(const Vector& a, const Vector& b) {
  return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}
Vector operator-(const Vector& a, const Vector& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
Vector operator*(Real s, const Vector& v) { return {s * v[0], s * v[1], s * v[2]}; }
Quaternion operator*(const Quaternion& a, const Quaternion& b) {
  return {a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
          a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
          a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
          a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]};
}
/// q v q^-1.
Vector turned(const Quaternion& q, const Vector& v) {
  const Quaternion back{q[0], -q[1], -q[2], -q[3]};
  const Quaternion r = q * Quaternion{0, v[0], v[1], v[2]} * back;
  const Real square = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
  return {r[1] / square, r[2] / square, r[3] / square};
}
Vector turned_back(const Quaternion& q, const Vector& v) {
  return turned({q[0], -q[1], -q[2], -q[3]}, v);
}
double magnitude(Real value) { return std::abs(static_cast<double>(value)); }
/// Newton's steps from the double's root.
Real root(Real value) {
  Real result = std::sqrt(static_cast<double>(value));
  for (int i = 0; i < 3; ++i) result = (result + value / result) / 2;
  return result;
}

struct ExactPose {
  Quaternion rotation;
  Vector translation;
};

/// exp(w t / 2) as a quaternion, by the series of sine and cosine.
Quaternion turn_of(const Vector& w, Real t) {
  const Vector half = (t / 2) * w;
  const Real square = half[0] * half[0] + half[1] * half[1] + half[2] * half[2];
  Real cosine = 0, share = 0, term = 1;
  for (int n = 0; n < 40; ++n) {
    cosine += term;
    share += term / (2 * n + 1);
    term *= -square / ((2 * n + 1) * (2 * n + 2));
  }
  return {cosine, share * half[0], share * half[1], share * half[2]};
}

/// Terms of a motion, from a power of the time on; beyond the reach along their tangent.
template <std::size_t kCount>
Vector sum_of(const std::array<Eigen::Vector3d, kCount>& terms, int first, Real t, Real reach_s) {
  const Real inside = t > reach_s ? reach_s : t < -reach_s ? -reach_s : t;
  Vector sum{0, 0, 0};
  Real before = 1;  // the power below
  for (int i = 1; i < first; ++i) before = before * inside;
  for (std::size_t k = 0; k < kCount; ++k) {
    const Real slope = static_cast<Real>(first + static_cast<int>(k)) * before;
    before = before * inside;
    sum = sum + (before + (t - inside) * slope) * real(terms[k]);
  }
  return sum;
}

ExactPose exact_pose(const geo::CameraMotion& motion, Real t) {
  const geo::MotionTerms& terms = motion.state.terms;
  const Vector spin = real(terms.spin_body_radps);
  const Vector uniform = real(motion.state.angular_velocity_body_radps) + Real(-1) * spin;
  const Quaternion body =
      real(motion.state.world_from_body.rotation) *
      turn_of(t * uniform + sum_of(terms.turning_body, 2, t, terms.reach_s), 1) * turn_of(spin, t);
  const Vector place = real(motion.state.world_from_body.translation) +
                       t * real(motion.state.velocity_world_mps) +
                       (t * t / 2) * real(motion.state.acceleration_world_mps2) +
                       sum_of(terms.position_world, 3, t, terms.reach_s);
  return {body * real(motion.body_from_camera.rotation),
          place + turned(body, real(motion.body_from_camera.translation))};
}

Real exact_offset(const geo::Shutter& shutter, Real u, Real v, int width, int height) {
  const Real along = shutter.has_columns() ? u - Real(width) / 2 : v - Real(height) / 2;
  const bool is_backward =
      shutter.readout == geo::Readout::Up || shutter.readout == geo::Readout::Left;
  return (is_backward ? -Real(shutter.line_time_s) : Real(shutter.line_time_s)) * along;
}

constexpr int kWidth = 640, kHeight = 480;
constexpr double kFocal_px = 411.0, kCx_px = 320.3, kCy_px = 239.1;

/// Two frames of a fast turn somewhere in the world.
struct Flight {
  geo::BodyState from, to;
  geo::Rigid3d mount;
  geo::Shutter shutter;
};
Flight draw_flight(std::uint64_t number) {
  std::uint64_t draw = 0;
  const auto between = [&](double low, double high) {
    return core::random_between(low, high, 78, number, draw++);
  };
  const auto vector = [&](double size) {
    return Eigen::Vector3d(between(-size, size), between(-size, size), between(-size, size));
  };
  const auto rotation = [&](double size) {
    const Eigen::Vector3d turn = vector(size);
    return Eigen::Quaterniond(Eigen::AngleAxisd(turn.norm(), turn.normalized()));
  };
  Flight flight;
  const auto set = [&](geo::BodyState& state) {
    state.velocity_world_mps = vector(40.0);
    state.acceleration_world_mps2 = vector(8.0);
    state.angular_velocity_body_radps = vector(0.8);
    // Of every second flight: each term counts as much as a jerk of 50 m/s^3 and an angular acceleration of 20 rad/s^2.
    if (number % 2 == 0) return;
    state.terms.reach_s = 0.025;
    for (int k = 0; k < 3; ++k)
      state.terms.position_world[static_cast<std::size_t>(k)] = vector(10.0 * std::pow(0.025, -k));
    for (int k = 0; k < 4; ++k)
      state.terms.turning_body[static_cast<std::size_t>(k)] = vector(10.0 * std::pow(0.025, -k));
  };
  set(flight.from);
  set(flight.to);
  flight.from.world_from_body.rotation = rotation(1.5).normalized();
  flight.from.world_from_body.translation = vector(25e3);
  flight.to.world_from_body.rotation =
      (flight.from.world_from_body.rotation * rotation(0.05)).normalized();
  flight.to.world_from_body.translation = flight.from.world_from_body.translation + vector(3.0);
  flight.mount = {rotation(1.5).normalized(), vector(0.7)};
  flight.shutter = {.line_time_s = between(1e-5, 1e-4),
                    .readout = static_cast<geo::Readout>(number % 4)};
  return flight;
}

/// scale   pixels by the tangent, or of a metre where rays are parallel
void check_flow_and_poses(const char* model_name, double scale) {
  const bool is_parallel = std::string(model_name) == "orthographic";
  // What is far sweeps past parallel rays as the camera turns: slower than lines do.
  const double farthest_m = is_parallel ? 300.0 : 3000.0;
  const std::uint64_t num_flights = is_parallel ? 100 : 400;
  const auto model = geo::make_camera({.model = model_name,
                                       .width_px = kWidth,
                                       .height_px = kHeight,
                                       .parameters = {scale, scale, kCx_px, kCy_px}});
  double largest_error_px = 0.0, largest_bound_px = 0.0;
  double largest_turn = 0.0, largest_turn_bound = 0.0;
  int num_flows = 0;
  for (std::uint64_t number = 0; number < num_flights; ++number) {
    const Flight flight = draw_flight(number);
    const auto view_of = [&](const geo::BodyState& state) {
      return CameraView{.model = *model,
                        .world_from_camera = state.world_from_body * flight.mount,
                        .motion = geo::CameraMotion{state, flight.mount, flight.shutter}};
    };
    const CameraView from = view_of(flight.from), to = view_of(flight.to);
    for (std::uint64_t i = 0; i < 24; ++i) {
      const auto between = [&](double low, double high, std::uint64_t which) {
        return core::random_between(low, high, 79, number, 8 * i + which);
      };
      const Eigen::Vector2d pixel(std::floor(between(0.0, kWidth, 0)) + 0.5,
                                  std::floor(between(0.0, kHeight, 1)) + 0.5);
      // A range as it is kept, of a point exactly there.
      const auto range_m = static_cast<double>(
          static_cast<float>(std::exp(between(std::log(30.0), std::log(farthest_m), 2))));
      const LineBounds bounds(from, pixel);

      const Real t_from = exact_offset(flight.shutter, pixel.x(), pixel.y(), kWidth, kHeight);
      const ExactPose line = exact_pose(*from.motion, t_from);
      const double offset_s = flight.shutter.offset_s(pixel, kWidth, kHeight);
      const geo::Rigid3d line_double = from.motion->world_from_camera(offset_s);
      const PoseError pose_error = line_pose_error(*from.motion, offset_s);
      for (std::size_t k = 0; k < 3; ++k)
        EXPECT_LE(
            magnitude(Real(line_double.translation[static_cast<int>(k)]) - line.translation[k]),
            pose_error.position_m);
      const Vector forward = turned(line.rotation, {0, 0, 1});
      const Vector forward_double = turned(real(line_double.rotation), {0, 0, 1});
      const Vector off = forward - forward_double;
      const double turn = magnitude(root(off[0] * off[0] + off[1] * off[1] + off[2] * off[2]));
      EXPECT_LE(turn, pose_error.angle_rad);
      largest_turn = std::max(largest_turn, turn);
      largest_turn_bound = std::max(largest_turn_bound, pose_error.angle_rad);

      const auto bound = bounds.flow_error_px(to, range_m, 0.0);
      const auto flow = capture::flow(from, to, pixel, range_m);
      if (!bound || !flow) continue;
      const Real x = (Real(pixel.x()) - kCx_px) / scale, y = (Real(pixel.y()) - kCy_px) / scale;
      const Real length = is_parallel ? Real(1) : root(x * x + y * y + 1);
      const Vector way =
          is_parallel ? Vector{x, y, range_m} : (Real(range_m) / length) * Vector{x, y, 1};
      const Vector point = line.translation + turned(line.rotation, way);
      // Lines pass many times faster than the point: every turn of the fixed point gains a factor.
      Real t = 0, u = 0, v = 0;
      for (int turns = 0; turns < 60; ++turns) {
        const ExactPose there = exact_pose(*to.motion, t);
        const Vector p = turned_back(there.rotation, point - there.translation);
        u = scale * (is_parallel ? p[0] : p[0] / p[2]) + kCx_px;
        v = scale * (is_parallel ? p[1] : p[1] / p[2]) + kCy_px;
        t = exact_offset(flight.shutter, u, v, kWidth, kHeight);
      }
      const double error_px =
          std::hypot(magnitude(u - pixel.x() - flow->x()), magnitude(v - pixel.y() - flow->y()));
      EXPECT_LE(error_px, bound->arithmetic) << "flight " << number << ", pixel " << pixel;
      largest_error_px = std::max(largest_error_px, error_px);
      largest_bound_px = std::max(largest_bound_px, bound->arithmetic);
      ++num_flows;
    }
  }
  EXPECT_GT(num_flows, 5 * static_cast<int>(num_flights));
  EXPECT_LE(largest_bound_px, 100.0 * largest_error_px);
  EXPECT_LE(largest_turn_bound, 100.0 * largest_turn);
}

TEST(LineBounds, OfFlowAndPosesAreNeverBelowTheErrorNorFarAboveIt) {
  check_flow_and_poses("pinhole", kFocal_px);
}

// The same where rays start at many places, up to 80 m from the camera's.
TEST(LineBounds, HoldWhereRaysAreParallel) { check_flow_and_poses("orthographic", 5.0); }

/// A point of something that moves, of global and of rolling shutters.
TEST(LineBounds, OfFlowOfWhatMovesAreNeverBelowTheErrorNorFarAboveIt) {
  const auto model = geo::make_camera({.model = "pinhole",
                                       .width_px = kWidth,
                                       .height_px = kHeight,
                                       .parameters = {kFocal_px, kFocal_px, kCx_px, kCy_px}});
  for (const bool is_rolling : {false, true}) {
    SCOPED_TRACE(is_rolling);
    double largest_error_px = 0.0, largest_bound_px = 0.0;
    int num_flows = 0;
    for (std::uint64_t number = 0; number < 300; ++number) {
      Flight flight = draw_flight(number);
      if (!is_rolling) flight.shutter = {};
      const auto view_of = [&](const geo::BodyState& state) {
        CameraView view{.model = *model, .world_from_camera = state.world_from_body * flight.mount};
        if (is_rolling) view.motion = geo::CameraMotion{state, flight.mount, flight.shutter};
        return view;
      };
      const CameraView from = view_of(flight.from), to = view_of(flight.to);
      for (std::uint64_t i = 0; i < 24; ++i) {
        std::uint64_t draw = 0;
        const auto between = [&](double low, double high) {
          return core::random_between(low, high, 80, number, 64 * i + draw++);
        };
        const auto vector = [&](double size) {
          return Eigen::Vector3d(between(-size, size), between(-size, size), between(-size, size));
        };
        const Eigen::Vector2d pixel(std::floor(between(0.0, kWidth)) + 0.5,
                                    std::floor(between(0.0, kHeight)) + 0.5);
        const auto range_m = static_cast<double>(
            static_cast<float>(std::exp(between(std::log(30.0), std::log(1000.0)))));
        // A body about the point.
        BodyMotion motion;
        motion.from.world_from_body.translation =
            capture::point_world(from, pixel, range_m) + vector(4.0);
        const Eigen::Vector3d axis = vector(1.0);
        motion.from.world_from_body.rotation =
            Eigen::Quaterniond(Eigen::AngleAxisd(between(0.0, 3.0), axis.normalized()))
                .normalized();
        motion.from.velocity_world_mps = vector(30.0);
        motion.from.acceleration_world_mps2 = vector(5.0);
        motion.from.angular_velocity_body_radps = vector(3.0);
        if (number % 2 == 1) {
          motion.from.terms = flight.from.terms;
          motion.from.terms.spin_body_radps = vector(10.0);
          motion.from.angular_velocity_body_radps += motion.from.terms.spin_body_radps;
        }
        motion.to = motion.from;
        motion.to->world_from_body.translation += vector(3.0);
        motion.to->world_from_body.rotation =
            (motion.from.world_from_body.rotation *
             Eigen::Quaterniond(Eigen::AngleAxisd(between(-0.3, 0.3), Eigen::Vector3d::UnitZ())))
                .normalized();

        const auto bound = is_rolling
                               ? LineBounds(from, pixel).flow_error_px(to, range_m, 0.0, &motion)
                               : FlowBounds(from, to).flow_error_px(pixel, range_m, 0.0, motion);
        const auto flow = capture::flow(from, to, motion, pixel, range_m);
        if (!bound || !flow || !std::isfinite(bound->arithmetic)) continue;
        const auto camera_at = [&](const geo::BodyState& state, Real t) {
          if (is_rolling) return exact_pose({state, flight.mount, flight.shutter}, t);
          // The pose that is stored.
          const geo::Rigid3d pose = state.world_from_body * flight.mount;
          return ExactPose{real(pose.rotation), real(pose.translation)};
        };
        const Real t_from = exact_offset(flight.shutter, pixel.x(), pixel.y(), kWidth, kHeight);
        const ExactPose line = camera_at(flight.from, t_from);
        const ExactPose body_then = exact_pose({motion.from, {}, {}}, t_from);
        const Vector ray{(Real(pixel.x()) - kCx_px) / kFocal_px,
                         (Real(pixel.y()) - kCy_px) / kFocal_px, 1};
        const Real length = root(ray[0] * ray[0] + ray[1] * ray[1] + 1);
        const Vector point =
            line.translation + turned(line.rotation, (Real(range_m) / length) * ray);
        const Vector on_body = turned_back(body_then.rotation, point - body_then.translation);
        Real t = 0, u = 0, v = 0;
        for (int turns = 0; turns < 80; ++turns) {
          const ExactPose body = exact_pose({*motion.to, {}, {}}, t);
          const Vector place = body.translation + turned(body.rotation, on_body);
          const ExactPose there = camera_at(flight.to, t);
          const Vector p = turned_back(there.rotation, place - there.translation);
          u = kFocal_px * p[0] / p[2] + kCx_px;
          v = kFocal_px * p[1] / p[2] + kCy_px;
          t = exact_offset(flight.shutter, u, v, kWidth, kHeight);
        }
        const double error_px =
            std::hypot(magnitude(u - pixel.x() - flow->x()), magnitude(v - pixel.y() - flow->y()));
        EXPECT_LE(error_px, bound->arithmetic) << "flight " << number << ", pixel " << pixel;
        largest_error_px = std::max(largest_error_px, error_px);
        largest_bound_px = std::max(largest_bound_px, bound->arithmetic);
        ++num_flows;
      }
    }
    EXPECT_GT(num_flows, 2000);
    EXPECT_LE(largest_bound_px, 100.0 * largest_error_px);
  }
}

}  // namespace
}  // namespace terracast::capture
