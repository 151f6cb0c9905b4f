#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "core/semantic_class_table.h"

namespace terracast::core {

/// What a point of the world is. The enumerators, their numbers and all that is known of them stand in
/// configs/classes.toml; the numbers stand in files and never change their meaning.
enum class SemanticClass : std::uint8_t {
#define TERRACAST_ENUMERATOR(enumerator, id, ...) enumerator = id,
  TERRACAST_SEMANTIC_CLASSES(TERRACAST_ENUMERATOR)
#undef TERRACAST_ENUMERATOR
};

#define TERRACAST_COUNT(...) +1
inline constexpr std::size_t kNumSemanticClasses = 0 TERRACAST_SEMANTIC_CLASSES(TERRACAST_COUNT);
#undef TERRACAST_COUNT

/// A row of the table of classes.
struct SemanticClassInfo {
  SemanticClass id = SemanticClass::Sky;
  std::string_view name;
  std::string_view meaning;
  std::array<std::uint8_t, 3> color_srgb = {};
  std::string_view parent;  ///< sky, ground, water, transport, construction, …
  bool is_thing = false;    ///< can be counted: each has an instance id
  // Numbers in other sets of classes; 0: the set has none that is meant so.
  int cityscapes_id = 0;  ///< and of KITTI's semantics
  int ade20k_id = 0;      ///< 1 … 150
  int coco_id = 0;        ///< of COCO's panoptic classes
};

/// The table of classes, by number.
std::span<const SemanticClassInfo> semantic_classes();

/// The classes' names, by number.
std::span<const std::string_view> semantic_class_names();

}  // namespace terracast::core
