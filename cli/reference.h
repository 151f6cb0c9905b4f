#pragma once

#include <string>
#include <vector>

namespace terracast::cli {

/// "a, b, c".
std::string joined(const std::vector<std::string>& words);

/// What `terracast list` can list.
std::vector<std::string> listable_names();
/// One name a line with its summary.
/// throws   Usage: cannot be listed (the nearest is named)
std::string list_text(const std::string& what);

/// Keys of a job whose dotted name contains `part`, with type, unit, range, default, meaning.
/// throws   Usage: none does (the nearest is named)
std::string explain_text(const std::string& part);

/// docs/config.md: every key, section by section.
std::string reference_text();

/// docs/classes.md: the table of semantic classes.
std::string classes_page();

}  // namespace terracast::cli
