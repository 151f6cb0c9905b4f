#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "capture/channel.h"
#include "core/json.h"

/// What COCO calls our classes.
namespace terracast::exporters {

struct CocoCategory {
  int id = 0;
  std::string_view name;
  std::string_view supercategory;
  bool is_thing = false;                                             ///< can be counted
  capture::SemanticClass first_class = capture::SemanticClass::Sky;  ///< whose color it has
};

/// The categories of a dataset: COCO's own of its panoptic task, into which several classes may fall and some into
/// none; or our classes, numbered as in configs/classes.toml plus 1, since 0 is COCO's void.
class CocoCategories {
 public:
  /// is_own   ours
  explicit CocoCategories(bool is_own);

  /// Sorted by id.
  std::span<const CocoCategory> all() const { return categories_; }
  /// Null: void.
  const CocoCategory* of(capture::SemanticClass semantic_class) const;
  /// The member "categories" of the panoptic file, or of that of instances: its things.
  core::Json json(bool is_panoptic) const;

 private:
  std::vector<CocoCategory> categories_;
  std::vector<int> index_of_class_;  ///< -1: void
};

}  // namespace terracast::exporters
