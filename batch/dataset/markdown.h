#pragma once

#include <string>
#include <string_view>
#include <vector>

/// Markdown (CommonMark with GitHub's tables) of text from outside.
namespace terracast::batch {

/// Text that shows as it is, in a paragraph, a list or a cell of a table: no mark in it is taken for
/// one. core::printable() first; so it is one line.
std::string markdown_text(std::string_view text);

/// The same of several lines; empty lines part paragraphs.
std::string markdown_lines(std::string_view text);

/// Lines that show as they are, in letters of one width.
std::string markdown_code(std::string_view text);

/// A table. All cells are Markdown already.
/// right_aligned   columns of numbers
std::string markdown_table(const std::vector<std::string>& head,
                           const std::vector<std::vector<std::string>>& rows,
                           const std::vector<bool>& right_aligned);

}  // namespace terracast::batch
