#include "export/coco_categories.h"

#include <algorithm>
#include <array>

#include "core/error.h"

namespace terracast::exporters {
namespace {

struct CocoName {
  int id;
  std::string_view name;
  std::string_view supercategory;
};

/// Those that configs/classes.toml names, as panoptic_coco_categories.json of cocodataset/panopticapi has them. Up to 90
/// they are things.
constexpr std::array kCocoNames = {
    CocoName{1, "person", "person"},
    CocoName{3, "car", "vehicle"},
    CocoName{5, "airplane", "vehicle"},
    CocoName{6, "bus", "vehicle"},
    CocoName{7, "train", "vehicle"},
    CocoName{8, "truck", "vehicle"},
    CocoName{9, "boat", "vehicle"},
    CocoName{95, "bridge", "building"},
    CocoName{125, "gravel", "ground"},
    CocoName{147, "railroad", "ground"},
    CocoName{148, "river", "water"},
    CocoName{149, "road", "ground"},
    CocoName{154, "sand", "ground"},
    CocoName{155, "sea", "water"},
    CocoName{159, "snow", "ground"},
    CocoName{178, "water-other", "water"},
    CocoName{184, "tree-merged", "plant"},
    CocoName{187, "sky-other-merged", "sky"},
    CocoName{191, "pavement-merged", "ground"},
    CocoName{193, "grass-merged", "plant"},
    CocoName{194, "dirt-merged", "ground"},
    CocoName{197, "building-other-merged", "building"},
    CocoName{198, "rock-merged", "solid"},
    CocoName{199, "wall-other-merged", "wall"},
};
constexpr int kLastThing = 90;

CocoCategory coco_category(const core::SemanticClassInfo& info) {
  const auto* name = std::find_if(kCocoNames.begin(), kCocoNames.end(),
                                  [&](const CocoName& one) { return one.id == info.coco_id; });
  TERRACAST_CHECK(name != kCocoNames.end(), "class {} has COCO's number {}, which has no name here",
                  info.name, info.coco_id);
  return {.id = info.coco_id,
          .name = name->name,
          .supercategory = name->supercategory,
          .is_thing = info.coco_id <= kLastThing,
          .first_class = info.id};
}

CocoCategory own_category(const core::SemanticClassInfo& info) {
  return {.id = static_cast<int>(info.id) + 1,
          .name = info.name,
          .supercategory = info.parent,
          .is_thing = info.is_thing,
          .first_class = info.id};
}

}  // namespace

CocoCategories::CocoCategories(bool is_own) {
  std::vector<int> ids;  // by class; 0: void
  for (const core::SemanticClassInfo& info : core::semantic_classes()) {
    const bool is_void = is_own ? info.id == capture::SemanticClass::Nothing : info.coco_id == 0;
    ids.push_back(0);
    if (is_void) continue;
    const CocoCategory category = is_own ? own_category(info) : coco_category(info);
    ids.back() = category.id;
    if (std::none_of(categories_.begin(), categories_.end(),
                     [&](const CocoCategory& one) { return one.id == category.id; }))
      categories_.push_back(category);
  }
  std::sort(categories_.begin(), categories_.end(),
            [](const CocoCategory& a, const CocoCategory& b) { return a.id < b.id; });
  for (const int id : ids) {
    const auto found = std::find_if(categories_.begin(), categories_.end(),
                                    [&](const CocoCategory& one) { return one.id == id; });
    index_of_class_.push_back(
        found == categories_.end() ? -1 : static_cast<int>(found - categories_.begin()));
  }
}

const CocoCategory* CocoCategories::of(capture::SemanticClass semantic_class) const {
  const int index = index_of_class_.at(static_cast<std::size_t>(semantic_class));
  return index < 0 ? nullptr : &categories_[static_cast<std::size_t>(index)];
}

core::Json CocoCategories::json(bool is_panoptic) const {
  core::Json list = core::Json::array();
  for (const CocoCategory& category : categories_) {
    if (!is_panoptic && !category.is_thing) continue;
    core::Json one = core::Json::object();
    one.set("id", category.id)
        .set("name", category.name)
        .set("supercategory", category.supercategory);
    if (is_panoptic) {
      const auto& color =
          core::semantic_classes()[static_cast<std::size_t>(category.first_class)].color_srgb;
      core::Json rgb = core::Json::array();
      for (const std::uint8_t value : color) rgb.push(static_cast<int>(value));
      one.set("isthing", category.is_thing ? 1 : 0).set("color", std::move(rgb));
    }
    list.push(std::move(one));
  }
  return list;
}

}  // namespace terracast::exporters
