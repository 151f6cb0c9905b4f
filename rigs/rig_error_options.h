#pragma once

#include <vector>

#include "core/schema.h"

namespace terracast::rigs {

/// Config `[errors]` of a rig: how far its cameras and their clocks are from what the config says of them.
/// Standard deviations of normal deviates; each camera draws its own, once a sequence.
struct RigErrorOptions {
  double focal_length_sd_mm = 0.0;
  double focal_length_sd_px = 0.0;
  double azimuth_sd_deg = 0.0;
  double pitch_sd_deg = 0.0;
  double roll_sd_deg = 0.0;
  std::vector<double> offset_sd_mm = {};  ///< along the rig's axes; empty: 0
  double clock_offset_sd_s = 0.0;
  double clock_drift_sd_ppm = 0.0;
  double clock_jitter_sd_s = 0.0;

  bool has_focal_length() const { return focal_length_sd_mm > 0.0 || focal_length_sd_px > 0.0; }
  bool has_orientation() const {
    return azimuth_sd_deg > 0.0 || pitch_sd_deg > 0.0 || roll_sd_deg > 0.0;
  }
  bool has_offset() const;
  bool has_clock() const {
    return clock_offset_sd_s > 0.0 || clock_drift_sd_ppm > 0.0 || clock_jitter_sd_s > 0.0;
  }

  void describe(core::SchemaVisitor& visit);
  void validate() const;
};

}  // namespace terracast::rigs
