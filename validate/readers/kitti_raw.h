#pragma once

#include "validate/dataset.h"

namespace terracast::validate {

/// KITTI raw, synchronised and rectified: DATE/DATE_drive_NNNN_sync with image_00 to image_03, OXTS
/// packets and time stamps; the calibration of the date. Cameras stand where a packet puts the unit
/// on WGS84 and the calibration puts them on it. Pixel centres at whole numbers: half a pixel is
/// added on reading. Ours: depth_02, poses.txt.
class KittiRawReader : public Reader {
 public:
  void read(const Dataset& dataset, Sequence& sequence, Findings& findings) const override;
  core::ImageF depth(const Dataset& dataset, const Camera& camera, int frame) const override;
};

}  // namespace terracast::validate
