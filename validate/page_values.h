#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "core/json.h"

/// Arrays of numbers as the report's page reads them: text in a script, since a page that is opened
/// as a file may load scripts and no other files.
namespace terracast::validate {

std::string base64(std::span<const std::byte> bytes);

/// {"type", "count", "data"}: each value's bits less those of the value before it, of 4 (f32), 2
/// (i16) or 1 (u8) bytes; then all lowest bytes, all next ones, …; as a zlib stream in base64.
/// Exact to the bit, NaN included.
core::Json packed(std::span<const float> values);
core::Json packed(std::span<const std::int16_t> values);
core::Json packed(std::span<const std::uint8_t> values);

/// A script that hands `value` to a function of the page: `name(value);`. Nothing in it ends a
/// script or starts a comment, wherever it stands.
std::string script_call(std::string_view name, const core::Json& value);

}  // namespace terracast::validate
