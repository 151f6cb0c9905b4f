#include "tiler/objects/model_folder.h"

#include <algorithm>
#include <cctype>
#include <fstream>

#include "core/error.h"
#include "core/hash.h"
#include "core/stop.h"
#include "tiler/objects/model_file.h"

namespace terracast::tiler {
namespace {

using core::ErrorKind;
using core::fail;

std::string with_slashes(std::string text) {
  std::replace(text.begin(), text.end(), '\\', '/');
  return text;
}

std::string unescaped(const std::string& uri) {
  std::string text;
  for (std::size_t i = 0; i < uri.size(); ++i) {
    const auto is_hex = [&](std::size_t at) {
      return at < uri.size() && std::isxdigit(static_cast<unsigned char>(uri[at])) != 0;
    };
    if (uri[i] == '%' && is_hex(i + 1) && is_hex(i + 2)) {
      text.push_back(static_cast<char>(std::stoi(uri.substr(i + 1, 2), nullptr, 16)));
      i += 2;
    } else {
      text.push_back(uri[i]);
    }
  }
  return text;
}

}  // namespace

ModelFolder::ModelFolder(const std::filesystem::path& model, std::string name)
    : name_(std::move(name)),
      model_(std::filesystem::absolute(model)),
      folder_(std::filesystem::weakly_canonical(std::filesystem::absolute(model).parent_path())) {}

bool ModelFolder::is_absolute(const std::string& text) {
  const std::string path = with_slashes(text);
  const std::size_t colon = path.find(':');  // "C:/", "file:"
  return path.starts_with('/') || (colon != std::string::npos && colon < path.find('/'));
}

std::filesystem::path ModelFolder::path_of(const std::string& text,
                                           const std::string& where) const {
  const std::string path = with_slashes(text);
  if (path.empty() || path.find('\0') != std::string::npos || is_absolute(path))
    fail(
        ErrorKind::Input,
        "{}: \"{}\" is no path in the model's own folder; copy what it names beside the model, and "
        "name it by its last name",
        where, text);
  std::error_code error;
  const std::filesystem::path whole = std::filesystem::weakly_canonical(folder_ / path, error);
  const auto [end, ignored] =
      std::mismatch(folder_.begin(), folder_.end(), whole.begin(), whole.end());
  if (end != folder_.end())
    fail(ErrorKind::Input,
         "{}: \"{}\" leads out of the model's folder; copy what it names there, and name it so",
         where, text);
  return whole;
}

std::filesystem::path ModelFolder::path_of_uri(const std::string& uri,
                                               const std::string& where) const {
  return path_of(unescaped(uri), where);
}

std::filesystem::path ModelFolder::path_or_beside(const std::string& text,
                                                  const std::string& where) const {
  const std::string path = with_slashes(text);
  if (is_absolute(path)) {
    const std::filesystem::path beside = path_of(path.substr(path.rfind('/') + 1), where);
    std::error_code error;
    if (std::filesystem::is_regular_file(beside, error)) return beside;
  }
  return path_of(text, where);
}

std::filesystem::path ModelFolder::beside(const std::string& extension) const {
  return path_of(model_.stem().string() + extension, name_);
}

std::vector<std::byte> ModelFolder::read(const std::filesystem::path& file,
                                         const std::string& where) {
  core::throw_if_stop_asked();
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error))
    fail(ErrorKind::Io, "{}: no such file", where);
  const std::uintmax_t size = std::filesystem::file_size(file, error);
  if (error) fail(ErrorKind::Io, "{}: cannot be read", where);
  if (size > kMostModelBytes)
    fail(ErrorKind::Input, "{}: {} bytes, and a model has at most {}", where, size,
         kMostModelBytes);
  read_bytes_ += size;
  if (read_bytes_ > kMostModelBytes)
    fail(ErrorKind::Input, "{}: it and what it names hold more than {} bytes", name_,
         kMostModelBytes);
  std::vector<std::byte> bytes(size);
  std::ifstream stream(file, std::ios::binary);
  stream.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size));
  if (!stream) fail(ErrorKind::Io, "{}: cannot be read", where);
  hashes_ += core::content_hash(bytes);
  return bytes;
}

}  // namespace terracast::tiler
