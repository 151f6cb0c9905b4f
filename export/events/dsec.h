#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "capture/frame_reader.h"
#include "export/dataset_writer.h"

/// Events as other programs read them, beside the scans that every dataset has.
namespace terracast::exporters {

/// Names of the forms in which events can be written: dsec.
std::vector<std::string> event_forms();

/// Writes all event cameras of a sequence as DSEC has them, in HDF5, deflated and shuffled, chunks of 1e5 events:
/// sensors/RIG/NAME/events.h5        events/x, y (u16), p (u8; 1 brighter), t (u32, or u64 beyond 4294 s; whole microseconds,
///                                   rounded down, since the sequence's start); ms_to_idx (u64): the first event at or
///                                   after m ms, up to a millisecond past the last frame's scans; t_offset (i64): the start,
///                                   microseconds since 1970
/// sensors/RIG/NAME/rectify_map.h5   rectify_map (f32, rows x columns x 2): x, y of each pixel in an ideal lens of the same
///                                   focal length and principal point, centres of pixels at whole numbers; NaN behind it
/// determinism   objects bear no times: the same bytes at any time
/// memory        a frame's events
/// throws        Io; Config: a start before 1970
void write_dsec_events(DatasetWriter& writer, const std::string& folder,
                       const capture::SequenceReader& sequence);

}  // namespace terracast::exporters
