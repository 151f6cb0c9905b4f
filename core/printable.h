#pragma once

#include <cstddef>
#include <string>
#include <string_view>

/// Text from outside (names of files, cells of tables, logs of other programs) as it may stand in
/// reports, in JSON and on a terminal.
namespace terracast::core {

/// Valid UTF-8 without control characters. Bytes that are no UTF-8 and those of control characters
/// become "\xff", two lower-case hexadecimal digits; so does a backslash before an x, so that the
/// text can be had back. All else stays. Done once: of its own result it makes another text.
std::string printable(std::string_view text);

/// The start of a text: at most so many bytes, and no letter of UTF-8 cut in two.
std::string_view first_letters(std::string_view text, std::size_t most_bytes);

}  // namespace terracast::core
