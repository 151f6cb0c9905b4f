#pragma once

#include <string_view>

namespace terracast::validate {

/// Formats of plug-ins have a dot in their names. No reader of ours knows them: of such a dataset the files are checked,
/// and no sequence is read.
inline bool is_format_of_plugin(std::string_view format) {
  return format.find('.') != std::string_view::npos;
}

}  // namespace terracast::validate
