#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

/// Parsing of the text files of datasets. Strict: what is not a number, not finite or too much is
/// an Input error that names file and line.
namespace terracast::validate {

/// A line of a file with its number from 1.
struct TextLine {
  std::size_t number = 0;
  std::string_view text;
};

/// Lines of a text, without their ends (\n or \r\n); the empty piece after the last end is not a
/// line.
std::vector<TextLine> split_lines(std::string_view text);

/// The parts between blanks and tabs, none of them empty.
std::vector<std::string_view> split_blanks(std::string_view text);
std::vector<std::string_view> split_at(std::string_view text, char separator);
std::string_view trimmed(std::string_view text);

/// `where` is for the message: "poses/00.txt:3".
/// throws  Input: not a finite number, or more behind it
double parse_number(std::string_view text, const std::string& where);
std::int64_t parse_integer(std::string_view text, const std::string& where);

/// Nanoseconds since 1970-01-01 of "YYYY-MM-DD HH:MM:SS[.n…]", up to nine decimals; a T may stand
/// for the blank, and a Z at the end.
/// throws  Input: another form, or no such time
std::int64_t parse_utc_ns(std::string_view text, const std::string& where);

/// Numbers parted by blanks.
/// count   how many there must be; 0: any
std::vector<double> parse_numbers(std::string_view text, std::size_t count,
                                  const std::string& where);

}  // namespace terracast::validate
