#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "batch/dataset/dataset_facts.h"
#include "core/json.h"

namespace terracast::batch {

inline constexpr std::string_view kIndexFile = "index.jsonl";

/// A member of each line of index.jsonl.
struct IndexField {
  std::string_view name;
  std::string_view type;  ///< Croissant's: sc:Text, sc:Integer, sc:Float
  bool is_repeated = false;
  std::string_view meaning;
  core::Json (*value)(const SequenceFacts&);
};
std::span<const IndexField> index_fields();

/// index.jsonl: an object a line for each sequence, by id.
std::string index_lines(const std::vector<SequenceFacts>& sequences);

/// splits/<split>.txt: the ids of its sequences, one a line.
std::string split_lines(const std::vector<SequenceFacts>& sequences, Split split);

}  // namespace terracast::batch
