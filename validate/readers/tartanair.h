#pragma once

#include "validate/dataset.h"

namespace terracast::validate {

/// TartanAir V2: ENV/Data_easy/P000 with image_, depth_, seg_ and flow_ folders and a pose file for
/// each camera. The camera is fixed: 640 x 640, f = 320, centre (320, 320). Poses are FRD in NED.
class TartanAirReader : public Reader {
 public:
  void read(const Dataset& dataset, Sequence& sequence, Findings& findings) const override;
  void check_mounts(const Sequence& sequence, Findings& findings) const override;
  core::ImageF depth(const Dataset& dataset, const Camera& camera, int frame) const override;
  FlowFields flow(const Dataset& dataset, const Camera& camera, int frame) const override;
};

}  // namespace terracast::validate
