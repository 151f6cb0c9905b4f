#pragma once

#include <cstddef>
#include <cstdint>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <utility>

namespace terracast::tiler {

/// Holds an OBJ and its libraries of materials (.mtl) against bounds, before they are read: what time and memory they take
/// is known from their lines.
class ObjCheck {
 public:
  /// Lines `g` and `o`, each of which begins a part of the model; lines `mtllib` too.
  static constexpr std::uint64_t kMostParts = 20'000;
  /// Lines `newmtl`, of all libraries together.
  static constexpr std::uint64_t kMostMaterials = 10'000;
  /// Lines `usemtl` that name another material than the one before.
  static constexpr std::uint64_t kMostChanges = 20'000;
  static constexpr std::uint64_t kMostLineBytes = std::uint64_t{1} << 20;
  /// Of all libraries together, each as often as it is read.
  static constexpr std::uint64_t kMostLibraryBytes = std::uint64_t{1} << 26;

  /// name   of the model, which begins the errors
  explicit ObjCheck(std::string name) : name_(std::move(name)) {}

  /// throws   Input: more than the bounds here and in model_file.h, with the line's number
  void look_at_model(std::span<const std::byte> bytes);
  /// A library that the model names; its materials count once, however often it is read.
  /// library   its path
  /// throws    Input: more than the bounds
  void look_at_library(std::span<const std::byte> bytes, const std::string& library);

 private:
  void take_line_of_model(std::string_view line);
  void take_corners(std::uint64_t number);
  void count_material(std::string_view statement);
  [[noreturn]] void fail_count(std::uint64_t most, const char* what, const char* remedy) const;

  std::string name_;
  std::string place_;  ///< the file that is looked at
  std::uint64_t line_ = 0;
  // Of a statement, which goes on on the next line where a backslash says so.
  bool goes_on_ = false;
  bool is_face_ = false;
  bool has_corners_ = false;  ///< a face, a line or points
  std::uint64_t statement_bytes_ = 0;
  std::uint64_t statement_corners_ = 0;

  std::uint64_t num_parts_ = 0;
  std::uint64_t num_libraries_ = 0;
  std::uint64_t num_materials_ = 0;
  std::uint64_t num_changes_ = 0;
  std::uint64_t num_vertices_ = 0;  ///< v, vt and vn, each with its own
  std::uint64_t num_faces_ = 0;
  std::uint64_t num_corners_ = 0;
  std::uint64_t num_triangles_ = 0;
  std::uint64_t library_bytes_ = 0;
  std::string material_;
  std::set<std::string> libraries_;
};

}  // namespace terracast::tiler
