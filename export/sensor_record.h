#pragma once

#include <string>

#include "capture/frame_reader.h"
#include "export/dataset_writer.h"

/// The samples of sensors that are not cameras, which every dataset has beside its own format's files.
namespace terracast::exporters {

inline constexpr const char* kSensorsFile = "sensors.json";

/// sensors/RIG/NAME.csv: a row a sample, its time (s since the sequence's first frame, true) and the channels, each
/// number with as many digits as bring it back to the bit. Of scanners sensors/RIG/NAME/000000.npy: a structured array
/// of NumPy's with the scans that begin from a frame's time to before the next one's; places are in the frame of the
/// sequence's poses. sensors.json: kind, rate, channels with units, mount and settings of each; of one with a clock of its
/// own what that is and what is believed of it. Its samples have stamp_s, what the clock showed, as their last column.
/// folder   of the sequence, relative to the dataset
/// throws   Input: damaged samples; Io
void write_sensors(DatasetWriter& writer, const std::string& folder,
                   const capture::SequenceReader& sequence);

}  // namespace terracast::exporters
