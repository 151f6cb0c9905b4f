#pragma once

#include "batch/dataset/dataset_facts.h"

namespace terracast::batch {

/// A dataset of two runs, three sequences and two formats.
DatasetFacts sample_facts();

}  // namespace terracast::batch
