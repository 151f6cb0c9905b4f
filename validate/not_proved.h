#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/json.h"
#include "validate/dataset.h"

namespace terracast::validate {

/// What a dataset states and no check proves. In both patterns * stands for any letters.
struct NotProved {
  std::string files;  ///< paths: "*/sensors/*.csv"
  std::string
      fields;  ///< members of JSON as "/cameras/*/name", columns as "range_m", words as "P2[3]"; "*": all
  std::string why;
  std::int64_t num_files = 0;  ///< of the dataset
};

/// The part of what is never proved that the dataset holds, and each file that no check reads.
std::vector<NotProved> not_proved(const Dataset& dataset);

/// The first that names a field; null: none, so that a check finds what is wrong with it.
const NotProved* named_by(const std::vector<NotProved>& named, const std::string& file,
                          const std::string& field);

/// [{"files", "fields", "why", "num_files"}]
core::Json not_proved_json(const std::vector<NotProved>& named);

}  // namespace terracast::validate
