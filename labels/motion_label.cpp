#include "labels/motion_label.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/error.h"
#include "core/log.h"
#include "labels/pair_cameras.h"

namespace terracast::labels {

using core::ErrorKind;
using core::fail;

void MotionLabel::describe(core::SchemaVisitor& visit) {
  visit.key("frames_apart", frames_apart_,
            "To which frames, of each camera: 1 is the next one, -1 the previous one.",
            core::between(-1000000, 1000000));
}

void MotionLabel::validate() const {
  if (frames_apart_.empty())
    fail(ErrorKind::Config, "{}: frames_apart is empty; 1 is the next frame", kind());
  if (std::find(frames_apart_.begin(), frames_apart_.end(), 0) != frames_apart_.end())
    fail(ErrorKind::Config, "{}: frames_apart = 0 is each image with itself; 1 is the next frame",
         kind());
}

void MotionLabel::check(std::span<const SequenceOutline> sequences, const core::Log& log) const {
  check_frames_apart(kind(), frames_apart_, sequences, log);
}

std::vector<PairRoute> MotionLabel::routes_of(const LabelInputs& inputs) const {
  SecondCameras seconds;
  for (int camera = 0; camera < static_cast<int>(inputs.sequence.info().cameras.size()); ++camera)
    seconds[camera] = {camera};
  return {{inputs.sequence, inputs.sequence, std::move(seconds)}};
}

std::string MotionLabel::file_name(const PairRoute& route, const ImageOf& first,
                                   const ImageOf& second) const {
  return fmt::format("{}/{:06}_{:06}.exr", camera_name(route.first_camera(first.camera)),
                     first.frame, second.frame);
}

}  // namespace terracast::labels
