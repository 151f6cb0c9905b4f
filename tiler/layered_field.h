#pragma once

#include <memory>
#include <vector>

#include "geo/geodesy.h"
#include "tiler/grid.h"
#include "tiler/height_field.h"

namespace terracast::tiler {

/// A field that lies over others where it counts.
struct FieldLayer {
  std::unique_ptr<HeightField> field;
  Grid<float> share;  ///< 0 … 1 at the field's whole map coordinates; empty: 1 everywhere
};

/// Fields over each other, the surface of each blended into what lies below by its share: no step
/// anywhere, once continuously differentiable where each is. Sea is where all that count are sea.
///
/// Map coordinates are the world x and y of a place's foot on the ellipsoid, in metres; those of
/// each field are interpolated from a grid of them, to 1e-6 m on the ground.
///
/// layers    from the base (without share) up; all of one datum
/// fit_m     above 0: the base is made to fit the layer above it where that ends: what it lacks
///           there goes on outward as a membrane and fades out over this distance
/// throws    Input: a field's projection bends more than 1e-3 m between the closest nodes
std::unique_ptr<HeightField> make_layered_field(const geo::WorldFrame& frame, double size_m,
                                                std::vector<FieldLayer> layers, double fit_m);

}  // namespace terracast::tiler
