#pragma once

#include <cstdint>

#include "geo/trajectory.h"
#include "job/traffic/drive.h"
#include "job/traffic/encounters.h"
#include "job/traffic/lane_path.h"
#include "tiler/objects/things.h"

namespace terracast::job {

struct TrafficOptions;

/// From a vehicle to the next in its lane, at least, at any time until the last.
inline constexpr double kLeastGap_s = 1.5;

/// Of what one is on the way with.
struct Body {
  const tiler::ThingInfo* thing = nullptr;
  int variant = 0;
};

/// Someone on the way along a curve; times are the sequence's.
class Goer final : public Traveller {
 public:
  /// start_m   along the curve, at time 0
  Goer(std::uint64_t key, const TrafficOptions& options, const Body& body, PathCurve curve,
       const DriveStyle& style, double start_m);

  std::uint64_t key() const override { return key_; }
  const TrafficOptions& options() const { return *options_; }
  const Body& body() const { return body_; }
  void take(const Body& body) { body_ = body; }
  /// How near it comes to a place.
  double distance_m(double time_s, const Eigen::Vector2d& at_world) const {
    return (at(time_s).at_world - at_world).norm();
  }
  /// The speed that it goes at where nothing holds it back, at its start.
  double pace_mps() const;
  double lasts_s() const { return drive_.duration_s() - start_s_; }
  double gone_m(double time_s) const { return drive_.at(start_s_ + time_s).at_m - start_m_; }

  Footprint at(double time_s) const override;
  /// Of vehicles.
  double headway_s() const override;
  /// As high as the deck that carries it, or else below all.
  geo::BodyState state(double time_s) const;

  /// The greatest curvature of the curve where it is gone along until a time.
  double sharpest_per_m(double until_s) const;
  /// Whether it stays clear of the border of a world's square until a time.
  bool is_inside(double half_size_m, double until_s) const;

 private:
  std::uint64_t key_;
  const TrafficOptions* options_;
  Body body_;
  PathCurve curve_;
  Drive drive_;
  double start_m_;
  double start_s_;
};

}  // namespace terracast::job
