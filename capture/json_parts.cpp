#include "capture/json_parts.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "capture/sequence_files.h"
#include "core/error.h"

namespace terracast::capture {
namespace {

using core::ErrorKind;
using core::fail;
using core::Json;

constexpr const char* kFormat = "terracast-capture";

}  // namespace

double Source::finite(const Json& json, const char* what) const {
  const double value = json.number();
  if (!std::isfinite(value)) fail(ErrorKind::Input, "{}: {} is not finite", file, what);
  return value;
}

std::vector<double> Source::numbers(const Json& json, std::size_t count, const char* what) const {
  std::vector<double> values = json.numbers();
  if (values.size() != count)
    fail(ErrorKind::Input, "{}: {} has {} numbers, but must have {}", file, what, values.size(),
         count);
  for (const double value : values)
    if (!std::isfinite(value)) fail(ErrorKind::Input, "{}: {} is not finite", file, what);
  return values;
}

Eigen::Vector3d Source::vector(const Json& json, const char* what) const {
  const std::vector<double> v = numbers(json, 3, what);
  return {v[0], v[1], v[2]};
}

geo::Rigid3d Source::rigid(const Json& json, const char* what) const {
  const std::vector<double> q = numbers(json.at("rotation_wxyz"), 4, what);
  const Eigen::Quaterniond rotation(q[0], q[1], q[2], q[3]);
  if (!(std::abs(rotation.norm() - 1.0) <= kUnitTolerance))
    fail(ErrorKind::Input, "{}: the rotation of {} has length {}, but must have 1", file, what,
         rotation.norm());
  return {rotation, vector(json.at("translation_m"), what)};
}

std::int64_t Source::count(const Json& json, std::int64_t highest, const char* what) const {
  const std::int64_t value = json.integer();
  if (value < 0 || value > highest)
    fail(ErrorKind::Input, "{}: {} = {} is outside 0 to {}", file, what, value, highest);
  return value;
}

void Source::format(const Json& json) const {
  if (!json.has("format") || json.at("format").string() != kFormat)
    fail(ErrorKind::Input, "{}: not a file of a terracast capture", file);
  const std::int64_t version = json.at("version").integer();
  if (version < kOldestCaptureVersion || version > kCaptureVersion)
    fail(ErrorKind::Input, "{}: capture format version {}; this program reads versions {} to {}",
         file, version, kOldestCaptureVersion, kCaptureVersion);
}

void Source::inputs(const Json& json, const SequenceInfo& info) const {
  if (const std::string& found = json.at("input_hash").string(); found != info.input_hash)
    fail(ErrorKind::Input, "{}: input_hash {} is not the sequence's {}", file, found,
         info.input_hash);
}

void Source::whole(const Json& json) const {
  try {
    core::check_content_hash(json);
  } catch (const core::Error& error) {
    fail(ErrorKind::Input, "{}: {}", file, error.message());
  }
}

Json header() {
  return std::move(Json::object().set("format", kFormat).set("version", kCaptureVersion));
}

Json json_from_rigid(const geo::Rigid3d& pose) {
  const Eigen::Quaterniond& q = pose.rotation;
  const Eigen::Vector3d& t = pose.translation;
  return Json::object()
      .set("rotation_wxyz", Json::array_of({q.w(), q.x(), q.y(), q.z()}))
      .set("translation_m", Json::array_of({t.x(), t.y(), t.z()}));
}

Json json_from_vector(const Eigen::Vector3d& v) { return Json::array_of({v.x(), v.y(), v.z()}); }

Json json_from_file(const FrameFile& file) {
  return Json::object()
      .set("path", file.path)
      .set("bytes", file.num_bytes)
      .set("xxh3_128", file.content_hash);
}

FrameFile file_from_json(const Json& json, const std::string& expected_path,
                         const std::string& file) {
  FrameFile result{.path = json.at("path").string(),
                   .num_bytes = 0,
                   .content_hash = json.at("xxh3_128").string()};
  // A path that is not the one the format gives could lead out of the folder.
  if (result.path != expected_path)
    fail(ErrorKind::Input, "{}: the path \"{}\" must be \"{}\"", file, result.path, expected_path);
  const std::int64_t num_bytes = json.at("bytes").integer();
  if (num_bytes <= 0)
    fail(ErrorKind::Input, "{}: {} is said to have {} bytes", file, result.path, num_bytes);
  result.num_bytes = static_cast<std::uint64_t>(num_bytes);
  return result;
}

bool is_content_hash(const std::string& text) {
  return text.size() == 32 && text.find_first_not_of("0123456789abcdef") == std::string::npos;
}

Json json_from_terms(const geo::MotionTerms& terms) {
  const auto list_of = [](const auto& vectors) {
    Json list = Json::array();
    for (const Eigen::Vector3d& vector : vectors) list.push(json_from_vector(vector));
    return list;
  };
  return std::move(Json::object()
                       .set("reach_s", terms.reach_s)
                       .set("position_world", list_of(terms.position_world))
                       .set("turning", list_of(terms.turning_body))
                       .set("spin_radps", json_from_vector(terms.spin_body_radps))
                       .set("error_m", terms.error_m)
                       .set("error_rad", terms.error_rad));
}

geo::MotionTerms terms_from_json(const Json& json, const Source& source) {
  geo::MotionTerms terms;
  const auto set = [&](auto& vectors, const char* what) {
    const Json& list = json.at(what);
    if (!list.is_array() || list.size() != vectors.size())
      fail(ErrorKind::Input, "{}: {} of motion_terms must be a list of {}", source.file, what,
           vectors.size());
    for (std::size_t i = 0; i < vectors.size(); ++i) vectors[i] = source.vector(list.at(i), what);
  };
  terms.reach_s = source.finite(json.at("reach_s"), "reach_s");
  set(terms.position_world, "position_world");
  set(terms.turning_body, "turning");
  terms.spin_body_radps = source.vector(json.at("spin_radps"), "spin_radps");
  terms.error_m = source.finite(json.at("error_m"), "error_m");
  terms.error_rad = source.finite(json.at("error_rad"), "error_rad");
  return terms;
}

bool are_sound(const geo::MotionTerms& terms) {
  const auto are_finite = [](const auto& vectors) {
    return std::all_of(vectors.begin(), vectors.end(),
                       [](const Eigen::Vector3d& vector) { return vector.allFinite(); });
  };
  const auto is_size = [](double value) { return value >= 0.0 && std::isfinite(value); };
  return is_size(terms.reach_s) && is_size(terms.error_m) && is_size(terms.error_rad) &&
         are_finite(terms.position_world) && are_finite(terms.turning_body) &&
         terms.spin_body_radps.allFinite();
}

}  // namespace terracast::capture
