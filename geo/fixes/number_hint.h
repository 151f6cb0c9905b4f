#pragma once

#include <string>
#include <string_view>

namespace terracast::geo {

/// What a message adds of a text that is no plain number but one in another spelling; empty: it is none either.
/// way_out   what to do then
std::string number_hint(std::string_view text, std::string_view way_out);

/// A number with a comma for its decimal sign.
bool is_number_with_comma(std::string_view text);

/// An angle as degrees_from_text() has it, of either axis.
bool is_angle_text(std::string_view text);

}  // namespace terracast::geo
