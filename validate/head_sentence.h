#pragma once

#include <string>

#include "core/json.h"

namespace terracast::validate {

/// What a report.json says, in one sentence: what is wrong, what was proved, and what this dataset could not have shown.
std::string head_sentence(const core::Json& report);

}  // namespace terracast::validate
