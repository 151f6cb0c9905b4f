#include "render/labels/pair_cameras.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/registry.h"

namespace terracast::render {
namespace {

using core::ErrorKind;
using core::fail;

PairEnd parse_end(const std::string& text, const std::string& pair) {
  const auto num_slashes = std::count(text.begin(), text.end(), '/');
  if (num_slashes == 1) return {.sequence = {}, .camera = text};
  if (num_slashes == 2) {
    const std::size_t slash = text.find('/');
    if (slash > 0) return {.sequence = text.substr(0, slash), .camera = text.substr(slash + 1)};
  }
  fail(ErrorKind::Config,
       "pairs: cameras: \"{}\" of \"{}\" is no camera; RIG/NAME or SEQUENCE/RIG/NAME is right",
       text, pair);
}

const SequenceOutline& find_sequence(const JobOutline& job, const std::string& name) {
  std::vector<std::string> names;
  for (const SequenceOutline& sequence : job.sequences) {
    if (sequence.name == name) return sequence;
    names.push_back(sequence.name);
  }
  fail(ErrorKind::Config, "pairs: cameras: {}",
       core::unknown_name_message("sequence", name, names));
}

/// Frames of one number are of one time, so that frames_apart says how far apart two images are.
void check_times(const SequenceOutline& from, const SequenceOutline& to) {
  constexpr double kTolerance_s = 1e-9;
  const std::size_t num_frames = std::min(from.times_s.size(), to.times_s.size());
  for (std::size_t i = 0; i < num_frames; ++i)
    if (!(std::abs(from.times_s[i] - to.times_s[i]) <= kTolerance_s))
      fail(ErrorKind::Config,
           "pairs: frame {} of sequence {} is {} s after its first, that of {} {} s: pairs of both "
           "need one rate_hz",
           i, from.name, from.times_s[i], to.name, to.times_s[i]);
}

void check_any_frame(const SequenceOutline& from, const SequenceOutline& to,
                     std::span<const std::int64_t> frames_apart) {
  const auto num_from = static_cast<std::int64_t>(from.times_s.size());
  const auto num_to = static_cast<std::int64_t>(to.times_s.size());
  const bool has_any =
      std::any_of(frames_apart.begin(), frames_apart.end(), [&](std::int64_t apart) {
        return std::max<std::int64_t>(0, -apart) < std::min(num_from, num_to - apart);
      });
  if (!has_any)
    fail(ErrorKind::Config,
         "pairs: sequence {} has {} frames and {} has {}: none are frames_apart = [{}]", from.name,
         num_from, to.name, num_to, fmt::join(frames_apart, ", "));
}

void check_across(const SequenceOutline& from, const SequenceOutline& to,
                  std::span<const std::int64_t> frames_apart, bool has_one_geometry) {
  if (!has_one_geometry)
    fail(
        ErrorKind::Config,
        "pairs of sequences {} and {} need shared_geometry = true: else each shows the ground as "
        "fine as its own cameras ask for, and a point of the one is not on the ground of the other",
        from.name, to.name);
  check_times(from, to);
  check_any_frame(from, to, frames_apart);
}

}  // namespace

CameraPair parse_camera_pair(const std::string& text) {
  const std::size_t blank = text.find(' ');
  if (blank == std::string::npos)
    fail(ErrorKind::Config,
         "pairs: cameras: \"{}\" is no pair; \"RIG/NAME RIG/NAME\" or \"SEQUENCE/RIG/NAME "
         "SEQUENCE/RIG/NAME\" is right",
         text);
  CameraPair pair{.from = parse_end(text.substr(0, blank), text),
                  .to = parse_end(text.substr(blank + 1), text)};
  if (pair.from.sequence.empty() != pair.to.sequence.empty())
    fail(ErrorKind::Config,
         "pairs: cameras: \"{}\" names the sequence of one camera alone; name both, or neither: "
         "then it is a pair of every sequence",
         text);
  return pair;
}

std::string camera_name(const capture::CameraCalibration& camera) {
  return camera.rig + "/" + camera.name;
}

int find_camera(const std::vector<capture::CameraCalibration>& cameras, const std::string& name) {
  std::vector<std::string> names;
  for (const capture::CameraCalibration& camera : cameras) names.push_back(camera_name(camera));
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end())
    fail(ErrorKind::Config, "{}", core::unknown_name_message("camera", name, names));
  return static_cast<int>(found - names.begin());
}

void check_camera_pairs(const std::vector<CameraPair>& pairs,
                        std::span<const std::int64_t> frames_apart, const JobOutline& job) {
  for (const CameraPair& pair : pairs) {
    if (pair.from.sequence.empty()) {
      for (const SequenceOutline& sequence : job.sequences)
        for (const PairEnd& end : {pair.from, pair.to}) find_camera(sequence.cameras, end.camera);
      continue;
    }
    const SequenceOutline& from = find_sequence(job, pair.from.sequence);
    const SequenceOutline& to = find_sequence(job, pair.to.sequence);
    find_camera(from.cameras, pair.from.camera);
    find_camera(to.cameras, pair.to.camera);
    if (pair.is_across()) check_across(from, to, frames_apart, job.has_one_geometry);
  }
}

}  // namespace terracast::render
