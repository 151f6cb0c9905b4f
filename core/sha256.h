#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace terracast::core {

/// SHA-256 (FIPS 180-4), as 64 lower-case hexadecimal digits: for those who must trust that nobody
/// changed a file. content_hash is faster where damage alone is looked for.
/// cost   0.6 ns a byte where the processor has instructions for it
std::string sha256(std::span<const std::byte> bytes);
std::string sha256(std::string_view text);
/// throws Io: the file cannot be read; Input: a device or pipe
std::string sha256_of_file(const std::filesystem::path& file);

/// A file and what it holds.
struct FileChecksum {
  std::string path;  ///< relative to the folder in which it is checked
  std::string sha256;
};

/// Text for `sha256sum -c`: a line a file, sorted by path. A backslash, line feed or carriage return
/// in a name is escaped as GNU's sha256sum does it, with a backslash before the line.
/// throws   Input: a path that is empty, absolute, holds a zero byte, is given twice, or is "-", which
///          sha256sum takes for its own input
std::string checksum_lines(std::vector<FileChecksum> files);

}  // namespace terracast::core
