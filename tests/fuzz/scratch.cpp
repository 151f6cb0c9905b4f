#include "tests/fuzz/scratch.h"

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <stdexcept>
#include <string>

namespace terracast::fuzz {
namespace {

namespace fs = std::filesystem;

/// Those that one process has made.
class Folders {
 public:
  Folders() : root_(fs::temp_directory_path() / ("terracast-fuzz-" + std::to_string(::getpid()))) {
    fs::remove_all(root_);
    fs::create_directories(root_);
  }
  ~Folders() {
    std::error_code ignored;
    fs::remove_all(root_, ignored);
  }
  Folders(const Folders&) = delete;
  Folders& operator=(const Folders&) = delete;
  const fs::path& root() const { return root_; }

 private:
  fs::path root_;
};

}  // namespace

fs::path scratch_folder(std::string_view name) {
  static const Folders folders;
  fs::path folder = folders.root() / name;
  fs::create_directories(folder);
  return folder;
}

fs::path fresh_folder() {
  static const fs::path folder = scratch_folder("input");
  for (const auto& entry : fs::directory_iterator(folder)) fs::remove_all(entry.path());
  return folder;
}

void write_bytes(const fs::path& file, Bytes bytes) {
  std::FILE* out = std::fopen(file.c_str(), "wb");
  const bool is_written =
      out != nullptr && std::fwrite(bytes.data(), 1, bytes.size(), out) == bytes.size();
  if ((out != nullptr && std::fclose(out) != 0) || !is_written)
    throw std::runtime_error(file.string() + ": cannot be written; is there room left?");
}

fs::path put(std::string_view name, Bytes bytes) {
  fs::path file = fresh_folder() / name;
  write_bytes(file, bytes);
  return file;
}

std::string_view text_of(Bytes bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

Bytes bytes_of(std::string_view text) { return std::as_bytes(std::span(text)); }

std::vector<Part> parts_of(Bytes input) {
  const std::string_view text = text_of(input);
  std::vector<Part> parts = {{"", {}}};
  std::size_t begin = 0;
  for (std::size_t line = 0; line < text.size();) {
    const std::size_t end = std::min(text.find('\n', line), text.size());
    const std::string_view one = text.substr(line, end - line);
    if (one.size() > 6 && one.starts_with("-- ") && one.ends_with(" --")) {
      parts.back().bytes = bytes_of(text.substr(begin, std::max(line, begin + 1) - begin - 1));
      parts.push_back({one.substr(3, one.size() - 6), {}});
      begin = std::min(end + 1, text.size());
    }
    line = end + 1;
  }
  parts.back().bytes = bytes_of(text.substr(begin));
  return parts;
}

bool is_plain_name(std::string_view name) {
  return !name.empty() && name.size() < 40 && name.front() != '.' &&
         std::all_of(name.begin(), name.end(), [](char c) {
           return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                  c == '.' || c == '_' || c == '-';
         });
}

fs::path put_parts(Bytes input, std::span<const std::string_view> names) {
  const fs::path folder = fresh_folder();
  for (const Part& part : parts_of(input))
    if (std::find(names.begin(), names.end(), part.name) != names.end())
      write_bytes(folder / part.name, part.bytes);
  return folder;
}

std::uint64_t Front::number(std::size_t num_bytes) {
  std::uint64_t value = 0;
  const Bytes taken = take(num_bytes);
  for (std::size_t i = 0; i < taken.size(); ++i)
    value |= std::to_integer<std::uint64_t>(taken[i]) << (8 * i);
  return value;
}

Bytes Front::take(std::size_t num_bytes) {
  const Bytes taken = bytes_.first(std::min(num_bytes, bytes_.size()));
  bytes_ = bytes_.subspan(taken.size());
  return taken;
}

}  // namespace terracast::fuzz
