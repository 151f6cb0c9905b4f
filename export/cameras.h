#pragma once

#include <optional>
#include <string>
#include <vector>

#include "capture/frame.h"
#include "export/exporter.h"
#include "export/georeference.h"

namespace terracast::exporters {

/// Index of a camera that an export names.
/// throws   Config: no such rig or camera; says which there are
int find_camera(const std::vector<capture::CameraCalibration>& cameras, const std::string& rig,
                const std::string& name);

/// Names of the rigs of cameras, in their order.
std::vector<std::string> rigs_of(const std::vector<capture::CameraCalibration>& cameras);

/// throws   Config: a rig that a format names is none of these; says which there are
void check_rigs(const Exporter& exporter, const std::vector<std::string>& known);

/// The cameras of the rigs that a format takes, called RIG/NAME.
/// throws   Config: there are none; says which rigs there are
std::vector<ExportedCamera> cameras_taken(const Exporter& exporter,
                                          const std::vector<capture::CameraCalibration>& cameras);

/// Refuses camera models of plug-ins among the cameras that a format takes.
/// throws   Config: one has, and nobody could prove what is exported of it
void check_provable(const Exporter& exporter,
                    const std::vector<capture::CameraCalibration>& cameras);

/// throws   Config: the camera is no pinhole; says which format wants one
void check_pinhole(const capture::CameraCalibration& camera, const char* format);

/// A pair is rectified where a point stands in the same row of both images. Of rolling shutters that holds where
/// both expose that row at once: then the point is seen at one time, and disparity is f b / z all the same.
/// throws   Config: the shutters' lines differ in time or order, or are columns; says what would fit
void check_shutters_of_pair(const capture::CameraCalibration& left,
                            const capture::CameraCalibration& right, const char* format);

/// How far the right camera stands to the right of the left, in the left camera's frame, m, when
/// the two are a rectified pair: axes parallel within 1e-9 rad, centres apart along x alone within
/// 1e-9 m, equal intrinsics.
/// throws   Config: they are not; says what differs
double rectified_baseline_m(const capture::CameraCalibration& left,
                            const capture::CameraCalibration& right, const char* format);

/// Of images whose files take so many bytes a pixel together.
FrameSize size_of_images(const std::vector<const capture::CameraCalibration*>& cameras,
                         double bytes_per_px);

/// A word for a folder: letters, digits, _ and -, all else replaced by _.
std::string folder_word(const std::string& text);

}  // namespace terracast::exporters
