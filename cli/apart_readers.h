#pragma once

#include <span>

#include "core/reading_apart.h"

namespace terracast::cli {

/// All that this program reads in processes of its own.
std::span<const core::ApartReader> apart_readers();

}  // namespace terracast::cli
