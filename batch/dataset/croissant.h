#pragma once

#include <string>
#include <vector>

#include "batch/dataset/dataset_facts.h"
#include "core/json.h"

namespace terracast::batch {

/// croissant.json: the dataset in Croissant 1.0 (http://mlcommons.org/croissant/1.0), schema.org's
/// description of datasets for machine learning. Files outside the formats' folders are FileObjects
/// with their SHA-256, those of the formats FileSets by format and extension; the record set `sequences`
/// is index.jsonl, with its splits. Properties that nobody has stated are left out.
/// facts.files   with the card among them
core::Json croissant(const DatasetFacts& facts);

/// Properties that Croissant 1.0 requires and that nobody has stated: of url, creator, datePublished and
/// license.
std::vector<std::string> croissant_gaps(const DatasetFacts& facts);

}  // namespace terracast::batch
