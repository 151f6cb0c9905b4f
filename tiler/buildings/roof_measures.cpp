#include "tiler/buildings/roof_measures.h"

#include <algorithm>
#include <cmath>

#include "core/random.h"
#include "tiler/buildings/building_draws.h"

namespace terracast::tiler {
namespace {

constexpr double kHighestRoof_m = 8.0;
constexpr double kHighestChurchRoof_m = 14.0;
/// Of those that say how high they are, and of spires: as high as buildings are.
constexpr double kUnbounded_m = 1e6;

}  // namespace

double parapet_m(std::uint64_t own) {
  return 0.1 * std::floor(core::random_between(4.0, 10.0, own, 0, kParapet));
}

double highest_roof_m(const BuildingDesign& design) {
  if (design.roof == RoofShape::Spire || design.roof_height_m > 0.0) return kUnbounded_m;
  return design.kind == BuildingKind::Church ? kHighestChurchRoof_m : kHighestRoof_m;
}

double roof_depth_m(const BuildingDesign& design, const RingsSteps& rings, std::uint64_t own) {
  if (design.kind == BuildingKind::Canopy) return 0.0;
  // What finds no other roof has a flat one.
  const double flat_m = parapet_m(own);
  if (design.roof == RoofShape::Flat) return flat_m;
  const Rectangle box = rectangle_round(rings.front());
  const double run_steps = design.roof == RoofShape::Skillion ? box.length_steps + box.width_steps
                                                              : 0.5 * box.width_steps;
  const double run_m = run_steps * world::kHeightStep_m + kMostOverhang * kEaves_m;
  const double rise_m =
      design.roof_height_m > 0.0 ? design.roof_height_m : design.roof_slope * run_m;
  const double depth_m = std::min({rise_m, highest_roof_m(design), design.top_m}) + kFascia_m;
  return std::max(0.1 * std::ceil(10.0 * depth_m), flat_m);
}

}  // namespace terracast::tiler
