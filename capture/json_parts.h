#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "capture/frame.h"
#include "core/json.h"
#include "geo/rigid3.h"

/// What the capture's JSON files have in common: their head, checks of values, poses, entries of
/// files.
namespace terracast::capture {

/// How far a stored quaternion may be from unit length: rounding, not a slip.
inline constexpr double kUnitTolerance = 1e-9;

/// One file's JSON, so that every message can name it.
/// throws   Input: a value, or the file, is not what it has to be
struct Source {
  const std::string& file;

  double finite(const core::Json& json, const char* what) const;
  std::vector<double> numbers(const core::Json& json, std::size_t count, const char* what) const;
  Eigen::Vector3d vector(const core::Json& json, const char* what) const;
  geo::Rigid3d rigid(const core::Json& json, const char* what) const;
  std::int64_t count(const core::Json& json, std::int64_t highest, const char* what) const;
  /// That it is of this format and version.
  void format(const core::Json& json) const;
  /// That it is of a sequence's inputs.
  void inputs(const core::Json& json, const SequenceInfo& info) const;
  /// That it is as it was written, by the content_hash that it carries.
  void whole(const core::Json& json) const;
};

/// The beginning of every file: format and version.
core::Json header();

core::Json json_from_rigid(const geo::Rigid3d& pose);
core::Json json_from_vector(const Eigen::Vector3d& v);

core::Json json_from_terms(const geo::MotionTerms& terms);
geo::MotionTerms terms_from_json(const core::Json& json, const Source& source);
/// Whether all of it is finite, and no size below 0.
bool are_sound(const geo::MotionTerms& terms);

core::Json json_from_file(const FrameFile& file);
/// throws   Input: another path, or a size that cannot be; `file` names the JSON that it stands in
FrameFile file_from_json(const core::Json& json, const std::string& expected_path,
                         const std::string& file);

/// Whether a text is 32 hexadecimal digits.
bool is_content_hash(const std::string& text);

}  // namespace terracast::capture
