#pragma once

#include "validate/dataset.h"

namespace terracast::validate {

/// COCO: images/<sequence>/<camera>/NNNNNN.png, panoptic/ beside it, annotations/{instances,panoptic}.json. The two
/// must agree: every mask is a segment of its panoptic image, whose numbers are the listed ones; areas and boxes are
/// those of the pixels; else it is a finding.
class CocoReader : public Reader {
 public:
  void read(const Dataset& dataset, Sequence& sequence, Findings& findings) const override;
  core::ImageF depth(const Dataset& dataset, const Camera& camera, int frame) const override;
};

}  // namespace terracast::validate
