#include "tiler/objects/placed_things.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <tuple>

#include "core/error.h"
#include "core/parallel.h"
#include "core/random.h"
#include "tiler/instance_ids.h"
#include "tiler/layer_stack.h"
#include "tiler/objects/power_line.h"
#include "tiler/objects/things.h"
#include "tiler/objects/wires.h"
#include "tiler/shown_ground.h"
#include "tiler/surface.h"
#include "tiler/world_options.h"
#include "world/instance_frame.h"

namespace terracast::tiler {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kCell_m = 256.0;
/// Beyond its own tile a thing is shown on coarser ones, too (LayerStack).
constexpr int kLevelsAtCorner = 2;
constexpr double kFinestSide_m = 32.0;
/// Wires are no longer than this.
constexpr double kLongestSpan_m = 1200.0;

std::int32_t cell(double at_m) { return static_cast<std::int32_t>(std::floor(at_m / kCell_m)); }
std::uint64_t cell_key(std::int32_t x, std::int32_t y) {
  return static_cast<std::uint64_t>(static_cast<std::uint32_t>(y)) << 32U |
         static_cast<std::uint32_t>(x);
}

Vector2d direction_of(std::uint16_t heading) {
  const double turn = heading * (2.0 * std::numbers::pi / 65536.0);
  return {std::cos(turn), std::sin(turn)};
}

/// Why a candidate does not stand.
enum class Verdict : std::uint8_t { Stands, Outside, WrongGround, Held, Steep, Taken };
constexpr std::string_view kVerdicts[] = {"",
                                          "beyond the square",
                                          "in water or on dry land",
                                          "where other layers are",
                                          "on steep ground",
                                          "where another thing stands"};

}  // namespace

GroundBelow::GroundBelow(const LayerInputs& inputs)
    : surface_(inputs.surface), covers_(inputs.earlier), half_size_m_(0.5 * inputs.size_m) {
  const auto& layers = inputs.surface.options().layers;
  for (std::size_t i = 0; i < inputs.earlier.size(); ++i) {
    const std::string kind = i < layers.size() ? layers[i].kind : "";
    layers_.push_back(
        {inputs.earlier[i].get(), kind == "roads", kind == "water" || kind == "land_cover"});
  }
}

bool GroundBelow::is_water(const Vector2d& place) const {
  return covers_.is_water_on(surface_, place);
}

std::optional<world::Cover> GroundBelow::cover(const Vector2d& place) const {
  const auto told = covers_.at(place, surface_.sample(place.x(), place.y()));
  return told ? std::optional(told->cover) : std::nullopt;
}

double GroundBelow::z_world(const Vector2d& place) const {
  const SurfaceSample sample = surface_.sample(place.x(), place.y());
  const double share = lift_share(place, half_size_m_);
  if (sample.cover != world::Cover::Land || share <= 0.0) return sample.z_world;
  double lift_m = 0.0;
  for (const Below& below : layers_) lift_m += below.layer->lift_m(place, sample);
  return sample.z_world + lift_m * share;
}

bool GroundBelow::is_held(const GroundRectangle& footprint, bool by_roads_too,
                          bool by_water_too) const {
  // By discs along its longer side that cover it.
  const bool is_long = footprint.half_length_m >= footprint.half_width_m;
  const double half_long = is_long ? footprint.half_length_m : footprint.half_width_m;
  const double half_short = is_long ? footprint.half_width_m : footprint.half_length_m;
  const Vector2d axis =
      is_long ? footprint.along : Vector2d(-footprint.along.y(), footprint.along.x());
  const int num =
      std::clamp(static_cast<int>(std::ceil(half_long / std::max(half_short, 0.05))), 1, 24);
  const double step = half_long / num;
  const double radius = std::hypot(half_short, step);
  for (const Below& below : layers_) {
    if ((below.is_roads && !by_roads_too) || (below.is_water && !by_water_too)) continue;
    for (int k = 0; k < num; ++k)
      if (below.layer->holds(footprint.middle + (2 * k + 1 - num) * step * axis, radius))
        return true;
  }
  return false;
}

