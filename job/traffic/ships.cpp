#include "job/traffic/ships.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <optional>
#include <unordered_map>

#include "core/random.h"
#include "job/moving.h"
#include "job/traffic/near.h"
#include "job/traffic/ship_kinds.h"
#include "tiler/objects/things.h"

namespace terracast::job {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kCell_m = 1000.0;
/// Courses last so much longer than what is asked of them, before and after.
constexpr double kLonger_s = 2.0;
/// Speeds are up to so much of their kind's slower and faster.
constexpr double kSpeedSpread = 0.15;
/// Headings that are tried.
constexpr std::uint64_t kHeadings = 6;
/// Of the water that is looked at; nothing that is narrower may hide a shore of its own within kOffShore_m.
constexpr double kLook_m = 15.0;
/// Below the keel there is so much of the draught again.
constexpr double kUnderKeel = 0.3;

double fastest_mps(std::span<const TrafficOptions> options) {
  double speed = 0.0, fastest = 0.0;
  for (const TrafficOptions& one : options) speed = std::max(speed, one.speed);
  for (const ShipKind& kind : ship_kinds()) fastest = std::max(fastest, kind.speed_mps);
  return speed * fastest * (1.0 + kSpeedSpread);
}

double longest_ship_m() {
  double longest_m = 0.0;
  for (const ShipKind& kind : ship_kinds())
    longest_m = std::max(longest_m, tiler::find_thing(kind.thing)->size_m.x());
  return longest_m;
}

/// A ship straight ahead at one speed.
class Ship final : public Traveller {
 public:
  Ship(std::uint64_t key, const TrafficOptions& options, const tiler::ThingInfo& thing, int variant,
       const Vector2d& from_world, const Vector2d& velocity_mps)
      : key_(key),
        options_(&options),
        thing_(&thing),
        variant_(variant),
        from_world_(from_world),
        velocity_mps_(velocity_mps) {}

  std::uint64_t key() const override { return key_; }
  const TrafficOptions& options() const { return *options_; }
  const tiler::ThingInfo& thing() const { return *thing_; }
  int variant() const { return variant_; }
  double speed_mps() const { return velocity_mps_.norm(); }
  Vector2d place(double time_s) const { return from_world_ + time_s * velocity_mps_; }
  double distance_m(double time_s, const Vector2d& at_world) const {
    return (place(time_s) - at_world).norm();
  }
  /// With half its length of room all around.
  Footprint at(double time_s) const override {
    const double length_m = thing_->size_m.x();
    return {.at_world = place(time_s),
            .forward = velocity_mps_.normalized(),
            .length_m = 2.0 * length_m,
            .width_m = thing_->size_m.y() + length_m};
  }
  geo::BodyState state(double time_s) const {
    geo::BodyState state;
    state.time_s = time_s;
    state.world_from_body.translation << place(time_s), 0.0;
    state.world_from_body.rotation =
        Eigen::AngleAxisd(std::atan2(velocity_mps_.y(), velocity_mps_.x()), Vector3d::UnitZ());
    state.velocity_world_mps << velocity_mps_, 0.0;
    return state;
  }

 private:
  std::uint64_t key_;
  const TrafficOptions* options_;
  const tiler::ThingInfo* thing_;
  int variant_;
  Vector2d from_world_;
  Vector2d velocity_mps_;
};

/// Places by squares.
class Places {
 public:
  explicit Places(std::span<const Vector2d> places) {
    for (const Vector2d& at : places) cells_[key_of(at)].push_back(at);
  }
  bool has_near(const Vector2d& from, const Vector2d& to, double within_m) const {
    const Vector2d low = from.cwiseMin(to).array() - within_m;
    const Vector2d high = from.cwiseMax(to).array() + within_m;
    for (double y = low.y(); y < high.y() + kCell_m; y += kCell_m)
      for (double x = low.x(); x < high.x() + kCell_m; x += kCell_m)
        if (const auto found = cells_.find(key_of({x, y})); found != cells_.end())
          for (const Vector2d& at : found->second)
            if (distance_m(at, from, to) < within_m) return true;
    return false;
  }

