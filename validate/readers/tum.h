#pragma once

#include "validate/dataset.h"

namespace terracast::validate {

/// TUM's RGB-D layout: of each camera rgb.txt, depth.txt, associations.txt and groundtruth.txt with the files they name, and
/// trajectories of the body and the IMUs. The format states no intrinsics: those are dataset.json's. Written from
/// docs/formats/tum.md.
class TumReader : public Reader {
 public:
  void read(const Dataset& dataset, Sequence& sequence, Findings& findings) const override;
  /// Of range/, along each pixel's ray, which the images of depth were held against.
  core::ImageF depth(const Dataset& dataset, const Camera& camera, int frame) const override;
};

}  // namespace terracast::validate
