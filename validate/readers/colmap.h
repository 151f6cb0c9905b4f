#pragma once

#include "validate/dataset.h"

namespace terracast::validate {

/// COLMAP (3.8 to 4.x): images/<rig>/<camera>/NNNNNN.png, the binary model in sparse/0, the text
/// one in sparse_txt/0, and depth/<rig>/<camera>/NNNNNN.npy. The world is the sequence's ENU; pixel
/// centres at +0.5.
class ColmapReader : public Reader {
 public:
  void read(const Dataset& dataset, Sequence& sequence, Findings& findings) const override;
  core::ImageF depth(const Dataset& dataset, const Camera& camera, int frame) const override;
};

}  // namespace terracast::validate
