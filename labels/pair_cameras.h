#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "labels/label.h"

/// Which cameras a config pairs.
namespace terracast::labels {

/// A camera that a pair names.
struct PairEnd {
  std::string sequence;  ///< empty: whichever is labelled
  std::string camera;    ///< RIG/NAME
};

struct CameraPair {
  PairEnd from;  ///< what it shows is looked for
  PairEnd to;
  bool is_across() const { return from.sequence != to.sequence; }
};

/// Reads "RIG/NAME RIG/NAME" or "SEQUENCE/RIG/NAME SEQUENCE/RIG/NAME".
/// throws   Config: it is neither
CameraPair parse_camera_pair(const std::string& text);
std::vector<CameraPair> parse_camera_pairs(std::span<const std::string> texts);

/// RIG/NAME of a camera.
std::string camera_name(const capture::CameraCalibration& camera);

/// Every camera that a sequence has, the first of those of one name.
std::vector<capture::CameraCalibration> cameras_of_all(std::span<const SequenceOutline> sequences);

/// The place of a camera among those of a sequence; nothing: there is none of that name.
std::optional<int> place_of_camera(const std::vector<capture::CameraCalibration>& cameras,
                                   const std::string& name);
/// throws   Config: there is none of that name; says what is near
int find_camera(const std::vector<capture::CameraCalibration>& cameras, const std::string& name);
/// Whether both cameras of a pair are among these.
bool has_cameras(const std::vector<capture::CameraCalibration>& cameras, const CameraPair& pair);

/// Holds frames_apart against the sequences of which it shall make pairs; the log is told once of those that are too
/// short.
/// throws   Config: the longest is too short
void check_frames_apart(std::string_view kind, std::span<const std::int64_t> frames_apart,
                        std::span<const SequenceOutline> sequences, const core::Log& log);

/// log      is told of frames apart that two sequences do not have
/// throws   Config: no such sequence, a camera that it has not, a pair that no sequence has; of pairs of two sequences:
///          they show two geometries, take frames of
///          one number at two times, or have no frames so many apart
void check_camera_pairs(const std::vector<CameraPair>& pairs,
                        std::span<const std::int64_t> frames_apart,
                        std::span<const SequenceOutline> sequences, const core::Log& log);

}  // namespace terracast::labels
