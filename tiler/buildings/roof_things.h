#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "tiler/buildings/building_design.h"
#include "tiler/buildings/footprint.h"
#include "tiler/buildings/roof.h"

/// What stands on roofs: boxes that are holes in them.
namespace terracast::tiler {

/// A box on a roof: its foot lies in one plane of the roof.
struct OnRoof {
  std::array<Eigen::Vector2i, 4> ring;  ///< anticlockwise
  std::array<double, 4> foot_steps{};
  std::array<double, 4> top_steps{};
  std::uint8_t finish = 0;
  std::uint8_t top_finish = 0;
};

/// Of what things on a roof are made: of the walls without windows, metal, or brick and plaster.
enum class RoofFinish : std::uint8_t { Wall, Metal, Chimney };
/// The number of such a finish in the building's shape.
using RoofFinishes = std::function<std::uint8_t(RoofFinish)>;

/// Lift housings, vents and coolers on a flat roof.
/// floor    the roof between its parapets
/// own      drawn for the building
/// height   of the roof, in steps
std::vector<OnRoof> plant_on(const RingsSteps& floor, const BuildingDesign& design,
                             std::uint64_t own, double height, const RoofFinishes& finish_of);

/// Chimneys on the upper part of roofs of houses, each within one face.
/// walls          below the roof
/// own            drawn for the building
/// eaves_height   where the roof begins, in steps
std::vector<OnRoof> chimneys_on(const Roof& roof, const RingsSteps& walls,
                                const BuildingDesign& design, std::uint64_t own,
                                double eaves_height, const RoofFinishes& finish_of);

}  // namespace terracast::tiler
