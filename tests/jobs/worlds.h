#pragma once

#include <span>
#include <string>

namespace terracast::test {

/// A world that jobs share.
struct JobWorld {
  std::string name;
  std::string text;         ///< of its file; @CONFIGS@ stands for the folder of the shipped configs
  double weight = 1.0;      ///< by which it is drawn
  double reach_m = 1000.0;  ///< flights start so far from the origin at most, east and north each
  double least_agl_m = 2.0;  ///< nothing on the ground reaches higher where flights may be low
  double most_agl_m = 1500.0;
  bool needs_data = false;  ///< of the folder that the option --data names
  bool is_formula = false;  ///< 8 km of bare ground, made in a second
  bool has_roads = false;
  bool is_land = true;  ///< all of it
};

/// All of them, in an order that stays: jobs draw from it.
std::span<const JobWorld> job_worlds();

}  // namespace terracast::test
