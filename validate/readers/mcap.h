#pragma once

#include "validate/dataset.h"

/// MCAP with messages of ROS 2: a file a sequence, read by the definitions that it has of its messages. A camera stands
/// where /tf puts base_link at the image's log time, and /tf_static the camera on it. Pixel centres at whole numbers: half a
/// pixel is added on reading. Samples of sensors are held against sensors.json. Written from docs/formats/mcap.md.
///
/// Images are parts of the file: FrameFiles has them as "PATH#OFFSET+LENGTH.KIND", in bytes.
namespace terracast::validate {

class McapReader : public Reader {
 public:
  void read(const Dataset& dataset, Sequence& sequence, Findings& findings) const override;
  core::ImageF depth(const Dataset& dataset, const Camera& camera, int frame) const override;
};

/// Whether a path of FrameFiles is that of a part of a file.
bool is_part_of_bag(const std::string& place);
/// The image of such a part, of 1 or 3 channels.
/// throws   Input: damaged, or not of the camera's size; Io
core::Image8 read_bag_image(const Dataset& dataset, const std::string& place,
                            const Intrinsics& size);

}  // namespace terracast::validate
