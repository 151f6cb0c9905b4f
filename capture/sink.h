#pragma once

#include <map>
#include <mutex>
#include <utility>

#include "capture/frame.h"
#include "capture/stream.h"

namespace terracast::capture {

/// Takes what the sensors of a sequence measure, frame by frame: a folder (frame_writer.h), or memory.
/// threads   write_camera and write_samples are safe for different frames, cameras and streams
class Sink {
 public:
  virtual ~Sink() = default;

  /// returns   the record's files and counts; bounds and visible_tracks are the caller's
  virtual CameraRecord write_camera(int frame, int camera, const CameraFrame& images) const = 0;
  /// Takes the samples from the frame's time to before the next frame's.
  virtual FrameFile write_samples(int frame, int stream, const Samples& samples) const = 0;
  /// Called once all parts of a frame were written.
  virtual void finish_frame(const FrameRecord& record) const = 0;
};

/// Keeps everything in memory. Threads: safe.
class MemorySink : public Sink {
 public:
  CameraRecord write_camera(int frame, int camera, const CameraFrame& images) const override;
  FrameFile write_samples(int frame, int stream, const Samples& samples) const override;
  void finish_frame(const FrameRecord& record) const override;

  /// Images, samples and records of frames that were written; std::out_of_range for others.
  const CameraFrame& images(int frame, int camera) const { return images_.at({frame, camera}); }
  const Samples& samples(int frame, int stream) const { return samples_.at({frame, stream}); }
  const FrameRecord& record(int frame) const { return records_.at(frame); }
  std::size_t num_frames() const { return records_.size(); }

 private:
  mutable std::mutex mutex_;
  mutable std::map<std::pair<int, int>, CameraFrame> images_;
  mutable std::map<std::pair<int, int>, Samples> samples_;
  mutable std::map<int, FrameRecord> records_;
};

/// Counts of a camera's images for its record: pixels of sky, of outside and of edges.
CameraRecord count_pixels(const CameraFrame& images);

}  // namespace terracast::capture
