#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace terracast::tiler {

/// A statement of an OBJ or its library of materials.
struct ModelStatement {
  std::uint64_t line = 0;  ///< on which it begins
  std::string_view name;   ///< "v", "newmtl"
  std::string_view rest;   ///< without blanks at its ends
};

/// All statements in their order; a backslash at a line's end joins it to the next. Comments have the name "#" or one that
/// begins so. A mark of UTF-8 at the beginning is passed over. Looks now and then whether a stop is asked for.
void each_statement(std::span<const std::byte> bytes,
                    const std::function<void(const ModelStatement&)>& take);

/// Words between blanks, up to one that begins a comment.
std::vector<std::string_view> words_of(std::string_view text);

/// nullopt: it is no number. Infinity and NaN are.
std::optional<double> number_of(std::string_view word);

}  // namespace terracast::tiler
