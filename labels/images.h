#pragma once

#include <cstdint>

#include "capture/frame_reader.h"
#include "core/parallel.h"

namespace terracast::labels {

/// Images of a sequence are numbered frame by frame, in each by camera.
inline std::int64_t num_images(const capture::SequenceReader& sequence) {
  return static_cast<std::int64_t>(sequence.frames().size() * sequence.info().cameras.size());
}

/// Calls visit(frame, camera) for every image of a sequence, in parallel.
template <class Visit>
void for_each_image(const capture::SequenceReader& sequence, const Visit& visit) {
  const auto num_cameras = static_cast<std::int64_t>(sequence.info().cameras.size());
  core::parallel_for(num_images(sequence), [&](std::int64_t i) {
    visit(static_cast<int>(i / num_cameras), static_cast<int>(i % num_cameras));
  });
}

}  // namespace terracast::labels
