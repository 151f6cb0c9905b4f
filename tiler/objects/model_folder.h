#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace terracast::tiler {

/// The files of a model: its own, and those in its folder that it names. No others are read, and of these no more bytes
/// than a model may have. Nothing is read any more when a stop is asked for.
class ModelFolder {
 public:
  /// name   of the model's file, for messages
  ModelFolder(const std::filesystem::path& model, std::string name);

  const std::string& name() const { return name_; }

  /// Of Unix or Windows, or a URL.
  static bool is_absolute(const std::string& text);

  /// A path that the model's file names, in its folder. A backslash parts folders as a slash does.
  /// where    for messages
  /// throws   Input: absolute, a URL, or leading out of the folder
  std::filesystem::path path_of(const std::string& text, const std::string& where) const;
  /// The same of a URI, in which %20 stands for a blank.
  std::filesystem::path path_of_uri(const std::string& uri, const std::string& where) const;
  /// The same of files whose writers state where things lay on their own disk: of an absolute path the last name, where
  /// a file of that name lies beside the model.
  std::filesystem::path path_or_beside(const std::string& text, const std::string& where) const;

  /// The file of the model's own name and another extension.
  std::filesystem::path beside(const std::string& extension) const;

  /// A file's bytes, which the model's hash holds.
  /// where    for messages
  /// throws   Io: no such file; Input: more than a model may have; Interrupted
  std::vector<std::byte> read(const std::filesystem::path& file, const std::string& where);

  /// Of all that was read.
  const std::string& hashes() const { return hashes_; }

 private:
  std::string name_;
  std::filesystem::path model_;
  std::filesystem::path folder_;
  std::uint64_t read_bytes_ = 0;
  std::string hashes_;
};

}  // namespace terracast::tiler
