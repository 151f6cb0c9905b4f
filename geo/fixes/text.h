#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace terracast::geo {

/// throws   Input: larger than the 256 MB that are read of a recording
void refuse_if_too_large(const std::filesystem::path& file);

/// The text of a recording in UTF-8, without a byte order mark. Lines that end in \r alone end in \n.
/// throws   Io: no such file; Input: larger than 256 MB, UTF-16, or bytes of value 0
std::string text_of_recording(const std::filesystem::path& file);

/// Without blanks, tabs and line ends on both sides.
std::string_view trimmed(std::string_view text);

/// With A to Z as a to z.
std::string in_lower_case(std::string_view text);

/// A finite decimal number that is the whole text but for blanks on both sides; the decimal sign is a
/// point whatever the locale.
std::optional<double> number_of(std::string_view text);

/// The words between blanks.
std::vector<std::string_view> words_of(std::string_view line);

/// The lines of a text, without \n or \r\n; a last line that is empty is none.
std::vector<std::string_view> lines_of_text(std::string_view text);

}  // namespace terracast::geo
