#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "core/semantic_class.h"

namespace terracast::world {

/// What the surface of an object is made of; how it is drawn is render's.
enum class Material : std::uint8_t {
  // Walls, with storeys, windows and doors where a finish's pattern says so.
  Plaster = 0,
  Brick,
  StoneWall,
  ConcreteWall,
  WoodWall,
  GlassFacade,
  SheetMetal,  ///< corrugated: halls, containers
  // Roofs.
  RoofTiles,
  Slate,
  FlatRoof,
  MetalRoof,
  Thatch,
  // Plants.
  Bark,
  Leaves,
  Needles,
  Blades,  ///< of grass, reed, corn
  // Things.
  Paint,  ///< of vehicles and machines
  Glass,
  Rubber,
  Metal,
  Concrete,
  Asphalt,
  Boulder,
  Planks,
  Plain,     ///< a finish's colour and nothing else
  Textured,  ///< by the texture that a finish's pattern names
  Lamp,      ///< gives light at night
};
inline constexpr int kNumMaterials = 27;

/// How a part of a shape looks, and what it is.
struct Finish {
  Material material = Material::Plain;
  core::SemanticClass semantic_class = core::SemanticClass::Object;
  std::array<std::uint8_t, 3> color_srgb = {128, 128, 128};
  /// Walls: facade_pattern(), 0 without windows. Textured: row of WorldManifest::textures. Others: 0.
  std::uint16_t pattern = 0;

  bool operator==(const Finish&) const = default;
};

/// Which windows, doors and bands a wall has.
enum class FacadeStyle : std::uint8_t {
  House = 0,    ///< single windows, a door here and there at the foot
  Shutters,     ///< the same with shutters beside the windows
  Apartments,   ///< rows of windows, glass doors with railings in some bays
  Shops,        ///< shop windows at the foot, dwellings above
  Offices,      ///< bands of glass along each storey
  CurtainWall,  ///< glass all over, with frames
  Hall,         ///< gates at the foot, a band of light below the eaves
  Church,       ///< few tall windows with arches
  Garage,       ///< gates along the foot
};

/// style         a FacadeStyle, or its number
/// storey_dm     height of its storeys in decimetres, 1 … 255
constexpr std::uint16_t facade_pattern(std::uint8_t style, std::uint8_t storey_dm) {
  return static_cast<std::uint16_t>(style << 8 | storey_dm);
}
constexpr std::uint16_t facade_pattern(FacadeStyle style, std::uint8_t storey_dm) {
  return facade_pattern(static_cast<std::uint8_t>(style), storey_dm);
}

/// Triangles of an object. Vertices lie on the world's lattice of kHeightStep_m, so that they are
/// exact in a tile's floats and the same in every tile in which they are shown.
struct Shape {
  struct Triangle {
    std::array<std::uint32_t, 3> corners = {};  ///< counter-clockwise seen from outside
    std::uint8_t finish = 0;                    ///< of finishes
    bool operator==(const Triangle&) const = default;
  };

  /// Steps of kHeightStep_m from the shape's own origin: of an object's shape, along the world's
  /// axes; of a prototype, x and y level, z up at its foot.
  std::vector<Eigen::Vector3i> vertices_steps;
  /// Of each vertex, or none: metres along the surface. On walls x runs along the wall and y up from
  /// its foot; Textured: in the texture's own lengths. Vertices of one place may differ in it.
  std::vector<Eigen::Vector2f> uv;
  std::vector<Triangle> triangles;
  std::vector<Finish> finishes;  ///< at most 256

  bool operator==(const Shape&) const = default;
};

/// What is shown of something on fine or coarse tiles.
struct ShapeLevel {
  std::int8_t coarsest_level = 0;  ///< of the tiles on which it is shown so
  Shape shape;
  bool operator==(const ShapeLevel&) const = default;
};

/// Finest first, each coarsest_level above the one before.
using ShapeLevels = std::vector<ShapeLevel>;

/// What is shown on a tile of a level: the finest shape that goes so far; null: nothing.
inline const Shape* shape_at(const ShapeLevels& levels, int tile_level) {
  for (const ShapeLevel& level : levels)
    if (tile_level <= level.coarsest_level) return &level.shape;
  return nullptr;
}

/// Something that is shown in many places, such as a tree or a car.
struct Prototype {
  std::string name;
  ShapeLevels levels;
  bool is_model = false;  ///< a user's: its meshes are what their file has, closed or not
  bool operator==(const Prototype&) const = default;
};

}  // namespace terracast::world
