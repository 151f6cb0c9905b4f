#include <algorithm>
#include <cmath>

#include "core/random.h"
#include "tiler/objects/object_tags.h"
#include "tiler/objects/rules.h"

namespace terracast::tiler {
namespace {

using Eigen::Vector2d;

// The stands that the layer of roads paints: rows along the longest side, two and a lane 16 m apart.
constexpr double kStand_m = 2.5;
constexpr double kDepth_m = 5.0;
constexpr double kRows_m = 16.0;
constexpr double kLargest_m2 = 4e5;

constexpr Chance kCars[] = {{"hatchback", 0.26}, {"city_car", 0.12}, {"sedan", 0.18},
                            {"estate", 0.15},    {"suv", 0.20},      {"small_van", 0.05},
                            {"pickup", 0.04}};

void park(const RuleInputs& inputs, const VectorFeature& feature,
          const std::vector<PointsWorld>& rings, std::uint64_t stream, Proposals& to) {
  const PointsWorld& ring = rings.front();
  const Vector2d direction = main_direction(ring);
  const Vector2d left(-direction.y(), direction.x());
  Vector2d low = Vector2d::Constant(1e300);
  Vector2d high = Vector2d::Constant(-1e300);
  for (const Vector2d& at : ring) {
    const Vector2d own(at.dot(direction), at.dot(left));
    low = low.cwiseMin(own);
    high = high.cwiseMax(own);
  }
  const Vector2d size = high - low;
  if (size.x() * size.y() > kLargest_m2 || size.x() > 2000.0 || size.y() < kDepth_m) return;
  struct Row {
    double across_m;
    double side;  ///< the lane lies to the left: 1
  };
  std::vector<Row> rows;
  const int num_pairs = static_cast<int>(std::floor(size.y() / kRows_m));
  const double first_m = low.y() + 0.5 * (size.y() - num_pairs * kRows_m);
  for (int k = 0; k < num_pairs; ++k) {
    rows.push_back({first_m + k * kRows_m + 0.5 * kDepth_m, 1.0});
    rows.push_back({first_m + (k + 1) * kRows_m - 0.5 * kDepth_m, -1.0});
  }
  if (num_pairs == 0) rows.push_back({low.y() + 0.5 * kDepth_m + 0.3, 1.0});
  std::uint64_t number = 0;
  for (const Row& row : rows) {
    const auto is_stand = [&](double along_m) {
      for (const double off : {-0.5, 0.0, 0.5})
        if (!is_inside(rings, along_m * direction + (row.across_m + off * (kDepth_m - 0.1)) * left))
          return false;
      return true;
    };
    double from_m = 0.0;
    int num = 0;
    const auto finish = [&] {
      // The first and last stands of a run are left out where lines are painted, too.
      for (int k = 0; num >= 5 && k + 3 < num; ++k) {
        const std::uint64_t draw = core::random_bits(inputs.seed, stream, number++);
        if (static_cast<double>(draw >> 11U) * 0x1.0p-53 >= inputs.options.parked_cars) continue;
        const auto shift = [&](std::uint64_t index, double by_m) {
          return core::random_between(-by_m, by_m, inputs.seed, core::stream_of(stream, draw),
                                      index);
        };
        const double along_m = from_m + kStand_m + (k + 0.5) * kStand_m + shift(1, 0.12);
        Candidate car{.rule = Rule::ParkedCars,
                      .footing = Footing::Paved,
                      .feature = feature.number,
                      .key = core::stream_of(stream, number),
                      .steepest = 0.10};
        choose(car, kCars, core::random_bits(inputs.seed, core::stream_of(stream, draw), 2));
        car.place_world = along_m * direction + (row.across_m + shift(3, 0.15)) * left;
        // Most stand with their nose away from the lane.
        const double nose = (draw & 7U) < 6U ? -row.side : row.side;
        car.heading =
            static_cast<std::uint16_t>(heading_of(nose * left) + static_cast<int>(shift(4, 180.0)));
        to.candidates.push_back(car);
      }
      num = 0;
    };
    for (double along_m = low.x() + 1.0; along_m < high.x(); along_m += kStand_m) {
      if (is_stand(along_m)) {
        if (num == 0) from_m = along_m;
        ++num;
      } else {
        finish();
      }
    }
    finish();
  }
}

}  // namespace

void propose_parked_cars(const RuleInputs& inputs, Proposals& to) {
  for (const VectorFeature& feature : inputs.features) {
    const ObjectTags tags(feature.tags);
    if (feature.kind != FeatureKind::Area || tags.value("amenity") != "parking") continue;
    if (is_one_of(tags.value("parking"), "underground|multi-storey|rooftop|sheds")) continue;
    for (std::size_t part = 0; part < feature.parts_world.size(); ++part)
      if (!feature.parts_world[part].empty() && feature.parts_world[part].front().size() >= 3)
        park(inputs, feature, feature.parts_world[part],
             core::stream_of(core::stream_of(0x7061726bULL, feature.number), part), to);
  }
}

}  // namespace terracast::tiler
