#pragma once

#include "validate/dataset.h"

namespace terracast::validate {

/// TartanAir V1: image, depth and segmentation of left and right, pose files, flow of the left
/// camera with its mask. Size, focal length and principal point are the format's own.
class TartanAirV1Reader : public Reader {
 public:
  void read(const Dataset& dataset, Sequence& sequence, Findings& findings) const override;
  void check_mounts(const Sequence& sequence, Findings& findings) const override;
  core::ImageF depth(const Dataset& dataset, const Camera& camera, int frame) const override;
  FlowFields flow(const Dataset& dataset, const Camera& camera, int frame) const override;
  core::Image8 segmentation(const Dataset& dataset, const Camera& camera, int frame) const override;
};

}  // namespace terracast::validate
