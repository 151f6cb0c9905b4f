#include "tests/fuzz/mutator.h"

#include <algorithm>
#include <array>

namespace terracast::fuzz {
namespace {

using namespace std::string_view_literals;

/// Inputs grow no longer.
constexpr std::size_t kLongest = 1 << 16;

/// What stands for numbers where text has them, and what parts texts.
constexpr std::array kTexts = {"0"sv,
                               "-1"sv,
                               "1e308"sv,
                               "-1e999"sv,
                               "nan"sv,
                               "inf"sv,
                               "1e-320"sv,
                               "2147483648"sv,
                               "-2147483649"sv,
                               "4294967296"sv,
                               "18446744073709551616"sv,
                               "9223372036854775807"sv,
                               "0x7fffffff"sv,
                               "1,5"sv,
                               ""sv,
                               "\n"sv,
                               "\0"sv,
                               "\r\n"sv,
                               "\""sv,
                               "["sv,
                               "]"sv,
                               "{"sv,
                               "}"sv,
                               "<"sv,
                               ">"sv,
                               ","sv,
                               ":"sv,
                               " "sv,
                               "\xff"sv,
                               "\xc3"sv,
                               "null"sv,
                               "true"sv,
                               "[]"sv,
                               "{}"sv,
                               "../"sv,
                               "/dev/zero"sv};

/// What stands for numbers of one to eight bytes.
constexpr std::array<std::uint64_t, 14> kNumbers = {0,
                                                    1,
                                                    0x7f,
                                                    0x80,
                                                    0xff,
                                                    0x7fff,
                                                    0x8000,
                                                    0xffff,
                                                    0x7fffffff,
                                                    0x80000000,
                                                    0xffffffff,
                                                    0x100000000,
                                                    0x7fffffffffffffff,
                                                    0xffffffffffffffff};

bool is_of_number(std::byte byte) {
  const char c = static_cast<char>(byte);
  return (c >= '0' && c <= '9') || c == '.' || c == '-' || c == '+' || c == 'e';
}

}  // namespace

Mutator::Mutator(std::vector<Input> seeds, std::uint64_t number)
    : seeds_(std::move(seeds)), random_(number) {}

/// Not by a distribution of the standard library, of which each implementation makes other numbers.
std::size_t Mutator::below(std::size_t count) { return count == 0 ? 0 : random_() % count; }

Mutator::Input Mutator::next() {
  Input input = seeds_[below(seeds_.size())];
  for (std::size_t left = 1 + below(4); left > 0; --left) change(input);
  if (input.size() > kLongest) input.resize(kLongest);
  return input;
}

void Mutator::change(Input& input) {
  switch (below(3)) {
    case 0:
      return change_bytes(input);
    case 1:
      return change_number(input);
    default:
      return change_range(input);
  }
}

void Mutator::put(Input& input, std::size_t at, std::size_t num_replaced, std::string_view text) {
  const auto begin = input.begin() + static_cast<std::ptrdiff_t>(at);
  const auto end = begin + static_cast<std::ptrdiff_t>(std::min(num_replaced, input.size() - at));
  const auto place = input.erase(begin, end);
  const auto bytes = std::as_bytes(std::span(text));
  input.insert(place, bytes.begin(), bytes.end());
}

void Mutator::change_bytes(Input& input) {
  if (input.empty()) return;
  for (std::size_t left = 1 + below(3); left > 0; --left) {
    std::byte& byte = input[below(input.size())];
    byte = below(2) == 0 ? byte ^ static_cast<std::byte>(1U << below(8))
                         : static_cast<std::byte>(below(256));
  }
}

/// Of text a number or a piece becomes another text; of other files some bytes become an extreme number, its bytes in
/// either order.
void Mutator::change_number(Input& input) {
  std::size_t at = below(input.size());
  if (below(2) == 0) {
    std::size_t length = below(3);
    for (std::size_t tries = 0; tries < 64 && at + tries < input.size(); ++tries)
      if (is_of_number(input[at + tries])) {
        at += tries;
        length = 0;
        while (at + length < input.size() && is_of_number(input[at + length])) ++length;
        break;
      }
    return put(input, at, length, kTexts[below(kTexts.size())]);
  }
  const std::size_t size = std::size_t{1} << below(4);
  const std::uint64_t number = kNumbers[below(kNumbers.size())] + below(3) - 1;
  const bool is_big_endian = below(4) == 0;
  for (std::size_t i = 0; i < size && at + i < input.size(); ++i)
    input[at + i] = static_cast<std::byte>(number >> (8 * (is_big_endian ? size - 1 - i : i)));
}

void Mutator::change_range(Input& input) {
  const Input& other = seeds_[below(seeds_.size())];
  const std::size_t from = below(other.size());
  const std::size_t length = below(std::min<std::size_t>(other.size() - from, 256) + 1);
  const std::string_view piece(reinterpret_cast<const char*>(other.data()) + from, length);
  const std::size_t at = below(input.size() + 1);
  switch (below(5)) {
    case 0:  // cut off
      return input.resize(at);
    case 1:  // cut out
      return put(input, at, below(64), {});
    case 2:  // in place of as much
      return put(input, at, length, piece);
    case 3:  // between
      return put(input, at, 0, piece);
    default: {  // many times
      const std::string repeated = [&] {
        const std::string_view little = piece.substr(0, 16);
        std::string text;
        for (std::size_t left = 1 + below(256); left > 0; --left) text += little;
        return text;
      }();
      return put(input, at, 0, repeated);
    }
  }
}

}  // namespace terracast::fuzz
