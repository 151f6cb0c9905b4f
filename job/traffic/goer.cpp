#include "job/traffic/goer.h"

#include <algorithm>
#include <cmath>

#include "job/traffic/traffic.h"
#include "tiler/objects/gait.h"

namespace terracast::job {

using Eigen::Vector3d;

Goer::Goer(std::uint64_t key, const TrafficOptions& options, const Body& body, PathCurve curve,
           const DriveStyle& style, double start_m)
    : key_(key),
      options_(&options),
      body_(body),
      curve_(std::move(curve)),
      drive_(curve_, style),
      start_m_(start_m),
      start_s_(drive_.time_s(start_m)) {}

Footprint Goer::at(double time_s) const {
  const PathCurve::Place place = curve_.at(drive_.at(start_s_ + time_s).at_m);
  const Vector3d& size_m = body_.thing->size_m;
  return {.at_world = place.at_world,
          .forward = place.tangent,
          .length_m = options_->is_of_people() ? tiler::kStepReach * size_m.z() : size_m.x(),
          .width_m = body_.thing->size_m.y(),
          .deck_z_world = place.deck_z_world,
          .is_deck_end = place.is_deck_end};
}

double Goer::headway_s() const { return options_->is_of_people() ? 0.0 : kLeastGap_s; }

geo::BodyState Goer::state(double time_s) const {
  const Drive::Progress progress = drive_.at(start_s_ + time_s);
  const PathCurve::Place place = curve_.at(progress.at_m);
  const Vector3d forward(place.tangent.x(), place.tangent.y(), 0.0);
  const Vector3d left(-forward.y(), forward.x(), 0.0);
  geo::BodyState state;
  state.time_s = time_s;
  state.world_from_body.translation << place.at_world,
      std::isfinite(place.deck_z_world) ? place.deck_z_world : kNoDeck_m;
  state.world_from_body.rotation =
      Eigen::AngleAxisd(std::atan2(forward.y(), forward.x()), Vector3d::UnitZ());
  state.velocity_world_mps = progress.speed_mps * forward;
  state.acceleration_world_mps2 =
      progress.acceleration_mps2 * forward +
      progress.speed_mps * progress.speed_mps * place.curvature_per_m * left;
  state.angular_velocity_body_radps.z() = progress.speed_mps * place.curvature_per_m;
  return state;
}

double Goer::pace_mps() const {
  double pace_mps = 0.0;
  for (double at_m = start_m_; at_m <= curve_.length_m(); at_m += 1.0)
    pace_mps = std::max(pace_mps, curve_.at(at_m).limit_mps);
  return pace_mps;
}

double Goer::sharpest_per_m(double until_s) const {
  double sharpest = 0.0;
  const double end_m = drive_.at(start_s_ + until_s).at_m;
  for (double at_m = start_m_; at_m <= end_m; at_m += 0.5)
    sharpest = std::max(sharpest, std::abs(curve_.at(at_m).curvature_per_m));
  return sharpest;
}

bool Goer::is_inside(double half_size_m, double until_s) const {
  return terracast::job::is_inside(curve_, start_m_, drive_.at(start_s_ + until_s).at_m,
                                   half_size_m);
}

}  // namespace terracast::job
