#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "core/random.h"
#include "tiler/objects/object_tags.h"
#include "tiler/objects/rules.h"
#include "tiler/roads/way_style.h"

// Vehicles on roads, and the lamps beside them.
namespace terracast::tiler {
namespace {

using Eigen::Vector2d;

const RoadTraffic* road_of(const ObjectTags& tags) {
  const std::string_view highway = tags.value("highway");
  const std::span<const RoadTraffic> roads = road_traffic();
  const auto found = std::find_if(roads.begin(), roads.end(),
                                  [&](const RoadTraffic& road) { return road.highway == highway; });
  return found == roads.end() ? nullptr : &*found;
}

bool is_on_ground(const ObjectTags& tags) { return !tags.is_yes("bridge") && !tags.is_yes("area"); }

struct Lanes {
  int forward = 1;
  int backward = 1;
  double lane_m = 3.0;
  double half_width_m = 3.0;  ///< of the paving
};
Lanes lanes_of(const FeatureTags& tags, const RoadTraffic& road) {
  std::int64_t num_repaired = 0;  // roads count them
  const std::optional<WayStyle> style = way_style(tags, num_repaired);
  if (!style) return {.forward = 0, .backward = 0};
  const bool is_back = style->is_against;
  const bool is_oneway = style->is_oneway || road.highway.ends_with("_link");
  const int num = style->num_lanes;
  Lanes lanes{.forward = num - num / 2, .backward = num / 2};
  if (is_oneway) lanes = {.forward = is_back ? 0 : num, .backward = is_back ? num : 0};
  lanes.half_width_m = style->half_width_m;
  lanes.lane_m = std::min(class_lane_m(road.highway), 2.0 * style->half_width_m / num);
  return lanes;
}

}  // namespace

void propose_traffic(const RuleInputs& inputs, Proposals& to) {
  constexpr double kSlot_m = 22.0;
  for (const VectorFeature& feature : inputs.features) {
    if (feature.kind != FeatureKind::Line || !is_on_ground(feature.tags)) continue;
    const RoadTraffic* road = road_of(feature.tags);
    if (road == nullptr) continue;
    const Lanes lanes = lanes_of(feature.tags, *road);
    const int num_lanes = lanes.forward + lanes.backward;
    const double share = inputs.options.traffic * road->per_lane_km * kSlot_m / 1000.0;
    const double keep = inputs.options.drives_on_left ? -1.0 : 1.0;
    std::uint64_t part_number = 0;
    for (const auto& part : feature.parts_world)
      for (const PointsWorld& line : part) {
        const Walk walk(line);
        const std::uint64_t stream =
            core::stream_of(core::stream_of(0x74726166ULL, feature.number), part_number++);
        if (walk.length_m() < 2.0 * kSlot_m) continue;
        for (int lane = 0; lane < num_lanes; ++lane) {
          const bool is_forward = lane < lanes.forward;
          // Lanes from the right edge of the way to its left, seen forward.
          const double right_m = (0.5 * num_lanes - 0.5 - lane) * lanes.lane_m * keep;
          const std::uint64_t own = core::stream_of(stream, static_cast<std::uint64_t>(lane));
          const int num_slots = static_cast<int>(walk.length_m() / kSlot_m);
          for (int slot = 0; slot < num_slots; ++slot) {
            const auto index = static_cast<std::uint64_t>(slot);
            if (core::random_unit(inputs.seed, own, 4 * index) >= share) continue;
            const double along_m =
                (slot + core::random_between(0.35, 0.65, inputs.seed, own, 4 * index + 1)) *
                kSlot_m;
            if (along_m < 12.0 || along_m > walk.length_m() - 12.0) continue;
            const Vector2d direction = walk.direction(along_m);
            // Not in sharp bends.
            if (direction.dot(walk.direction(along_m - 7.0)) < 0.97 ||
                direction.dot(walk.direction(along_m + 7.0)) < 0.97)
              continue;
            Candidate vehicle{.rule = Rule::Traffic,
                              .footing = Footing::Paved,
                              .feature = feature.number,
                              .key = core::stream_of(own, index),
                              .steepest = 0.15};
            const std::uint64_t draw = core::random_bits(inputs.seed, own, 4 * index + 2);
            const bool is_heavy =
                core::random_unit(inputs.seed, own, 4 * index + 3) < road->trucks &&
                (lane == 0 || lane + 1 == num_lanes);
            choose(vehicle, vehicles_on(*road, is_heavy), draw);
            vehicle.place_world =
                walk.at(along_m) + right_m * Vector2d(direction.y(), -direction.x());
            vehicle.heading = heading_of(is_forward ? direction : Vector2d(-direction));
            to.candidates.push_back(vehicle);
          }
        }
      }
  }
}

namespace {

/// Where carriageways are: no lamp stands on one.
class Carriageways {
 public:
  explicit Carriageways(const std::vector<VectorFeature>& features) {
    for (const VectorFeature& feature : features) {
      const RoadTraffic* road = feature.kind == FeatureKind::Line ? road_of(feature.tags) : nullptr;
      if (road == nullptr) continue;
      const Lanes lanes = lanes_of(feature.tags, *road);
      const double half_m = lanes.half_width_m;
      for (const auto& part : feature.parts_world)
        for (const PointsWorld& line : part)
          for (std::size_t i = 0; i + 1 < line.size(); ++i) add(line[i], line[i + 1], half_m);
    }
  }

