#include <cmath>
#include <numbers>

#include "tests/tiler/raster_files.h"
#include "tiler/tile_stage.h"
#include "world/lod.h"
#include "world/ray_query.h"

namespace terracast::test {
namespace {

/// Whether a ray meets the ellipsoid sunk by `depth_m`, by the quadratic of the sphere that it is
/// scaled to.
bool meets_ellipsoid(const geo::WorldFrame& frame, double depth_m,
                     const Eigen::Vector3d& origin_world, const Eigen::Vector3d& direction_world) {
  const double polar_m = geo::kWgs84SemiMajorAxis_m * (1.0 - geo::kWgs84Flattening);
  const Eigen::Array3d radii_m =
      Eigen::Array3d(geo::kWgs84SemiMajorAxis_m, geo::kWgs84SemiMajorAxis_m, polar_m) - depth_m;
  const geo::Rigid3d ecef_from_world = frame.ecef_from_world();
  const Eigen::Vector3d origin = (ecef_from_world * origin_world).array() / radii_m;
  const Eigen::Vector3d direction = (ecef_from_world.rotation * direction_world).array() / radii_m;
  const double b = origin.dot(direction);
  return b < 0.0 && b * b >= direction.squaredNorm() * (origin.squaredNorm() - 1.0);
}

/// Angle below the horizontal at which the ellipsoid begins, by bisection.
double dip_rad(const geo::WorldFrame& frame, double depth_m, const Eigen::Vector3d& origin_world,
               const Eigen::Vector3d& ahead, const Eigen::Vector3d& up) {
  double sky = 0.0;
  double ground = 0.5 * std::numbers::pi;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (sky + ground);
    const Eigen::Vector3d direction = std::cos(middle) * ahead - std::sin(middle) * up;
    (meets_ellipsoid(frame, depth_m, origin_world, direction) ? ground : sky) = middle;
  }
  return ground;
}

TEST(Horizon, NoRayThatMeetsTheEllipsoidIsSky) {
  for (const double bottom_m : {20.0, -400.0}) {  // the second below the ellipsoid, as the Dead Sea
    const ScratchFolder folder;
    tiler::WorldOptions options = world_of("paraboloid", 4096.0);
    options.elevation[0].curvature_per_m = 2e-5;
    options.elevation[0].height_m = bottom_m;
    const auto surface = prepare(options);
    // Where all ground lies below the ellipsoid, that sunk to its bottom; 1 m for its other shape.
    const double depth_m = bottom_m < 0.0 ? 1.0 - bottom_m : 0.0;
    tiler::TilePlan plan;
    plan.detail.finest_spacing_m = 64.0;
    plan.sequences.push_back(
        {{.position_world = {600.0, -400.0, 1500.0}, .pixels_per_radian = 10.0}});
    const core::Log log("tile", core::LogLevel::Off);
    const world::TileStore store = tiler::run_tile_stage(
        *surface, plan, folder.path(), {.log = log, .num_threads = 0, .events_file = {}});
    const Eigen::Vector3d origin = plan.sequences[0].front().position_world;
    const world::RayQuery query(store, world::choose_cut(store, plan.sequences[0], plan.detail),
                                {});
    const Eigen::Vector3d up = surface->frame().up_world(origin);
    const Eigen::Vector3d east = Eigen::Vector3d::UnitY().cross(up).normalized();
    std::vector<world::WorldRay> rays;
    for (int i = 0; i < 360; ++i) {
      const double azimuth = i * std::numbers::pi / 180.0;
      const Eigen::Vector3d ahead = std::sin(azimuth) * east + std::cos(azimuth) * up.cross(east);
      const double dip = dip_rad(surface->frame(), depth_m, origin, ahead, up);
      // From the nadir to 1e-9 rad below the tangent: 0.1 mm at its place.
      for (const double share : {1.0, 0.5, 0.1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-9}) {
        const double angle = dip + share * (0.5 * std::numbers::pi - dip);
        rays.push_back({.origin_world = origin,
                        .direction_world = std::cos(angle) * ahead - std::sin(angle) * up});
      }
    }
    std::vector<world::SurfaceHit> hits(rays.size());
    query.intersect(rays, hits, world::Coherence::Incoherent);
    int num_sky = 0;
    for (const world::SurfaceHit& hit : hits) num_sky += hit.is_sky() ? 1 : 0;
    EXPECT_EQ(num_sky, 0) << "of " << rays.size() << ", bottom at " << bottom_m << " m";
  }
}

}  // namespace
}  // namespace terracast::test