PlacedThings::PlacedThings(const Proposals& proposals, const std::vector<ThingKind>& kinds,
                           const LayerInputs& inputs) {
  const std::vector<Candidate>& candidates = proposals.candidates;
  const double half_size_m = 0.5 * inputs.size_m;
  const GroundBelow ground(inputs);
  if (candidates.size() > 4 * kMostThings)
    core::fail(core::ErrorKind::Config,
               "{} things are proposed, and a world has at most {}; lower traffic, parked_cars or "
               "the other shares, or list fewer",
               candidates.size(), kMostThings);
  const auto footprint_of = [&](const Candidate& candidate) {
    const double scale = candidate.scale / 4096.0;
    const Vector2d size = scale * kinds[candidate.thing].footprint_m;
    return GroundRectangle{candidate.place_world, direction_of(candidate.heading), 0.5 * size.x(),
                           0.5 * size.y()};
  };
  // What each finds by itself, in any order.
  std::vector<Verdict> verdicts(candidates.size(), Verdict::Stands);
  const auto judge = [&](const Candidate& candidate) {
    const GroundRectangle footprint = footprint_of(candidate);
    if (!candidate.place_world.allFinite() ||
        candidate.place_world.cwiseAbs().maxCoeff() + footprint.reach_m() + 1.0 >= half_size_m)
      return Verdict::Outside;
    if (candidate.footing == Footing::Any) return Verdict::Stands;
    const Vector2d left(-footprint.along.y(), footprint.along.x());
    const bool wants_water = candidate.footing == Footing::Water;
    for (const double x : {-1.0, -0.5, 0.0, 0.5, 1.0})
      for (const double y : {-1.0, 0.0, 1.0}) {
        if (y == 0.0 && std::abs(x) == 0.5) continue;
        const Vector2d at = footprint.middle + x * footprint.half_length_m * footprint.along +
                            y * footprint.half_width_m * left;
        if (ground.is_water(at) != wants_water) return Verdict::WrongGround;
      }
    if (ground.is_held(footprint, candidate.footing != Footing::Paved, !wants_water))
      return Verdict::Held;
    // Hedges part land; they do not run through crops and woods.
    if (candidate.rule == Rule::Barriers) {
      const auto cover = ground.cover(footprint.middle);
      if (cover == world::Cover::Crops || cover == world::Cover::Forest)
        return Verdict::WrongGround;
    }
    if (candidate.steepest < 1.0) {
      const auto rise = [&](const Vector2d& step) {
        return std::abs(ground.z_world(footprint.middle + step) -
                        ground.z_world(footprint.middle - step)) /
               (2.0 * step.norm());
      };
      const double along = rise(std::max(footprint.half_length_m, 1.0) * footprint.along);
      const double across = rise(std::max(footprint.half_width_m, 1.0) * left);
      if (std::hypot(along, across) > candidate.steepest) return Verdict::Steep;
    }
    return Verdict::Stands;
  };
  core::parallel_for_blocks(
      static_cast<std::int64_t>(candidates.size()), 256, [&](std::int64_t begin, std::int64_t end) {
        for (std::int64_t i = begin; i < end; ++i)
          verdicts[static_cast<std::size_t>(i)] = judge(candidates[static_cast<std::size_t>(i)]);
      });
  // Who comes first has the place.
  std::vector<std::size_t> order(candidates.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return std::tuple(candidates[a].rule, candidates[a].key) <
           std::tuple(candidates[b].rule, candidates[b].key);
  });
  std::vector<std::size_t> standing;
  std::map<std::pair<std::uint32_t, std::uint8_t>, std::uint16_t> used;
  std::size_t num_things = 0;
  for (std::size_t k = 0; k < order.size(); ++k) {
    const std::size_t i = order[k];
    const Candidate& candidate = candidates[i];
    if (k > 0 && candidates[order[k - 1]].rule == candidate.rule &&
        candidates[order[k - 1]].key == candidate.key) {
      verdicts[i] = Verdict::Taken;  // the same thing, given twice
      continue;
    }
    if (verdicts[i] != Verdict::Stands) continue;
    const GroundRectangle footprint = footprint_of(candidate);
    // Lists are believed; the rest keeps off what stands.
    if (candidate.rule != Rule::Placements && !candidate.joins && footprints_.overlaps(footprint)) {
      verdicts[i] = Verdict::Taken;
      continue;
    }
    if (!candidate.joins) footprints_.add(footprint);
    standing.push_back(i);
    used.emplace(std::pair(candidate.thing, candidate.variant), std::uint16_t{0});
    num_things += candidate.num_stacked;
  }
  if (num_things > kMostThings)
    core::fail(core::ErrorKind::Config,
               "{} things stand in the world, and it has room for {}; lower traffic, parked_cars "
               "or the other shares, or list fewer",
               num_things, kMostThings);
  for (auto& [what, row] : used) {
    row = static_cast<std::uint16_t>(used_.size());
    used_.push_back(what);
  }
  std::vector<std::uint64_t> keys;
  std::unordered_map<std::size_t, std::size_t> thing_of;  // of candidates
  for (const std::size_t i : standing) {
    const Candidate& candidate = candidates[i];
    thing_of.emplace(i, things_.size());
    for (int tier = 0; tier < candidate.num_stacked; ++tier) {
      PlacedThing thing{.feature = candidate.feature,
                        .place_world = candidate.place_world,
                        .heading = candidate.heading,
                        .scale = candidate.scale};
      const std::uint64_t own = core::stream_of(
          core::stream_of(static_cast<std::uint64_t>(candidate.rule), candidate.key),
          static_cast<std::uint64_t>(tier));
      std::uint8_t variant = candidate.variant;
      double above_m = candidate.above_m;
      if (candidate.num_stacked > 1) {  // piles are of containers of one kind in many colours
        const ThingInfo& info = all_things()[candidate.thing];
        above_m += tier * info.size_m.z();
        const auto other = static_cast<std::uint8_t>(core::mix_bits(own) %
                                                     static_cast<std::uint64_t>(info.num_variants));
        if (used.count({candidate.thing, other}) != 0) variant = other;
      }
      thing.above_m = static_cast<float>(above_m);
      thing.prototype = used.at({candidate.thing, variant});
      thing.variety = static_cast<std::uint8_t>(core::mix_bits(own) >> 56U);
      things_.push_back(thing);
      keys.push_back(own);
    }
  }
  std::vector<std::uint64_t> span_keys;
  for (const PowerLine& line : proposals.lines) {
    std::size_t last = line.supports.size();
    for (std::size_t k = 0; k < line.supports.size(); ++k) {
      if (thing_of.count(line.supports[k]) == 0) continue;
      if (last < line.supports.size()) {
        const Candidate& from = candidates[line.supports[last]];
        const Candidate& to = candidates[line.supports[k]];
        const double length_m = (from.place_world - to.place_world).norm();
        if (length_m > 1.0 && length_m < kLongestSpan_m) {
          spans_.push_back({.instance_id = 0,
                            .feature = line.feature,
                            .from = thing_of.at(line.supports[last]),
                            .to = thing_of.at(line.supports[k]),
                            .from_thing = from.thing,
                            .to_thing = to.thing});
          span_keys.push_back(core::stream_of(core::stream_of(0x77697265, from.key),
                                              core::stream_of(to.key, line.feature)));
        }
      }
      last = k;
    }
  }
  // A line that goes the same way twice has one span.
  std::vector<std::size_t> by_key(spans_.size());
  for (std::size_t i = 0; i < by_key.size(); ++i) by_key[i] = i;
  std::sort(by_key.begin(), by_key.end(), [&](std::size_t a, std::size_t b) {
    return std::tuple(span_keys[a], a) < std::tuple(span_keys[b], b);
  });
  std::vector<WireSpan> spans;
  std::vector<std::uint64_t> kept_keys;
  for (const std::size_t i : by_key) {
    if (!kept_keys.empty() && kept_keys.back() == span_keys[i]) continue;
    spans.push_back(spans_[i]);
    kept_keys.push_back(span_keys[i]);
  }
  spans_ = std::move(spans);
  std::vector<std::uint64_t> all_keys = keys;
  all_keys.insert(all_keys.end(), kept_keys.begin(), kept_keys.end());
  const std::vector<std::uint32_t> ids = inputs.ids.assign("objects", all_keys);
  for (std::size_t i = 0; i < things_.size(); ++i) things_[i].instance_id = ids[i];
  for (std::size_t i = 0; i < spans_.size(); ++i) spans_[i].instance_id = ids[things_.size() + i];

  std::array<std::int64_t, kNumRules> placed{};
  std::map<std::pair<Rule, Verdict>, std::int64_t> left_out;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    if (verdicts[i] == Verdict::Stands)
      placed[static_cast<std::size_t>(candidates[i].rule)] += candidates[i].num_stacked;
    else
      ++left_out[{candidates[i].rule, verdicts[i]}];
  }
  for (int rule = 0; rule < kNumRules; ++rule)
    if (placed[static_cast<std::size_t>(rule)] > 0)
      counts_.emplace_back(rule_name(static_cast<Rule>(rule)),
                           placed[static_cast<std::size_t>(rule)]);
  if (!spans_.empty())
    counts_.emplace_back("spans of wires", static_cast<std::int64_t>(spans_.size()));
  for (const auto& [what, count] : left_out)
    counts_.emplace_back(fmt::format("{} left out {}", rule_name(what.first),
                                     kVerdicts[static_cast<std::size_t>(what.second)]),
                         count);
}

