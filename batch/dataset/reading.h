#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace terracast::batch {

/// How the users of a format read it.
struct FormatReading {
  std::string_view format;
  std::string_view title;
  std::string_view words;  ///< one sentence, Markdown
  std::vector<std::string_view>
      tags;  ///< what the format holds, as those who list datasets call it
};

/// The format's entry; one that says nothing but the name for a format of another program.
FormatReading reading_of(std::string_view format);

/// What a file is to programs that read the web, by its extension.
std::string_view mime_type(std::string_view extension);

}  // namespace terracast::batch
