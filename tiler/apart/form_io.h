#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "world/byte_stream.h"

/// What a process that reads a file from outside says of it, as bytes. A form is a struct whose describe(visit) names its
/// members, once for both ways: numbers, texts, enumerations, and optional ones, lists and structs of these.
namespace terracast::tiler {

/// The largest enumerator that a form may have; from 0.
template <class Enum>
inline constexpr std::int32_t kLargestOf = -1;

class FormWriter {
 public:
  explicit FormWriter(world::ByteWriter& out) : out_(out) {}

  void operator()(const std::string& text) { out_.put_text(text); }
  template <class T>
  void operator()(const std::optional<T>& one) {
    out_.put(static_cast<std::uint8_t>(one ? 1 : 0));
    if (one) (*this)(*one);
  }
  template <class T>
  void operator()(const std::vector<T>& list) {
    out_.put_count(list.size());
    for (const T& one : list) (*this)(one);
  }
  template <class T>
  void operator()(const T& value) {
    if constexpr (std::is_enum_v<T>)
      out_.put(static_cast<std::int32_t>(value));
    else if constexpr (std::is_arithmetic_v<T>)
      out_.put(value);
    else
      const_cast<T&>(value).describe(*this);  // a description changes nothing of what is written
  }

 private:
  world::ByteWriter& out_;
};

class FormReader {
 public:
  explicit FormReader(world::ByteReader& in) : in_(in) {}

  void operator()(std::string& text) { text = in_.get_text(); }
  template <class T>
  void operator()(std::optional<T>& one) {
    if (in_.get<std::uint8_t>() != 0) (*this)(one.emplace());
  }
  template <class T>
  void operator()(std::vector<T>& list) {
    // None is made room for before its bytes are seen.
    for (std::size_t left = in_.get_count(1); left > 0; --left) (*this)(list.emplace_back());
  }
  template <class T>
  void operator()(T& value) {
    if constexpr (std::is_enum_v<T>)
      value = enumerator<T>();
    else if constexpr (std::is_same_v<T, bool>)
      value = in_.get<std::uint8_t>() != 0;
    else if constexpr (std::is_arithmetic_v<T>)
      value = in_.get<T>();
    else
      value.describe(*this);
  }

 private:
  /// No other value may even be looked at.
  template <class Enum>
  Enum enumerator() {
    static_assert(kLargestOf<Enum> >= 0, "state kLargestOf for it");
    const auto number = in_.get<std::int32_t>();
    if (number < 0 || number > kLargestOf<Enum>) in_.refuse("a value is none of its kind");
    return static_cast<Enum>(number);
  }

  world::ByteReader& in_;
};

/// What is done about a form that is damaged, which only a reader gone wrong gives.
inline constexpr const char* kFormWayOut =
    "its reader was led astray by it: have the file written anew, or leave it out";

template <class Form>
std::vector<std::byte> encode_form(const Form& form) {
  world::ByteWriter out;
  FormWriter{out}(form);
  const auto bytes = std::as_bytes(std::span(out.bytes()));
  return {bytes.begin(), bytes.end()};
}

/// file     for messages
/// throws   Input: it ends too early, counts more than it holds, or goes on behind its end
template <class Form>
Form decode_form(std::span<const std::byte> bytes, const std::string& file) {
  world::ByteReader in({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()}, file,
                       kFormWayOut);
  Form form;
  FormReader{in}(form);
  if (!in.is_at_end()) in.refuse("its reader's answer goes on behind its end");
  return form;
}

}  // namespace terracast::tiler
