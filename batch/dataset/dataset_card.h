#pragma once

#include <string>

#include "batch/dataset/dataset_facts.h"

namespace terracast::batch {

/// README.md of a dataset: the card that Hugging Face shows, with its facts in YAML before it. Each list
/// is sorted by name; text from outside shows as it is (markdown_text).
std::string dataset_card(const DatasetFacts& facts);

}  // namespace terracast::batch
