#pragma once

#include <functional>
#include <vector>

#include "core/context.h"
#include "geo/trajectory.h"
#include "render/sequence_plan.h"
#include "world/nearest_surface.h"

namespace terracast::job {

/// An upper bound on the speed of a motion in one of its pieces between knots. It holds where the velocity's coordinates,
/// or the speed itself, are polynomials of the time of degree 8 at most: those of all kinds of trajectories are, but for
/// the Earth's curve, for which docs/frames.md says why the bound holds.
struct SpeedBound {
  double begin_s;
  double end_s;
  double most_mps;
};

/// returns   pieces that cover from_s to until_s without a gap
std::vector<SpeedBound> speed_bounds(const geo::Trajectory& motion, double from_s, double until_s);

/// Told the time of the sequence up to which a path is proved; empty: nobody is.
using ClearanceProgress = std::function<void(double time_s)>;

/// Proves that the whole path of a body's place, between frames too, stays at least least_m from every surface of a cut:
/// from a place at the distance d it steps by the time in which the body moves by d - least_m at most.
/// until_s    time of the sequence at which the path ends; it begins at 0
/// throws     Input: it comes nearer (time, place, distance, what is there), or may do so: within 5 mm more; it begins below
///            the ground or water; Io
/// cost       some thousand distances for a flight of a kilometre near the ground; one for each 4 mm of it at most
void prove_clearance(const geo::BodyMotion& motion, double until_s, double least_m,
                     world::SurfaceFinder& finder, const world::TileStore& store,
                     const ClearanceProgress& progress = {});

/// Proves the same of a sequence from its first frame to its last, in the geometry that it shows.
/// least_m   above 0
void prove_clearance(const render::SequencePlan& plan, double least_m,
                     const world::TileStore& store, const core::Context& context);

}  // namespace terracast::job
