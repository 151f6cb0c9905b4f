#include "tiler/objects/obj_check.h"

#include <algorithm>
#include <array>

#include "core/error.h"
#include "tiler/objects/model_file.h"

namespace terracast::tiler {
namespace {

using core::ErrorKind;
using core::fail;

/// Three corners a triangle, each with a vertex, a place on a texture and a normal of its own.
constexpr std::uint64_t kMostCorners = 3 * kMostModelTriangles;
constexpr std::uint64_t kMostVertices = 3 * kMostCorners;

constexpr std::array<bool, 256> kEndsLine = [] {
  std::array<bool, 256> ends{};
  for (const char c : {'\n', '\r', '\0', '\f'}) ends[static_cast<unsigned char>(c)] = true;
  return ends;
}();
bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\v'; }

std::string_view without_blanks(std::string_view line) {
  std::size_t begin = 0;
  while (begin < line.size() && is_blank(line[begin])) ++begin;
  return line.substr(begin);
}

/// A backslash, which says that a statement goes on, is none.
std::uint64_t num_words(std::string_view text) {
  std::uint64_t number = 0;
  bool was_blank = true;
  for (const char c : text) {
    const bool is_now = is_blank(c) || c == '\\';
    number += was_blank && !is_now ? 1 : 0;
    was_blank = is_now;
  }
  return number;
}

/// A backslash in the middle parts folders.
bool goes_on(std::string_view line) {
  while (!line.empty() && is_blank(line.back())) line.remove_suffix(1);
  return line.ends_with('\\');
}

/// What follows the first word.
std::string_view argument_of(std::string_view statement) {
  const auto blank = std::find_if(statement.begin(), statement.end(), is_blank);
  std::string_view rest =
      without_blanks(statement.substr(static_cast<std::size_t>(blank - statement.begin())));
  while (!rest.empty() && is_blank(rest.back())) rest.remove_suffix(1);
  return rest;
}

template <class Take>
void each_line(std::span<const std::byte> bytes, std::uint64_t& number, const Take& take) {
  std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);  // a mark of UTF-8
  number = 1;
  for (std::size_t begin = 0; begin < text.size(); ++number) {
    std::size_t end = begin;
    while (end < text.size() && !kEndsLine[static_cast<unsigned char>(text[end])]) ++end;
    take(text.substr(begin, end - begin));
    begin = end + 1;
    if (text.substr(end, 2) == "\r\n") ++begin;
  }
}

}  // namespace

void ObjCheck::fail_count(std::uint64_t most, const char* what, const char* remedy) const {
  fail(ErrorKind::Input, "{}: line {}: more than {} {}; {}", place_, line_, most, what, remedy);
}

void ObjCheck::look_at_model(std::span<const std::byte> bytes) {
  place_ = name_;
  each_line(bytes, line_, [&](std::string_view line) { take_line_of_model(line); });
}

void ObjCheck::look_at_library(std::span<const std::byte> bytes, const std::string& library) {
  place_ = library;
  library_bytes_ += bytes.size();
  if (library_bytes_ > kMostLibraryBytes)
    fail(ErrorKind::Input,
         "{}: its libraries of materials, each as often as it is named, hold more than {} bytes; "
         "name {} once",
         name_, kMostLibraryBytes, library);
  if (!libraries_.insert(library).second) return;
  each_line(bytes, line_, [&](std::string_view line) { count_material(without_blanks(line)); });
}

/// A model may name itself as a library.
void ObjCheck::count_material(std::string_view statement) {
  if (statement.size() < 2 || (statement[0] != 'n' && statement[0] != 'N') || statement[1] != 'e')
    return;
  if (++num_materials_ > kMostMaterials)
    fail_count(kMostMaterials, "materials (newmtl)", "merge those that look alike");
}

void ObjCheck::take_line_of_model(std::string_view line) {
  constexpr const char* kSplit = "split the model, or save it as glTF";
  if (!goes_on_) {
    is_face_ = has_corners_ = false;
    statement_bytes_ = statement_corners_ = 0;
  }
  statement_bytes_ += line.size();
  const std::string_view statement = without_blanks(line);
  if (goes_on_ && has_corners_) take_corners(num_words(statement));
  goes_on_ = goes_on(line);
  switch (statement.empty() ? '#' : statement[0]) {
    case 'v':
      if (++num_vertices_ > kMostVertices)
        fail_count(kMostVertices, "vertices (v, vt, vn)", "simplify the model first");
      break;
    case 'f':
      ++num_faces_;
      [[fallthrough]];
    case 'l':
    case 'p':
      is_face_ = statement[0] == 'f';
      has_corners_ = true;
      statement_corners_ = 0;
      take_corners(num_words(argument_of(statement)));
      break;
    case 'g':
    case 'o':
      if (++num_parts_ > kMostParts) fail_count(kMostParts, "groups and objects (g, o)", kSplit);
      break;
    case 'm':
      if (statement.starts_with("mtllib") && ++num_libraries_ > kMostParts)
        fail_count(kMostParts, "libraries of materials (mtllib)", "name each once");
      break;
    case 'u':
      if (!statement.starts_with("usemtl") || argument_of(statement) == material_) break;
      material_ = argument_of(statement);
      if (++num_changes_ > kMostChanges)
        fail_count(kMostChanges, "changes of material (usemtl)",
                   "put the faces of a material together");
      break;
    default:
      count_material(statement);
  }
  if (statement_bytes_ > kMostLineBytes)
    fail(ErrorKind::Input,
         "{}: line {}: a statement of more than {} bytes; is it an OBJ, saved whole?", place_,
         line_, kMostLineBytes);
}

void ObjCheck::take_corners(std::uint64_t number) {
  num_corners_ += number;
  const std::uint64_t before = statement_corners_;
  statement_corners_ += number;
  if (is_face_ && statement_corners_ > kMostFaceCorners)
    fail(ErrorKind::Input,
         "{}: line {}: face {} has {} corners, and a face has at most {}; save the model as "
         "triangles",
         place_, line_, num_faces_ - 1, statement_corners_, kMostFaceCorners);
  const auto triangles_of = [](std::uint64_t corners) { return corners < 3 ? 0 : corners - 2; };
  if (is_face_) num_triangles_ += triangles_of(statement_corners_) - triangles_of(before);
  if (num_triangles_ > kMostModelTriangles)
    fail_count(kMostModelTriangles, "triangles", "simplify the model first");
  if (num_corners_ > kMostCorners)
    fail_count(kMostCorners, "corners of faces, lines and points", "simplify the model first");
}

}  // namespace terracast::tiler
