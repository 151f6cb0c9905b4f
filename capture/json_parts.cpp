#include "capture/json_parts.h"

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
  if (version != kCaptureVersion)
    fail(ErrorKind::Input, "{}: capture format version {}; this program reads version {}", file,
         version, kCaptureVersion);
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

}  // namespace terracast::capture
