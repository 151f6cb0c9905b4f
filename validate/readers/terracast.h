#pragma once

#include "validate/dataset.h"

namespace terracast::validate {

/// terracast's own format: cameras of any model with tables of their rays, ranges along those, flow both ways with
/// masks, classes, instances, normals. Written from docs/formats/terracast.md.
class TerracastReader : public Reader {
 public:
  void read(const Dataset& dataset, Sequence& sequence, Findings& findings) const override;
  core::ImageF depth(const Dataset& dataset, const Camera& camera, int frame) const override;
  FlowFields flow(const Dataset& dataset, const Camera& camera, int frame) const override;
  core::ImageF normals(const Dataset& dataset, const Camera& camera, int frame) const override;
  core::ImageU32 instances(const Dataset& dataset, const Camera& camera, int frame) const override;
};

}  // namespace terracast::validate
