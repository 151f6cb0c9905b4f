#include "tiler/objects/rules.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <unordered_map>

#include "core/error.h"
#include "core/random.h"
#include "tiler/objects/object_tags.h"
#include "tiler/objects/things.h"

namespace terracast::tiler {

using Eigen::Vector2d;

std::string_view rule_name(Rule rule) {
  switch (rule) {
    case Rule::Placements:
      return "placements";
    case Rule::PowerLines:
      return "power lines";
    case Rule::Landmarks:
      return "landmarks";
    case Rule::Aircraft:
      return "aircraft";
    case Rule::Ships:
      return "ships";
    case Rule::Ports:
      return "ports";
    case Rule::Boats:
      return "boats";
    case Rule::Yards:
      return "yards";
    case Rule::StreetLamps:
      return "street lamps";
    case Rule::Barriers:
      return "barriers";
    case Rule::ParkedCars:
      return "parked cars";
    case Rule::Traffic:
      return "traffic";
  }
  return "";
}

std::uint16_t heading_of(const Vector2d& direction) {
  const double turns = std::atan2(direction.y(), direction.x()) / (2.0 * std::numbers::pi);
  return static_cast<std::uint16_t>(static_cast<std::int64_t>(std::llround(turns * 65536.0)) &
                                    0xffff);
}

std::uint16_t heading_of_compass(double deg) {
  const double turns = (90.0 - deg) / 360.0;
  return static_cast<std::uint16_t>(
      static_cast<std::int64_t>(std::llround((turns - std::floor(turns)) * 65536.0)) & 0xffff);
}

void RuleOptions::describe(core::SchemaVisitor& visit) {
  visit.key("parked_cars", parked_cars,
            "Share of parking places (amenity=parking) and docks (amenity=loading_dock) that are "
            "taken; 0: none.",
            core::between(0.0, 1.0));
  visit.key("traffic", traffic, "Vehicles on roads, of what their class has by day; 0: none.",
            core::between(0.0, 4.0));
  visit.key("lamp_spacing_m", lamp_spacing_m,
            "Distance of street lamps along streets of towns and what is lit; 0: only "
            "highway=street_lamp.",
            core::between(0.0, 500.0));
  visit.key("aircraft", aircraft,
            "Share of stands on aprons that are taken; 0: none, and no bridges to them.",
            core::between(0.0, 1.0));
  visit.key("containers", containers,
            "Share of the piles of container terminals and yards; 0: neither these nor cranes.",
            core::between(0.0, 1.0));
  visit.key("boats", boats,
            "Share of berths in marinas that are taken; 0: neither boats nor jetties.",
            core::between(0.0, 1.0));
  visit.key(
      "ships", ships,
      "Ships where features say so (ship=*, seamark:type=anchorage or berth) and along quays.");
  visit.key("power_lines", power_lines, "Pylons, poles and wires of power=line and minor_line.");
  visit.key("landmarks", landmarks,
            "Wind turbines, masts, towers, tanks, silos, cranes, lighthouses, hangars and halls of "
            "which a point is known.");
  visit.key("barriers", barriers, "Hedges, fences and walls of barrier=*.");
  visit.key("drives_on_left", drives_on_left, "Traffic keeps to the left.");
}

bool is_feature_wanted(const FeatureTags& all_tags) {
  const ObjectTags tags(all_tags);
  using Key = ObjectTags::AnyKey;
  for (const Key& key : {Key("highway"), Key("power"), Key("man_made"), Key("ship"),
                         Key("seamark:type"), Key("harbour"), Key("mooring"), Key("barrier")})
    if (tags.has(key)) return true;
  const std::string_view aeroway = tags.value("aeroway");
  if (!aeroway.empty() || tags.value("leisure") == "marina") return true;
  if (tags.value("amenity") == "parking" || tags.value("amenity") == "loading_dock") return true;
  const std::string_view landuse = tags.value("landuse");
  if (landuse == "harbour" || landuse == "port" || landuse == "industrial" ||
      tags.has("industrial"))
    return true;
  const std::string_view building = tags.value("building");
  return building == "hangar" || building == "warehouse";
}

Proposals propose(const RuleInputs& inputs) {
  Proposals to;
  const RuleOptions& options = inputs.options;
  if (options.power_lines) propose_power_lines(inputs, to);
  if (options.landmarks) propose_landmarks(inputs, to);
  if (options.aircraft > 0.0) propose_aircraft(inputs, to);
  if (options.ships) propose_ships(inputs, to);
  if (options.containers > 0.0) propose_ports(inputs, to);
  if (options.boats > 0.0) propose_boats(inputs, to);
  propose_yards(inputs, to);
  propose_street_lamps(inputs, to);
  if (options.barriers) propose_barriers(inputs, to);
  if (options.parked_cars > 0.0) propose_parked_cars(inputs, to);
  if (options.traffic > 0.0) propose_traffic(inputs, to);
  return to;
}

std::uint32_t thing_row(std::string_view name) {
  const ThingInfo* thing = find_thing(name);
  TERRACAST_CHECK(thing != nullptr, "there is no thing {}", name);
  return static_cast<std::uint32_t>(thing - all_things().data());
}

void choose(Candidate& candidate, std::span<const Chance> chances, std::uint64_t draw) {
  const DrawnThing drawn = draw_thing(chances, draw);
  candidate.thing = static_cast<std::uint32_t>(drawn.thing - all_things().data());
  candidate.variant = static_cast<std::uint8_t>(drawn.variant);
}

Walk::Walk(const PointsWorld& line) {
  for (const Vector2d& point : line) {
    if (!point.allFinite()) continue;
    if (points_.empty()) {
      points_.push_back(point);
      along_m_.push_back(0.0);
      continue;
    }
    const double step_m = (point - points_.back()).norm();
    if (step_m < 1e-6) continue;
    along_m_.push_back(along_m_.back() + step_m);
    points_.push_back(point);
  }
}

std::size_t Walk::segment(double along_m) const {
  const auto after = std::upper_bound(along_m_.begin(), along_m_.end(), along_m);
  const auto row = static_cast<std::size_t>(after - along_m_.begin());
  return std::clamp<std::size_t>(row, 1, points_.size() - 1) - 1;
}

Vector2d Walk::at(double along_m) const {
  const std::size_t k = segment(along_m);
  return points_[k] + (along_m - along_m_[k]) * direction(along_m);
}

Vector2d Walk::direction(double along_m) const {
  const std::size_t k = segment(along_m);
  return (points_[k + 1] - points_[k]) / (along_m_[k + 1] - along_m_[k]);
}

bool is_inside(const std::vector<PointsWorld>& rings, const Vector2d& place) {
  bool inside = false;
  for (const PointsWorld& ring : rings)
    for (std::size_t i = 0; i < ring.size(); ++i) {
      const Vector2d& a = ring[i];
      const Vector2d& b = ring[(i + 1) % ring.size()];
      if ((a.y() > place.y()) == (b.y() > place.y())) continue;
      if (a.x() + (place.y() - a.y()) * (b.x() - a.x()) / (b.y() - a.y()) > place.x())
        inside = !inside;
    }
  return inside;
}

double area_m2(const std::vector<PointsWorld>& rings) {
  double outer = 0.0;
  for (std::size_t r = 0; r < rings.size(); ++r) {
    const PointsWorld& ring = rings[r];
    double twice = 0.0;
    for (std::size_t i = 0; i < ring.size(); ++i) {
      const Vector2d a = ring[i] - ring.front();
      const Vector2d b = ring[(i + 1) % ring.size()] - ring.front();
      twice += a.x() * b.y() - a.y() * b.x();
    }
    outer += (r == 0 ? 0.5 : -0.5) * std::abs(twice);
  }
  return std::max(outer, 0.0);
}

Vector2d middle_of(const VectorFeature& feature) {
  Vector2d low = Vector2d::Constant(1e300);
  Vector2d high = Vector2d::Constant(-1e300);
  for (const auto& part : feature.parts_world)
    for (const PointsWorld& line : part)
      for (const Vector2d& point : line) {
        low = low.cwiseMin(point);
        high = high.cwiseMax(point);
      }
  return 0.5 * (low + high);
}

Vector2d main_direction(const PointsWorld& ring) {
  Vector2d direction(1.0, 0.0);
  double longest_m = 0.0;
  for (std::size_t i = 0; i < ring.size(); ++i) {
    const Vector2d edge = ring[(i + 1) % ring.size()] - ring[i];
    if (edge.norm() > longest_m) {
      longest_m = edge.norm();
      direction = edge / longest_m;
    }
  }
  return direction;
}

}  // namespace terracast::tiler
