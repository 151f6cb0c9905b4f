#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "sensors/drawn_noise.h"
#include "sensors/instrument_errors.h"
#include "sensors/sensor.h"

/// A radar that looks along its x axis through a wide cone and measures the range of its first return: of the nearest
/// surface in the cone, each sample at its own time from its own pose, in a world that moves meanwhile.
namespace terracast::sensors {
namespace {

using core::ErrorKind;
using core::fail;
using Eigen::Vector3d;

/// A cone of directions.
struct Cone {
  Vector3d axis;
  double half_angle_rad;

  /// Of its directions the one nearest to another one.
  Vector3d nearest_to(const Vector3d& direction) const {
    const double along = axis.dot(direction);
    const Vector3d across = direction - along * axis;
    const double size = across.norm();
    if (std::atan2(size, along) <= half_angle_rad) return direction.normalized();
    // Straight back, all of its border is as near.
    const Vector3d side = size > 0.0 ? Vector3d(across / size) : axis.unitOrthogonal();
    return std::cos(half_angle_rad) * axis + std::sin(half_angle_rad) * side;
  }
};

/// The plane of a surface that a ray met, from the ray's origin: normal . point = offset_m.
struct SurfacePlane {
  Vector3d normal;  ///< away from the origin
  double offset_m;

  SurfacePlane(const world::SurfaceHit& hit, const Vector3d& direction)
      : normal(hit.normal_world()), offset_m(hit.t * normal.dot(direction)) {
    if (offset_m >= 0.0) return;
    normal = -normal;
    offset_m = -offset_m;
  }
};

/// Directions in the cone to the nearest points of planes, of the edges of the first with the others, and to its corners
/// with two others.
std::vector<Vector3d> nearest_points(const std::vector<SurfacePlane>& planes, const Cone& cone) {
  constexpr double kParallel = 1e-9;
  std::vector<Vector3d> directions;
  const auto add = [&](const Vector3d& point) {
    // Of a surface that the radar touches the nearest point has no direction.
    if (point.norm() > kParallel) directions.push_back(cone.nearest_to(point));
  };
  for (const SurfacePlane& plane : planes) add(plane.normal);
  const SurfacePlane& first = planes[0];
  for (std::size_t i = 1; i < planes.size(); ++i) {
    const Vector3d along = first.normal.cross(planes[i].normal);
    if (along.norm() < kParallel) continue;
    const Vector3d edge = along.normalized();
    const auto meeting = [&](const Vector3d& normal, double offset_m) -> Vector3d {
      Eigen::Matrix3d rows;
      rows << first.normal.transpose(), planes[i].normal.transpose(), normal.transpose();
      return rows.inverse() * Vector3d(first.offset_m, planes[i].offset_m, offset_m);
    };
    const Vector3d foot = meeting(edge, 0.0);
    add(foot);
    // Where the edge goes through the cone's border: (axis . p)^2 = cos^2 p^2 of p = foot + s edge, square to each other.
    const double cosine2 = std::pow(std::cos(cone.half_angle_rad), 2);
    const double a = std::pow(cone.axis.dot(edge), 2) - cosine2;
    const double half_b = cone.axis.dot(foot) * cone.axis.dot(edge);
    const double c = std::pow(cone.axis.dot(foot), 2) - cosine2 * foot.squaredNorm();
    const double root2 = half_b * half_b - a * c;
    for (const double sign : {-1.0, 1.0})
      if (root2 >= 0.0 && std::abs(a) > kParallel)
        add(foot + (sign * std::sqrt(root2) - half_b) / a * edge);
    for (std::size_t j = i + 1; j < planes.size(); ++j)
      if (std::abs(along.dot(planes[j].normal)) > kParallel)
        add(meeting(planes[j].normal, planes[j].offset_m));
  }
  return directions;
}

class RadarAltimeter : public Sensor {
 public:
  void describe(core::SchemaVisitor& visit) override {
    visit.key("half_angle_deg", half_angle_deg_,
              "Half the angle of the cone that it looks through.", core::between(0.1, 80.0));
    visit.key(
        "num_rays", num_rays_,
        "Rays that look for the nearest surface, evenly over the cone; from what they meet it "
        "is sought on. What is smaller than the gaps between them may be missed.",
        core::between(1.0, 10000.0));
    visit.key("least_range_m", least_range_m_, "What is nearer is passed over.",
              core::between(0.0, 1e5));
    visit.key("most_range_m", most_range_m_,
              "What is farther is not found: its range is +inf, as the sky's.",
              core::between(1e-3, 1e6));
    visit.key("noise_m", noise_m_, "Deviation of an error that each sample has anew, at least.",
              core::between(0.0, 1e4));
    visit.key("noise_share", noise_share_,
              "That deviation as a share of the range, where it is more than noise_m.",
              core::between(0.0, 1.0));
    visit.key("step_m", step_m_, "Step of the ranges that are shown; 0: doubles.",
              core::between(0.0, 1e4));
  }
  void validate() const override {
    if (!(least_range_m_ < most_range_m_))
      fail(ErrorKind::Config,
           "least_range_m = {} is not below most_range_m = {}; take more of the latter",
           least_range_m_, most_range_m_);
  }
  std::unique_ptr<Sensor> clone() const override { return std::make_unique<RadarAltimeter>(*this); }

