#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <string>
#include <vector>

#include "core/atomic_file.h"
#include "core/error.h"
#include "validate/dataset.h"
#include "validate/npy.h"

/// The arrays of terracast's own format, some of which stand beside others.
namespace terracast::validate {

/// An array of the image's size, and its values.
/// channels   0: (height, width); else (height, width, channels)
/// throws     Input: another shape or type; Io
template <class Value>
std::vector<Value> read_array(const Dataset& dataset, const std::string& path,
                              const Intrinsics& size, std::size_t channels, char kind) {
  const auto num_pixels =
      static_cast<std::size_t>(size.height_px) * static_cast<std::size_t>(size.width_px);
  const std::size_t num_values = num_pixels * std::max<std::size_t>(channels, 1);
  constexpr std::size_t kHeader = 1 << 16;
  const NpyArray array =
      parse_npy(core::read_file(dataset.root / path, num_values * sizeof(Value) + kHeader), path);
  std::vector<std::size_t> shape = {static_cast<std::size_t>(size.height_px),
                                    static_cast<std::size_t>(size.width_px)};
  if (channels > 0) shape.push_back(channels);
  if (array.shape != shape)
    core::fail(core::ErrorKind::Input, "{}: an array of the shape ({}) is right", path,
               fmt::join(shape, ", "));
  if (array.kind != kind || array.item_size != sizeof(Value))
    core::fail(core::ErrorKind::Input, "{}: values of type {}{} where {}{} should be", path,
               array.kind, array.item_size, kind, sizeof(Value));
  std::vector<Value> values(num_values);
  std::memcpy(values.data(), array.bytes.data(), num_values * sizeof(Value));
  return values;
}

/// "FILE: pixel (x, y)", of a value's place in an image, row by row.
std::string pixel_text(const std::string& path, std::size_t index, int width);

/// Ranges along the rays of a camera with a plane, float32; NaN where none comes in, +inf for the sky, which is NaN in what
/// is returned.
/// throws   Input: another array, a range that is not above 0, NaN where a ray comes in or none where none does; Io
core::ImageF read_range(const Dataset& dataset, const std::string& path, const Intrinsics& camera);

}  // namespace terracast::validate
