#pragma once

#include <cstdint>
#include <string>

#include "capture/frame.h"

/// The files of a captured sequence: what they are called, and what they can hold.
namespace terracast::capture {

/// Version of the format on disk: 7 has geo::MotionTerms. A reader takes version 6 too, which has none.
inline constexpr int kCaptureVersion = 7;
inline constexpr int kOldestCaptureVersion = 6;
/// Frames are numbered by six digits.
inline constexpr int kMaxFrames = 1000000;
/// Of one camera's image.
inline constexpr std::int64_t kMaxPixels = std::int64_t{1} << 28;

/// Samples a second of a stream, and its channels: what a file of one frame can hold.
inline constexpr double kMaxStreamRate_hz = 1e6;
inline constexpr std::size_t kMaxStreamChannels = 4096;

/// Names relative to the sequence's folder.
inline constexpr const char* kSequenceFile = "sequence.json";
inline constexpr const char* kTracksFile = "tracks.json";
inline constexpr const char* kManifestFile = "manifest.json";
/// The folder of the records, which no rig can be called.
inline constexpr const char* kRecordsFolder = "frames";
/// That of labels which are made later, which no rig can be called either.
inline constexpr const char* kLabelsFolder = "labels";
std::string record_path(int frame_index);
std::string color_path(const CameraCalibration& camera, int frame_index);
std::string raw_path(const CameraCalibration& camera, int frame_index);
std::string facts_path(const CameraCalibration& camera, int frame_index);
std::string samples_path(const StreamInfo& stream, int frame_index);

/// Whether a sequence, rig or camera may bear a name, which becomes a folder's: 1 to 64 letters,
/// digits, _ or -.
bool is_safe_name(const std::string& name);

}  // namespace terracast::capture
