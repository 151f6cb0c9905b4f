#pragma once

#include <string>
#include <vector>

#include "capture/frame_reader.h"
#include "export/dataset_writer.h"
#include "export/georeference.h"
#include "export/scan_forms.h"

/// Files that no format has of its own, and every dataset of ours: in the folder of each sequence.
namespace terracast::exporters {

/// bounds.csv: one row for each frame and camera, what depth and flow may err by. `…_error` is of the
/// arithmetic from pixel to label, `…_rounding` of keeping ranges and labels as float32, and flow in the
/// format's steps (not of flow beyond its range); the largest over the image's pixels, less `left_out` of
/// `pixels` at edges. Flow is that to the frames before and after; where there is no ground or no flow,
/// cells are empty.
std::string bounds_csv(const capture::SequenceReader& sequence,
                       const std::vector<ExportedCamera>& cameras);

/// Writes georeference.csv, bounds.csv and geometry.json, and what there is to say of how images were made
/// (export/imaging_record.h), of how bodies move under rolling shutters (export/motion_record.h) and of errors of
/// rigs (export/calibration.h), and of sensors beside cameras (export/sensor_record.h).
/// folder    of the sequence, relative to the dataset
/// forms     of scans besides (export/clouds/cloud.h, export/events/dsec.h): Exporter::scan_forms
/// throws    Io; as write_clouds() and write_dsec_events()
void write_additions(DatasetWriter& writer, const std::string& folder,
                     const capture::SequenceReader& sequence,
                     const std::vector<ExportedCamera>& cameras, const ScanForms& forms = {});

}  // namespace terracast::exporters
