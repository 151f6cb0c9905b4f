#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace terracast::core {

/// A JSON value; objects keep the order of insertion. Doubles are written in the shortest form that
/// reads back to the same bits; infinities and NaN have no JSON form and are refused when written.
///
///     Json record = Json::object();
///     record.set("time_s", 0.5).set("cameras", Json::array());
///     double time_s = record.at("time_s").number();     // throws Input naming file and member
///     when missing
class Json {
 public:
  Json();                          ///< null
  Json(bool value);                // NOLINT(google-explicit-constructor)
  Json(int value);                 // NOLINT(google-explicit-constructor)
  Json(std::int64_t value);        // NOLINT(google-explicit-constructor)
  Json(std::uint64_t value);       // NOLINT(google-explicit-constructor)
  Json(double value);              // NOLINT(google-explicit-constructor)
  Json(const char* value);         // NOLINT(google-explicit-constructor)
  Json(std::string_view value);    // NOLINT(google-explicit-constructor)
  Json(const std::string& value);  // NOLINT(google-explicit-constructor)
  Json(const Json&);
  Json(Json&&) noexcept;
  Json& operator=(Json);
  ~Json();

  static Json object();
  static Json array();
  static Json array_of(const std::vector<double>& values);
  static Json array_of(const std::vector<std::string>& values);

  /// Values of a file that is read; they take up to 200 bytes of memory each, however short their text is: 4 GB.
  static constexpr std::size_t kMostValues = 20'000'000;
  /// The same of lists of a whole dataset's files or annotations, which grow with what is exported.
  static constexpr std::size_t kMostOfDatasets = 400'000'000;

  /// throws Input: not JSON (with line and column), or more values; `name` is the file's, for messages
  static Json parse(std::string_view text, const std::string& name,
                    std::size_t most_values = kMostValues);
  static Json read(const std::filesystem::path& file, std::size_t most_values = kMostValues);

  /// indent   blanks a level; -1: one line
  std::string text(int indent = 2) const;
  /// Atomically.
  void write(const std::filesystem::path& file, int indent = 2) const;

  Json& set(std::string_view member, Json value);  ///< of an object; returns *this
  Json& push(Json value);                          ///< to an array; returns *this

  bool is_null() const;
  bool is_object() const;
  bool is_array() const;
  bool has(std::string_view member) const;
  std::size_t size() const;
  const Json& at(std::string_view member) const;  ///< throws Input: no such member
  const Json& at(std::size_t index) const;        ///< throws Input: out of range
  const std::vector<std::pair<std::string, Json>>& members() const;

  bool boolean() const;          ///< throws Input: another type
  double number() const;         ///< any number
  std::int64_t integer() const;  ///< a whole number
  const std::string& string() const;
  std::vector<double> numbers() const;       ///< an array of numbers
  std::vector<std::string> strings() const;  ///< an array of text

 private:
  struct Value;
  std::unique_ptr<Value> value_;
};

/// Adds the member `content_hash` to an object: over all its other members, whatever the blanks and
/// line ends between them.
void add_content_hash(Json& object);

/// throws   Input: the object's members are not those that its `content_hash` was made of; it has
///          none
void check_content_hash(const Json& object);

}  // namespace terracast::core
