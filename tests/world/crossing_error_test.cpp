#include "world/crossing_error.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "core/random.h"
#include "world/tile_id.h"
#include "world/triangle_mesh.h"

namespace terracast::world {
namespace {

/// 113 bits.
__extension__ typedef __float128 Real;
using Vector = std::array<Real, 3>;

Vector real(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }
Vector operator+(const Vector& a, const Vector& b) {
  return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}
Vector operator-(const Vector& a, const Vector& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
Vector operator*(Real s, const Vector& v) { return {s * v[0], s * v[1], s * v[2]}; }
Real dot(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Vector cross(const Vector& a, const Vector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

/// The rotation of a quaternion of any length: q v q^-1.
Vector rotated(const Eigen::Quaterniond& q, const Vector& v) {
  const Vector u = real(q.vec());
  const Real w = q.w();
  const Real square = dot(u, u) + w * w;
  return (1 / square) * ((2 * dot(u, v)) * u + (w * w - dot(u, u)) * v + (2 * w) * cross(u, v));
}

enum class Kind { WellShaped, Sliver, Tiny, Large, Grazing, FarFromTheOrigin };
constexpr int kNumKinds = 6;
constexpr const char* kNames[kNumKinds] = {"well shaped", "sliver",  "tiny",
                                           "large",       "grazing", "far from the origin"};

/// A triangle and a ray that is aimed at a point of it.
struct Sample {
  TriangleCorners corners;
  InstanceFrame frame;  ///< of the corners
  Eigen::Vector3d origin_world, direction_world;
};

class Draw {
 public:
  explicit Draw(std::uint64_t sample) : sample_(sample) {}
  double between(double low, double high) {
    return core::random_between(low, high, 4242, sample_, num_drawn_++);
  }
  Eigen::Vector3d in_box(double half) {
    const double x = between(-half, half), y = between(-half, half);
    return {x, y, between(-half, half)};
  }
  Eigen::Vector3d unit() {
    for (;;) {
      const Eigen::Vector3d v = in_box(1.0);
      if (v.norm() > 0.1 && v.norm() <= 1.0) return v.normalized();
    }
  }

 private:
  std::uint64_t sample_, num_drawn_ = 0;
};

Eigen::Vector3i steps_of(const Eigen::Vector3d& point_m) {
  return (point_m / kHeightStep_m).array().round().cast<int>();
}

Sample sample_of(Kind kind, bool is_instance, std::uint64_t index) {
  Draw draw(index);
  const double size_m = kind == Kind::Tiny ? 0.02 : kind == Kind::Large ? 400.0 : 2.0;
  const double from_origin_m = kind == Kind::FarFromTheOrigin ? 3e5 : 2000.0;
  Sample sample;
  const Eigen::Vector3d place_world =
      draw.in_box(from_origin_m) + Eigen::Vector3d::Constant(0.5 * from_origin_m);
  if (is_instance) {
    sample.frame.place_world = steps_of(place_world).cast<double>() * kHeightStep_m;
    sample.frame.world_from_prototype =
        Eigen::Quaterniond(Eigen::AngleAxisd(draw.between(0.0, 6.28), draw.unit())).normalized();
    sample.frame.scale = std::floor(draw.between(1000.0, 16000.0)) / 4096.0;
  }
  const Eigen::Vector3d middle = is_instance ? draw.in_box(10.0) : place_world;
  for (;;) {
    for (Eigen::Vector3i& corner : sample.corners) corner = steps_of(middle + draw.in_box(size_m));
    if (kind == Kind::Sliver)
      sample.corners[2] =
          steps_of(0.3 * sample.corners[0].cast<double>() * kHeightStep_m +
                   0.7 * sample.corners[1].cast<double>() * kHeightStep_m + draw.in_box(0.003));
    const Eigen::Vector3d along = (sample.corners[1] - sample.corners[0]).cast<double>();
    const Eigen::Vector3d across = (sample.corners[2] - sample.corners[0]).cast<double>();
    if (along.cross(across).norm() > 0.0) break;
  }
  double a = draw.between(0.0, 1.0), b = draw.between(0.0, 1.0);
  if (a + b > 1.0) a = 1.0 - a, b = 1.0 - b;
  const Eigen::Vector3d corner = sample.corners[0].cast<double>() * kHeightStep_m;
  const Eigen::Vector3d along = sample.corners[1].cast<double>() * kHeightStep_m - corner;
  const Eigen::Vector3d across = sample.corners[2].cast<double>() * kHeightStep_m - corner;
  const Eigen::Vector3d aim_world = sample.frame * (corner + a * along + b * across);
  Eigen::Vector3d way = draw.unit();
  if (kind == Kind::Grazing) {
    const Eigen::Vector3d normal =
        sample.frame.world_from_prototype * along.cross(across).normalized();
    way = (way - way.dot(normal) * normal).normalized() +
          std::pow(10.0, draw.between(-6.0, -2.0)) * normal;
  }
  const double distance_m = std::exp(draw.between(std::log(0.5), std::log(3000.0)));
  sample.origin_world = aim_world - distance_m * way;
  sample.direction_world = (aim_world - sample.origin_world) / draw.between(0.3, 1.0) / distance_m;
  return sample;
}

/// t of the exact ray and the triangle's plane.
Real exact_t(const Sample& sample) {
  std::array<Vector, 3> corners;
  for (std::size_t k = 0; k < 3; ++k)
    corners[k] =
        real(sample.frame.place_world) +
        Real(sample.frame.scale) * rotated(sample.frame.world_from_prototype,
                                           real(sample.corners[k].cast<double>() * kHeightStep_m));
  const Vector normal = cross(corners[1] - corners[0], corners[2] - corners[0]);
  return dot(normal, corners[0] - real(sample.origin_world)) /
         dot(normal, real(sample.direction_world));
}

// Triangles of a kind have errors of all sizes, by how their rays graze: so each is held against its own bound, and
// of each thousand the one that comes nearest to it.
// As ObjectScene traces them: solids in the world's frame, instances by a ray that is moved into theirs.
void check_kind(Kind kind, bool is_instance) {
  constexpr int kSamples = 17'000, kBatch = 1000;
  const char* name = kNames[static_cast<std::size_t>(kind)];
  int num_crossed = 0, num_unbounded = 0;
  double largest_ratio = 0.0, largest_share = 0.0;
  for (int i = 0; i < kSamples; ++i) {
    const Sample sample =
        sample_of(kind, is_instance,
                  static_cast<std::uint64_t>(i) * 100 + static_cast<std::uint64_t>(kind) * 2 +
                      static_cast<std::uint64_t>(is_instance));
    Eigen::Vector3d origin = sample.origin_world, direction = sample.direction_world;
    RayError error;
    if (is_instance) {
      const double inverse_scale = 1.0 / sample.frame.scale;
      const Eigen::Quaterniond back = sample.frame.world_from_prototype.conjugate();
      origin = inverse_scale * (back * (origin - sample.frame.place_world));
      direction = inverse_scale * (back * direction);
      error = error_of_moved_ray(origin, direction, sample.frame.world_from_prototype);
    }
    TriangleBlock block{};
    block.count = 1;
    block.set(0, sample.corners, 0);
    BlockCrossings crossings;
    cross_block(ShearedRay(origin, direction), block, crossings);
    if (crossings.crossed == 0) continue;
    ++num_crossed;
    const double bound = crossing_error(origin, direction, error, sample.corners);
    if (std::isinf(bound)) {
      ++num_unbounded;
      continue;
    }
    const double off = std::abs(static_cast<double>(Real(crossings.t[0]) - exact_t(sample)));
    ASSERT_LE(off, bound) << name << (is_instance ? ", instance " : ", solid ") << i;
    largest_share = std::max(largest_share, off / bound);
    if (num_crossed % kBatch != 0) continue;
    EXPECT_GT(largest_share, 0.01)
        << name << (is_instance ? ", instances" : ", solids") << " to " << i;
    largest_ratio = std::max(largest_ratio, 1.0 / largest_share);
    largest_share = 0.0;
  }
  fmt::print("{}, {}: {} crossed, {} without a bound; bound / error at most {:.1f}\n", name,
             is_instance ? "instances" : "solids", num_crossed, num_unbounded, largest_ratio);
  EXPECT_GT(num_crossed, 3 * kBatch);
  EXPECT_LE(num_unbounded, num_crossed / 1000);
}

TEST(CrossingError, IsNeverBelowTheErrorAndWithinAHundredTimesOfItForSolids) {
  for (int kind = 0; kind < kNumKinds; ++kind) check_kind(static_cast<Kind>(kind), false);
}

TEST(CrossingError, IsNeverBelowTheErrorAndWithinAHundredTimesOfItForInstances) {
  for (int kind = 0; kind < kNumKinds; ++kind) check_kind(static_cast<Kind>(kind), true);
}

TEST(CrossingError, IsToldOfNoRayInTheTrianglesPlaneNorOfOneBesideIt) {
  const TriangleCorners corners = {Eigen::Vector3i(0, 0, 0), Eigen::Vector3i(1024, 0, 0),
                                   Eigen::Vector3i(0, 1024, 0)};
  EXPECT_TRUE(std::isinf(crossing_error({-5.0, 0.2, 0.0}, {1.0, 0.0, 0.0}, {}, corners)));
  EXPECT_TRUE(
      std::isinf(crossing_error({0.3, 0.3, 5.0}, {0.0, 0.0, -1.0}, {.direction = 2.0}, corners)));
  EXPECT_TRUE(std::isinf(crossing_error({0.3, 0.3, 5.0}, {1e-17, 0.0, 0.0}, {}, corners)));
  EXPECT_LT(crossing_error({0.3, 0.3, 5.0}, {0.0, 0.0, -1.0}, {}, corners), 1e-14);
}

}  // namespace
}  // namespace terracast::world
