#include "core/semantic_class.h"

namespace terracast::core {

std::span<const SemanticClassInfo> semantic_classes() {
#define TERRACAST_ROW(enumerator, id, name, meaning, rrggbb, parent, is_thing, cityscapes, ade20k, \
                      coco)                                                                        \
  SemanticClassInfo{SemanticClass::enumerator,                                                     \
                    name,                                                                          \
                    meaning,                                                                       \
                    {(rrggbb) >> 16 & 0xff, (rrggbb) >> 8 & 0xff, (rrggbb)&0xff},                  \
                    parent,                                                                        \
                    is_thing,                                                                      \
                    cityscapes,                                                                    \
                    ade20k,                                                                        \
                    coco},
  static constexpr std::array<SemanticClassInfo, kNumSemanticClasses> kTable = {
      TERRACAST_SEMANTIC_CLASSES(TERRACAST_ROW)};
#undef TERRACAST_ROW
  return kTable;
}

std::span<const std::string_view> semantic_class_names() {
#define TERRACAST_NAME(enumerator, id, name, ...) name,
  static constexpr std::array<std::string_view, kNumSemanticClasses> kNames = {
      TERRACAST_SEMANTIC_CLASSES(TERRACAST_NAME)};
#undef TERRACAST_NAME
  return kNames;
}

}  // namespace terracast::core
