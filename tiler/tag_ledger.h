#pragma once

#include <span>

#include "core/ledger.h"
#include "tiler/tag_rules.h"
#include "tiler/vector_source.h"

namespace terracast::tiler {

/// Counts every tag of features by what a layer makes of it, and the values that are not understood.
/// number_field   is used, whatever the table says (VectorOptions); "": there is none
core::Ledger ledger_of_tags(std::span<const VectorFeature> features, const TagTable& table,
                            std::string_view number_field = {});

}  // namespace terracast::tiler
