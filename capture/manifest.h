#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "capture/frame.h"
#include "core/error.h"
#include "core/json.h"

/// The capture's JSON files and the names of all its files. Reading checks every value, and that each
/// file is what was written, by the content_hash that it carries.
namespace terracast::capture {

/// Version of the format on disk; a reader takes its own only.
inline constexpr int kCaptureVersion = 4;
/// Frames are numbered by six digits.
inline constexpr int kMaxFrames = 1000000;
/// Of one camera's image.
inline constexpr std::int64_t kMaxPixels = std::int64_t{1} << 28;

/// Names relative to the sequence's folder.
inline constexpr const char* kSequenceFile = "sequence.json";
inline constexpr const char* kTracksFile = "tracks.json";
inline constexpr const char* kManifestFile = "manifest.json";
/// The folder of the records, which no rig can be called.
inline constexpr const char* kRecordsFolder = "frames";
std::string record_path(int frame_index);
std::string color_path(const CameraCalibration& camera, int frame_index);
std::string facts_path(const CameraCalibration& camera, int frame_index);

/// Whether a sequence, rig or camera may bear a name, which becomes a folder's: 1 to 64 letters,
/// digits, _ or -.
bool is_safe_name(const std::string& name);

/// Whether a sequence can be held: names that are safe as folders, cameras that can be made, counts
/// in range.
/// kind     of the error thrown
/// where    begins its message
void check_sequence(const SequenceInfo& info, core::ErrorKind kind, const std::string& where);

/// Whether a record belongs to a sequence: index, cameras, file names, values.
void check_record(const FrameRecord& record, const SequenceInfo& info, core::ErrorKind kind,
                  const std::string& where);

core::Json json_from_sequence(const SequenceInfo& info);
/// {"cell_px", "finest_spacing_m", "tiles": ["level/x/y hash", …]}, for exports; a capture's has the
/// tiles' heights beside it.
core::Json json_from_geometry(const ShownGeometry& geometry);
core::Json json_from_tracks(const std::vector<TrackPoint>& tracks);
/// input_hash   of its sequence: a record is trusted by itself, whatever became of sequence.json
core::Json json_from_record(const FrameRecord& record, const std::string& input_hash);

/// throws Input: a member is missing or has an impossible value, the file is not as it was written, a
///        record is of a sequence of other inputs; `file` names it
SequenceInfo sequence_from_json(const core::Json& json, const std::string& file);
std::vector<TrackPoint> tracks_from_json(const core::Json& json, const std::string& file);
FrameRecord record_from_json(const core::Json& json, const SequenceInfo& info,
                             const std::string& file);

/// Whether a JSON file of this version is not as it was written.
/// throws Io
bool is_damaged(const std::filesystem::path& file);

/// manifest.json: the hash of every JSON file and the sums over all frames.
struct Manifest {
  std::string input_hash;
  std::vector<FrameFile> files;  ///< sequence.json, tracks.json, then the records in order
  bool operator==(const Manifest&) const = default;
};
/// records   all, in order: their pixel counts are summed for each camera
core::Json json_from_manifest(const Manifest& manifest, const SequenceInfo& info,
                              const std::vector<FrameRecord>& records);
Manifest manifest_from_json(const core::Json& json, const SequenceInfo& info,
                            const std::string& file);

}  // namespace terracast::capture
