#pragma once

#include <Eigen/Core>
#include <array>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tiler/objects/thing_mesh.h"

namespace terracast::tiler {

/// How a thing meets the ground.
enum class Stance {
  Stands,  ///< its lowest points, such as the wheels' feet, are at z = 0
  Rooted,  ///< it goes on below z = 0, into the ground
  Floats,  ///< z = 0 is its water line
};

/// A built-in thing. Its frame: x forward, y left, z up, m; about the middle of where it stands.
struct ThingInfo {
  std::string name;
  std::string_view family;  ///< the file: cars, ships, …
  core::SemanticClass semantic_class = core::SemanticClass::Object;
  Stance stance = Stance::Stands;
  /// Length, width and height above z = 0 of the finest level's box.
  Eigen::Vector3d size_m = Eigen::Vector3d::Zero();
  std::string_view source;  ///< of the sizes
  double pivots_m = 0.0;    ///< of cars of trains: from the pivot of one bogie to that of the other
  /// Of the tiles on which its levels of detail are shown, finest first.
  std::vector<int> coarsest_levels;
  int num_variants = 1;  ///< colours
  /// detail    0: the finest, to coarsest_levels.size() - 1
  std::function<void(ThingMesh& mesh, int detail, int variant)> build;
};

/// The table of built-in things, family after family.
std::span<const ThingInfo> all_things();
/// nullptr: there is none.
const ThingInfo* find_thing(std::string_view name);
std::vector<std::string> thing_names();

/// name    "<thing>" or, of several variants, "<thing> <number>"
world::Prototype thing_prototype(const ThingInfo& thing, int variant);

/// A thing as it moves: what turns has shapes of its own.
struct MovableThing {
  world::Shape shape;
  std::vector<TurningShape> turning;
};
/// Its finest level.
MovableThing movable_thing(const ThingInfo& thing, int variant);

/// Sides of something round: fewer on coarser levels, an even number, at least four.
int round_sides(int finest, int detail);

}  // namespace terracast::tiler
