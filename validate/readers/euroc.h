#pragma once

#include "validate/dataset.h"

namespace terracast::validate {

/// EuRoC's layout (ASL): mav0 with camK, imuK and the truth, state_groundtruth_estimate0. A camera stands where the truth
/// puts the body at the image's stamp, and T_BS puts the camera on it. Pixel centres at whole numbers: half a pixel is
/// added on reading. Ours: range/camK, and the calibration as Kalibr and OpenVINS have it. Written from
/// docs/formats/euroc.md.
class EurocReader : public Reader {
 public:
  void read(const Dataset& dataset, Sequence& sequence, Findings& findings) const override;
  core::ImageF depth(const Dataset& dataset, const Camera& camera, int frame) const override;
};

}  // namespace terracast::validate
