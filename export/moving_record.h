#pragma once

#include <string>
#include <vector>

#include "capture/frame_reader.h"
#include "core/json.h"
#include "export/dataset_writer.h"
#include "export/georeference.h"

/// What a dataset says of things that move: which there are, where each is at every frame's time and how it goes on,
/// and which pixels show it.
namespace terracast::exporters {

/// Files of ours in the folder of a sequence in which things move.
inline constexpr const char* kMovingFile = "moving.csv";
inline constexpr const char* kMovingFolder = "moving";

/// moving.csv: one row for each frame and body that is there then. Its pose in the frame of the format's poses
/// (local: east, north, up), local_from_body; then, along the axes that the body has at that time, its velocity
/// (m/s), acceleration (m/s²), angular velocity (rad/s) and terms of its motion against the Earth: so much later, dt,
/// it is where the rule of motion.csv takes it (export/motion_record.h). Bodies count from 1, in the order of
/// dataset.json.
std::string moving_csv(const capture::SequenceReader& sequence, const LocalFrame& local);

/// Which body each pixel shows: its number, 0 where it shows what stands.
/// facts   of a frame of the sequence
core::Image16 moving_mask(const capture::SequenceInfo& info, const capture::CameraFrame& facts);

/// Writes all of it into a sequence's folder. Parallel over frames.
void write_moving(DatasetWriter& writer, const std::string& folder,
                  const capture::SequenceReader& sequence,
                  const std::vector<ExportedCamera>& cameras);

/// The member `moving` of a sequence in dataset.json.
/// path   the sequence's, in the dataset
core::Json describe_moving(const capture::SequenceInfo& info, const std::string& path);

}  // namespace terracast::exporters
