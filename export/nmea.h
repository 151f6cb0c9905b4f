#pragma once

#include "capture/frame_reader.h"
#include "export/dataset_writer.h"

/// Fixes of receivers as NMEA 0183 has them, beside the tables that every dataset has.
namespace terracast::exporters {

/// Writes, for each sensor of kind gnss, sensors/RIG/NAME.nmea: the sentences RMC, GGA and GST of each fix as it is shown,
/// stamped in UTC: to the millisecond, or with nine decimals where that is not exact, which makes RMC longer than NMEA's 82
/// letters.
/// accuracy   places to 1e-7 minutes (0.2 mm), heights to 0.1 mm, speeds to 1e-4 knots: the digits that are written
void write_fixes(DatasetWriter& writer, const std::string& folder,
                 const capture::SequenceReader& sequence);

}  // namespace terracast::exporters