  bool is_on(const Vector2d& place, double room_m) const {
    const auto found = cells_.find(key(cell(place.x()), cell(place.y())));
    if (found == cells_.end()) return false;
    for (const Segment& segment : found->second) {
      const Vector2d step = segment.b - segment.a;
      const double share =
          std::clamp((place - segment.a).dot(step) / std::max(step.squaredNorm(), 1e-9), 0.0, 1.0);
      if ((segment.a + share * step - place).norm() < segment.half_m + room_m) return true;
    }
    return false;
  }

 private:
  struct Segment {
    Vector2d a;
    Vector2d b;
    double half_m;
  };
  static constexpr double kCell_m = 64.0;
  static constexpr double kReach_m = 20.0;
  static std::int32_t cell(double at_m) {
    return static_cast<std::int32_t>(std::floor(at_m / kCell_m));
  }
  static std::uint64_t key(std::int32_t x, std::int32_t y) {
    return static_cast<std::uint64_t>(static_cast<std::uint32_t>(y)) << 32U |
           static_cast<std::uint32_t>(x);
  }
  void add(const Vector2d& a, const Vector2d& b, double half_m) {
    if (!a.allFinite() || !b.allFinite() || (b - a).norm() > 20000.0) return;
    const Vector2d low = a.cwiseMin(b).array() - kReach_m;
    const Vector2d high = a.cwiseMax(b).array() + kReach_m;
    for (std::int32_t y = cell(low.y()); y <= cell(high.y()); ++y)
      for (std::int32_t x = cell(low.x()); x <= cell(high.x()); ++x)
        cells_[key(x, y)].push_back({a, b, half_m});
  }
  std::unordered_map<std::uint64_t, std::vector<Segment>> cells_;
};

}  // namespace

void propose_street_lamps(const RuleInputs& inputs, Proposals& to) {
  const Carriageways carriageways(inputs.features);
  for (const VectorFeature& feature : inputs.features) {
    const ObjectTags tags(feature.tags);
    const std::string_view highway = tags.value("highway");
    if (highway == "street_lamp") {
      Candidate lamp{.rule = Rule::StreetLamps,
                     .footing = Footing::Land,
                     .feature = feature.number,
                     .key = core::stream_of(0x6c616d70ULL, feature.number)};
      lamp.thing = thing_row("street_lamp");
      lamp.place_world = middle_of(feature);
      lamp.heading = heading_of_compass(
          tags.direction_deg("direction")
              .value_or(static_cast<double>(core::random_bits(inputs.seed, 0x6c61, feature.number) %
                                            360U)));
      to.candidates.push_back(lamp);
      continue;
    }
    if (inputs.options.lamp_spacing_m <= 0.0 || feature.kind != FeatureKind::Line ||
        !is_on_ground(feature.tags))
      continue;
    const RoadTraffic* road = road_of(feature.tags);
    const std::optional<bool> is_lit = tags.flag("lit");
    const bool is_way = highway == "footway" || highway == "pedestrian" || highway == "cycleway";
    if (is_lit == false || (road == nullptr && !(is_way && is_lit == true))) continue;
    const bool is_street = highway == "residential" || highway == "living_street";
    if (is_lit != true && !is_street) continue;
    const Lanes lanes = road != nullptr ? lanes_of(feature.tags, *road) : Lanes{};
    double half_m = road != nullptr ? lanes.half_width_m : 1.2;
    if (const auto width = tags.middle("width"); width && *width > 1.0 && *width < 40.0)
      half_m = 0.5 * *width;
    const double spacing_m =
        std::max(is_way ? 0.8 * inputs.options.lamp_spacing_m : inputs.options.lamp_spacing_m, 5.0);
    std::uint64_t part_number = 0;
    for (const auto& part : feature.parts_world)
      for (const PointsWorld& line : part) {
        const Walk walk(line);
        const std::uint64_t stream =
            core::stream_of(core::stream_of(0x6c616d71ULL, feature.number), part_number++);
        const int num = static_cast<int>(walk.length_m() / spacing_m + 0.4);
        for (int k = 0; k < num; ++k) {
          const double along_m = (k + 0.5) * walk.length_m() / num;
          const Vector2d direction = walk.direction(along_m);
          const Vector2d right(direction.y(), -direction.x());
          // Wide streets have them on both sides in turn.
          const double side = half_m > 4.5 && k % 2 == 1 ? -1.0 : 1.0;
          Candidate lamp{.rule = Rule::StreetLamps,
                         .footing = Footing::Paved,
                         .feature = feature.number,
                         .key = core::stream_of(stream, static_cast<std::uint64_t>(k))};
          lamp.thing =
              thing_row(is_way || highway == "living_street" ? "park_lamp" : "street_lamp");
          lamp.place_world = walk.at(along_m) + side * (half_m + 0.8) * right;
          lamp.heading = heading_of(-side * right);
          if (carriageways.is_on(lamp.place_world, 0.3)) continue;
          to.candidates.push_back(lamp);
        }
      }
  }
}

}  // namespace terracast::tiler
