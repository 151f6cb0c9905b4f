#include "job/clearance.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/error.h"
#include "core/progress.h"
#include "geo/paths/place.h"
#include "render/checked_plan.h"
#include "world/lod.h"

namespace terracast::job {
namespace {

using core::ErrorKind;
using core::fail;

/// How much farther than the least distance a path must stay to be proved: steps are no shorter than about that.
constexpr double kTolerance_m = 0.005;
/// Far more than the roundings of distances, positions and times of knots.
constexpr double kRounding_m = 1e-4;

/// A polynomial of degree n is nowhere between greater than its greatest value at m of Chebyshev's nodes, m > n, divided by
/// cos(n pi / 2m) (Ehlich and Zeller 1964). Here n is 8.
constexpr int kNodes = 24;
constexpr double kMostOfNodes = 1.1548;

double most_speed_mps(const geo::Trajectory& motion, double begin_s, double end_s) {
  double most_mps = 0.0;
  for (int i = 0; i < kNodes; ++i) {
    const double node = std::cos(std::numbers::pi * (i + 0.5) / kNodes);
    const double time_s = 0.5 * (begin_s + end_s) + 0.5 * (end_s - begin_s) * node;
    most_mps = std::max(most_mps, motion.at(time_s).velocity_world_mps.norm());
  }
  return kMostOfNodes * most_mps;
}

/// "the ground", "the surface of water", "object 17 of the layer trees (vegetation)".
std::string words_of(const world::NearestSurface& surface, const world::WorldManifest& manifest) {
  if (!surface.object)
    return world::is_water(surface.cover) ? "the surface of water" : "the ground";
  const std::size_t row = surface.object->layer;
  const std::string layer = row < manifest.layers.size()
                                ? fmt::format(" of the layer {} ({})", manifest.layers[row].name,
                                              manifest.layers[row].kind)
                                : "";
  return fmt::format("object {}{}", surface.object->instance_id, layer);
}

/// Goes along a path as far as distances let it.
class Proof {
 public:
  Proof(const geo::BodyMotion& motion, double until_s, double least_m, world::SurfaceFinder& finder,
        const world::TileStore& store, const ClearanceProgress& progress)
      : motion_(motion),
        until_s_(until_s),
        least_m_(least_m),
        finder_(finder),
        store_(store),
        progress_(progress),
        frame_(store.manifest().origin) {}

  void run() {
    check_begin();
    double time_s = 0.0;
    std::vector<SpeedBound> pieces =
        speed_bounds(*motion_.trajectory, motion_.start_s, motion_.start_s + until_s_);
    std::size_t piece = 0;
    for (;;) {
      const double distance_m = distance_at(time_s);
      if (distance_m < least_m_ + kTolerance_m) refuse(time_s);
      if (progress_) progress_(time_s);
      if (time_s >= until_s_) return;
      double left_m = distance_m - least_m_ - kRounding_m;
      // Whole pieces first, then a part of one.
      for (; piece < pieces.size(); ++piece) {
        const double end_s = pieces[piece].end_s - motion_.start_s;
        const double needed_m = pieces[piece].most_mps * std::max(end_s - time_s, 0.0);
        if (needed_m > left_m) break;
        left_m -= needed_m;
        time_s = end_s;
      }
      if (piece == pieces.size())
        time_s = until_s_;
      else
        time_s = std::min(time_s + left_m / pieces[piece].most_mps, until_s_);
    }
  }

 private:
  /// The distance to the nearest surface, or the reach where that is farther.
  double distance_at(double time_s) {
    const double reach_m = least_m_ + kReach_m;
    const auto nearest = finder_.find(place_at(time_s), reach_m);
    return nearest ? nearest->distance_m : reach_m;
  }
  Eigen::Vector3d place_at(double time_s) const {
    return motion_.at(time_s).world_from_body.translation;
  }
  std::string place_text(double time_s) const {
    return geo::text_of(frame_.geodetic_from_world(place_at(time_s)));
  }