 private:
  static double distance_m(const Vector2d& at, const Vector2d& from, const Vector2d& to) {
    const Vector2d step = to - from;
    const double share =
        std::clamp((at - from).dot(step) / std::max(step.squaredNorm(), 1e-12), 0.0, 1.0);
    return (at - from - share * step).norm();
  }
  static std::uint64_t key_of(const Vector2d& at) {
    const auto cell = [](double along_m) {
      return static_cast<std::uint64_t>(static_cast<std::int64_t>(std::floor(along_m / kCell_m)));
    };
    return cell(at.x()) << 32U ^ (cell(at.y()) & 0xffffffffU);
  }
  std::unordered_map<std::uint64_t, std::vector<Vector2d>> cells_;
};

class Shipping {
 public:
  Shipping(const WaterSite& site, double duration_s)
      : site_(site), standing_(site.standing), duration_s_(duration_s) {}

  /// Those of an entry that begin in a square; nullptr: one that has no clear course.
  void draw_in(const TrafficOptions& options, int x, int y,
               std::vector<std::unique_ptr<Ship>>& ships, Tally& tally) const {
    const std::uint64_t cell =
        core::stream_of(static_cast<std::uint64_t>(options.seed),
                        core::stream_of(static_cast<std::uint32_t>(x),
                                        static_cast<std::uint32_t>(y) + 0x73686970ULL));
    const double mean = kShipsPerKm2 * options.amount * 1e-6 * kCell_m * kCell_m;
    // As many as exponential gaps of mean 1 go into the mean.
    double left = mean;
    for (std::uint64_t k = 0;; ++k) {
      left += std::log1p(-core::random_unit(cell, 0, k));
      if (left < 0.0) return;
      const std::uint64_t key = core::random_bits(cell, 1, k);
      const Vector2d from =
          kCell_m * Vector2d(x + core::random_unit(key, 2, 0), y + core::random_unit(key, 2, 1));
      ++tally.num_proposed;
      if (auto ship = drawn_at(options, key, from))
        ships.push_back(std::move(ship));
      else
        tally.add(Unmade::WayEnds);
    }
  }

 private:
  std::unique_ptr<Ship> drawn_at(const TrafficOptions& options, std::uint64_t key,
                                 const Vector2d& from) const {
    const WaterAt water = site_.water(from);
    if (!water.is_water) return nullptr;
    const ShipKind* kind = drawn_kind(options, key);
    if (kind == nullptr || (kind->is_at_sea_alone && !water.is_sea)) return nullptr;
    const tiler::ThingInfo& thing = *tiler::find_thing(kind->thing);
    const double speed_mps =
        options.speed * kind->speed_mps *
        core::random_between(1.0 - kSpeedSpread, 1.0 + kSpeedSpread, key, 3, 0);
    for (std::uint64_t k = 0; k < kHeadings; ++k) {
      const double heading_rad = 2.0 * std::numbers::pi * core::random_unit(key, 4, k);
      const Vector2d velocity = speed_mps * Vector2d(std::cos(heading_rad), std::sin(heading_rad));
      if (!is_clear(*kind, thing, from, velocity)) continue;
      return std::make_unique<Ship>(
          key, options, thing,
          static_cast<int>(core::random_bits(key, 5, 0) %
                           static_cast<std::uint64_t>(thing.num_variants)),
          from, velocity);
    }
    return nullptr;
  }

  /// nullptr: one that the entry's things leave out.
  static const ShipKind* drawn_kind(const TrafficOptions& options, std::uint64_t key) {
    std::vector<const ShipKind*> fit;
    double all = 0.0;
    for (const ShipKind& kind : ship_kinds())
      if (options.things.empty() || std::find(options.things.begin(), options.things.end(),
                                              kind.thing) != options.things.end()) {
        fit.push_back(&kind);
        all += kind.share;
      }
    double left = all * core::random_unit(key, 6, 0);
    for (const ShipKind* kind : fit) {
      if (left < kind->share) return kind;
      left -= kind->share;
    }
    return fit.empty() ? nullptr : fit.back();
  }

