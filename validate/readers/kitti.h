#pragma once

#include "validate/dataset.h"

namespace terracast::validate {

/// KITTI odometry: sequences/NN with calib.txt, times.txt, image_0 to image_3, depth_2 and disp_2;
/// poses/NN.txt of camera 0 relative to its first frame, placed in the world by georeference.csv.
/// Pixel centres at whole numbers: half a pixel is added on reading.
class KittiReader : public Reader {
 public:
  void read(const Dataset& dataset, Sequence& sequence, Findings& findings) const override;
  core::ImageF depth(const Dataset& dataset, const Camera& camera, int frame) const override;
  core::ImageF disparity(const Dataset& dataset, const Camera& camera, int frame) const override;
};

}  // namespace terracast::validate
