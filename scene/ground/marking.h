#pragma once

#include "core/semantic_class.h"
#include "world/ground_paint.h"

/// Marks painted on roads, runways and other strips: rectangles and the strokes of numbers, laid out in
/// metres across and along the strip by published standards. One description says which places are
/// marked, exactly, and what share of a square around a place is.
namespace terracast::scene {

/// Shares of a square that marks of each colour cover, 0 … 1 together.
struct MarkCover {
  double white = 0.0;
  double yellow = 0.0;
  double share() const { return white + yellow; }
};

/// Whether a place is on a mark.
bool is_marked(const world::PaintSample& paint);

/// The share that marks cover of a square about the place, its sides along and across the strip's line.
/// width_m    of the square; 0: the place itself
/// accuracy   1e-9, where the line is straight
MarkCover marks_within(const world::PaintSample& paint, double width_m);

/// The class of painted ground: its coating's, or RoadMarking where it is marked.
core::SemanticClass class_of(const world::PaintSample& paint);

/// Rails and their sleepers, for the ground between and below them (EN 13674-1 60E1, EN 13230 B70,
/// gauge 1435 mm).
struct TrackCover {
  double rail = 0.0;       ///< share of a square that is rail
  double sleeper = 0.0;    ///< … that is sleeper
  double rail_side = 0.0;  ///< … that is shade and rust at the rails' feet
};
/// Of a strip with Marking::Rails; as marks_within.
TrackCover tracks_within(const world::PaintSample& paint, double width_m);

}  // namespace terracast::scene