void PlacedThings::index(const std::vector<world::Prototype>& prototypes) {
  for (const world::Prototype& prototype : prototypes) {
    double largest = 0.0;
    for (const world::ShapeLevel& level : prototype.levels)
      for (const Eigen::Vector3i& vertex : level.shape.vertices_steps)
        largest = std::max(largest, vertex.cast<double>().norm());
    reaches_m_.push_back(largest * world::kHeightStep_m);
    coarsest_levels_.push_back(prototype.levels.back().coarsest_level);
  }
  for (std::uint32_t i = 0; i < things_.size(); ++i) {
    const PlacedThing& thing = things_[i];
    largest_reach_m_ =
        std::max(largest_reach_m_, reaches_m_[thing.prototype] * thing.scale / 4096.0);
    cells_[cell_key(cell(thing.place_world.x()), cell(thing.place_world.y()))].push_back(
        {i, false});
  }
  for (std::uint32_t i = 0; i < spans_.size(); ++i) {
    const Vector2d from = things_[spans_[i].from].place_world;
    const Vector2d to = things_[spans_[i].to].place_world;
    largest_reach_m_ = std::max(largest_reach_m_, 0.5 * (to - from).norm() + 15.0);
    const Vector2d middle = 0.5 * (from + to);
    cells_[cell_key(cell(middle.x()), cell(middle.y()))].push_back({i, true});
  }
}

