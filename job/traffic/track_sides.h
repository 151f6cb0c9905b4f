#pragma once

#include <Eigen/Core>
#include <vector>

#include "job/traffic/way_graph.h"

namespace terracast::job {

/// Which way trains go on tracks beside each other. Threads: safe.
class TrackSides {
 public:
  /// on_left   trains keep to the left of two tracks
  TrackSides(const WayGraph& graph, bool on_left);

  /// Whether trains go along an arm in its direction: both ways on single tracks and amid several; where another track
  /// is beside it, 2.5 m to 7.5 m away, at one side alone, this one is that of the side on which they keep.
  bool goes(const Arm& arm) const;

 private:
  struct Box {
    std::uint32_t part = 0;
    Eigen::Vector2d low;
    Eigen::Vector2d high;
  };
  /// Looks whether a track is to the left and to the right of the middle of a part, seen along its line.
  void look_beside(std::uint32_t part, bool& at_left, bool& at_right) const;

  const WayGraph& graph_;
  bool on_left_;
  std::vector<Box> tracks_;
};

}  // namespace terracast::job
