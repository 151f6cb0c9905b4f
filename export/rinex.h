#pragma once

#include <string>

#include "capture/frame_reader.h"
#include "export/dataset_writer.h"

/// Observations of satellites as RINEX 3.04 has them, beside the scans that every dataset has.
namespace terracast::exporters {

/// Writes, for each sensor of kind gnss_observations, sensors/RIG/NAME/observations.rnx (C1C, L1C, D1C of the satellites that
/// were visible) and navigation.rnx (the orbits that the signals were made with, to their last digit).
/// accuracy   pseudoranges to 0.5 mm, carrier phases to 0.0005 cycles: the format's digits. Epochs are stamped by the
///            receiver's clock in steps of 100 ns, and ranges count from these stamps
/// memory     the text of a whole sequence: about 50 bytes an observation
void write_observations(DatasetWriter& writer, const std::string& folder,
                        const capture::SequenceReader& sequence);

}  // namespace terracast::exporters
