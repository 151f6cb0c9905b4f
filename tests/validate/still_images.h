#pragma once

#include <string>

#include "validate/checks/checker.h"

/// Checks over images that are made in place, of a camera that stands still.
namespace terracast::validate {

/// Two frames of one camera.
inline Sequence still_scene(int width_px, int height_px) {
  Sequence sequence;
  sequence.name = "P000";
  sequence.num_frames = 2;
  sequence.rate_hz = 1.0;
  Camera camera;
  camera.name = "cam0";
  camera.intrinsics = {width_px, height_px, 60.0, 60.0, 0.5 * width_px, 0.5 * height_px};
  camera.local_from_camera.assign(2, Pose{});
  camera.files.resize(2);
  sequence.cameras.push_back(camera);
  return sequence;
}

/// A result of a check by its name; an empty one where the check has none.
inline CheckResult result_of(const std::string& check, const std::string& name,
                             const Sequence& sequence, const FrameImages& first,
                             const FrameImages& second) {
  Dataset dataset;
  Findings findings;
  const std::vector<FrameImages> images{first, second};
  FrameWindow window(dataset, sequence, findings, images);
  for (const CheckInfo& info : checks()) {
    if (info.name != check) continue;
    const auto checker = info.make(ValidateOptions{});
    while (window.advance()) checker->frame(window, window.pairs());
    for (CheckResult& result : checker->finish(dataset, sequence))
      if (result.name == name) return result;
  }
  return {};
}

}  // namespace terracast::validate
