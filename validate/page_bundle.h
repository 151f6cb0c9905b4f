#pragma once

#include <string_view>

/// The page's own files, made from validate/page when terracast is built; the program carries them.
namespace terracast::validate {

std::string_view page_script();  ///< page.js: needs no other file and no network
std::string_view page_style();   ///< page.css

}  // namespace terracast::validate
