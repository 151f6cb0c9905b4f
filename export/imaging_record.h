#pragma once

#include <string>
#include <vector>

#include "capture/frame_reader.h"
#include "export/georeference.h"

namespace terracast::exporters {

/// File of ours in the folder of a sequence, where its cameras are more than pinholes that see an instant.
inline constexpr const char* kImagingFile = "imaging.json";

/// Whether any camera is exposed for a while, has a lens that is open, or makes its image of the light in a way of
/// its own.
bool has_imaging(const capture::SequenceInfo& info);

/// How each camera was exposed (exposure_s, aperture) and made its images (settings, the resolved
/// `[rigs.imaging]`; exposure_ev, a number a frame, stops above the sequence's exposure).
std::string imaging_text(const capture::SequenceReader& sequence,
                         const std::vector<ExportedCamera>& cameras);

}  // namespace terracast::exporters
