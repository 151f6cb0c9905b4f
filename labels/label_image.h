#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "core/image_io.h"
#include "geo/camera_model.h"

/// Labels of each pixel of an image: an OpenEXR file that says of which capture it is.
namespace terracast::labels {

/// Whether a file was written of a capture, for an image of that size, and holds a channel.
/// source      of capture::labels_source()
/// part_name   as it was written with
/// throws      Io
bool is_label_image_done(const std::filesystem::path& file, const std::string& source,
                         const geo::CameraIntrinsics& image, std::string_view part_name,
                         std::string_view channel);

/// channels   in alphabetical order
std::vector<std::byte> encode_label_image(const std::string& source,
                                          const geo::CameraIntrinsics& image,
                                          const std::string& part_name,
                                          std::vector<core::ExrChannel> channels);

/// The same into a file.
void write_label_image(const std::filesystem::path& file, const std::string& source,
                       const geo::CameraIntrinsics& image, const std::string& part_name,
                       std::vector<core::ExrChannel> channels);

}  // namespace terracast::labels
