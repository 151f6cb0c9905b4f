#pragma once

#include <string>
#include <string_view>

#include "validate/check.h"

/// The parts of an evaluation's page, which is one file: pictures and plots stand in it.
namespace terracast::validate {

/// Head, style and all that the page begins with; and its end.
std::string page_head(std::string_view title);
std::string page_end();

/// A picture as PNG inside the page, with its title below.
std::string figure(const CheckResult::Picture& picture);

/// A line plot as SVG.
std::string svg_of(const CheckResult::Plot& plot);

}  // namespace terracast::validate
