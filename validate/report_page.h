#pragma once

#include <string>
#include <string_view>

/// The frame of the report's pages: head with style, end, and escaping.
namespace terracast::validate {

/// Text as it may stand in HTML and in attributes; line ends become <br>.
std::string escaped(std::string_view text);
std::string first_line(std::string_view text);
std::string page_head(std::string_view title);
std::string page_end();

}  // namespace terracast::validate
