#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "core/random.h"
#include "tiler/objects/object_tags.h"
#include "tiler/objects/rules.h"

namespace terracast::tiler {
namespace {

using Eigen::Vector2d;
using Place = std::pair<std::int64_t, std::int64_t>;

/// Places within half a metre are one.
Place place_of(const Vector2d& at) {
  return {std::llround(2.0 * at.x()), std::llround(2.0 * at.y())};
}

struct Kind {
  std::string_view thing;
  double span_m;  ///< where a line has no support for longer, some are put in
};

Kind kind_of(const ObjectTags& tags) {
  if (tags.value("power") == "minor_line") return {"wood_pole", 75.0};
  const double volts = tags.most("voltage").value_or(0.0);
  if (volts > 0.0 && volts < 50000.0) return {"wood_pole", 75.0};
  if (volts > 0.0 && volts < 200000.0) return {"pylon_small", 330.0};
  return {"pylon", 400.0};
}

}  // namespace

void propose_power_lines(const RuleInputs& inputs, Proposals& to) {
  std::set<Place> known;
  for (const VectorFeature& feature : inputs.features) {
    const std::string_view power = ObjectTags(feature.tags).value("power");
    if (feature.kind == FeatureKind::Point &&
        (power == "tower" || power == "pole" || power == "portal"))
      known.insert(place_of(middle_of(feature)));
  }
  std::map<Place, std::size_t> supports;
  for (const VectorFeature& feature : inputs.features) {
    const std::string_view power = ObjectTags(feature.tags).value("power");
    if (feature.kind != FeatureKind::Line || (power != "line" && power != "minor_line")) continue;
    const Kind kind = kind_of(feature.tags);
    const std::uint64_t stream = core::stream_of(0x706f7765ULL, feature.number);
    std::uint64_t number = 0;
    for (const auto& part : feature.parts_world)
      for (const PointsWorld& line : part) {
        PointsWorld places;
        std::size_t num_known = 0;
        for (const Vector2d& at : line) num_known += known.count(place_of(at));
        for (const Vector2d& at : line) {
          if (!at.allFinite()) continue;
          if (2 * num_known >= line.size() && num_known > 0 && known.count(place_of(at)) == 0)
            continue;
          if (!places.empty()) {
            const Vector2d from = places.back();
            const double step_m = (at - from).norm();
            if (step_m < 1.0) continue;
            const int num =
                std::min(static_cast<int>(std::ceil(step_m / (1.25 * kind.span_m))), 1000);
            for (int k = 1; k < num; ++k) places.push_back(from + (at - from) * k / num);
          }
          places.push_back(at);
        }
        if (places.size() < 2) continue;
        PowerLine way{.feature = feature.number, .supports = {}};
        for (std::size_t i = 0; i < places.size(); ++i) {
          const auto [entry, is_new] =
              supports.try_emplace(place_of(places[i]), to.candidates.size());
          if (is_new) {
            const Vector2d before = places[i] - places[i > 0 ? i - 1 : i];
            const Vector2d after = places[i + 1 < places.size() ? i + 1 : i] - places[i];
            const Vector2d direction =
                (i > 0 ? before.normalized() : Vector2d::Zero().eval()) +
                (i + 1 < places.size() ? after.normalized() : Vector2d::Zero().eval());
            Candidate support{.rule = Rule::PowerLines,
                              .footing = Footing::Land,
                              .feature = feature.number,
                              .key = core::stream_of(stream, number)};
            support.thing = thing_row(kind.thing);
            support.place_world = places[i];
            support.heading = heading_of(direction.norm() > 1e-3 ? direction : Vector2d(1.0, 0.0));
            to.candidates.push_back(support);
          }
          ++number;
          way.supports.push_back(entry->second);
        }
        to.lines.push_back(std::move(way));
      }
  }
}

}  // namespace terracast::tiler
