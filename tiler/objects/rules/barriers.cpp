#include <algorithm>
#include <cmath>

#include "core/random.h"
#include "tiler/objects/object_tags.h"
#include "tiler/objects/rules.h"
#include "tiler/objects/things.h"

// Hedges, fences and walls along barrier=*: piece by piece along each straight part.
namespace terracast::tiler {
namespace {

using Eigen::Vector2d;

/// nullptr: of another kind.
const char* thing_of(const ObjectTags& tags) {
  const std::string_view barrier = tags.value("barrier");
  if (barrier == "hedge") {
    const auto width_m = tags.middle("width");
    return width_m && *width_m > 1.2 ? "field_hedge" : "hedge";
  }
  if (barrier == "fence") return "board_fence";
  if (barrier == "wall") return "garden_wall";
  return nullptr;
}

constexpr double kShortest_m = 1.6;
/// Corners that turn by less are gone round without a gap: cosine.
constexpr double kSlightTurn = 0.94;

/// No two pieces of a hedge that stand side by side look alike: some are turned round, and in the fields some
/// are of another kind.
void vary_hedge(Candidate& piece, const ThingInfo& thing) {
  if (thing.semantic_class != core::SemanticClass::Bush) return;
  const std::uint64_t drawn = core::mix_bits(piece.key ^ 0x6865646765ULL);
  if ((drawn & 1U) != 0) piece.heading = static_cast<std::uint16_t>(piece.heading + 0x8000U);
  if (thing.name == "field_hedge" && (drawn >> 1U & 3U) == 0)
    piece.variant =
        static_cast<std::uint8_t>((drawn >> 3U) % static_cast<std::uint64_t>(thing.num_variants));
}

void line_up(const PointsWorld& line, const ThingInfo& thing, const Candidate& like,
             std::uint64_t stream, Proposals& to) {
  std::uint64_t number = 0;
  for (std::size_t k = 0; k + 1 < line.size(); ++k) {
    const Vector2d edge = line[k + 1] - line[k];
    const double edge_m = edge.norm();
    if (!(edge_m > kShortest_m) || edge_m > 1e5) continue;
    const Vector2d along = edge / edge_m;
    const auto gap_at = [&](std::size_t corner, std::size_t beyond) {
      if (corner == beyond) return 0.0;
      const Vector2d other = line[beyond] - line[corner];
      return std::abs(other.normalized().dot(along)) > kSlightTurn ? 0.0 : 0.5 * thing.size_m.y();
    };
    const double from_m = k > 0 ? gap_at(k, k - 1) : 0.0;
    const double until_m = edge_m - (k + 2 < line.size() ? gap_at(k + 1, k + 2) : 0.0);
    const int count = static_cast<int>(std::ceil((until_m - from_m) / thing.size_m.x()));
    if (count < 1) continue;
    const double step_m = (until_m - from_m) / count;
    for (int piece = 0; piece < count; ++piece, ++number) {
      Candidate one = like;
      one.key = core::stream_of(stream, number);
      one.place_world = line[k] + (from_m + (piece + 0.5) * step_m) * along;
      one.heading = heading_of(along);
      vary_hedge(one, thing);
      // Two steps less, so that rounded footprints do not overlap.
      one.scale = static_cast<std::uint16_t>(std::floor(4096.0 * step_m / thing.size_m.x()) - 2.0);
      if (one.scale > 1200) to.candidates.push_back(one);
    }
  }
}

}  // namespace

void propose_barriers(const RuleInputs& inputs, Proposals& to) {
  for (const VectorFeature& feature : inputs.features) {
    const char* name = thing_of(feature.tags);
    if (name == nullptr || feature.kind == FeatureKind::Point) continue;
    const std::uint64_t stream = core::stream_of(0x62617272ULL, feature.number);
    Candidate like{.rule = Rule::Barriers, .footing = Footing::Land, .feature = feature.number};
    like.thing = thing_row(name);
    const ThingInfo& thing = all_things()[like.thing];
    like.variant = static_cast<std::uint8_t>(core::random_bits(inputs.seed, stream, 1) %
                                             static_cast<std::uint64_t>(thing.num_variants));
    std::uint64_t part_number = 0;
    for (const auto& part : feature.parts_world)
      for (PointsWorld line : part) {
        if (feature.kind == FeatureKind::Area && !line.empty()) line.push_back(line.front());
        line_up(line, thing, like, core::stream_of(stream, part_number++), to);
      }
  }
}

}  // namespace terracast::tiler