  bool is_clear(const ShipKind& kind, const tiler::ThingInfo& thing, const Vector2d& from,
                const Vector2d& velocity_mps) const {
    const Vector2d first = from - kLonger_s * velocity_mps;
    const Vector2d last = from + (duration_s_ + kLonger_s) * velocity_mps;
    const double half_m = 0.5 * thing.size_m.x();
    const double off_m = kOffShore_m + half_m;
    for (const Vector2d& end : {first, last})
      if (end.cwiseAbs().maxCoeff() > site_.half_size_m - off_m) return false;
    if (standing_.has_near(first, last, off_m)) return false;
    const double deep_m = (1.0 + kUnderKeel) * kind.draught_m;
    // The rectangle and the half discs at its ends, on a grid along the course.
    const Vector2d along = velocity_mps.normalized(), left(-along.y(), along.x());
    const double length_m = (last - first).norm();
    for (double u = -off_m; u <= length_m + off_m; u += kLook_m) {
      const double beyond_m = std::max({0.0, -u, u - length_m});
      const double reach_m = std::sqrt(std::max(off_m * off_m - beyond_m * beyond_m, 0.0));
      for (double v = -reach_m; v <= reach_m; v += kLook_m) {
        const WaterAt water = site_.water(first + u * along + v * left);
        if (!water.is_water || water.depth_m < deep_m) return false;
      }
    }
    return true;
  }

  const WaterSite& site_;
  Places standing_;
  double duration_s_;
};

void tell_ships(std::size_t num, const Tally& tally, const core::Log& log) {
  const std::string left_out = fmt::format(
      "of {} proposed around, {} have no course that stays clear of shores, shoals and what stands "
      "in the water, {} would meet what moves there, {} each other, {} are beyond `most`",
      tally.num_proposed, tally.of(Unmade::WayEnds), tally.num_blocked, tally.num_giving_way,
      tally.num_beyond);
  if (num == 0)
    log.warn("traffic of ships: nothing is within reach of the cameras: {}", left_out);
  else
    log.info("traffic: {} ships within reach of the cameras; {}", num, left_out);
}

}  // namespace

double reach_of_ships_m(std::span<const TrafficOptions> options, double duration_s) {
  double seen_m = 0.0;
  for (const TrafficOptions& one : options) seen_m = std::max(seen_m, one.reach_m);
  // Who is seen, who meets them, and whom these meet.
  return seen_m + 3.0 * fastest_mps(options) * (duration_s + kLonger_s) + 4.0 * longest_ship_m();
}

std::vector<scene::MovingThing> lay_out_ships(std::span<const TrafficOptions> options,
                                              std::span<const geo::BodyState> frames,
                                              double duration_s, const WaterSite& site,
                                              const core::Log& log) {
  const double reach_m = reach_of_ships_m(options, duration_s);
  Vector2d low = Vector2d::Constant(1e300), high = -low;
  for (const geo::BodyState& frame : frames) {
    low = low.cwiseMin(frame.world_from_body.translation.head<2>());
    high = high.cwiseMax(frame.world_from_body.translation.head<2>());
  }
  const Shipping shipping(site, duration_s);
  const auto cell = [](double at_m) { return static_cast<int>(std::floor(at_m / kCell_m)); };
  Tally tally;
  std::vector<std::unique_ptr<Ship>> ships;
  for (const TrafficOptions& one : options)
    for (int y = cell(low.y() - reach_m); y <= cell(high.y() + reach_m); ++y)
      for (int x = cell(low.x() - reach_m); x <= cell(high.x() + reach_m); ++x)
        shipping.draw_in(one, x, y, ships, tally);
  std::vector<const Traveller*> travellers;
  for (const auto& ship : ships) travellers.push_back(ship.get());
  const Encounters encounters = find_encounters(travellers, site.obstacles, {}, duration_s);
  for (std::size_t i = 0; i < ships.size(); ++i) {
    tally.num_blocked += encounters.is_blocked[i];
    tally.num_giving_way += encounters.gives_way[i];
    if (encounters.is_blocked[i] != 0 || encounters.gives_way[i] != 0) ships[i] = nullptr;
  }
  std::erase(ships, nullptr);
  keep_near(ships, options, frames, tally);
  MovingThings shapes;
  std::vector<scene::MovingThing> things;
  for (const auto& ship : ships) {
    const std::string& name = ship->options().name;
    scene::MovingThing thing =
        shapes.of(fmt::format("{}-{:016x}", name.empty() ? "ship" : name, ship->key()),
                  ship->thing(), ship->variant());
    thing.ride = scene::Ride::Water;
    for (const geo::BodyState& frame : frames) {
      thing.states.push_back(ship->state(frame.time_s));
      thing.states.back()->terms.reach_s = site.reach_s;
      thing.gone_m.push_back(ship->speed_mps() * frame.time_s);
    }
    things.push_back(std::move(thing));
  }
  tell_ships(things.size(), tally, log);
  return things;
}

}  // namespace terracast::job
