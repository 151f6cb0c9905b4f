#pragma once

#include <array>
#include <cstdint>

#include "core/semantic_class.h"
#include "world/shape.h"

namespace terracast::tiler {

/// Finishes of plants, by colour.
inline world::Finish plant_finish(world::Material material, core::SemanticClass semantic_class,
                                  std::array<std::uint8_t, 3> color_srgb) {
  return {.material = material, .semantic_class = semantic_class, .color_srgb = color_srgb};
}
inline world::Finish tree_bark(std::array<std::uint8_t, 3> color_srgb) {
  return plant_finish(world::Material::Bark, core::SemanticClass::Tree, color_srgb);
}
inline world::Finish tree_leaves(std::array<std::uint8_t, 3> color_srgb) {
  return plant_finish(world::Material::Leaves, core::SemanticClass::Tree, color_srgb);
}
inline world::Finish tree_needles(std::array<std::uint8_t, 3> color_srgb) {
  return plant_finish(world::Material::Needles, core::SemanticClass::Tree, color_srgb);
}
inline world::Finish plant_blades(std::array<std::uint8_t, 3> color_srgb) {
  return plant_finish(world::Material::Blades, core::SemanticClass::Plant, color_srgb);
}

}  // namespace terracast::tiler
