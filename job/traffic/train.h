#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "geo/trajectory.h"
#include "job/traffic/drive.h"
#include "job/traffic/encounters.h"
#include "job/traffic/lane_path.h"
#include "job/traffic/train_rows.h"

namespace terracast::job {

struct TrafficOptions;
class Train;

/// A car of a train.
class TrainCar final : public Traveller {
 public:
  /// behind_m   of its middle, behind the train's head
  TrainCar(const Train& train, const Body& body, double behind_m)
      : train_(&train), body_(body), behind_m_(behind_m) {}

  std::uint64_t key() const override;
  bool goes_first() const override { return true; }
  Footprint at(double time_s) const override;
  const Body& body() const { return body_; }
  /// As high as the deck that carries it, or else below all.
  geo::BodyState state(double time_s) const;

 private:
  const Train* train_;
  Body body_;
  double behind_m_;
};

/// A row of cars on the way along a curve; times are the sequence's.
class Train {
 public:
  /// head_m   along the curve, at time 0; the curve begins behind the train's end
  Train(std::uint64_t key, const TrafficOptions& options, const DrawnTrain& drawn, PathCurve curve,
        const DriveStyle& style, double head_m);
  Train(const Train&) = delete;
  Train& operator=(const Train&) = delete;

  std::uint64_t key() const { return key_; }
  const TrafficOptions& options() const { return *options_; }
  std::span<const TrainCar> cars() const { return cars_; }
  double lasts_s() const { return drive_.duration_s() - start_s_; }
  double gone_m(double time_s) const { return progress(time_s).at_m - head_m_; }
  /// How near it comes to a place.
  double distance_m(double time_s, const Eigen::Vector2d& at_world) const;
  /// Whether it stays clear of the border of a world's square until a time.
  bool is_inside(double half_size_m, double until_s) const;

  const PathCurve& curve() const { return curve_; }
  /// Of its head.
  Drive::Progress progress(double time_s) const { return drive_.at(start_s_ + time_s); }

 private:
  std::uint64_t key_;
  const TrafficOptions* options_;
  PathCurve curve_;
  Drive drive_;
  double head_m_;
  double length_m_;
  double start_s_;
  std::vector<TrainCar> cars_;
};

}  // namespace terracast::job
