#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "capture/frame_reader.h"
#include "labels/matches.h"

/// Which points the labels `tracks` follow.
namespace terracast::labels {

struct TrackDraw {
  std::int64_t num_points = 0;
  double moving_share = 0.0;  ///< of them on what moves, as far as as much is seen
  std::uint64_t seed = 0;
};

/// A point of a surface, and the pixel whose centre shows it.
struct TrackedPoint {
  ShownPoint point;
  ImageOf image;
  Eigen::Vector2i pixel = Eigen::Vector2i::Zero();
  std::uint32_t instance_id = 0;  ///< as the capture has them
  std::uint32_t semantic_id = 0;
};

/// Points drawn from the images of some cameras: all frames and cameras in turn, pixels of an image at random, of what
/// moves each thing that an image shows as often as another. No pixel is drawn twice; one of which the camera does not
/// see the very point (at a rim, by less than roundings) is not taken. Points on what moves are spread evenly among the
/// others, so that any first points have the same share of them.
/// cameras       ascending
/// returns       fewer than were asked for where the images have no more pixels that show anything
/// determinism   of the capture, the draw and the cameras, whatever the threads
/// cost          reads the facts of the images drawn from, once for what stands and once for what moves, and again where
///               images showed less than was wanted of them; two rays a point
/// throws        Input, Io: as Matcher::points
std::vector<TrackedPoint> draw_tracks(const capture::SequenceReader& sequence,
                                      const Matcher& matcher, const TrackDraw& draw,
                                      std::span<const int> cameras);

/// Places of `count` images in an order of which any run is spread evenly over them: steps of the golden ratio, each
/// place once.
std::vector<std::size_t> golden_order(std::size_t count);

}  // namespace terracast::labels