namespace {

/// Wires are shown no farther than both their supports.
void show_up_to(std::int8_t last_level, world::ShapeLevels& levels) {
  while (levels.size() > 1 && levels[levels.size() - 2].coarsest_level >= last_level)
    levels.pop_back();
  levels.back().coarsest_level = std::min(levels.back().coarsest_level, last_level);
}

}  // namespace

world::Instance PlacedThings::instance_of(const PlacedThing& thing, const LayerSite& site) const {
  world::Instance instance;
  instance.provenance = {.instance_id = thing.instance_id, .layer = 0, .feature = thing.feature};
  instance.prototype = thing.prototype;
  const double ground_z = site.ground_z_world(thing.place_world);
  const double z = ground_z + static_cast<double>(thing.above_m);
  instance.place_steps =
      (Vector3d(thing.place_world.x(), thing.place_world.y(), z) / world::kHeightStep_m)
          .array()
          .round()
          .cast<int>();
  instance.heading = thing.heading;
  instance.scale = thing.scale;
  instance.variety = thing.variety;
  instance.coarsest_level = static_cast<std::int8_t>(last_level_with_ground(
      site, thing.place_world, ground_z, 0, coarsest_levels_[thing.prototype]));
  return instance;
}

void PlacedThings::add_to(const world::TileId& id, const LayerSite& site,
                          const std::vector<world::Prototype>& prototypes,
                          const geo::WorldFrame& frame, world::TileObjects& objects) const {
  static_cast<void>(prototypes);
  const Vector2d low = id.corner_world();
  const Vector2d high = low.array() + id.side_m();
  // What a level shows: more levels beyond the tile itself, for what reaches far.
  const auto is_shown = [&](const Vector2d& place, double reach_m, int coarsest_level) {
    if (((place.array() + reach_m) < low.array()).any() ||
        ((place.array() - reach_m) > high.array()).any())
      return false;
    if (world::tile_at(id.level, place.x(), place.y()) == id) return id.level <= coarsest_level;
    const int doublings =
        static_cast<int>(std::ceil(std::log2(std::max(2.0 * reach_m / kFinestSide_m, 1.0))));
    return id.level - kLevelsAtCorner - doublings <= coarsest_level;
  };
  const auto visit = [&](const std::vector<Entry>& entries) {
    for (const Entry& entry : entries) {
      if (!entry.is_span) {
        const PlacedThing& thing = things_[entry.number];
        if (is_shown(thing.place_world, reaches_m_[thing.prototype] * thing.scale / 4096.0 + 0.01,
                     coarsest_levels_[thing.prototype]))
          objects.instances.push_back(instance_of(thing, site));
        continue;
      }
      const WireSpan& span = spans_[entry.number];
      const PlacedThing& from = things_[span.from];
      const PlacedThing& to = things_[span.to];
      const double reach_m = 0.5 * (to.place_world - from.place_world).norm() + 15.0;
      if (!is_shown(0.5 * (from.place_world + to.place_world), reach_m, kCoarsestWireLevel))
        continue;
      const world::Instance support = instance_of(from, site), next = instance_of(to, site);
      world::Solid wires = wires_between(span.from_thing, world::instance_frame(support, frame),
                                         span.to_thing, world::instance_frame(next, frame));
      wires.provenance = {.instance_id = span.instance_id, .layer = 0, .feature = span.feature};
      show_up_to(std::min(support.coarsest_level, next.coarsest_level), wires.levels);
      objects.solids.push_back(std::move(wires));
    }
  };
  const std::int32_t low_x = cell(low.x() - largest_reach_m_),
                     high_x = cell(high.x() + largest_reach_m_);
  const std::int32_t low_y = cell(low.y() - largest_reach_m_),
                     high_y = cell(high.y() + largest_reach_m_);
  const auto num =
      static_cast<std::size_t>(high_x - low_x + 1) * static_cast<std::size_t>(high_y - low_y + 1);
  if (num > cells_.size()) {
    for (const auto& [key, entries] : cells_) visit(entries);
    return;
  }
  for (std::int32_t y = low_y; y <= high_y; ++y)
    for (std::int32_t x = low_x; x <= high_x; ++x)
      if (const auto found = cells_.find(cell_key(x, y)); found != cells_.end())
        visit(found->second);
}

}  // namespace terracast::tiler
