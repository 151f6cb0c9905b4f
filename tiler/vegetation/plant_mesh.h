#pragma once

#include <Eigen/Core>
#include <span>

#include "tiler/vegetation/plant.h"
#include "world/shape.h"

namespace terracast::tiler {

/// A level of detail that is wanted.
struct PlantLevel {
  int coarsest_level = 0;  ///< of the tiles
  int max_triangles = 0;
};

/// All of a plant's stems and leaves.
world::Shape full_mesh(const Plant& plant);

/// A plant with at most so many triangles: thin stems are left out, and leaves are drawn together
/// into fewer and larger ones, so that height and width stay, and the area that is seen
/// (seen_area_m2()) stays within 12 % as long as there are leaves to do it with.
/// full_area_m2   of full_mesh()
world::Shape mesh_of(const Plant& plant, int max_triangles, double full_area_m2);

/// Levels of detail, finest first.
world::ShapeLevels levels_of(const Plant& plant, std::span<const PlantLevel> levels);

/// Area of a shape's outline, gaps left out, the mean of views from the sides, aslant and from
/// above; as far as a raster of 160 cells along the largest extent shows it.
double seen_area_m2(const world::Shape& shape);

/// Area of a shape's outline from above, as far as a raster of 96 cells shows it.
double plan_area_m2(const world::Shape& shape);

}  // namespace terracast::tiler
