#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace terracast::core {

/// Writes a whole file under a unique name beside `file`, syncs it and renames it: a killed job or
/// a full disk leaves no half file under the final name. Missing folders are made; a link is
/// followed, and what it names is written.
/// throws   Io: naming the file and the system's reason; `file` is a device or pipe
void write_file(const std::filesystem::path& file, std::span<const std::byte> bytes);
void write_file(const std::filesystem::path& file, std::string_view text);

/// The same for a file that nobody wrote yet. Of several that write it at once, on whatever
/// machines, one puts its text there and gets true; the others get false, and that text is there.
/// throws   Io: as write_file(); the file system can do neither links nor renames that keep a file
bool write_new_file(const std::filesystem::path& file, std::string_view text);

/// The same as write_file() for libraries that insist on writing to a path: `write` gets the temporary path (same
/// extension).
void write_file_by(const std::filesystem::path& file,
                   const std::function<void(const std::filesystem::path& temporary)>& write);

/// Puts the content of a file under another name too, in place whole as write_file does: by a second
/// link to it where the file system can, else by a copy. Neither name may be written to in place
/// after that.
/// throws   Io: naming the file and the system's reason
void link_file(const std::filesystem::path& from, const std::filesystem::path& file);

/// A whole file.
/// throws   Io: missing or unreadable; Input: larger than max_bytes, or a device or pipe
std::vector<std::byte> read_file(const std::filesystem::path& file,
                                 std::size_t max_bytes = std::size_t{1} << 34);
std::string read_text_file(const std::filesystem::path& file,
                           std::size_t max_bytes = std::size_t{1} << 30);

/// A file of any size, block by block, in order.
/// throws   Io: missing or unreadable; Input: a device or pipe; what `consume` throws
void read_file_blocks(const std::filesystem::path& file,
                      const std::function<void(std::span<const std::byte>)>& consume);

/// Makes a folder and its parents.
/// throws   Io: naming it and the system's reason
void make_folder(const std::filesystem::path& folder);

/// Removes what killed writers left behind in `folder` (their temporary names), itself and its
/// sub-folders.
void remove_temporaries(const std::filesystem::path& folder);

}  // namespace terracast::core
