#include "capture/sink.h"

#include <span>

#include "capture/channel.h"

namespace terracast::capture {

CameraRecord count_pixels(const CameraFrame& images) {
  CameraRecord record;
  const std::span<const std::uint32_t> semantic = images.semantic_id.data();
  const std::span<const std::uint32_t> flags = images.flags.data();
  for (std::size_t i = 0; i < semantic.size(); ++i) {
    record.num_sky += semantic[i] == static_cast<std::uint32_t>(SemanticClass::Sky) ? 1 : 0;
    record.num_outside += semantic[i] == static_cast<std::uint32_t>(SemanticClass::Outside) ? 1 : 0;
    record.num_edge += (flags[i] & kEdge) != 0 ? 1 : 0;
  }
  return record;
}

CameraRecord MemorySink::write_camera(int frame, int camera, const CameraFrame& images) const {
  const std::lock_guard lock(mutex_);
  images_[{frame, camera}] = images;
  return count_pixels(images);
}

FrameFile MemorySink::write_samples(int frame, int stream, const Samples& samples) const {
  const std::lock_guard lock(mutex_);
  samples_[{frame, stream}] = samples;
  return {};
}

void MemorySink::finish_frame(const FrameRecord& record) const {
  const std::lock_guard lock(mutex_);
  records_[record.index] = record;
}

}  // namespace terracast::capture