  std::vector<capture::StreamChannel> channels() const override {
    return {{.name = "range_m", .unit = "m"}, {.name = "true_range_m", .unit = "m"}};
  }

  void measure(const SensorSite& site, std::span<const double> times_s,
               std::span<double> values) const override {
    DrawnNoise noise({.white = 1.0}, site.stream_seed, 1, 0);
    for (std::size_t i = 0; i < times_s.size(); ++i) {
      const double truth_m = first_return_m(site, times_s[i]);
      const double deviation_m = std::max(noise_m_, noise_share_ * truth_m);
      double shown_m = truth_m;
      if (std::isfinite(truth_m))
        shown_m = shown_number(
            truth_m + deviation_m * noise.added_to(0.0, site.tick_at(times_s[i])), step_m_, 0.0);
      values[2 * i] = shown_m;
      values[2 * i + 1] = truth_m;
    }
  }

 private:
  /// So many of the nearest hits are followed along their surfaces.
  static constexpr std::size_t kFollowed = 4;

  double first_return_m(const SensorSite& site, double time_s) const {
    const geo::Rigid3d pose = site.world_from_sensor(time_s);
    const Cone cone{.axis = pose.rotation * Vector3d::UnitX(),
                    .half_angle_rad = half_angle_deg_ * std::numbers::pi / 180.0};
    const scene::SceneAt scene = site.scene.at(time_s);
    std::vector<world::WorldRay> rays;
    for (const Vector3d& direction : directions(pose.rotation, cone.half_angle_rad))
      rays.push_back(ray(pose.translation, direction));
    std::vector<world::SurfaceHit> hits(rays.size());
    const auto trace = [&](std::span<const world::WorldRay> cast,
                           std::span<world::SurfaceHit> found) {
      scene.trace(cast, {}, found, world::Coherence::Incoherent, {}, site.trail);
    };
    trace(rays, hits);
    std::vector<std::size_t> order(rays.size());
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return hits[a].t < hits[b].t; });
    // Rays stand so far apart.
    const double gap_rad =
        std::sqrt(2.0 * std::numbers::pi * (1.0 - std::cos(cone.half_angle_rad)) /
                  static_cast<double>(num_rays_));
    double nearest_m = hits[order[0]].t;
    for (std::size_t i = 0; i < std::min(kFollowed, order.size()); ++i)
      if (!hits[order[i]].is_sky())
        nearest_m =
            std::min(nearest_m, followed_m(rays[order[i]], hits[order[i]], cone, gap_rad, trace));
    return nearest_m;
  }

