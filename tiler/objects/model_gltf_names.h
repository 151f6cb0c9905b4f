#pragma once

#include <span>
#include <string_view>

#include "core/json.h"
#include "core/ledger.h"

namespace terracast::tiler {

/// Members, extensions and attributes of glTF 2 that the reader knows.
std::span<const core::KnownName> gltf_names();

/// Whether a model that requires an extension is what it should be when it is read here.
bool is_gltf_extension_read(std::string_view extension);

/// Counts all members of a glTF file's description and all its extensions; attributes are left to who reads them.
void count_gltf(const core::Json& root, core::Ledger& ledger);

}  // namespace terracast::tiler
