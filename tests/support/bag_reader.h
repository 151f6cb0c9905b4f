#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "core/json.h"

/// Files of MCAP as @mcap/core reads them (tests/mcap/read_bag.mjs).
namespace terracast::test {

struct Bag {
  core::Json summary;
  std::vector<core::Json> messages;  ///< in the order of the file's index

  /// The messages of a topic.
  std::vector<const core::Json*> of(const std::string& topic) const;
};

/// throws   Input: the reader refuses the file; in its words
Bag read_bag(const std::filesystem::path& file);

/// Bytes of hexadecimal digits.
std::vector<std::byte> bytes_of_hex(const std::string& digits);

/// A header's stamp, ns.
std::int64_t stamp_ns(const core::Json& message);

}  // namespace terracast::test
