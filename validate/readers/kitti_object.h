#pragma once

#include "validate/dataset.h"

namespace terracast::validate {

/// KITTI object: training/{image_2,label_2,calib}/NNNNNN, numbered through all sequences. Each row of labels must be
/// one of the format's, its box in the image must lie within the projection of its box in space, and its alpha
/// must follow from its place and turn; else it is a finding.
class KittiObjectReader : public Reader {
 public:
  void read(const Dataset& dataset, Sequence& sequence, Findings& findings) const override;
  core::ImageF depth(const Dataset& dataset, const Camera& camera, int frame) const override;
};

}  // namespace terracast::validate
