#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <utility>
#include <vector>

/// Every field of a dataset's files, found by the files' syntax alone: members of JSON, columns of CSV, words of rows
/// and of `key:` lines, channels of PNG and NumPy's arrays, records of COLMAP's binary files, columns of a database.
namespace terracast::test {

/// How much a change is. Relative changes are 1 % to 3 % of a number, absolute ones 0.01 to 0.03 of its unit; whole
/// numbers change by 1 to 3 in both, words by a letter, flags turn.
struct Amount {
  std::uint64_t seed = 0;
  bool is_relative = false;

  /// -1 or 1, times a number in [1, 3).
  double signed_size() const;
  /// A real number changed. One that is not finite, or below 1e-9 where the change is relative, stays.
  double changed(double value) const;
  std::int64_t changed(std::int64_t value) const;
};

/// A value of a field, or all values of a channel.
struct FieldPlace {
  std::string file;  ///< relative to the dataset
  /// The file's bytes with the value changed; those given where the change leaves all as it is.
  std::function<std::string(const std::string& bytes, const Amount&)> changed;
};

/// All places of a field in files of one kind.
struct Field {
  std::string kind;  ///< path of the files, numbers as #: "P000/image_lcam_front/#_lcam_front.png"
  std::string name;  ///< "/cameras/*/fx_px", "lat_deg", "P2[3]", "channel 0"
  std::vector<FieldPlace> places;
};

/// Fields of all files of a dataset, and of dataset.json; by kind and name.
/// throws   runtime_error: a file of a syntax that is not known here
std::vector<Field> fields_of(const std::filesystem::path& dataset);

/// "a/000012.png" as "a/#.png".
std::string kind_of(const std::string& path);

/// A name and a place in a file of text, or of records.
using NamedChange =
    std::pair<std::string, std::function<std::string(const std::string&, const Amount&)>>;
/// By the syntax of text.
std::vector<NamedChange> json_fields(const std::string& text);
std::vector<NamedChange> csv_fields(const std::string& text);
std::vector<NamedChange> word_fields(const std::string& text);
/// By the syntax of bytes.
std::vector<NamedChange> npy_fields(const std::string& bytes);
std::vector<NamedChange> npz_fields(const std::string& bytes);
std::vector<NamedChange> png_fields(const std::string& bytes);
/// file   "cameras.bin", "images.bin", …
std::vector<NamedChange> colmap_fields(const std::string& file, const std::string& bytes);
std::vector<NamedChange> database_fields(const std::string& bytes);

}  // namespace terracast::test