  /// The least range near a ray's: of each surface that stands around, the nearest point in the cone of its plane, of the
  /// edges in which they meet, and their corners, until none is nearer; then the same from less far around.
  template <class Trace>
  double followed_m(const world::WorldRay& first, const world::SurfaceHit& hit, const Cone& cone,
                    double gap_rad, const Trace& trace) const {
    constexpr int kAround = 6, kMostSteps = 200;
    constexpr double kSmallest_rad = 1e-4;
    Vector3d direction = first.direction_world;
    SurfacePlane here(hit, direction);
    double nearest_m = hit.t;
    double radius_rad = gap_rad;
    for (int step = 0; step < kMostSteps && radius_rad > kSmallest_rad; ++step) {
      std::vector<SurfacePlane> planes{here};
      double next_m = nearest_m;
      const auto look = [&](const std::vector<Vector3d>& directions, bool gathers) {
        std::vector<world::WorldRay> rays;
        for (const Vector3d& to : directions) rays.push_back(ray(first.origin_world, to));
        std::vector<world::SurfaceHit> hits(rays.size());
        trace(rays, hits);
        for (std::size_t i = 0; i < hits.size(); ++i) {
          if (hits[i].is_sky()) continue;
          const SurfacePlane plane(hits[i], directions[i]);
          if (gathers) planes.push_back(plane);
          if (!(hits[i].t < next_m)) continue;
          next_m = hits[i].t;
          here = plane;
          direction = directions[i];
        }
      };
      std::vector<Vector3d> around;
      const Vector3d side = direction.unitOrthogonal(), other = direction.cross(side);
      for (int k = 0; k < kAround; ++k) {
        const double turn = 2.0 * std::numbers::pi * k / kAround;
        around.push_back(cone.nearest_to(
            direction + radius_rad * (std::cos(turn) * side + std::sin(turn) * other)));
      }
      look(around, true);
      look(nearest_points(planes, cone), false);
      if (!(next_m < nearest_m)) radius_rad *= 0.5;
      nearest_m = next_m;
    }
    return nearest_m;
  }

  world::WorldRay ray(const Vector3d& origin_world, const Vector3d& direction_world) const {
    return {.origin_world = origin_world,
            .direction_world = direction_world,
            .t_min = least_range_m_,
            .t_max = most_range_m_};
  }

  /// The axis first, then a spiral whose turns are as far apart as its points: evenly over the cap of the sphere.
  std::vector<Vector3d> directions(const Eigen::Quaterniond& world_from_sensor,
                                   double half_angle_rad) const {
    constexpr double kGoldenAngle_rad = std::numbers::pi * (3.0 - 2.23606797749979);
    std::vector<Vector3d> directions;
    for (std::int64_t i = 0; i < num_rays_; ++i) {
      const double share =
          num_rays_ == 1 ? 0.0 : static_cast<double>(i) / static_cast<double>(num_rays_ - 1);
      const double cosine = 1.0 - share * (1.0 - std::cos(half_angle_rad));
      const double sine = std::sqrt(std::max(0.0, 1.0 - cosine * cosine));
      const double turn = kGoldenAngle_rad * static_cast<double>(i);
      directions.push_back(world_from_sensor *
                           Vector3d(cosine, sine * std::cos(turn), sine * std::sin(turn)));
    }
    return directions;
  }

  double half_angle_deg_ = 20.0;
  std::int64_t num_rays_ = 200;
  double least_range_m_ = 0.1, most_range_m_ = 2000.0;
  double noise_m_ = 0.0, noise_share_ = 0.0, step_m_ = 0.0;
};

}  // namespace

SensorInfo radar_altimeter_sensor() {
  return {.name = "radar_altimeter",
          .summary = "a radar's range to the first surface in a cone",
          .make = [] { return std::unique_ptr<Sensor>(std::make_unique<RadarAltimeter>()); }};
}

}  // namespace terracast::sensors
