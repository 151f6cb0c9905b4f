#include "labels/pair_cameras.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cstdlib>
#include <set>
#include <utility>

#include "core/error.h"
#include "core/log.h"
#include "core/registry.h"

namespace terracast::labels {
namespace {

using core::ErrorKind;
using core::fail;

[[noreturn]] void fail_as_no_pair(const std::string& text) {
  fail(ErrorKind::Config,
       "cameras: \"{}\" is no pair; \"RIG/NAME RIG/NAME\" is right, or of two sequences "
       "\"SEQUENCE/RIG/NAME SEQUENCE/RIG/NAME\"",
       text);
}

PairEnd parse_end(const std::string& text, const std::string& pair) {
  const auto num_slashes = std::count(text.begin(), text.end(), '/');
  const bool has_empty_part = text.empty() || text.front() == '/' || text.back() == '/' ||
                              text.find("//") != std::string::npos;
  if (has_empty_part || num_slashes < 1 || num_slashes > 2 || text.find(' ') != std::string::npos)
    fail_as_no_pair(pair);
  if (num_slashes == 1) return {.sequence = {}, .camera = text};
  const std::size_t slash = text.find('/');
  return {.sequence = text.substr(0, slash), .camera = text.substr(slash + 1)};
}

const SequenceOutline& find_sequence(std::span<const SequenceOutline> sequences,
                                     const std::string& name) {
  std::vector<std::string> names;
  for (const SequenceOutline& sequence : sequences) {
    if (sequence.name == name) return sequence;
    names.push_back(sequence.name);
  }
  fail(ErrorKind::Config, "cameras: {}", core::unknown_name_message("sequence", name, names));
}

/// Frames of one number are of one time, so that frames_apart says how far apart two images are.
void check_rates(const SequenceOutline& from, const SequenceOutline& to) {
  if (from.rate_hz != to.rate_hz)
    fail(ErrorKind::Config,
         "sequence {} has rate_hz = {} and {} has {}: frames of one number are not of one "
         "time; pairs of both need one rate",
         from.name, from.rate_hz, to.name, to.rate_hz);
}

void check_frames_between(const SequenceOutline& from, const SequenceOutline& to,
                          std::span<const std::int64_t> frames_apart, const core::Log& log) {
  std::set<std::int64_t> without;
  for (const std::int64_t apart : frames_apart)
    if (std::max<std::int64_t>(0, -apart) >=
        std::min<std::int64_t>(from.num_frames, to.num_frames - apart))
      without.insert(apart);
  if (std::all_of(frames_apart.begin(), frames_apart.end(),
                  [&](std::int64_t apart) { return without.contains(apart); }))
    fail(ErrorKind::Config,
         "pairs: sequence {} has {} frames and {} has {}: none are frames_apart = [{}]", from.name,
         from.num_frames, to.name, to.num_frames, fmt::join(frames_apart, ", "));
  for (const std::int64_t apart : without)
    log.warn(
        "pairs: frames_apart = {}: sequence {} has {} frames and {} has {}, and so no such pair",
        apart, from.name, from.num_frames, to.name, to.num_frames);
}

/// Vehicles may carry different rigs: a pair is of those that carry both.
void check_within(const CameraPair& pair, std::span<const SequenceOutline> sequences) {
  const bool has_any = std::any_of(
      sequences.begin(), sequences.end(),
      [&](const SequenceOutline& sequence) { return has_cameras(sequence.cameras, pair); });
  if (has_any || sequences.empty()) return;
  const std::vector<capture::CameraCalibration> all = cameras_of_all(sequences);
  for (const PairEnd& end : {pair.from, pair.to}) find_camera(all, end.camera);
  fail(ErrorKind::Config,
       "cameras: no sequence has both {0} and {1}; of two sequences \"SEQUENCE/{0} "
       "SEQUENCE/{1}\" is right",
       pair.from.camera, pair.to.camera);
}

void check_across(const SequenceOutline& from, const SequenceOutline& to,
                  std::span<const std::int64_t> frames_apart, const core::Log& log) {
  if (!from.shares_geometry || !to.shares_geometry)
    fail(
        ErrorKind::Config,
        "pairs of sequences {} and {} need shared_geometry = true: else each shows the ground as "
        "fine as its own cameras ask for, and a point of the one is not on the ground of the other",
        from.name, to.name);
  check_rates(from, to);
  check_frames_between(from, to, frames_apart, log);
}

}  // namespace

CameraPair parse_camera_pair(const std::string& text) {
  const std::size_t blank = text.find(' ');
  if (blank == std::string::npos) fail_as_no_pair(text);
  CameraPair pair{.from = parse_end(text.substr(0, blank), text),
                  .to = parse_end(text.substr(blank + 1), text)};
  if (pair.from.sequence.empty() != pair.to.sequence.empty()) fail_as_no_pair(text);
  return pair;
}

std::vector<CameraPair> parse_camera_pairs(std::span<const std::string> texts) {
  std::vector<CameraPair> pairs;
  for (const std::string& text : texts) pairs.push_back(parse_camera_pair(text));
  return pairs;
}

std::string camera_name(const capture::CameraCalibration& camera) {
  return camera.rig + "/" + camera.name;
}

std::vector<capture::CameraCalibration> cameras_of_all(std::span<const SequenceOutline> sequences) {
  std::vector<capture::CameraCalibration> all;
  for (const SequenceOutline& sequence : sequences)
    for (const capture::CameraCalibration& camera : sequence.cameras)
      if (!place_of_camera(all, camera_name(camera))) all.push_back(camera);
  return all;
}

std::optional<int> place_of_camera(const std::vector<capture::CameraCalibration>& cameras,
                                   const std::string& name) {
  for (std::size_t i = 0; i < cameras.size(); ++i)
    if (camera_name(cameras[i]) == name) return static_cast<int>(i);
  return std::nullopt;
}

int find_camera(const std::vector<capture::CameraCalibration>& cameras, const std::string& name) {
  if (const std::optional<int> place = place_of_camera(cameras, name)) return *place;
  std::vector<std::string> names;
  for (const capture::CameraCalibration& camera : cameras) names.push_back(camera_name(camera));
  fail(ErrorKind::Config, "{}", core::unknown_name_message("camera", name, names));
}

bool has_cameras(const std::vector<capture::CameraCalibration>& cameras, const CameraPair& pair) {
  return place_of_camera(cameras, pair.from.camera) && place_of_camera(cameras, pair.to.camera);
}

void check_frames_apart(std::string_view kind, std::span<const std::int64_t> frames_apart,
                        std::span<const SequenceOutline> sequences, const core::Log& log) {
  const auto longest = std::max_element(sequences.begin(), sequences.end(),
                                        [](const SequenceOutline& a, const SequenceOutline& b) {
                                          return a.num_frames < b.num_frames;
                                        });
  for (const std::int64_t apart : std::set(frames_apart.begin(), frames_apart.end()))
    for (const SequenceOutline& sequence : sequences) {
      if (std::abs(apart) < sequence.num_frames) continue;
      if (std::abs(apart) >= longest->num_frames)
        fail(ErrorKind::Config,
             "{}: frames_apart = {}: no sequence is so long; the longest, {}, has {} frames", kind,
             apart, longest->name, longest->num_frames);
      log.warn("{}: frames_apart = {}: sequence {} has {} frames, and so no such pair", kind, apart,
               sequence.name, sequence.num_frames);
    }
}

void check_camera_pairs(const std::vector<CameraPair>& pairs,
                        std::span<const std::int64_t> frames_apart,
                        std::span<const SequenceOutline> sequences, const core::Log& log) {
  std::set<std::pair<std::string, std::string>> checked;  // several cameras of two sequences
  for (const CameraPair& pair : pairs) {
    if (pair.from.sequence.empty()) {
      check_within(pair, sequences);
      continue;
    }
    const SequenceOutline& from = find_sequence(sequences, pair.from.sequence);
    const SequenceOutline& to = find_sequence(sequences, pair.to.sequence);
    core::with_context([&] { find_camera(from.cameras, pair.from.camera); },
                       fmt::format("looking for a camera of sequence {}", from.name));
    core::with_context([&] { find_camera(to.cameras, pair.to.camera); },
                       fmt::format("looking for a camera of sequence {}", to.name));
    if (pair.is_across() && checked.emplace(from.name, to.name).second)
      check_across(from, to, frames_apart, log);
  }
}

}  // namespace terracast::labels