  void check_begin() {
    const std::optional<double> height_m = finder_.height_above_ground_m(place_at(0.0));
    if (height_m && *height_m < 0.0)
      fail(ErrorKind::Input,
           "the path begins {:.2f} m below the ground or the surface of water ({}); "
           "clearance.min_m is for paths above both",
           -*height_m, place_text(0.0));
  }

  /// Says how near it comes about where it cannot be proved any more.
  [[noreturn]] void refuse(double time_s) {
    constexpr int kMostLooks = 2000;
    constexpr double kStep_m = 0.02, kLeastStep_s = 1e-4;
    double worst_s = time_s, worst_m = distance_at(time_s);
    for (int look = 0; look < kMostLooks && time_s < until_s_; ++look) {
      const double speed_mps = motion_.at(time_s).velocity_world_mps.norm();
      time_s =
          std::min(time_s + std::max(kStep_m / std::max(speed_mps, 1e-3), kLeastStep_s), until_s_);
      const double distance_m = distance_at(time_s);
      if (distance_m < worst_m) {
        worst_m = distance_m;
        worst_s = time_s;
      }
      if (distance_m > least_m_ + kTolerance_m) break;
    }
    const auto nearest = finder_.find(place_at(worst_s), least_m_ + kReach_m);
    const std::string found =
        worst_m < least_m_
            ? fmt::format("{:.3f} m from {} at t = {:.2f} s ({}), nearer than clearance.min_m = {}",
                          worst_m, words_of(*nearest, store_.manifest()), worst_s,
                          place_text(worst_s), least_m_)
            : fmt::format(
                  "{:.3f} m from {} at t = {:.2f} s ({}); to be proved it must be {} mm more than "
                  "clearance.min_m = {}",
                  worst_m, words_of(*nearest, store_.manifest()), worst_s, place_text(worst_s),
                  1e3 * kTolerance_m, least_m_);
    fail(ErrorKind::Input,
         "the path comes to {}; lead it higher or round it, or lower clearance.min_m", found);
  }

  static constexpr double kReach_m = 32.0;  ///< beyond least_m; steps are no longer

  const geo::BodyMotion& motion_;
  double until_s_, least_m_;
  world::SurfaceFinder& finder_;
  const world::TileStore& store_;
  const ClearanceProgress& progress_;
  geo::WorldFrame frame_;
};

}  // namespace

std::vector<SpeedBound> speed_bounds(const geo::Trajectory& motion, double from_s, double until_s) {
  std::vector<SpeedBound> bounds;
  double begin_s = from_s;
  const auto add = [&](double end_s) {
    bounds.push_back({begin_s, end_s, most_speed_mps(motion, begin_s, end_s)});
    begin_s = end_s;
  };
  for (const double knot_s : motion.knots_s())
    if (knot_s > begin_s && knot_s < until_s) add(knot_s);
  if (until_s > begin_s) add(until_s);
  return bounds;
}

void prove_clearance(const geo::BodyMotion& motion, double until_s, double least_m,
                     world::SurfaceFinder& finder, const world::TileStore& store,
                     const ClearanceProgress& progress) {
  TERRACAST_CHECK(motion.trajectory != nullptr && least_m > 0.0, "a clearance of {} m", least_m);
  Proof(motion, until_s, least_m, finder, store, progress).run();
}

void prove_clearance(const render::SequencePlan& plan, double least_m,
                     const world::TileStore& store, const core::Context& context) {
  TERRACAST_CHECK(!plan.states.empty(), "sequence {} without frames", plan.name);
  const double until_s = plan.states.back().time_s;
  world::SurfaceFinder finder(store,
                              world::choose_cut(store, render::viewpoints_of(plan), plan.detail));
  core::Progress progress(context, "frames proved clear",
                          static_cast<std::int64_t>(plan.states.size()));
  std::size_t num_passed = 0;
  prove_clearance(plan.motion, until_s, least_m, finder, store, [&](double time_s) {
    const std::size_t before = num_passed;
    while (num_passed < plan.states.size() && plan.states[num_passed].time_s <= time_s)
      ++num_passed;
    progress.advance(static_cast<std::int64_t>(num_passed - before));
  });
}

}  // namespace terracast::job
