#include "job/traffic/train.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "job/traffic/rail_car.h"

namespace terracast::job {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

DriveStyle style_of(DriveStyle style, double length_m) {
  style.length_m = length_m;
  return style;
}

/// Of the decks below a car's pivots and its middle.
struct CarDeck {
  double z_world = std::numeric_limits<double>::quiet_NaN();
  bool is_end = false;
};
CarDeck deck_below(const PathCurve& curve, double front_m, double rear_m) {
  CarDeck deck;
  double sum = 0.0;
  int num = 0;
  for (const double at_m : {front_m, 0.5 * (front_m + rear_m), rear_m}) {
    const PathCurve::Place place = curve.at(at_m);
    deck.is_end = deck.is_end || place.is_deck_end;
    if (!std::isfinite(place.deck_z_world)) continue;
    sum += place.deck_z_world;
    ++num;
  }
  if (num > 0) deck.z_world = sum / num;
  deck.is_end = deck.is_end || num < 3;
  return deck;
}

}  // namespace

Train::Train(std::uint64_t key, const TrafficOptions& options, const DrawnTrain& drawn,
             PathCurve curve, const DriveStyle& style, double head_m)
    : key_(key),
      options_(&options),
      curve_(std::move(curve)),
      drive_(curve_, style_of(style, drawn.length_m())),
      head_m_(head_m),
      length_m_(drawn.length_m()),
      start_s_(drive_.time_s(head_m)) {
  double behind_m = 0.0;
  for (const Body& car : drawn.cars) {
    const double length_m = car.thing->size_m.x();
    cars_.emplace_back(*this, car, behind_m + 0.5 * length_m);
    behind_m += length_m;
  }
}

double Train::distance_m(double time_s, const Vector2d& at_world) const {
  double nearest_m = 1e300;
  for (const TrainCar& car : cars_)
    nearest_m = std::min(nearest_m, (car.at(time_s).at_world - at_world).norm());
  return nearest_m;
}

bool Train::is_inside(double half_size_m, double until_s) const {
  return job::is_inside(curve_, std::max(head_m_ - length_m_, 0.0), progress(until_s).at_m,
                        half_size_m);
}

std::uint64_t TrainCar::key() const { return train_->key(); }

Footprint TrainCar::at(double time_s) const {
  const Drive::Progress progress = train_->progress(time_s);
  const double front_m = progress.at_m - behind_m_ + 0.5 * body_.thing->pivots_m;
  const CarMotion car = car_motion(train_->curve(), front_m, progress, body_.thing->pivots_m);
  const CarDeck deck = deck_below(train_->curve(), front_m, car.rear_m);
  return {.at_world = car.at_world,
          .forward = car.forward,
          .length_m = body_.thing->size_m.x(),
          .width_m = body_.thing->size_m.y(),
          .deck_z_world = deck.z_world,
          .is_deck_end = deck.is_end};
}

geo::BodyState TrainCar::state(double time_s) const {
  const Drive::Progress progress = train_->progress(time_s);
  const double front_m = progress.at_m - behind_m_ + 0.5 * body_.thing->pivots_m;
  const CarMotion car = car_motion(train_->curve(), front_m, progress, body_.thing->pivots_m);
  const CarDeck deck = deck_below(train_->curve(), front_m, car.rear_m);
  geo::BodyState state;
  state.time_s = time_s;
  state.world_from_body.translation << car.at_world,
      std::isfinite(deck.z_world) ? deck.z_world : kNoDeck_m;
  state.world_from_body.rotation =
      Eigen::AngleAxisd(std::atan2(car.forward.y(), car.forward.x()), Vector3d::UnitZ());
  state.velocity_world_mps << car.velocity_mps, 0.0;
  state.acceleration_world_mps2 << car.acceleration_mps2, 0.0;
  state.angular_velocity_body_radps.z() = car.turning_radps;
  return state;
}

}  // namespace terracast::job
