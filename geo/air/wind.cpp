#include "geo/air/wind.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/error.h"
#include "core/random.h"
#include "geo/units.h"

namespace terracast::geo {
namespace {

constexpr double kFoot_m = metres_from_feet(1.0);
/// The height that the standard states wind for.
constexpr double kReference_m = 20.0 * kFoot_m;
constexpr std::uint64_t kWindStream = 0x77696e64;  ///< of random numbers: "wind"

double interpolated(double a, double b, double share) { return a + share * (b - a); }

UnitTurbulence drawn_component(TurbulenceModel model, const WindOptions& options, int component,
                               double lengths) {
  return {model, component == 0 ? TurbulenceComponent::Along : TurbulenceComponent::Across, lengths,
          static_cast<std::uint64_t>(options.seed),
          core::stream_of(kWindStream, static_cast<std::uint64_t>(component))};
}

}  // namespace

void GustOptions::describe(core::SchemaVisitor& visit) {
  visit.key("start_m", start_m, "Way through the air, from time 0 on, after which it begins.",
            core::between(0.0, 1e7));
  visit.key("length_m", length_m, "Way over which it grows, as (1 - cos); after it, it stays.",
            core::between(0.1, 1e6));
  const core::Constraint speed = core::between(-100.0, 100.0);
  visit.key("along_mps", along_mps, "Its speed towards where the mean wind blows.", speed);
  visit.key("left_mps", left_mps, "Its speed to the left of that, seen from above.", speed);
  visit.key("up_mps", up_mps, "Its speed upward.", speed);
}

void WindOptions::describe(core::SchemaVisitor& visit) {
  visit.key("speed_mps", speed_mps, "Mean wind 6.1 m (20 ft) above the ground; 0: none.",
            core::between(0.0, 1000.0));
  visit.key("from_deg", from_deg, "Where it comes from, clockwise from north.",
            core::between(-360.0, 360.0));
  visit.key("profile", profile,
            "shear: it grows with the logarithm of the height above the ground, from 0.9 to 305 m "
            "(3 to 1000 ft); even: the same at all heights.",
            core::one_of({"even", "shear"}));
  visit.key("roughness_m", roughness_m,
            "Height of shear at which it would be 0: 0.6096 (2 ft) by MIL-F-8785C, 0.04572 (0.15 "
            "ft) for its approaches and landings.",
            core::between(1e-5, 0.8));
  visit.key("turbulence", turbulence, "Spectrum of the turbulence.",
            core::one_of({"none", "dryden", "von_karman"}));
  visit.key("turbulence_speed_mps", turbulence_speed_mps,
            "Wind 6.1 m above the ground that the turbulence is as strong as: MIL-F-8785C has 7.7 "
            "for light, 15.4 for moderate, 23.1 for severe; 0: speed_mps.",
            core::between(0.0, 1000.0));
  visit.key("seed", seed, "Seed of the turbulence.", core::at_least(0.0));
  visit.list("gusts", gusts, "Gusts, each a (1 - cos) over its length, that add up.");
}

void WindOptions::validate() const {
  constexpr double kMost_mps = 60.0;
  for (const auto& [key, speed] :
       {std::pair{"speed_mps", speed_mps}, {"turbulence_speed_mps", turbulence_speed_mps}})
    if (speed > kMost_mps)
      core::fail(
          core::ErrorKind::Config,
          "{} = {} m/s is more than a hurricane's {}; a wind of {} knots is {:.1f} m/s, one of "
          "{} km/h {:.1f} m/s",
          key, speed, kMost_mps, speed, speed * 1852.0 / 3600.0, speed, speed / 3.6);
  if (turbulence == "none" && turbulence_speed_mps > 0.0)
    core::fail(core::ErrorKind::Config,
               "turbulence_speed_mps = {} without turbulence; set turbulence = \"dryden\" or "
               "\"von_karman\"",
               turbulence_speed_mps);
  if (turbulence != "none" && turbulence_speed_mps == 0.0 && speed_mps == 0.0)
    core::fail(core::ErrorKind::Config,
               "turbulence = \"{}\" has no strength: set speed_mps or turbulence_speed_mps",
               turbulence);
  for (const GustOptions& gust : gusts)
    if (gust.along_mps == 0.0 && gust.left_mps == 0.0 && gust.up_mps == 0.0)
      core::fail(core::ErrorKind::Config,
                 "a gust after {} m has no speed; set along_mps, left_mps or up_mps", gust.start_m);
}

TurbulenceScale turbulence_scale(TurbulenceModel model, double agl_m, double speed_mps) {
  constexpr double kLeast_ft = 10.0, kLow_ft = 1000.0, kHigh_ft = 2000.0;
  const double height_ft = std::max(agl_m / kFoot_m, kLeast_ft);
  const double low_ft = std::min(height_ft, kLow_ft);
  const double ratio = 0.177 + 0.000823 * low_ft;
  const double vertical_mps = 0.1 * speed_mps;
  TurbulenceScale scale{.level_m = kFoot_m * low_ft / std::pow(ratio, 1.2),
                        .vertical_m = kFoot_m * low_ft,
                        .level_mps = vertical_mps / std::pow(ratio, 0.4),
                        .vertical_mps = vertical_mps};
  if (height_ft > kLow_ft) {
    const double high_m = metres_from_feet(model == TurbulenceModel::Dryden ? 1750.0 : 2500.0);
    const double share = std::min((height_ft - kLow_ft) / (kHigh_ft - kLow_ft), 1.0);
    scale.level_m = interpolated(scale.level_m, high_m, share);
    scale.vertical_m = interpolated(scale.vertical_m, high_m, share);
  }
  return scale;
}

WindField::WindField(const WindOptions& options, double most_distance_m, double least_agl_m)
    : options_(options),
      turbulence_speed_mps_(options.turbulence_speed_mps > 0.0 ? options.turbulence_speed_mps
                                                               : options.speed_mps) {
  const double from_rad = radians_from_degrees(options.from_deg);
  const Eigen::Vector3d downwind(-std::sin(from_rad), -std::cos(from_rad), 0.0);
  enu_from_wind_ << downwind, Eigen::Vector3d(-downwind.y(), downwind.x(), 0.0),
      Eigen::Vector3d::UnitZ();
  if (options.turbulence == "none") return;
  const TurbulenceModel model =
      options.turbulence == "dryden" ? TurbulenceModel::Dryden : TurbulenceModel::VonKarman;
  const TurbulenceScale scale = turbulence_scale(model, least_agl_m, turbulence_speed_mps_);
  const double level = most_distance_m / scale.level_m;
  const double vertical = most_distance_m / scale.vertical_m;
  turbulence_ = {
      model,
      {drawn_component(model, options, 0, level), drawn_component(model, options, 1, level),
       drawn_component(model, options, 2, vertical)}};
}

Eigen::Vector3d WindField::mean_mps(const Place& place) const {
  constexpr double kLowest_m = 3.0 * kFoot_m, kHighest_m = 1000.0 * kFoot_m;
  double speed_mps = options_.speed_mps;
  if (options_.profile == "shear")
    speed_mps *= std::log(std::clamp(place.agl_m, kLowest_m, kHighest_m) / options_.roughness_m) /
                 std::log(kReference_m / options_.roughness_m);
  return place.world_from_enu * (speed_mps * enu_from_wind_.col(0));
}

Eigen::Vector3d WindField::at(const Place& place, const AirWay& way) const {
  Eigen::Vector3d changing = Eigen::Vector3d::Zero();  // along the wind, left, up
  for (const GustOptions& gust : options_.gusts) {
    const double share = std::clamp((way.distance_m - gust.start_m) / gust.length_m, 0.0, 1.0);
    changing += 0.5 * (1.0 - std::cos(std::numbers::pi * share)) *
                Eigen::Vector3d(gust.along_mps, gust.left_mps, gust.up_mps);
  }
  if (turbulence_) {
    const auto& components = turbulence_->components;
    if (way.level_lengths > components[0].end_lengths() ||
        way.vertical_lengths > components[2].end_lengths())
      core::fail(
          core::ErrorKind::Input,
          "after {:.0f} m through the air, {:.1f} m above the ground, no turbulence is drawn "
          "any more: it is blown farther off its way than was allowed for, or below it, "
          "where eddies are smaller; lower the wind's speeds, or fly higher",
          way.distance_m, place.agl_m);
    const TurbulenceScale scale =
        turbulence_scale(turbulence_->model, place.agl_m, turbulence_speed_mps_);
    changing += Eigen::Vector3d(scale.level_mps * components[0].at(way.level_lengths),
                                scale.level_mps * components[1].at(way.level_lengths),
                                scale.vertical_mps * components[2].at(way.vertical_lengths));
  }
  return mean_mps(place) + place.world_from_enu * (enu_from_wind_ * changing);
}

AirWay WindField::way_rate(double agl_m, double speed_mps) const {
  if (!turbulence_) return {.distance_m = speed_mps};
  const TurbulenceScale scale = turbulence_scale(turbulence_->model, agl_m, turbulence_speed_mps_);
  return {.distance_m = speed_mps,
          .level_lengths = speed_mps / scale.level_m,
          .vertical_lengths = speed_mps / scale.vertical_m};
}

}  // namespace terracast::geo
