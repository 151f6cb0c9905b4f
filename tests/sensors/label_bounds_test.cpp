#include "capture/label_bounds.h"

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <mutex>

#include "capture/channel.h"
#include "core/parallel.h"
#include "core/random.h"
#include "tests/support/brute_terrain.h"
#include "tests/support/hills_flight.h"
#include "tests/support/record.h"
#include "tests/support/test_data.h"

namespace terracast::sensors {
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
/// Newton's steps from the double's root: 53 bits become 106, then all.
Real root(Real value) {
  Real result = std::sqrt(static_cast<double>(value));
  for (int i = 0; i < 2; ++i) result = (result + value / result) / 2;
  return result;
}
double magnitude(Real value) { return std::abs(static_cast<double>(value)); }

/// The rotation of a quaternion of any length: q v q^-1.
Vector rotated(const Eigen::Quaterniond& q, const Vector& v) {
  const Vector u = real(q.vec());
  const Real w = q.w();
  const Real square = dot(u, u) + w * w;
  return (1 / square) * ((2 * dot(u, v)) * u + (w * w - dot(u, u)) * v + (2 * w) * cross(u, v));
}

/// A pinhole, orthographic or pushbroom camera at a place, in 113 bits.
class ExactView {
 public:
  explicit ExactView(const capture::CameraView& view)
      : model_(view.model.intrinsics().model),
        parameters_(view.model.intrinsics().parameters),
        pose_(view.world_from_camera) {}

  Vector ray_camera(const Eigen::Vector2d& pixel) const {
    const Vector place = on_plane(pixel);
    return {model_ == "orthographic" ? 0 : place[0], model_ == "pinhole" ? place[1] : 0, 1};
  }
  Vector origin_world(const Eigen::Vector2d& pixel) const {
    const Vector place = on_plane(pixel);
    return center() + rotated(pose_.rotation, {model_ == "orthographic" ? place[0] : 0,
                                               model_ == "pinhole" ? 0 : place[1], 0});
  }
  Vector ray_world(const Eigen::Vector2d& pixel) const {
    return rotated(pose_.rotation, ray_camera(pixel));
  }
  Vector center() const { return real(pose_.translation); }
  std::array<Real, 2> pixel(const Vector& point_world) const {
    const Vector p = rotated(pose_.rotation.conjugate(), point_world - center());
    return {parameters_[0] * (model_ == "orthographic" ? p[0] : p[0] / p[2]) + parameters_[2],
            parameters_[1] * (model_ == "pinhole" ? p[1] / p[2] : p[1]) + parameters_[3]};
  }

 private:
  Vector on_plane(const Eigen::Vector2d& pixel) const {
    return {(Real(pixel.x()) - parameters_[2]) / parameters_[0],
            (Real(pixel.y()) - parameters_[3]) / parameters_[1], 0};
  }

