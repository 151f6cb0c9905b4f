#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "capture/frame.h"
#include "capture/sink.h"

namespace terracast::capture {

/// Writes one sequence:
///
///     <sequence>/sequence.json  tracks.json  manifest.json
///     <sequence>/frames/NNNNNN.json
///     <sequence>/<rig>/<camera>/NNNNNN.png   colour
///     <sequence>/<rig>/<camera>/NNNNNN.raw.png   digital numbers of a mosaic, where there is one
///     <sequence>/<rig>/<camera>/NNNNNN.exr   facts (single part, channels of channel.h)
///     <sequence>/<rig>/<sensor>/NNNNNN.npy   samples of a stream up to the next frame
///
/// Everything is written atomically; nothing holds threads, hosts, times of day or absolute paths.
/// threads   write_camera and finish_frame are safe for different frames and cameras; several
///           processes may write one sequence, also the same frames of it: all write the same bytes,
///           each file is put in place whole, and none is ever removed
class SequenceWriter : public Sink {
 public:
  /// throws   Config: the folder holds a sequence of other inputs (says both hashes and that
  ///          another --out is wanted); Io
  SequenceWriter(const std::filesystem::path& folder, const SequenceInfo& info,
                 const std::vector<TrackPoint>& tracks);

  const std::filesystem::path& folder() const { return folder_; }

  /// Whether a frame is finished: its record exists and its files have the recorded sizes.
  bool has_frame(int index) const;

  /// Encodes and writes a camera's files.
  /// returns   the record's files and counts; bounds and visible_tracks are the caller's
  CameraRecord write_camera(int frame_index, int camera_index,
                            const CameraFrame& frame) const override;

  FrameFile write_samples(int frame_index, int stream_index, const Samples& samples) const override;

  /// Takes a camera's files from another sequence's folder, of which they must be whole: as further
  /// links to them, or as copies.
  void link_camera(const std::filesystem::path& earlier_folder, const CameraRecord& camera) const;

  void finish_frame(const FrameRecord& record) const override;

  /// Writes manifest.json (every record with its hash) when all frames are there. Of several processes
  /// that write a sequence, each of which calls this after its last frame, at least the last to call
  /// finds them all.
  /// returns   whether they were
  bool finish_sequence() const;

 private:
  FrameFile write(const std::string& path, const std::vector<std::byte>& bytes) const;

  std::filesystem::path folder_;
  SequenceInfo info_;
};

/// Checks frames of a finished sequence against the hashes of its manifest and records.
/// returns   those of the selection that lost a file, or hold one that changed, ascending; nothing when
///           the sequence is not finished
/// cost      reads the selection's files once
/// throws    Io
std::optional<std::vector<int>> find_damaged_frames(const std::filesystem::path& folder,
                                                    const SequenceInfo& info,
                                                    const FrameSelection& selection);

/// Encoded facts of a frame, for benchmarks and tests: what write_camera puts on disk.
std::vector<std::byte> encode_color(const CameraFrame& frame);
std::vector<std::byte> encode_raw(const CameraFrame& frame);
std::vector<std::byte> encode_facts(const CameraFrame& frame);

}  // namespace terracast::capture
