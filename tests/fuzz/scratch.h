#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string_view>
#include <vector>

#include "tests/fuzz/targets.h"

/// What wrappers of readers share: files on disk, and inputs of several parts.
namespace terracast::fuzz {

/// Folders of this process alone, below TMPDIR, which are removed at its end.
/// name   of the folder
/// returns   the folder, made where it is not there
std::filesystem::path scratch_folder(std::string_view name);

/// The folder for one input, emptied.
std::filesystem::path fresh_folder();

/// Writes a file in place; no folder is made.
void write_bytes(const std::filesystem::path& file, Bytes bytes);

/// Puts an input into the fresh folder.
/// returns   the file
std::filesystem::path put(std::string_view name, Bytes bytes);

std::string_view text_of(Bytes bytes);
Bytes bytes_of(std::string_view text);

/// A file of several. An input of a reader of several files has them behind each other, each under a line "-- name --",
/// of which the line end before it is a part; what stands before the first such line has no name.
struct Part {
  std::string_view name;
  Bytes bytes;
};
std::vector<Part> parts_of(Bytes input);

/// Whether a part of an input may become a file of its name: letters, digits, points, _ and - alone.
bool is_plain_name(std::string_view name);

/// Puts the parts of an input that have one of these names into the fresh folder.
/// returns   the folder
std::filesystem::path put_parts(Bytes input, std::span<const std::string_view> names);

/// Numbers off the front of an input, for targets that make structures of it.
class Front {
 public:
  explicit Front(Bytes bytes) : bytes_(bytes) {}
  /// Little-endian; 0 behind the end.
  std::uint64_t number(std::size_t num_bytes);
  Bytes take(std::size_t num_bytes);
  Bytes rest() { return take(bytes_.size()); }
  bool is_empty() const { return bytes_.empty(); }

 private:
  Bytes bytes_;
};

}  // namespace terracast::fuzz
