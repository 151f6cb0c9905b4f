#include "validate/page_values.h"

#include <fmt/format.h>

#include <bit>
#include <vector>

#include "core/deflate.h"

namespace terracast::validate {

namespace {

template <class Bits, class Value>
core::Json packed_as(std::span<const Value> values, const char* type) {
  const std::size_t count = values.size();
  std::vector<std::byte> planes(count * sizeof(Bits));
  Bits before = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const auto bits = std::bit_cast<Bits>(values[i]);
    const auto difference = static_cast<Bits>(bits - before);
    before = bits;
    for (std::size_t k = 0; k < sizeof(Bits); ++k)
      planes[k * count + i] = static_cast<std::byte>(difference >> (8 * k) & 0xffU);
  }
  return core::Json::object()
      .set("type", type)
      .set("count", static_cast<std::uint64_t>(count))
      .set("data", base64(core::zlib_deflated(planes)));
}

}  // namespace

std::string base64(std::span<const std::byte> bytes) {
  static constexpr std::string_view kLetters =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t group = 0;
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
    for (std::size_t k = 0; k < 3; ++k)
      group = group << 8 | (k < count ? std::to_integer<std::uint32_t>(bytes[i + k]) : 0U);
    for (std::size_t k = 0; k < 4; ++k)
      text += k <= count ? kLetters[group >> (18 - 6 * k) & 63U] : '=';
  }
  return text;
}

core::Json packed(std::span<const float> values) { return packed_as<std::uint32_t>(values, "f32"); }
core::Json packed(std::span<const std::int16_t> values) {
  return packed_as<std::uint16_t>(values, "i16");
}
core::Json packed(std::span<const std::uint8_t> values) {
  return packed_as<std::uint8_t>(values, "u8");
}

std::string script_call(std::string_view name, const core::Json& value) {
  const std::string text = value.text(-1);
  std::string script = std::string(name) + "(";
  script.reserve(text.size() + name.size() + 8);
  // Inside JSON these characters stand in text alone, where the escape means the same.
  for (const char c : text) {
    if (c == '<')
      script += "\\u003c";
    else if (c == '>')
      script += "\\u003e";
    else
      script += c;
  }
  return script + ");\n";
}

}  // namespace terracast::validate
