#include "rigs/rig_error_options.h"

#include <algorithm>

#include "core/error.h"

namespace terracast::rigs {

bool RigErrorOptions::has_offset() const {
  return std::any_of(offset_sd_mm.begin(), offset_sd_mm.end(), [](double sd) { return sd > 0.0; });
}

void RigErrorOptions::describe(core::SchemaVisitor& visit) {
  visit.key("focal_length_sd_mm", focal_length_sd_mm,
            "Standard deviation of the focal length, of cameras that state focal_length_mm.",
            core::between(0.0, 1000.0));
  visit.key("focal_length_sd_px", focal_length_sd_px,
            "The same in pixels, instead; fy is off by the same factor as fx.",
            core::between(0.0, 1e5));
  visit.key("azimuth_sd_deg", azimuth_sd_deg,
            "Standard deviation of a camera's turn about the rig's up axis.",
            core::between(0.0, 90.0));
  visit.key("pitch_sd_deg", pitch_sd_deg,
            "Standard deviation of its tilt, with azimuth and roll as in euler_deg.",
            core::between(0.0, 90.0));
  visit.key("roll_sd_deg", roll_sd_deg, "Standard deviation of its turn about its optical axis.",
            core::between(0.0, 90.0));
  core::Constraint three = core::between(0.0, 1e6);
  three.min_size = three.max_size = 3;
  visit.key("offset_sd_mm", offset_sd_mm,
            "Standard deviations of its centre of projection along the three axes of offset_mm; "
            "empty: 0.",
            three);
  visit.key("clock_offset_sd_s", clock_offset_sd_s,
            "Standard deviation of what its clock is ahead by at the sequence's start.",
            core::between(0.0, 1e6));
  visit.key("clock_drift_sd_ppm", clock_drift_sd_ppm, "Standard deviation of what its clock gains.",
            core::between(0.0, 1e5));
  visit.key("clock_jitter_sd_s", clock_jitter_sd_s,
            "Standard deviation of each of its time stamps about its clock.",
            core::between(0.0, 1e3));
}

void RigErrorOptions::validate() const {
  if (focal_length_sd_mm > 0.0 && focal_length_sd_px > 0.0)
    core::fail(core::ErrorKind::Config,
               "focal_length_sd_mm = {} beside focal_length_sd_px = {}; state one of the two",
               focal_length_sd_mm, focal_length_sd_px);
}

}  // namespace terracast::rigs
