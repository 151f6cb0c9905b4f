#pragma once

#include <cstddef>
#include <cstdint>
#include <random>
#include <string_view>
#include <vector>

namespace terracast::fuzz {

/// Makes wrong files of right ones: bits are turned, numbers become extreme ones, ranges are cut out, repeated, or taken
/// from another seed. The same seeds and number give the same inputs on every machine.
class Mutator {
 public:
  using Input = std::vector<std::byte>;

  /// seeds    at least one
  /// number   of the course; another one makes other inputs
  Mutator(std::vector<Input> seeds, std::uint64_t number);

  Input next();

 private:
  std::size_t below(std::size_t count);
  void change(Input& input);
  void put(Input& input, std::size_t at, std::size_t num_replaced, std::string_view text);
  void change_bytes(Input& input);
  void change_number(Input& input);
  void change_range(Input& input);

  std::vector<Input> seeds_;
  std::mt19937_64 random_;
};

}  // namespace terracast::fuzz
