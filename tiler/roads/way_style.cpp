#include "tiler/roads/way_style.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include "core/error.h"
#include "tiler/roads/road_tags.h"

namespace terracast::tiler {
namespace {

using core::SemanticClass;
using world::Marking;
using world::Paving;

/// What a class of roads is where its tags say no more. Widths after RAL 2012 and RASt 06 (Germany); grades: RAA
/// 2008 and RAL 2012 for what is built for speed, what mountain towns have for streets.
struct RoadClass {
  std::string_view name;
  int rank;
  double lane_m;
  int num_lanes;    ///< of both directions
  double margin_m;  ///< beside the lanes, in all
  double shoulder_m;
  double max_grade;
  double smooth_m;
  double bend_m;
  Marking marking;
};
/// In the order of world::WayKind.
constexpr std::array<RoadClass, 16> kRoadClasses = {{
    {"motorway", 90, 3.5, 2, 3.5, 2.0, 0.06, 150.0, 4.0, Marking::Motorway},
    {"trunk", 80, 3.5, 2, 1.5, 2.0, 0.08, 100.0, 3.0, Marking::Lanes},
    {"primary", 70, 3.5, 2, 1.0, 1.8, 0.09, 70.0, 2.0, Marking::Lanes},
    {"secondary", 60, 3.25, 2, 1.0, 1.8, 0.10, 60.0, 1.8, Marking::Lanes},
    {"tertiary", 50, 3.0, 2, 0.5, 1.8, 0.12, 45.0, 1.5, Marking::Center},
    {"motorway_link", 75, 4.0, 1, 2.5, 1.8, 0.07, 70.0, 2.5, Marking::Lanes},
    {"trunk_link", 65, 4.0, 1, 1.5, 1.8, 0.08, 60.0, 2.0, Marking::Lanes},
    {"primary_link", 55, 3.75, 1, 1.0, 1.8, 0.09, 40.0, 1.5, Marking::Lanes},
    {"secondary_link", 45, 3.5, 1, 1.0, 1.8, 0.10, 40.0, 1.5, Marking::None},
    {"tertiary_link", 35, 3.5, 1, 1.0, 1.8, 0.12, 30.0, 1.2, Marking::None},
    {"unclassified", 40, 2.75, 2, 0.0, 1.6, 0.15, 35.0, 1.5, Marking::None},
    {"road", 30, 2.75, 2, 0.0, 1.6, 0.15, 35.0, 1.5, Marking::None},
    {"residential", 38, 2.75, 2, 0.5, 1.6, 0.18, 25.0, 0.9, Marking::None},
    {"living_street", 32, 2.5, 2, 0.0, 1.6, 0.18, 25.0, 0.7, Marking::None},
    {"service", 20, 2.2, 2, 0.0, 1.5, 0.20, 20.0, 0.7, Marking::None},
    {"busway", 34, 3.25, 1, 0.5, 1.6, 0.10, 40.0, 1.2, Marking::None},
}};

/// `maxspeed` where it is a plausible number, in km/h; 0: it is not.
int max_speed_kmph(const RoadTags& tags) {
  const double speed_kmph = tags.speed_kmph("maxspeed").value_or(0.0);
  return speed_kmph >= 3.0 && speed_kmph <= 250.0 ? static_cast<int>(std::lround(speed_kmph)) : 0;
}

std::optional<Paving> paving_of_word(std::string_view surface) {
  const auto starts = [&](std::string_view with) { return surface.substr(0, with.size()) == with; };
  if (starts("asphalt") || starts("paved") || starts("chipseal")) return Paving::Asphalt;
  if (starts("concrete") || starts("metal")) return Paving::Concrete;
  if (starts("paving_stones") || starts("sett") || starts("cobblestone") ||
      starts("unhewn_cobblestone") || starts("bricks"))
    return Paving::Cobbles;
  if (starts("gravel") || starts("fine_gravel") || starts("compacted") || starts("pebblestone") ||
      starts("unpaved") || starts("rock"))
    return Paving::Gravel;
  if (starts("dirt") || starts("earth") || starts("ground") || starts("mud")) return Paving::Earth;
  if (starts("grass")) return Paving::Grass;
  if (starts("sand")) return Paving::Sand;
  return std::nullopt;
}

Paving paving_of(std::string_view surface, Paving otherwise) {
  return paving_of_word(surface).value_or(otherwise);
}

bool is_hard(Paving paving) { return paving == Paving::Asphalt || paving == Paving::Concrete; }

/// `width` where it is one of such ways; what is not is counted.
std::optional<double> width_of(const RoadTags& tags, double least_m, double most_m,
                               std::int64_t& num_repaired) {
  const auto width_m = tags.middle("width");
  if (!width_m) return std::nullopt;
  if (*width_m >= least_m && *width_m <= most_m) return width_m;
  ++num_repaired;
  return std::nullopt;
}

/// Order of painting of a rank; `layer` outweighs all ranks.
std::int16_t order_of(int base, int level) {
  return static_cast<std::int16_t>(base + 1000 * level);
}

/// usually_oneway   where tags say no more
void set_direction(const RoadTags& tags, bool usually_oneway, WayStyle& style) {
  const std::string_view oneway = tags.value("oneway");
  style.is_against = oneway == "-1" || oneway == "reverse";
  style.is_oneway = style.is_against || flag_from_tag(oneway).value_or(usually_oneway);
}

void describe_road(const RoadTags& tags, const RoadClass& road, WayStyle& style,
                   std::int64_t& num_repaired) {
  style.rank = road.rank;
  style.kind = static_cast<world::WayKind>(&road - kRoadClasses.data());
  style.lane_m = road.lane_m;
  style.max_speed_kmph = max_speed_kmph(tags);
  using Key = RoadTags::WordKey;
  for (const Key& key : {Key("access"), Key("vehicle"), Key("motor_vehicle")}) {
    const std::string_view access = tags.value(key);
    if (is_access_word(access))
      style.has_motor_traffic = access != "private" && flag_from_tag(access) != false;
  }
  style.shoulder_m = road.shoulder_m;
  style.max_grade = road.max_grade;
  style.smooth_m = road.smooth_m;
  style.bend_m = road.bend_m;
  style.paving = paving_of(tags.value("surface"), Paving::Asphalt);
  style.marking = is_hard(style.paving) ? road.marking : Marking::None;
  const std::string_view junction = tags.value("junction");
  const bool is_round = junction == "roundabout" || junction == "circular";
  set_direction(tags, road.name == "motorway", style);
  style.is_oneway = style.is_oneway || is_round;
  style.num_lanes = road.num_lanes;
  if (style.is_oneway && road.num_lanes == 2 && road.rank < 80) style.num_lanes = 1;
  // Parts of a lane widen a road, and are not painted.
  double wide_lanes = style.num_lanes;
  if (const auto lanes = tags.middle("lanes")) {
    if (*lanes >= 1.0 && *lanes <= 8.0) {
      wide_lanes = *lanes;
      style.num_lanes = static_cast<int>(std::floor(*lanes));
    } else {
      ++num_repaired;
    }
  }
  const bool is_service = road.name == "service";
  const std::string_view kind = tags.value("service");
  double width_m = road.lane_m * wide_lanes + road.margin_m;
  if (is_service && !tags.has("lanes"))
    width_m = kind == "parking_aisle" ? 5.5 : kind == "driveway" || kind == "alley" ? 3.2 : 4.0;
  if (style.num_lanes == 1 && !is_service) width_m = std::max(width_m, 4.0);
  const double least_m = 2.0;
  const double most_m = std::max(8.0, 5.5 * style.num_lanes + 8.0);
  if (const auto given_m = width_of(tags, least_m, most_m, num_repaired)) width_m = *given_m;
  style.half_width_m = 0.5 * width_m;
  if (style.num_lanes == 1 && style.marking == Marking::Center) style.marking = Marking::None;
  if (is_round) style.marking = Marking::None;
  if (is_service) {
    style.num_lanes = 1;
    style.coarsest_level = 4;
  }
  // A motorway of several lanes has a hard shoulder; a narrow one has none.
  style.is_lit_town = road.name == "residential" || road.name == "living_street";
  const std::string_view sidewalk = tags.value("sidewalk");
  const bool wants_sidewalk = is_one_of(sidewalk, "both|left|right") ||
                              flag_from_tag(sidewalk) == true ||
                              flag_from_tag(tags.value("sidewalk:both")) == true;
  if (wants_sidewalk && road.rank < 80) style.sidewalk_m = 2.0;
  style.order = order_of(400 + road.rank, style.level);
}

bool describe_highway(const RoadTags& tags, std::string_view value, WayStyle& style,
                      std::int64_t& num_repaired) {
  for (const RoadClass& road : kRoadClasses)
    if (road.name == value) {
      describe_road(tags, road, style, num_repaired);
      return true;
    }
  style.use = WayUse::Path;
  style.semantic_class = SemanticClass::Path;
  style.is_shaped = false;
  style.shoulder_m = 0.3;
  style.max_grade = 0.25;
  style.smooth_m = 12.0;
  style.clearance_m = 2.5;
  style.coarsest_level = 2;
  style.rank = 5;
  double width_m = 1.5;
  style.kind = value == "track"        ? world::WayKind::Track
               : value == "pedestrian" ? world::WayKind::Pedestrian
               : value == "footway"    ? world::WayKind::Footway
               : value == "cycleway"   ? world::WayKind::Cycleway
               : value == "bridleway"  ? world::WayKind::Bridleway
               : value == "steps"      ? world::WayKind::Steps
                                       : world::WayKind::Path;
  if (value == "track") {
    const std::string_view grade = tags.value("tracktype");
    style.paving = paving_of(tags.value("surface"), grade == "grade1"   ? Paving::Asphalt
                                                    : grade == "grade2" ? Paving::Gravel
                                                                        : Paving::Earth);
    width_m = 3.0;
    style.rank = 15;
    style.clearance_m = 4.5;
    style.coarsest_level = 3;
    style.order = order_of(300, style.level);
  } else if (value == "pedestrian") {
    style.paving = paving_of(tags.value("surface"), Paving::Cobbles);
    width_m = 5.0;
    style.rank = 12;
    style.clearance_m = 4.0;
    style.coarsest_level = 3;
    style.order = order_of(260, style.level);
  } else if (value == "footway" || value == "cycleway" || value == "steps" || value == "path" ||
             value == "bridleway") {
    const bool is_paved = value == "cycleway" || value == "footway" || value == "steps";
    style.paving = paving_of(tags.value("surface"), value == "steps"      ? Paving::Concrete
                                                    : value == "cycleway" ? Paving::Asphalt
                                                    : is_paved            ? Paving::Cobbles
                                                                          : Paving::Earth);
    width_m = value == "path" ? 0.9 : value == "bridleway" ? 1.5 : 2.0;
    if (tags.value("footway") == "crossing") return false;  // zebras are crossings' own
    style.order = order_of(value == "path" || value == "bridleway" ? 200 : 240, style.level);
  } else {
    return false;
  }
  if (const auto given_m = width_of(tags, 0.3, 12.0, num_repaired)) width_m = *given_m;
  style.half_width_m = 0.5 * width_m;
  return true;
}

std::optional<world::WayKind> railway_kind(std::string_view value) {
  using world::WayKind;
  constexpr std::array<std::pair<std::string_view, WayKind>, 7> kKinds = {
      {{"rail", WayKind::Rail},
       {"light_rail", WayKind::LightRail},
       {"tram", WayKind::Tram},
       {"narrow_gauge", WayKind::NarrowGauge},
       {"subway", WayKind::Subway},
       {"preserved", WayKind::Preserved},
       {"funicular", WayKind::Funicular}}};
  for (const auto& [name, kind] : kKinds)
    if (name == value) return kind;
  return std::nullopt;
}

bool describe_railway(const RoadTags& tags, std::string_view value, WayStyle& style) {
  const std::optional<world::WayKind> kind = railway_kind(value);
  if (!kind) return false;
  style.use = WayUse::Railway;
  style.kind = *kind;
  style.max_speed_kmph = max_speed_kmph(tags);
  set_direction(tags, false, style);
  style.is_siding = is_one_of(tags.value("service"), "yard|siding|spur|crossover");
  style.semantic_class = SemanticClass::Railway;
  style.paving = Paving::Ballast;
  style.marking = Marking::Rails;
  style.num_lanes = 1;
  if (const auto tracks = tags.middle("tracks"); tracks && *tracks >= 1.0 && *tracks <= 6.0)
    style.num_lanes = static_cast<int>(std::lround(*tracks));
  style.half_width_m = 0.5 * (4.0 * style.num_lanes + 0.4);
  style.shoulder_m = 1.6;
  style.rank = 85;
  style.max_grade = value == "rail" ? 0.03 : value == "funicular" ? 0.5 : 0.04;
  style.smooth_m = value == "funicular" ? 20.0 : 150.0;
  style.bend_m = 1.0;
  style.clearance_m = 5.7;
  style.order = order_of(550, style.level);
  if (value == "tram") {  // mostly in a street, whose paving lies over it
    style.is_shaped = false;
    style.order = order_of(340, style.level);
  }
  return true;
}

bool describe_aeroway(const RoadTags& tags, std::string_view value, WayStyle& style,
                      std::int64_t& num_repaired) {
  if (value != "runway" && value != "taxiway" && value != "stopway") return false;
  const bool is_runway = value == "runway";
  style.use = WayUse::Airfield;
  style.semantic_class = value == "taxiway" ? SemanticClass::Taxiway : SemanticClass::Runway;
  style.paving = paving_of(tags.value("surface"), Paving::Asphalt);
  double width_m = value == "taxiway" ? 18.0 : 45.0;
  if (const auto given_m = width_of(tags, 5.0, 120.0, num_repaired)) width_m = *given_m;
  style.half_width_m = 0.5 * width_m;
  style.shoulder_m = is_runway ? 30.0 : 8.0;
  style.rank = is_runway ? 100 : value == "stopway" ? 98 : 95;
  style.max_grade = is_runway || value == "stopway" ? 0.008 : 0.015;
  style.smooth_m = 300.0;
  style.bend_m = value == "taxiway" ? 4.0 : 0.3;
  style.coarsest_level = 7;
  style.order = order_of(is_runway ? 650 : 620, style.level);
  if (is_hard(style.paving))
    style.marking = is_runway            ? Marking::Runway
                    : value == "taxiway" ? Marking::Taxiway
                                         : Marking::None;
  return true;
}

}  // namespace

bool is_surface_word(std::string_view word) { return paving_of_word(word).has_value(); }

bool is_road_class(std::string_view highway) {
  return std::any_of(kRoadClasses.begin(), kRoadClasses.end(),
                     [&](const RoadClass& road) { return road.name == highway; });
}

double class_lane_m(std::string_view highway) {
  const auto found = std::find_if(kRoadClasses.begin(), kRoadClasses.end(),
                                  [&](const RoadClass& road) { return road.name == highway; });
  TERRACAST_CHECK(found != kRoadClasses.end(), "there is no class {} of roads", highway);
  return found->lane_m;
}

std::optional<WayStyle> way_style(const FeatureTags& all_tags, std::int64_t& num_repaired) {
  const RoadTags tags(all_tags);
  const Sight sight = sight_of(all_tags, SightOf::Way);
  if (sight == Sight::Indoors || tags.is_yes("area")) return std::nullopt;
  WayStyle style;
  if (const auto level = tags.middle("layer"))
    style.level = static_cast<int>(std::lround(std::clamp(*level, -5.0, 5.0)));
  style.is_bridge = tags.is_yes("bridge");
  style.is_tunnel = sight != Sight::Open;
  if (style.is_tunnel) style.is_bridge = false;
  if (style.is_bridge) style.level = std::max(style.level, 1);
  // What lies on the ground is painted in one order, whatever its `layer`: it is the ground's.
  const int level = style.level;
  if (!style.is_bridge && !style.is_tunnel) style.level = 0;
  bool is_way = false;
  if (tags.has("highway"))
    is_way = describe_highway(tags, tags.value("highway"), style, num_repaired);
  if (!is_way && tags.has("railway")) is_way = describe_railway(tags, tags.value("railway"), style);
  if (!is_way && tags.has("aeroway"))
    is_way = describe_aeroway(tags, tags.value("aeroway"), style, num_repaired);
  if (!is_way) {
    const std::string_view man_made = tags.value("man_made");
    if (man_made != "pier" && man_made != "breakwater") return std::nullopt;
    style.use = WayUse::Path;
    style.semantic_class = SemanticClass::Pier;
    style.half_width_m = man_made == "pier" ? 1.5 : 3.0;
    if (const auto width_m = width_of(tags, 0.8, 60.0, num_repaired))
      style.half_width_m = 0.5 * *width_m;
    style.is_shaped = false;
    style.is_bridge = false;
    style.is_tunnel = false;
    style.paving = man_made == "pier" ? Paving::Concrete : Paving::Gravel;
    style.order = order_of(230, 0);
    return style;
  }
  style.level = level;
  if (style.is_shaped) style.shoulder_m = std::max(style.shoulder_m, style.sidewalk_m + 0.4);
  return style;
}

std::optional<PadStyle> pad_style(const FeatureTags& all_tags) {
  const RoadTags tags(all_tags);
  PadStyle style;
  if (tags.is_yes("bridge")) return std::nullopt;
  const std::string_view aeroway = tags.value("aeroway");
  if (aeroway == "apron" || aeroway == "helipad") {
    style.use = aeroway == "apron" ? PadUse::Airfield : PadUse::Level;
    style.paving = paving_of(tags.value("surface"), Paving::Concrete);
    style.semantic_class = SemanticClass::Apron;
    style.order = 600;
    style.coarsest_level = 7;
    return style;
  }
  if (aeroway == "runway" || aeroway == "taxiway") {
    style.use = PadUse::Airfield;
    style.paving = paving_of(tags.value("surface"), Paving::Asphalt);
    style.semantic_class = aeroway == "runway" ? SemanticClass::Runway : SemanticClass::Taxiway;
    style.order = aeroway == "runway" ? 615 : 610;
    style.coarsest_level = 7;
    return style;
  }
  if (tags.value("amenity") == "parking" || tags.value("amenity") == "bicycle_parking") {
    const std::string_view kind = tags.value("parking");
    if (is_one_of(kind, "underground|multi-storey|rooftop")) return std::nullopt;
    style.use = PadUse::Level;
    style.paving = paving_of(tags.value("surface"), Paving::Asphalt);
    style.semantic_class = SemanticClass::Parking;
    style.order = 90;
    style.has_stands = tags.value("amenity") == "parking" && is_hard(style.paving);
    return style;
  }
  const std::string_view man_made = tags.value("man_made");
  if (man_made == "pier" || man_made == "breakwater" || man_made == "quay") {
    style.use = PadUse::Pier;
    style.paving = paving_of(tags.value("surface"),
                             man_made == "breakwater" ? Paving::Gravel : Paving::Concrete);
    style.semantic_class = SemanticClass::Pier;
    style.order = 80;
    return style;
  }
  const std::string_view area = tags.value("area:highway");
  const std::string_view highway = tags.value("highway");
  if (!area.empty() && !tags.is_yes("area") && highway.empty()) {
    const bool is_walk = area == "footway" || area == "pedestrian" || area == "path";
    style.paving = paving_of(tags.value("surface"), is_walk ? Paving::Cobbles : Paving::Asphalt);
    style.semantic_class = is_walk ? SemanticClass::Path : SemanticClass::Road;
    style.order = is_walk ? 60 : 70;
    return style;
  }
  if (highway == "pedestrian" || highway == "footway" || highway == "service" ||
      highway == "residential" || highway == "path" || tags.value("place") == "square") {
    const bool is_walk = highway != "service" && highway != "residential";
    style.paving = paving_of(tags.value("surface"), is_walk ? Paving::Cobbles : Paving::Asphalt);
    style.semantic_class = is_walk ? SemanticClass::Path : SemanticClass::Road;
    style.order = is_walk ? 60 : 70;
    return style;
  }
  return std::nullopt;
}

}  // namespace terracast::tiler