  std::string model_;
  std::vector<double> parameters_;
  geo::Rigid3d pose_;
};

/// The largest errors and bounds of a frame's pixels.
struct Largest {
  double error = 0.0;
  double bound = 0.0;
  std::int64_t num_passed = 0;  ///< pixels whose error is beyond their bound
  void add(double pixel_error, double pixel_bound) {
    error = std::max(error, pixel_error);
    bound = std::max(bound, pixel_bound);
    if (!(pixel_error <= pixel_bound)) ++num_passed;
  }
};

std::int64_t num_rays() {
  const char* text = std::getenv("TERRACAST_EXACT_RAYS");
  return text == nullptr ? 1'000'000 : static_cast<std::int64_t>(std::atof(text));
}

constexpr int kWidth = 320, kHeight = 240;

/// Pairs of places a few metres and degrees apart, anywhere over the world and from a metre to two
/// kilometres above its highest ground.
std::vector<geo::BodyState> scattered_pairs(int num_pairs, double half_size_m) {
  std::vector<geo::BodyState> states;
  for (int i = 0; i < num_pairs; ++i) {
    std::uint64_t draw = 0;
    const auto between = [&](double low, double high) {
      return core::random_between(low, high, 77, static_cast<std::uint64_t>(i), draw++);
    };
    const auto turn = [](double angle, const Eigen::Vector3d& axis) {
      return Eigen::Quaterniond(Eigen::AngleAxisd(angle, axis));
    };
    geo::BodyState state;
    state.world_from_body.translation = {between(-half_size_m, half_size_m),
                                         between(-half_size_m, half_size_m),
                                         200.0 + std::exp(between(0.0, std::log(2000.0)))};
    state.world_from_body.rotation = (turn(between(0.0, 6.28), Eigen::Vector3d::UnitZ()) *
                                      turn(between(-0.1, 1.2), Eigen::Vector3d::UnitY()) *
                                      turn(between(-0.5, 0.5), Eigen::Vector3d::UnitX()))
                                         .normalized();
    states.push_back(state);
    state.world_from_body.translation +=
        Eigen::Vector3d(between(-5.0, 5.0), between(-5.0, 5.0), between(-1.0, 1.0));
    state.world_from_body.rotation =
        (state.world_from_body.rotation * turn(between(-0.1, 0.1), Eigen::Vector3d::UnitZ()) *
         turn(between(-0.1, 0.1), Eigen::Vector3d::UnitY()))
            .normalized();
    states.push_back(state);
  }
  return states;
}

std::vector<capture::TileScale> scales_of(const world::TileStore& store,
                                          const std::vector<world::CutTile>& cut) {
  std::vector<capture::TileScale> scales;
  for (const world::CutTile& leaf : cut) {
    const world::Tile tile = store.load(leaf.id);
    scales.push_back({.spacing_m = leaf.id.spacing_m(),
                      .lowest_z_world = tile.lowest_z_world(),
                      .highest_z_world = tile.highest_z_world()});
  }
  return scales;
}

// Every pixel of frames from scattered places: the triangle that was named (RayExactness shows that it is the
// right one), its plane and the pixel's ray in 113 bits.
std::string check_bounds(const geo::CameraIntrinsics& intrinsics, std::int64_t num_rays) {
  const bool is_pinhole = intrinsics.model == "pinhole";
  const test::ScratchFolder folder;
  const world::TileStore store = test::make_hills(folder / "world");
  const int num_pairs = static_cast<int>((num_rays + kWidth * kHeight - 1) / (kWidth * kHeight));
  render::SequencePlan plan = test::small_plan(2 * num_pairs, kWidth, kHeight);
  plan.states = scattered_pairs(num_pairs, 0.45 * store.manifest().size_m);
  plan.cameras.resize(1);
  plan.cameras[0].intrinsics = intrinsics;
  const test::TracedPlan scene(store, std::move(plan));
  const test::BruteTerrain terrain(store, scene.query.cut());
  const std::vector<capture::TileScale> scales = scales_of(store, scene.query.cut());
  const ViewTable& views = scene.renderer.views();

  std::int64_t num_pixels = 0, num_left_out = 0;
  std::atomic<std::int64_t> num_sky = 0, num_edges = 0, num_grazing = 0;
  double largest_ratio = 0.0;
  std::array<Largest, 4> all;
  static constexpr const char* kNames[] = {"depth", "depth kept", "flow", "flow kept"};
  for (int pair = 0; pair < num_pairs; ++pair) {
    const int frame = 2 * pair;
    const TruthFrame truth = scene.renderer.truth(frame, 0);
    const auto view_of = [&](int at) {
      return capture::CameraView{*views.at(at, 0).model,
                                 scene.plan.states[static_cast<std::size_t>(at)].world_from_body *
                                     scene.plan.cameras[0].body_from_camera()};
    };
    const capture::CameraView from = view_of(frame), to = view_of(frame + 1);
    const capture::DepthBounds depth_bounds(from);
    const capture::FlowBounds flow_bounds(from, to);
    const ExactView exact_from(from), exact_to(to);
    const core::ImageF depth_image = capture::depth_image(from.model, truth.facts.range_m);
    const core::ImageF flow_image = capture::flow_image(from, to, truth.facts.range_m);
    const capture::LabelBounds bounds = capture::bounds_of_labels(
        from, to, std::nullopt, truth.facts, truth.crossing_error, scales);
    std::array<Largest, 4> largest;
    std::mutex mutex;
    core::parallel_for_blocks(kHeight, 8, [&](std::int64_t begin, std::int64_t end) {
      std::array<Largest, 4> mine;
      for (int y = static_cast<int>(begin); y < end; ++y) {
        for (int x = 0; x < kWidth; ++x) {
          if ((truth.facts.flags(x, y) & capture::kEdge) != 0) {
            ++num_edges;
            continue;
          }
          const Eigen::Vector2d pixel = capture::pixel_center(x, y);
          const double range_m = truth.range_m[static_cast<std::size_t>(y * kWidth + x)];
          const Vector ray = exact_from.ray_world(pixel);
          double range_error_m = 0.0;
          const Vector origin = exact_from.origin_world(pixel);
          Vector point = origin;
          if (std::isinf(range_m)) {
            ++num_sky;
            point = exact_to.center() + ray;  // a direction
          } else {
            const std::uint32_t id = truth.facts.primitive_id(x, y);
            const auto corners = terrain.triangle(id >> 17, static_cast<int>(id >> 1 & 0xff),
                                                  static_cast<int>(id >> 9 & 0xff), (id & 1) != 0);
            const Vector normal =
                cross(real(corners[1]) - real(corners[0]), real(corners[2]) - real(corners[0]));
            const Real t = dot(normal, real(corners[0]) - origin) / dot(normal, ray);
            point = point + t * ray;
            const Eigen::Vector3d normal_world(truth.facts.normal_world(x, y, 0),
                                               truth.facts.normal_world(x, y, 1),
                                               truth.facts.normal_world(x, y, 2));
            range_error_m =
                depth_bounds.range_error_m(pixel, range_m, normal_world, scales[id >> 17]);
            const Vector ray_camera = exact_from.ray_camera(pixel);
            const double kept_m = truth.facts.range_m(x, y);
            const capture::LabelError bound =
                depth_bounds.depth_error_m(pixel, kept_m, range_error_m);
            if (std::isinf(range_error_m)) {
              ++num_grazing;
              continue;
            }
            const double depth_m = capture::depth_from_range(from.model, pixel, range_m);
            EXPECT_LE(magnitude(Real(range_m) - t * root(dot(ray_camera, ray_camera))),
                      range_error_m);
            mine[0].add(magnitude(Real(depth_m) - t), bound.arithmetic);
            mine[1].add(magnitude(Real(depth_image(x, y)) - t), bound.arithmetic + bound.rounding);
          }
          const double kept_m = truth.facts.range_m(x, y);
          const auto bound = flow_bounds.flow_error_px(pixel, kept_m, range_error_m);
          const auto flow = capture::flow(from, to, pixel, range_m);
          if (!bound || !flow) continue;
          const auto target = exact_to.pixel(point);
          const auto flow_error = [&](const Eigen::Vector2d& motion) {
            return std::hypot(magnitude(target[0] - pixel.x() - motion.x()),
                              magnitude(target[1] - pixel.y() - motion.y()));
          };
          mine[2].add(flow_error(*flow), bound->arithmetic);
          mine[3].add(flow_error({flow_image(x, y, 0), flow_image(x, y, 1)}),
                      bound->arithmetic + bound->rounding);
        }
      }
      const std::lock_guard lock(mutex);
      for (std::size_t k = 0; k < largest.size(); ++k) {
        largest[k].error = std::max(largest[k].error, mine[k].error);
        largest[k].bound = std::max(largest[k].bound, mine[k].bound);
        largest[k].num_passed += mine[k].num_passed;
      }
    });
    num_pixels += kWidth * kHeight;
    num_left_out += bounds.num_left_out;
    // From ranges as kept, which differ from the traced ones by 2^-24.
    const auto expect_largest = [&](const std::optional<capture::LabelError>& error, double bound) {
      EXPECT_NEAR(error.value_or(capture::LabelError{}).arithmetic, bound, 1e-6 * bound);
    };
    expect_largest(bounds.depth_m, largest[0].bound);
    expect_largest(bounds.flow_next_px, largest[2].bound);
    EXPECT_FALSE(bounds.flow_previous_px);
    for (std::size_t k = 0; k < largest.size(); ++k) {
      EXPECT_EQ(largest[k].num_passed, 0) << kNames[k] << ", frame " << frame;
      if (largest[k].error > 0.0) {
        EXPECT_LE(largest[k].bound, 100.0 * largest[k].error) << kNames[k] << ", frame " << frame;
        largest_ratio = std::max(largest_ratio, largest[k].bound / largest[k].error);
      }
      all[k].error = std::max(all[k].error, largest[k].error);
      all[k].bound = std::max(all[k].bound, largest[k].bound);
    }
  }
  std::string figures = fmt::format(
      "{} rays, {} of sky; left out {} at edges, {} in their triangle's plane; largest error and "
      "bound:",
      num_pixels, num_sky.load(), num_edges.load(), num_grazing.load());
  for (std::size_t k = 0; k < all.size(); ++k)
    figures += fmt::format(" {} {:.2g}, {:.2g};", kNames[k], all[k].error, all[k].bound);
  figures += fmt::format(" bound / error of a frame at most {:.1f}", largest_ratio);
  fmt::print("{}\n", figures);
  EXPECT_EQ(num_left_out, num_edges + num_grazing);
  EXPECT_LE(static_cast<double>(num_left_out), 1e-3 * static_cast<double>(num_pixels));
  // Where rays are parallel all may go to the sky.
  EXPECT_LT(num_sky, num_pixels);
  if (is_pinhole) {
    EXPECT_GT(num_sky, num_pixels / 100);
    EXPECT_LT(num_sky, num_pixels / 2);
  }
  for (const Largest& one : all) EXPECT_GT(one.error, 0.0);
  return figures;
}

TEST(LabelBounds, AreNeverBelowTheErrorAndWithinAHundredTimesOfIt) {
  const std::string figures =
      check_bounds({"pinhole", kWidth, kHeight, {kWidth, kWidth, 160.0, 120.0}}, num_rays());
  test::record("rays", "certified_bounds", "- Certified bounds: " + figures + ".");
}

// The same where rays start at many places, up to 70 m beside the camera's.
TEST(LabelBounds, HoldWhereRaysStartAtManyPlaces) {
  check_bounds({"orthographic", kWidth, kHeight, {3.0, 3.1, 161.3, 118.9}}, num_rays() / 5);
  check_bounds({"pushbroom", kWidth, kHeight, {331.7, 3.0, 161.3, 118.9}}, num_rays() / 5);
}

TEST(LabelBounds, RoundingToFloatIsHalfAStep) {
  for (const double value : {1.0, 1.5, 0.999, 4095.99, 4096.0, 1e-3, 1e-42, 3e38}) {
    const auto near = static_cast<float>(value);
    const double up = std::nextafter(near, std::numeric_limits<float>::infinity());
    const double half_step = (up - static_cast<double>(near)) / 2.0;
    EXPECT_LE(std::abs(static_cast<double>(near) - value), capture::float_rounding(value));
    EXPECT_GE(2.0 * half_step, capture::float_rounding(value)) << value;
  }
  EXPECT_EQ(capture::float_rounding(0.0), 0.0);
}

}  // namespace
}  // namespace terracast::sensors
