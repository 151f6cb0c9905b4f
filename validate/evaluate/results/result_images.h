#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "core/image.h"

/// Images that methods write, one a frame. A value that the file marks as unknown, or that cannot
/// be one, is NaN. All readers take files for hostile: sizes are held against the image's before
/// anything is decoded.
namespace terracast::validate {

/// What a result must measure: that of the dataset's image.
struct ImageSize {
  int width_px = 0;
  int height_px = 0;
};

/// Flow from a frame to the next, 2 channels, px: u to the right, v down.
/// By what the file begins with:
///   .flo  Middlebury: float32 202021.25, int32 width, height, pairs (u, v); over 1e9 is unknown
///   .png  KITTI: 16 bit RGB, u = (R - 32768) / 64, v = (G - 32768) / 64, unknown where B is 0
///   .npy  float32 or float64, (height, width, 2) or (2, height, width)
///   .npz  TartanAir: flow_fwd of the shape (1, 2, height, width)
/// throws  Input: another format or size, truncated, damaged
core::ImageF parse_flow(std::span<const std::byte> bytes, const std::string& name,
                        const ImageSize& size);
std::vector<std::string> flow_extensions();

/// Planar depth, m; NaN where it is not above 0 and finite.
///   .npy  float32 or float64, (height, width), or with a channel of 1
///   .png  16 bit grey: KITTI's depth, counts / 256, 0 unknown; 8 bit RGBA: TartanAir's bytes of a
///         little-endian float32, in the order that OpenCV reads
///   .pfm  one channel
core::ImageF parse_depth(std::span<const std::byte> bytes, const std::string& name,
                         const ImageSize& size);
std::vector<std::string> depth_extensions();

/// Disparity of the left image, px; NaN where it is not above 0 and finite.
///   .png  KITTI: 16 bit grey, counts / 256, 0 unknown;   .pfm one channel;   .npy as for depth
core::ImageF parse_disparity(std::span<const std::byte> bytes, const std::string& name,
                             const ImageSize& size);
std::vector<std::string> disparity_extensions();

/// Scene flow, 3 channels, m; NaN in all three where one is not finite.
///   .npy  float32 or float64, (height, width, 3) or (3, height, width)
core::ImageF parse_scene_flow(std::span<const std::byte> bytes, const std::string& name,
                              const ImageSize& size);
std::vector<std::string> scene_flow_extensions();

/// Reads a file by one of these.
/// throws  Input: more bytes than an image of that size in double with 3 channels can have; Io
using ParseImage = core::ImageF(std::span<const std::byte>, const std::string&, const ImageSize&);
core::ImageF read_result(const std::filesystem::path& file, const ImageSize& size,
                         ParseImage* parse);

}  // namespace terracast::validate
