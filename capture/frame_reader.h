#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "capture/frame.h"
#include "capture/labels.h"

namespace terracast::capture {

/// Reads a finished sequence. Every file is checked against its record.
/// threads   safe
class SequenceReader {
 public:
  /// throws   Io, Input: no such folder, unfinished (says how many frames are missing), damaged,
  ///          another version
  static SequenceReader open(const std::filesystem::path& folder);

  const std::filesystem::path& folder() const { return folder_; }
  const SequenceInfo& info() const { return info_; }
  const std::vector<TrackPoint>& tracks() const { return tracks_; }
  const std::vector<FrameRecord>& frames() const { return frames_; }

  /// Which parts of a camera's frame to read.
  /// Raw is read where there is one.
  enum Parts : unsigned { kColor = 1, kFacts = 2, kAll = 3, kRaw = 4 };
  /// throws   Input: a file is missing, damaged or not what its record says
  CameraFrame read_camera(int frame_index, int camera_index, unsigned parts = kAll) const;

  /// All samples of a stream.
  /// throws   Input: a file is missing, damaged or not what its record says
  Samples read_samples(int stream_index) const;
  /// Those that begin from a frame's time to before the next one's, as they were measured together.
  Samples read_samples(int stream_index, int frame_index) const;

  geo::Rigid3d world_from_camera(int frame_index, int camera_index) const;
  /// The same with its motion, where its shutter rolls.
  /// model   the camera's; must outlive the view
  CameraView view(const geo::CameraModel& model, int frame_index, int camera_index) const;

 private:
  std::filesystem::path folder_;
  SequenceInfo info_;
  std::vector<TrackPoint> tracks_;
  std::vector<FrameRecord> frames_;
};

/// What is whole of a sequence, be it finished, unfinished or damaged. Threads: safe.
class WholeFrames {
 public:
  /// returns   nothing where there is no sequence, or one that is damaged or of another version
  /// throws    Io
  static std::optional<WholeFrames> open(const std::filesystem::path& folder);

  const std::filesystem::path& folder() const { return folder_; }
  const SequenceInfo& info() const { return info_; }

  /// A frame's record; nothing when it is missing or damaged.
  /// throws   Io
  std::optional<FrameRecord> record(int frame) const;
  /// Whether all files of a record are whole, by their hashes.
  /// cost     reads them once
  bool has_files(const FrameRecord& record) const;

 private:
  std::filesystem::path folder_;
  SequenceInfo info_;
};

/// Whether a captured sequence is that of a config.
/// throws   Config: it is not; the first line that differs is named
void check_same_config(const std::filesystem::path& folder, const std::string& captured_toml,
                       const std::string& config_toml);
/// The same of the sequence in a folder, if there is one; of a damaged one whoever reads it tells.
void check_captured_config(const std::filesystem::path& folder, const std::string& config_toml);

/// The sequences of a capture folder, sorted by name.
/// throws   Io, Input: none there
std::vector<std::filesystem::path> list_sequences(const std::filesystem::path& capture_folder);

}  // namespace terracast::capture
